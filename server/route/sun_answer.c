#include "server/route/sun_answer.h"

#include "server/scene/sensor_answer.h"

#include <stdlib.h>

/* Seconds, roughly, for the rays of an element. */
#define PER_ELEMENT 1e-6

bool sun_answer_begin(const call *in, const radiosity_request *request, sun_answer *out, problem *why) {
    const scene *s = in->scene;
    lam_error error;
    if (request->n_suns == 0) return true;
    const lam_status status = scene_sun_make(s->sun, &error);
    if (status != LAM_OK) return call_refuse_store(s, status, &error, why);
    out->shares = call_allocate(in, bytes_times(request->n_suns, bytes_times(s->n, sizeof *out->shares)),
                                "the sun", why);
    if (out->shares == NULL || !request->at_sensors) return out->shares != NULL;
    out->at_sensors = call_allocate(
        in, bytes_times(request->n_suns, bytes_times(scene_sensors(s), sizeof *out->at_sensors)), "the sun",
        why);
    return out->at_sensors != NULL;
}

void sun_answer_free(sun_answer *s) {
    free(s->shares);
    free(s->at_sensors);
    *s = (sun_answer){.shares = NULL};
}

/* The first sun of a vector from `first` on. */
static size_t sun_from(const radiosity_request *request, size_t first) {
    size_t k = 0;
    while (k < request->n_suns && request->suns[k].vector < first) k++;
    return k;
}

bool sun_answer_find(call *in, const radiosity_request *request, size_t first, size_t count, sun_answer *s) {
    const scene *of = in->scene;
    for (size_t k = sun_from(request, first); k < request->n_suns && request->suns[k].vector < first + count;
         k++) {
        if (!in->is_wanted(in)) return false;
        scene_sun_shares(of->sun, &request->suns[k], s->shares + k * of->n);
        if (s->at_sensors != NULL)
            scene_sun_at_sensors(of->sun, &request->suns[k], s->at_sensors + k * scene_sensors(of));
    }
    return true;
}

double sun_answer_cost(const scene *of) {
    return PER_ELEMENT * (double)of->n;
}

void sun_answer_add(const scene *of, const radiosity_request *request, const sun_answer *s, size_t first,
                    size_t count, float *H0) {
    const size_t n = of->n, C = of->n_channels;
    for (size_t k = sun_from(request, first); k < request->n_suns && request->suns[k].vector < first + count;
         k++)
        for (size_t c = 0; c < C; c++) {
            const float direct = request->sunlight[k * C + c], *share = s->shares + k * n;
            float *row = H0 + ((request->suns[k].vector - first) * C + c) * n;
            for (size_t i = 0; i < n; i++) row[i] += direct * share[i];
        }
}

void sun_answer_add_double(const scene *of, const radiosity_request *request, const sun_answer *s,
                           size_t first, size_t count, double *H0) {
    const size_t n = of->n, C = of->n_channels;
    for (size_t k = sun_from(request, first); k < request->n_suns && request->suns[k].vector < first + count;
         k++)
        for (size_t c = 0; c < C; c++) {
            const double direct = (double)request->sunlight[k * C + c];
            const float *share = s->shares + k * n;
            double *row = H0 + ((request->suns[k].vector - first) * C + c) * n;
            for (size_t i = 0; i < n; i++) row[i] += direct * (double)share[i];
        }
}
