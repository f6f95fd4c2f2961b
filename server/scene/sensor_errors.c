#include "server/scene/sensor_errors.h"

#include "server/scene/request_light.h"
#include "server/scene/sensor_answer.h"

#include <stdlib.h>

/* The sets of all names. */
static bool list_sets(const scene *s, const reduce_request *r, sensor_errors *e) {
    const size_t n_sets = s->sensor_sets.n_groups;
    bool *named = memory_allocate(n_sets, sizeof *named, "errors", NULL);
    e->sets = memory_allocate(n_sets, sizeof *e->sets, "errors", NULL);
    const bool good = named != NULL && e->sets != NULL;
    for (size_t k = 0; good && k < r->n_names; k++)
        for (size_t g = 0; g < r->names[k].n_groups; g++) named[r->names[k].groups[g]] = true;
    for (size_t set = 0; good && set < n_sets; set++)
        if (named[set]) e->sets[e->n_sets++] = (uint32_t)set;
    free(named);
    return good;
}

bool sensor_errors_begin(const scene *s, const radiosity_request *request, answer_notes *notes,
                         sensor_errors *out) {
    const reduce_request *r = &request->reduce;
    sensor_errors made = {.names = NULL};
    *out = made;
    if (!request_has_own_error(s, request, notes)) {
        if (notes->has_error) notes->head.advice = "the store states no error of this light at sensors";
        notes->has_error = false;
        notes->head.known = false;
        return true;
    }
    made.names = memory_allocate(r->n_names, sizeof *made.names, "errors", NULL);
    made.squares = memory_allocate(s->sensor_sets.n_groups, sizeof *made.squares, "errors", NULL);
    if (made.names == NULL || made.squares == NULL || !list_sets(s, r, &made)) {
        sensor_errors_free(&made);
        return false;
    }
    for (size_t k = 0; k < r->n_names; k++)
        made.names[k] = (name_error){.name = reduce_text(r, k), .parts = {.mesh = -1}};
    notes->error_light = "own";
    notes->of_sensors = true;
    notes->head.parts = (stated_parts){.mesh = -1};
    notes->n_name_errors = r->n_names;
    notes->name_errors = made.names;
    *out = made;
    return true;
}

void sensor_errors_free(sensor_errors *e) {
    free(e->names);
    free(e->squares);
    free(e->sets);
    *e = (sensor_errors){.names = NULL};
}

void sensor_errors_take(const radiosity_request *request, sensor_errors *e, answer_notes *notes) {
    const reduce_request *r = &request->reduce;
    sensor_squares together = {.light2 = 0};
    for (size_t k = 0; k < r->n_names; k++) {
        sensor_squares one = {.light2 = 0};
        for (size_t g = 0; g < r->names[k].n_groups; g++)
            sensor_squares_add(&one, &e->squares[r->names[k].groups[g]]);
        const stated_parts parts = sensor_parts(&one);
        headline of_name = {.known = true, .parts = e->names[k].parts};
        headline_raise(&of_name, &parts);
        e->names[k].parts = of_name.parts;
    }
    for (size_t k = 0; k < e->n_sets; k++) sensor_squares_add(&together, &e->squares[e->sets[k]]);
    const stated_parts parts = sensor_parts(&together);
    headline_raise(&notes->head, &parts);
}

/* Squares of the sets for vector v with this light, B [C][n]; values [C][receivers] is work. */
static bool square_vector(const scene *s, const radiosity_request *request, const vector_light *light,
                          const float *sun, const float *at_sensors, const float *B, size_t v,
                          sent_light *sent, float *values, sensor_errors *e) {
    const error_scene about = scene_for_errors(s);
    const float *D = request_dimmers(s, request, v);
    error_answer of = {.quantity = LAM_RADIOSITY,
                       .E = light->E,
                       .H0 = light->H0,
                       .count = s->n,
                       .values = B,
                       .L = light->L,
                       .luminaires = lit_luminaires_of(s->luminaires, D)};
    const sensor_answer answer = {s->sensors, &of, light->L, values};
    sent_light_size(s, request, v, of.E, sun, sent, &of);
    of.sky = request_sky_size(s, light->L);
    lam_sensors_gather(s->sensors, 1, of.values, light->L, D, values);
    sensor_values_add_suns(s, request, v, at_sensors, values);
    return sensor_squares_of(&s->errors.by_group, &about, &answer, e->n_sets, e->sets, e->squares);
}

bool scene_note_sensor_error(const scene *s, const radiosity_request *request, const float *H0,
                             const float *sun, const float *at_sensors, const float *W, const float *B,
                             answer_notes *notes, name_error **names) {
    const size_t vector = s->n_channels * s->n;
    sensor_errors e;
    sent_light sent = {.luminaires = NULL};
    *names = NULL;
    if (!sensor_errors_begin(s, request, notes, &e)) return false;
    if (e.names == NULL) return true;
    float *values = memory_allocate(s->n_channels, scene_sensors(s) * sizeof *values, "errors", NULL);
    float *own = memory_allocate(W != NULL ? light_of_weights_room(s) : 0, sizeof *own, "errors", NULL);
    bool good = values != NULL && own != NULL && sent_light_allocate(s, request, sun != NULL, &sent);
    for (size_t v = 0; good && v < request->n_rhs; v++) {
        vector_light light = {request->E + v * vector, H0 != NULL ? H0 + v * vector : NULL,
                              request_sky(s, request, v)};
        good = (W == NULL || light_of_weights(s, W + v * s->n_channels * s->n_emitters, own, &light)) &&
               square_vector(s, request, &light, sun, at_sensors, B + v * vector, v, &sent, values, &e);
        if (good) sensor_errors_take(request, &e, notes);
    }
    free(own);
    *names = e.names; /* which the notes have */
    e.names = NULL;
    sensor_errors_free(&e);
    sent_light_free(&sent);
    free(values);
    return good;
}
