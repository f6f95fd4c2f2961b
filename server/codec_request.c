#include "server/codec_request.h"

#include <stdlib.h>
#include <string.h>

void radiosity_request_free(radiosity_request *request) {
    free(request->E);
    free(request->sky.values);
    free(request->emitters.values);
    free(request->selected);
    *request = (radiosity_request){0};
}

bool radiosity_request_add(radiosity_request *request, const codec_scene *scene, float **E, problem *why) {
    size_t values, bytes, size;
    if (request->n_rhs == scene->max_batch)
        return problem_set(why, 422,
                           "the batch holds more than %zu vectors (--max-batch); send several requests",
                           scene->max_batch);
    if (!size_multiply(scene->n, scene->n_channels, &values) ||
        !size_multiply(values, sizeof(float), &bytes) || !size_multiply(bytes, request->n_rhs + 1, &size) ||
        size > scene->max_bytes)
        return problem_set(
            why, 422,
            "%zu vectors of %zu channels and %zu elements pass the %zu bytes that a request may "
            "hold; send several requests",
            request->n_rhs + 1, scene->n_channels, scene->n, scene->max_bytes);
    if (request->n_rhs == request->capacity) {
        size_t capacity = request->capacity == 0 ? 1 : 2 * request->capacity;
        if (capacity > scene->max_batch) capacity = scene->max_batch;
        if (!size_multiply(bytes, capacity, &size) || size > scene->max_bytes) {
            capacity = scene->max_bytes / bytes;
            size = capacity * bytes;
        }
        float *grown = realloc(request->E, size);
        if (grown == NULL) return problem_set(why, 503, "not enough memory for %zu bytes of emission", size);
        request->E = grown;
        request->capacity = capacity;
    }
    *E = request->E + request->n_rhs * values;
    memset(*E, 0, bytes);
    request->n_rhs++;
    return true;
}

static bool add_side(const radiosity_request *request, const codec_scene *scene, side_rows *side,
                     size_t width, const char *what, float **row, problem *why) {
    size_t values, bytes, size;
    if (!size_multiply(width, scene->n_channels, &values) || !size_multiply(values, sizeof(float), &bytes) ||
        !size_multiply(bytes, request->n_rhs, &size) || size > scene->max_bytes)
        return problem_set(
            why, 422,
            "%zu times %zu channels of %zu %s pass the %zu bytes that a request may hold; send "
            "several requests",
            request->n_rhs, scene->n_channels, width, what, scene->max_bytes);
    if (request->n_rhs > side->capacity) {
        size_t capacity = request->capacity;
        if (!size_multiply(bytes, capacity, &size) || size > scene->max_bytes) {
            capacity = scene->max_bytes / bytes;
            size = capacity * bytes;
        }
        float *grown = realloc(side->values, size);
        if (grown == NULL) return problem_set(why, 503, "not enough memory for %zu bytes of %s", size, what);
        side->values = grown;
        side->capacity = capacity;
    }
    memset(side->values + side->n * values, 0, (request->n_rhs - side->n) * bytes);
    side->n = request->n_rhs;
    *row = side->values + (request->n_rhs - 1) * values;
    return true;
}

bool radiosity_request_sky(radiosity_request *request, const codec_scene *scene, float **row, problem *why) {
    return add_side(request, scene, &request->sky, scene->n_tiles, "tiles", row, why);
}

bool radiosity_request_emitters(radiosity_request *request, const codec_scene *scene, float **row,
                                problem *why) {
    return add_side(request, scene, &request->emitters, scene->n_emitters, "emitters", row, why);
}

const char *codec_quantity_name(lam_quantity quantity) {
    switch (quantity) {
    case LAM_RADIOSITY:
        return "radiosity";
    case LAM_IRRADIANCE:
        return "irradiance";
    case LAM_INDIRECT:
        return "indirect";
    }
    return "";
}
