/* GET /metrics: Prometheus text. */
#include "server/route/routes.h"

void get_metrics(call *in, answer *out) {
    const service *s = in->service;
    const catalog_snapshot *snapshot = in->snapshot;
    metrics_gauges gauges = {.queued = batch_jobs(s->queue),
                             .refining = atomic_load(&s->n_refining),
                             .body_bytes = request_ledger_bodies(in->memory->ledger)};
    metrics_stores stores = {.n_refused = snapshot->refused->count};
    size_t n_mapped = 0;
    buffer b = {0};
    size_t work_bytes = 0;
    for (size_t i = 0; i < snapshot->n_scenes; i++) {
        const scene *one = snapshot->scenes[i];
        /* Of a variant only the memory that is not its base's. */
        gauges.operator_bytes += one->base != NULL ? one->bytes : lam_operator_bytes(one->op);
        stores.memory += one->memory + scene_grown(one);
        if (one->work_bytes > work_bytes) work_bytes = one->work_bytes;
        stores.n_damaged += scene_damaged(one, NULL, NULL);
        stores.n_unverified += !scene_verified(one);
        if (one->map != NULL && one->base == NULL) {
            const long long at = scene_verified_at(one);
            if (n_mapped++ == 0 || at < stores.verified_at) stores.verified_at = at;
        }
        stores.mapped_bytes += one->map != NULL && one->base == NULL ? store_map_bytes(one->map) : 0;
    }
    stores.memory += scene_work_memory(s->config->threads, work_bytes);
    gauges.n_scenes = snapshot->n_scenes - stores.n_damaged;
    const bool written = metrics_write(s->metrics, &gauges, &b) && metrics_write_stores(&stores, &b) &&
                         problem_counts_write(&s->problems, &b) &&
                         request_ledger_write(in->memory->ledger, &b) &&
                         connections_write(s->connections, &b) && access_log_metrics(s->access_log, &b);
    answer_json(out, &b, written);
    if (written) out->type = "text/plain; version=0.0.4; charset=utf-8";
}
