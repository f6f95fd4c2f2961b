/* GET /metrics: Prometheus text. */
#include "server/route/routes.h"

static bool write_metrics(void *context, buffer *b) {
    const call *in = context;
    const service *s = in->service;
    const catalog_snapshot *snapshot = in->snapshot;
    metrics_gauges gauges = {.queued = batch_jobs(s->queue),
                             .refining = atomic_load(&s->n_refining),
                             .body_bytes = request_ledger_bodies(in->memory->ledger)};
    metrics_stores stores = {.n_refused = snapshot->refused->count, .read_all = catalog_read_all(s->catalog)};
    size_t n_mapped = 0;
    size_t work_bytes = 0;
    for (size_t i = 0; i < snapshot->n_scenes; i++) {
        const scene *one = snapshot->scenes[i];
        /* A variant counts only with the memory that is not its base's. */
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
    return metrics_write(s->metrics, &gauges, b) && metrics_write_stores(&stores, b) &&
           problem_counts_write(&s->problems, b) && request_ledger_write(in->memory->ledger, b) &&
           connections_write(s->connections, b) && access_log_metrics(s->access_log, b);
}

/* A coding of the text, made once for each text. */
static kept_bytes *find_form(kept_forms *text, content_coding form) {
    kept_bytes *found = kept_forms_find(text, form);
    if (found != NULL) return found;
    kept_bytes *plain = kept_forms_find(text, CODING_IDENTITY);
    buffer made = {0};
    if (coding_whole(form, plain->content.bytes, plain->content.length, &made))
        found = kept_forms_keep(text, form, &made);
    buffer_free(&made);
    kept_bytes_release(plain);
    return found;
}

void get_metrics(call *in, answer *out) {
    kept_forms *text = metrics_page_get(in->service->metrics_page, write_metrics, in);
    kept_bytes *body = text != NULL ? find_form(text, in->accepted.coding) : NULL;
    kept_forms_release(text);
    if (body == NULL)
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for the answer");
    else
        *out = (answer){.status = 200,
                        .type = "text/plain; version=0.0.4; charset=utf-8",
                        .kept = body,
                        .kept_coding = in->accepted.coding};
}
