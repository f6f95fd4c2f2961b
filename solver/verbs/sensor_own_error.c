#include "solver/verbs/sensor_own_error.h"

#include "solver/codec/sensor_error.h"
#include "solver/light/emission_apply.h"
#include "solver/operator/luminaire_light.h"
#include "solver/verbs/own_light.h"

#include <math.h>
#include <stdlib.h>

/* Room for one vector: the radiosities of all elements, and squares by set of the store. */
typedef struct sensor_room {
    float *B;
    void *work; /* of an operator of any emission; else NULL */
    size_t work_bytes;
    emission light;       /* that of a store of few emitters on elements, not limited; borrowed */
    emission_pass answer; /* to it */
    uint32_t *sets;
    sensor_squares *squares;
} sensor_room;

static void room_free(sensor_room *r) {
    free(r->B);
    free(r->work);
    emission_pass_free(&r->answer);
    free(r->sets);
    free(r->squares);
}

static lam_status room_make(const lit_store *lit, const error_scene *scene, const sensor_choice *c,
                            sensor_room *out, lam_error *error) {
    static const char what[] = "the error at sensors";
    const bool few = lam_operator_emitters(lit->op) > 0;
    out->B = memory_allocate(scene->n_channels, scene->n * sizeof *out->B, what, error);
    if (few) {
        out->light = lit->light;
        out->light.sensors = NULL;
        out->light.limiter = NULL;
        const lam_status status = emission_pass_create(&out->light, lit->op, lit->sky, LAM_RADIOSITY, 0, NULL,
                                                       1, &out->answer, error);
        if (status != LAM_OK) return status;
    } else {
        out->work_bytes = lam_operator_work_bytes(lit->op, 1);
        out->work = memory_allocate(out->work_bytes, 1, what, error);
    }
    out->sets = memory_allocate(c->n_sets, sizeof *out->sets, what, error);
    out->squares = memory_allocate(lam_sensors_sets(c->all), sizeof *out->squares, what, error);
    if (out->B == NULL || (!few && out->work == NULL) || out->sets == NULL || out->squares == NULL)
        return LAM_ERR_MEMORY;
    for (size_t k = 0; k < c->n_sets; k++) out->sets[k] = (uint32_t)c->sets[k];
    return LAM_OK;
}

/* B of vector v, whose light was taken. */
static lam_status answer_elements(const lit_store *lit, const own_light *light, const error_answer *of,
                                  sensor_room *room, lam_error *error) {
    if (room->work == NULL)
        return emission_pass_solve(&room->answer, 1, &(size_t){light->vector}, room->B, error);
    return lam_operator_apply_lit(lit->op, 1, LAM_RADIOSITY, light->E, of->H0, room->B, room->work,
                                  room->work_bytes, error);
}

/* True where the laws of the store hold of the light; of few emitters it may state a covariance instead. */
static bool is_stated(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                      const own_light *light, const solution *out) {
    const error_by_group *by = &stated->by_group;
    return by->n_bins > 0 && stated->emitters.figures.s == 0 && out->relative >= 0 &&
           (lit->light.D == NULL || luminaires_know_errors(lit->light.luminaires, scene->n_groups)) &&
           (light->n_tiles == 0 || by->figures.n_tiles == light->n_tiles);
}

/* Takes the larger errors of sets, and of all together, of a vector. */
static void take_squares(const sensor_room *room, sensor_choice *c, solution *out) {
    sensor_squares together = {.light2 = 0};
    for (size_t k = 0; k < c->n_sets; k++) {
        const stated_parts parts = sensor_parts(&room->squares[c->sets[k]]);
        const headline one = {.known = true, .parts = parts};
        sensor_squares_add(&together, &room->squares[c->sets[k]]);
        c->stated[k] = fmax(c->stated[k], headline_stated(&one));
    }
    const stated_parts parts = sensor_parts(&together);
    headline_raise(&out->head, &parts);
}

lam_status sensor_error_take(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                             sensor_choice *c, solution *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t row = scene->n_channels * lam_sensors_count(c->all);
    own_light light = {.n_tiles = 0};
    sensor_room room = {.B = NULL};
    TRY(own_light_make(lit, scene, &light, error));
    if (!is_stated(stated, scene, lit, &light, out) || out->n_vectors > SENSOR_ERROR_VECTORS) {
        if (out->head.known)
            out->head.advice = out->n_vectors > SENSOR_ERROR_VECTORS
                                   ? "at sensors it is stated of up to 64 lights"
                                   : "the store states no error of this light at sensors";
        out->head.known = false;
        goto done;
    }
    TRY(room_make(lit, scene, c, &room, error));
    c->stated = memory_allocate(c->n_sets, sizeof *c->stated, "the error at sensors", error);
    if (c->stated == NULL) TRY(LAM_ERR_MEMORY);
    out->head.parts = (stated_parts){.mesh = -1};
    out->error_light = "own";
    out->emitters = 0;
    for (size_t v = 0; v < out->n_vectors; v++) {
        error_answer of = {.quantity = LAM_RADIOSITY, .count = scene->n, .values = room.B, .whole = true};
        const sensor_answer answer = {c->all, &of, light.L, out->values + v * row};
        TRY(own_light_take(&light, v, error));
        own_light_put(&light, &stated->by_group, &of);
        TRY(answer_elements(lit, &light, &of, &room, error));
        if (!sensor_squares_of(&stated->by_group, scene, &answer, c->n_sets, room.sets, room.squares))
            FAIL(error, LAM_ERR_MEMORY, "not enough memory for the error at sensors");
        const emission_size both = emission_size_sum(&of.size, &of.sky);
        out->emitters = fmax(out->emitters, emission_size_number(&both));
        take_squares(&room, c, out);
    }
done:
    own_light_free(&light);
    room_free(&room);
    return status;
}
