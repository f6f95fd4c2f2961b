/* GET /metrics: Prometheus text. */
#include "server/routes.h"

void get_metrics(call *in, answer *out) {
    const catalog_snapshot *snapshot = in->snapshot;
    uint64_t bytes = 0;
    buffer b = {0};
    for (size_t i = 0; i < snapshot->n_scenes; i++) { /* of a variant only what its base does not lend */
        const scene *s = snapshot->scenes[i];
        bytes += s->base != NULL ? s->bytes : lam_operator_bytes(s->op);
    }
    bool written =
        metrics_write(in->service->metrics, snapshot->n_scenes, bytes, batch_jobs(in->service->queue), &b);
    answer_json(out, &b, written);
    if (written) out->type = "text/plain; version=0.0.4; charset=utf-8";
}
