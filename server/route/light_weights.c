#include "server/route/light_weights.h"

#include "server/scene/direct_light.h"
#include "server/scene/request_light.h"
#include "solver/operator/emitters.h"

#include <stdlib.h>
#include <string.h>

float *light_weights_find(const call *in, const radiosity_request *request, problem *why) {
    const scene *s = in->scene;
    const size_t row = s->n_channels * s->n_emitters;
    lam_error error;
    float *W =
        call_allocate(in, bytes_times(request->n_rhs, row * sizeof *W), "the weights of emitters", why);
    if (W == NULL) return NULL;
    const lam_status status = lam_operator_weights(s->op, request->n_rhs, request->E, scene_tiles(s),
                                                   request->sky.values, W, &error);
    if (status != LAM_OK) {
        problem_set(why, status == LAM_ERR_MEMORY ? PROBLEM_NO_MEMORY : PROBLEM_NOT_IN_STORE, "%s",
                    error.message);
        free(W);
        return NULL;
    }
    for (size_t k = 0; request->emitters.values != NULL && k < request->n_rhs * row; k++)
        W[k] += request->emitters.values[k];
    if (request->luminaires.values != NULL)
        operator_emitters_dim(s->op, request->n_rhs, request->luminaires.values, W);
    return W;
}

bool light_weights_see_sky(const call *in, radiosity_request *request, problem *why) {
    const scene *s = in->scene;
    const size_t count = request->n_rhs * s->n_channels * scene_tiles(s);
    if (!request_has_sky_weights(s, request)) return true;
    float *L = call_allocate(in, bytes_times(count, sizeof *L), "the sky at sensors", why);
    if (L == NULL) return false;
    operator_emitters_radiances(s->op, request->n_rhs, request->emitters.values, L);
    for (size_t k = 0; request->sky.values != NULL && k < count; k++) L[k] += request->sky.values[k];
    request->seen_sky = (side_rows){.values = L, .n = request->n_rhs, .capacity = request->n_rhs};
    return true;
}
