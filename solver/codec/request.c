#include "solver/codec/request.h"

#include "solver/base/array_grow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *codec_source(const codec_scene *scene) {
    return scene->source != NULL ? scene->source : "the body";
}

void radiosity_request_free(radiosity_request *request) {
    free(request->E);
    free(request->spots);
    free(request->colours);
    free(request->sky.values);
    free(request->emitters.values);
    free(request->luminaires.values);
    free(request->sensors.values);
    free(request->seen_sky.values);
    free(request->suns);
    free(request->sunlight);
    free(request->selected);
    free(request->faces);
    free(request->receivers);
    reduce_request_free(&request->reduce);
    *request = (radiosity_request){0};
}

face_choice radiosity_request_faces(const radiosity_request *request, const face_index *faces) {
    return (face_choice){request->select ? request->n_faces : faces->n_faces,
                         request->select ? request->faces : NULL};
}

size_t radiosity_request_values(const radiosity_request *request, size_t n, const face_index *faces) {
    if (request->at_sensors) return request->n_receivers;
    if (request->at_corners) return request->n_corners;
    if (request->at_faces) return radiosity_request_faces(request, faces).n;
    return request->select ? request->n_selected : n;
}

bool radiosity_request_add(radiosity_request *request, const codec_scene *scene, problem *why) {
    if (request->n_rhs == scene->max_batch)
        return problem_set(why, PROBLEM_TOO_MUCH,
                           "the batch holds more than %zu vectors (--max-batch); send several requests",
                           scene->max_batch);
    request->n_rhs++;
    return true;
}

static bool take_memory(const codec_scene *scene, size_t bytes, problem *why) {
    return scene->take == NULL || scene->take(scene->owner, bytes, why);
}

/* Makes room for `wanted` rows of `bytes` each within max_bytes, and zeroes those beyond *n. */
static bool grow_rows(const codec_scene *scene, float **values, size_t *n, size_t *capacity, size_t wanted,
                      size_t bytes, const char *what, problem *why) {
    if (wanted > *capacity) {
        const size_t most = scene->max_bytes / bytes, more = 2 * *capacity > wanted ? 2 * *capacity : wanted;
        size_t rows = more < most ? more : most;
        problem unused;
        /* Room for vectors to come is taken if there is any. */
        if (!take_memory(scene, (rows - *capacity) * bytes, &unused)) {
            rows = wanted;
            if (!take_memory(scene, (rows - *capacity) * bytes, why)) return false;
        }
        if (array_resize(values, rows, bytes, what, NULL) != LAM_OK)
            return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for %zu vectors of %s", rows, what);
        *capacity = rows;
    }
    memset((char *)*values + *n * bytes, 0, (wanted - *n) * bytes);
    *n = wanted;
    return true;
}

/* Vectors up to the last. */
static bool grow_dense(radiosity_request *request, const codec_scene *scene, problem *why) {
    size_t values, bytes, size;
    if (!size_multiply(scene->n, scene->n_channels, &values) ||
        !size_multiply(values, sizeof(float), &bytes) || !size_multiply(bytes, request->n_rhs, &size) ||
        size > scene->max_bytes)
        return problem_set(
            why, PROBLEM_TOO_MUCH,
            "%zu vectors of %zu channels and %zu elements pass the %zu bytes that a request may "
            "hold; send several requests",
            request->n_rhs, scene->n_channels, scene->n, scene->max_bytes);
    if (request->n_dense == request->n_rhs) return true;
    return grow_rows(scene, &request->E, &request->n_dense, &request->dense_capacity, request->n_rhs, bytes,
                     "emission", why);
}

bool radiosity_request_dense(radiosity_request *request, const codec_scene *scene, float **E, problem *why) {
    if (!grow_dense(request, scene, why)) return false;
    *E = request->E + (request->n_rhs - 1) * scene->n_channels * scene->n;
    return true;
}

bool radiosity_request_spot(radiosity_request *request, const codec_scene *scene, uint32_t where,
                            bool whole_group, const float *colour, problem *why) {
    const size_t C = scene->n_channels, each = sizeof *request->spots + C * sizeof *colour;
    if (request->n_spots == request->spots_capacity) {
        const size_t most = scene->max_bytes / each;
        size_t more = array_capacity(request->spots_capacity, request->n_spots + 1);
        if (more > most) more = most;
        if (more <= request->n_spots)
            return problem_set(why, PROBLEM_TOO_MUCH,
                               "the sparse vectors pass the %zu bytes that a request may hold; send several "
                               "requests",
                               scene->max_bytes);
        if (!take_memory(scene, (more - request->spots_capacity) * each, why)) return false;
        if (array_resize(&request->spots, more, sizeof *request->spots, "spots", NULL) != LAM_OK ||
            array_resize(&request->colours, more, C * sizeof *colour, "spots", NULL) != LAM_OK)
            return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for a sparse emission");
        request->spots_capacity = more;
    }
    request->spots[request->n_spots] =
        (emission_spot){.vector = (uint32_t)(request->n_rhs - 1), .where = where, .whole_group = whole_group};
    memcpy(request->colours + request->n_spots * C, colour, C * sizeof *colour);
    request->n_spots++;
    return true;
}

void radiosity_request_share(radiosity_request *request, double area) {
    request->spots[request->n_spots - 1].shared = area;
}

static float value_at(const codec_scene *scene, const emission_spot *spot, uint32_t element, float value) {
    if (!(spot->shared > 0)) return value;
    return group_index_counts(scene->groups, element)
               ? (float)((double)value * scene->area[element] / spot->shared)
               : 0;
}

bool radiosity_request_expand(radiosity_request *request, const codec_scene *scene, problem *why) {
    const size_t n = scene->n, C = scene->n_channels;
    if (!grow_dense(request, scene, why)) return false;
    for (size_t k = 0; k < request->n_spots; k++) {
        const emission_spot *spot = &request->spots[k];
        const float *colour = request->colours + k * C;
        const uint32_t *elements = &spot->where;
        size_t count = 1;
        if (spot->whole_group) {
            elements = scene->groups->elements + scene->groups->start[spot->where];
            count = scene->groups->start[spot->where + 1] - scene->groups->start[spot->where];
        }
        for (size_t c = 0; c < C; c++) {
            float *E = request->E + (spot->vector * C + c) * n;
            for (size_t e = 0; e < count; e++) {
                const float value = value_at(scene, spot, elements[e], colour[c]);
                if (!isfinite(value))
                    return problem_set(why, PROBLEM_BAD_VALUE,
                                       "%.9g times the area of element %u, %.9g m2, passes single precision",
                                       (double)colour[c], (unsigned)elements[e], scene->area[elements[e]]);
                E[elements[e]] = value;
            }
        }
    }
    request->n_spots = 0;
    return true;
}

static bool is_negative(const float *x, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (x[i] < 0) return true;
    return false;
}

/* The same of the row of a vector and channel. */
static bool side_is_negative(const side_rows *side, size_t n_channels, size_t width, size_t vector,
                             size_t c) {
    return vector < side->n && is_negative(side->values + (vector * n_channels + c) * width, width);
}

size_t radiosity_request_spots(const radiosity_request *request, size_t vector) {
    size_t low = 0, high = request->n_spots;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (request->spots[middle].vector < vector)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

bool radiosity_request_has_signs(const radiosity_request *request, const codec_scene *scene, size_t vector,
                                 size_t c) {
    const size_t C = scene->n_channels;
    const size_t end = radiosity_request_spots(request, vector + 1);
    for (size_t k = radiosity_request_spots(request, vector); k < end; k++)
        if (request->colours[k * C + c] < 0) return true;
    return (vector < request->n_dense && is_negative(request->E + (vector * C + c) * scene->n, scene->n)) ||
           side_is_negative(&request->sky, C, scene->n_tiles, vector, c) ||
           side_is_negative(&request->emitters, C, scene->n_emitters, vector, c) ||
           side_is_negative(&request->luminaires, C, scene->n_luminaires, vector, c);
}

static bool add_side(const radiosity_request *request, const codec_scene *scene, side_rows *side,
                     size_t width, const char *what, float **row, problem *why) {
    size_t values, bytes, size;
    if (!size_multiply(width, scene->n_channels, &values) || !size_multiply(values, sizeof(float), &bytes) ||
        !size_multiply(bytes, request->n_rhs, &size) || size > scene->max_bytes)
        return problem_set(
            why, PROBLEM_TOO_MUCH,
            "%zu times %zu channels of %zu %s pass the %zu bytes that a request may hold; send "
            "several requests",
            request->n_rhs, scene->n_channels, width, what, scene->max_bytes);
    if (!grow_rows(scene, &side->values, &side->n, &side->capacity, request->n_rhs, bytes, what, why))
        return false;
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

bool radiosity_request_luminaires(radiosity_request *request, const codec_scene *scene, float **row,
                                  problem *why) {
    return add_side(request, scene, &request->luminaires, scene->n_luminaires, "luminaires", row, why);
}

bool radiosity_request_sensors(radiosity_request *request, const codec_scene *scene, float **row,
                               problem *why) {
    return add_side(request, scene, &request->sensors, scene->sensors->start[scene->sensors->n_groups],
                    "sensors", row, why);
}

bool radiosity_request_sun(radiosity_request *request, const codec_scene *scene, const request_sun *sun,
                           const float *direct, problem *why) {
    const size_t C = scene->n_channels, each = sizeof *request->suns + C * sizeof *request->sunlight;
    if (request->n_suns == request->suns_capacity) {
        const size_t more = array_capacity(request->suns_capacity, request->n_suns + 1);
        if (!take_memory(scene, (more - request->suns_capacity) * each, why)) return false;
        if (array_resize(&request->suns, more, sizeof *request->suns, "suns", NULL) != LAM_OK ||
            array_resize(&request->sunlight, more, C * sizeof *direct, "suns", NULL) != LAM_OK)
            return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for suns");
        request->suns_capacity = more;
    }
    request->suns[request->n_suns] = *sun;
    request->suns[request->n_suns].vector = (uint32_t)(request->n_rhs - 1);
    memcpy(request->sunlight + request->n_suns * C, direct, C * sizeof *direct);
    request->n_suns++;
    return true;
}

static const char *const quantities[] = {
    [LAM_RADIOSITY] = "radiosity", [LAM_IRRADIANCE] = "irradiance", [LAM_INDIRECT] = "indirect"};

const char *codec_quantity_name(lam_quantity quantity) {
    return quantities[quantity];
}

bool codec_quantity_find(const char *word, size_t length, lam_quantity *quantity) {
    for (size_t q = 0; q < sizeof quantities / sizeof *quantities; q++)
        if (strlen(quantities[q]) == length && memcmp(quantities[q], word, length) == 0) {
            *quantity = (lam_quantity)q;
            return true;
        }
    return false;
}
