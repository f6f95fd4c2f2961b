/* GET /metrics: Prometheus text. */
#include "server/routes.h"

void get_metrics(call *in, answer *out) {
    const service *s = in->service;
    const catalog_snapshot *snapshot = in->snapshot;
    metrics_gauges gauges = {.n_scenes = snapshot->n_scenes,
                             .queued = batch_jobs(s->queue),
                             .body_bytes = atomic_load(&s->body_bytes)};
    buffer b = {0};
    for (size_t i = 0; i < snapshot->n_scenes; i++)
        gauges.operator_bytes += lam_operator_bytes(snapshot->scenes[i]->op);
    const bool written = metrics_write(s->metrics, &gauges, &b) && connections_write(s->connections, &b);
    answer_json(out, &b, written);
    if (written) out->type = "text/plain; version=0.0.4; charset=utf-8";
}
