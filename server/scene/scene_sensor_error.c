/* The errors of answers at sensors (scene.h). */
#include "server/scene/request_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/codec/sensor_error.h"

#include <math.h>
#include <stdlib.h>

/* Squares of each set, and of all sets that some names mean. */
typedef struct set_squares {
    size_t n;
    uint32_t *sets;          /* [n] */
    sensor_squares *squares; /* [n] */
} set_squares;

static void set_squares_free(set_squares *s) {
    free(s->sets);
    free(s->squares);
}

/* The sets of all names, one after the other. */
static bool list_sets(const reduce_request *r, set_squares *out) {
    size_t n = 0;
    for (size_t k = 0; k < r->n_names; k++) n += r->names[k].n_groups;
    out->sets = memory_allocate(n, sizeof *out->sets, "errors", NULL);
    out->squares = memory_allocate(n, sizeof *out->squares, "errors", NULL);
    if (out->sets == NULL || out->squares == NULL) return false;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t g = 0; g < r->names[k].n_groups; g++) out->sets[out->n++] = r->names[k].groups[g];
    return true;
}

/* Takes the larger parts for each name, and for all together. */
static void take_names(const reduce_request *r, const set_squares *of, name_error *names, headline *head) {
    sensor_squares together = {.light2 = 0};
    for (size_t k = 0, at = 0; k < r->n_names; k++) {
        sensor_squares one = {.light2 = 0};
        for (size_t g = 0; g < r->names[k].n_groups; g++) sensor_squares_add(&one, &of->squares[at++]);
        sensor_squares_add(&together, &one);
        headline of_name = {.known = true, .parts = names[k].parts};
        const stated_parts parts = sensor_parts(&one);
        headline_raise(&of_name, &parts);
        names[k].parts = of_name.parts;
    }
    const stated_parts parts = sensor_parts(&together);
    headline_raise(head, &parts);
}

/* Squares of the sets for vector v; values [C][receivers] is work. */
static bool square_vector(const scene *s, const radiosity_request *request, const float *H0, const float *B,
                          size_t v, sent_light *sent, float *values, set_squares *out) {
    const size_t vector = s->n_channels * s->n;
    const error_scene about = scene_for_errors(s);
    const float *L = request_sky(s, request, v), *D = request_dimmers(s, request, v);
    error_answer of = {.quantity = LAM_RADIOSITY,
                       .E = request->E + v * vector,
                       .H0 = H0 != NULL ? H0 + v * vector : NULL,
                       .count = s->n,
                       .values = B + v * vector,
                       .L = L,
                       .luminaires = lit_luminaires_of(s->luminaires, D)};
    const sensor_answer answer = {s->sensors, &of, L, values};
    sent_light_size(s, request, v, of.E, NULL, sent, &of);
    of.sky = request_sky_size(s, L);
    lam_sensors_gather(s->sensors, 1, of.values, L, D, values);
    return sensor_squares_of(&s->errors.by_group, &about, &answer, out->n, out->sets, out->squares);
}

bool scene_note_sensor_error(const scene *s, const radiosity_request *request, const float *H0,
                             const float *B, answer_notes *notes, name_error **names) {
    const reduce_request *r = &request->reduce;
    const size_t C = s->n_channels;
    set_squares sets = {.n = 0};
    sent_light sent = {.luminaires = NULL};
    *names = NULL;
    if (!request_has_own_error(s, request, notes)) {
        notes->has_error = false;
        if (notes->head.advice == NULL)
            notes->head.advice = "no error is stated for this light at sensors; precompute again";
        return true;
    }
    name_error *made = memory_allocate(r->n_names, sizeof *made, "errors", NULL);
    float *values = memory_allocate(C, scene_sensors(s) * sizeof *values, "errors", NULL);
    bool good = made != NULL && values != NULL && list_sets(r, &sets) &&
                sent_light_allocate(s, request, false, &sent);
    if (good) {
        notes->error_light = "own";
        notes->of_sensors = true;
        notes->head.parts = (stated_parts){.mesh = -1};
    }
    for (size_t k = 0; good && k < r->n_names; k++)
        made[k] = (name_error){.name = reduce_text(r, k), .parts = {.mesh = -1}};
    for (size_t v = 0; good && v < request->n_rhs; v++) {
        good = square_vector(s, request, H0, B, v, &sent, values, &sets);
        if (good) take_names(r, &sets, made, &notes->head);
    }
    if (good) {
        notes->n_name_errors = r->n_names;
        notes->name_errors = *names = made;
        made = NULL;
    }
    free(made);
    free(values);
    sent_light_free(&sent);
    set_squares_free(&sets);
    return good;
}
