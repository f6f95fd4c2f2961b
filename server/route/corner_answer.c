#include "server/route/corner_answer.h"

#include "server/scene/scene_store.h"

#include <stdlib.h>
#include <string.h>

bool corner_answer_begin(const call *in, radiosity_request *request, corner_answer *out, problem *why) {
    const scene *s = in->scene;
    lam_error error;
    if (!request->at_corners) return true;
    const lam_status status = scene_corners_get(scene_root(s)->corners, &out->plan, &error);
    if (status != LAM_OK) return call_refuse_store(s, status, &error, why);
    request->n_corners = out->plan->n_nodes;
    return true;
}

bool corner_answer_keep(const call *in, corner_answer *a, problem *why) {
    if (a->plan == NULL) return true;
    a->work = call_allocate(in, bytes_times(in->scene->n_channels, a->plan->n * sizeof *a->work),
                            "the corners", why);
    return a->work != NULL;
}

void corner_answer_free(corner_answer *a) {
    free(a->work);
}

void corner_answer_find(const scene *s, const corner_answer *a, size_t first, size_t count, float *x,
                        float *out) {
    const size_t C = s->n_channels, row = C * s->n;
    if (a->plan == NULL) return;
    x += first * row;
    out += first * C * a->plan->n_nodes;
    if (a->work == NULL) {
        corner_plan_apply(a->plan, count * C, x, out);
        return;
    }
    for (size_t v = 0; v < count; v++) {
        memcpy(a->work, x + v * row, row * sizeof *x);
        corner_plan_apply(a->plan, C, a->work, out + v * C * a->plan->n_nodes);
    }
}
