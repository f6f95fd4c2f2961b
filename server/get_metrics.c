/* GET /metrics: Prometheus text. */
#include "server/routes.h"

void get_metrics(call *in, answer *out) {
    const catalog_snapshot *snapshot = in->snapshot;
    uint64_t bytes = 0;
    metrics_stores stores = {.mapped_bytes = 0};
    buffer b = {0};
    for (size_t i = 0; i < snapshot->n_scenes; i++) {
        const scene *s = snapshot->scenes[i];
        /* Of a variant only what its base does not lend. */
        bytes += s->base != NULL ? s->bytes : lam_operator_bytes(s->op);
        stores.n_damaged += scene_damaged(s, NULL, NULL);
        stores.n_unverified += !scene_verified(s);
        stores.mapped_bytes += s->map != NULL && s->base == NULL ? store_map_bytes(s->map) : 0;
    }
    bool written = metrics_write(in->service->metrics, snapshot->n_scenes - stores.n_damaged, bytes,
                                 batch_jobs(in->service->queue), &b) &&
                   metrics_write_stores(&stores, &b);
    answer_json(out, &b, written);
    if (written) out->type = "text/plain; version=0.0.4; charset=utf-8";
}
