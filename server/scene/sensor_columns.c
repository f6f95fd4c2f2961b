#include "server/scene/sensor_columns.h"

#include "server/scene/direct_light.h"
#include "server/scene/request_light.h"
#include "server/scene/sensor_answer.h"
#include "solver/codec/sensor_error.h"
#include "solver/operator/emitters.h"
#include "solver/operator/sensor_light.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

struct column_table {
    size_t references; /* with the lock of its owner */
    size_t bytes;      /* of columns; likewise */
    size_t n;
    _Atomic(const float *) at[];
};

struct sensor_columns {
    pthread_mutex_t lock;
    memory_ledger *ledger;
    size_t n, width, max_bytes;
    column_table *now;
};

static column_table *table_allocate(size_t n, lam_error *error) {
    column_table *t = memory_allocate(1, sizeof *t + n * sizeof *t->at, "columns of sensors", error);
    if (t == NULL) return NULL;
    t->references = 1;
    t->n = n;
    for (size_t k = 0; k < n; k++) atomic_init(&t->at[k], NULL);
    return t;
}

lam_status sensor_columns_create(size_t n_columns, size_t width, size_t max_bytes, memory_ledger *ledger,
                                 sensor_columns **out, lam_error *error) {
    sensor_columns *c = memory_allocate(1, sizeof *c, "columns of sensors", error);
    if (c == NULL) return LAM_ERR_MEMORY;
    *c = (sensor_columns){.ledger = ledger, .n = n_columns, .width = width, .max_bytes = max_bytes};
    c->now = table_allocate(n_columns, error);
    if (c->now == NULL) {
        free(c);
        return LAM_ERR_MEMORY;
    }
    pthread_mutex_init(&c->lock, NULL);
    *out = c;
    return LAM_OK;
}

/* The caller holds the lock. */
static void release_locked(sensor_columns *c, column_table *t) {
    if (--t->references > 0) return;
    for (size_t k = 0; k < t->n; k++) free((void *)(uintptr_t)atomic_load(&t->at[k]));
    memory_ledger_give_back(c->ledger, t->bytes);
    free(t);
}

void sensor_columns_destroy(sensor_columns *c) {
    if (c == NULL) return;
    release_locked(c, c->now);
    pthread_mutex_destroy(&c->lock);
    free(c);
}

void sensor_columns_clear(sensor_columns *c) {
    if (c == NULL) return;
    column_table *fresh = table_allocate(c->n, NULL);
    if (fresh == NULL) return;
    pthread_mutex_lock(&c->lock);
    release_locked(c, c->now);
    c->now = fresh;
    pthread_mutex_unlock(&c->lock);
}

size_t sensor_columns_held(sensor_columns *c) {
    if (c == NULL) return 0;
    pthread_mutex_lock(&c->lock);
    const size_t bytes = c->now->bytes;
    pthread_mutex_unlock(&c->lock);
    return bytes;
}

column_table *sensor_columns_acquire(sensor_columns *c) {
    pthread_mutex_lock(&c->lock);
    column_table *t = c->now;
    t->references++;
    pthread_mutex_unlock(&c->lock);
    return t;
}

void sensor_columns_release(sensor_columns *c, column_table *t) {
    if (t == NULL) return;
    pthread_mutex_lock(&c->lock);
    release_locked(c, t);
    pthread_mutex_unlock(&c->lock);
}

const float *column_table_get(const column_table *t, size_t k) {
    return atomic_load_explicit(&t->at[k], memory_order_acquire);
}

void sensor_columns_put(sensor_columns *c, column_table *t, size_t k, const float *column) {
    const size_t bytes = c->width * sizeof *column;
    float *kept = NULL;
    pthread_mutex_lock(&c->lock);
    const bool wanted = atomic_load(&t->at[k]) == NULL && t->bytes + bytes <= c->max_bytes;
    if (wanted && memory_ledger_take(c->ledger, bytes)) {
        kept = malloc(bytes > 0 ? bytes : 1);
        if (kept == NULL) {
            memory_ledger_give_back(c->ledger, bytes);
        } else {
            memcpy(kept, column, bytes);
            t->bytes += bytes;
            atomic_store_explicit(&t->at[k], kept, memory_order_release);
        }
    }
    pthread_mutex_unlock(&c->lock);
}

sensor_lights scene_sensor_lights(const scene *s) {
    const size_t k = scene_luminaires(s);
    if (s->n_emitters > 0) return (sensor_lights){s->n_emitters - k, k, 0};
    return (sensor_lights){s->groups.n_groups, k, scene_tiles(s)};
}

size_t sensor_column_width(const scene *s) {
    return 2 * (s->n_channels * scene_sensors(s) + s->sensor_sets.n_groups);
}

column_view sensor_column_view(const scene *s, const float *column) {
    const size_t values = s->n_channels * scene_sensors(s);
    return (column_view){column, column + values, column + 2 * values,
                         column + 2 * values + s->sensor_sets.n_groups};
}

/* Arrays of a pass: E and B are [count][C][n], H0 too; L and D, of one light, [C][m] and [C][k]; sent is
 * [2][n]; W are weights [count][C][s] of a store of emitters. */
typedef struct column_work {
    float *E, *H0, *B, *L, *D, *sent, *W;
} column_work;

size_t sensor_columns_work(const scene *s, size_t count) {
    return s->n_channels * (count * (3 * s->n + s->n_emitters) + scene_tiles(s) + scene_luminaires(s)) +
           2 * s->n;
}

static column_work split_work(const scene *s, size_t count, float *work) {
    const size_t C = s->n_channels, vectors = count * C * s->n;
    return (column_work){work,
                         work + vectors,
                         work + 2 * vectors,
                         work + 3 * vectors,
                         work + 3 * vectors + C * scene_tiles(s),
                         work + 3 * vectors + C * (scene_tiles(s) + scene_luminaires(s)),
                         work + 3 * vectors + C * (scene_tiles(s) + scene_luminaires(s)) + 2 * s->n};
}

/* Sets every channel of light k of a row of `width` to 1, and all others to 0. */
static void set_unit(size_t n_channels, size_t width, size_t k, float *row) {
    memset(row, 0, n_channels * width * sizeof *row);
    for (size_t c = 0; c < n_channels; c++) row[c * width + k] = 1;
}

/* An emitter of a store of few, of which W [C][s] is set too. False when memory is short. */
static bool take_emitter(const scene *s, size_t which, const column_work *w, float *W, float *E, float *H0,
                         const float **L, const float **D) {
    const size_t C = s->n_channels;
    const sensor_lights lights = scene_sensor_lights(s);
    const bool sky = operator_emitters_of(s->op)->a.L != NULL;
    set_unit(C, s->n_emitters, which, W);
    if (which >= lights.groups) {
        set_unit(C, lights.luminaires, which - lights.groups, w->D);
        *D = w->D;
    } else if (sky) {
        operator_emitters_radiances(s->op, 1, W, w->L);
        *L = w->L;
    }
    return operator_emitters_light(s->op, 1, W, E, H0, NULL) == LAM_OK;
}

/* The light `which`, number `at` of a pass: E, or H0 of L or D, whose pointers are set, or NULL. False when
 * memory is short. */
static bool take_light(const scene *s, size_t which, size_t at, const column_work *w, const float **L,
                       const float **D) {
    const size_t C = s->n_channels;
    const sensor_lights lights = scene_sensor_lights(s);
    float *E = w->E + at * C * s->n, *H0 = w->H0 + at * C * s->n;
    *L = *D = NULL;
    if (s->n_emitters > 0) return take_emitter(s, which, w, w->W + at * C * s->n_emitters, E, H0, L, D);
    memset(E, 0, C * s->n * sizeof *E);
    memset(H0, 0, C * s->n * sizeof *H0);
    if (which < lights.groups) {
        for (uint32_t k = s->groups.start[which]; k < s->groups.start[which + 1]; k++)
            for (size_t c = 0; c < C; c++) E[c * s->n + s->groups.elements[k]] = 1;
    } else if (which < lights.groups + lights.luminaires) {
        set_unit(C, lights.luminaires, which - lights.groups, w->D);
        lam_luminaires_irradiance(s->luminaires, 1, w->D, H0);
        *D = w->D;
    } else {
        set_unit(C, lights.tiles, which - lights.groups - lights.luminaires, w->L);
        lam_sky_irradiance(s->sky, C, w->L, H0);
        *L = w->L;
    }
    return true;
}

/* The errors of every set, of the light of a column alone, as sensor_column_view has them. False when memory
 * is short. */
static bool add_errors(const scene *s, const column_work *w, const float *B, const float *L, const float *D,
                       float *column) {
    const size_t C = s->n_channels, n = s->n, n_sets = s->sensor_sets.n_groups;
    const column_view view = sensor_column_view(s, column);
    float *rest = column + (view.rest - column), *mesh = column + (view.mesh - column);
    const error_scene about = scene_for_errors(s);
    error_answer of = {.quantity = LAM_RADIOSITY,
                       .E = w->E,
                       .H0 = w->H0,
                       .count = n,
                       .values = B,
                       .L = L,
                       .luminaires = lit_luminaires_of(s->luminaires, D)};
    memset(rest, 0, n_sets * sizeof *rest);
    memset(mesh, 0, n_sets * sizeof *mesh);
    if (!scene_states_errors(s, L != NULL, D != NULL)) return true;
    for (size_t c = 0; c < C; c++) {
        const float *lamps = D != NULL ? w->H0 + c * n : NULL;
        error_answer_add_channel(&of, &about, c, w->E + c * n, lamps, lamps, w->sent);
    }
    of.sky = request_sky_size(s, L);
    const sensor_answer answer = {s->sensors, &of, L, view.values};
    uint32_t *sets = memory_allocate(n_sets, sizeof *sets, "errors", NULL);
    sensor_squares *squares = memory_allocate(n_sets, sizeof *squares, "errors", NULL);
    for (size_t k = 0; sets != NULL && k < n_sets; k++) sets[k] = (uint32_t)k;
    const bool good = sets != NULL && squares != NULL &&
                      sensor_squares_of(&s->errors.by_group, &about, &answer, n_sets, sets, squares);
    for (size_t k = 0; good && k < n_sets; k++) {
        rest[k] = (float)sqrt(squares[k].off2 / (double)C);
        mesh[k] = squares[k].mesh2 < 0 ? -1 : (float)sqrt(squares[k].mesh2 / (double)C);
    }
    free(sets);
    free(squares);
    return good;
}

bool light_vectors_make(const scene *s, lam_quantity quantity, size_t count, const uint32_t *which,
                        batch_workspace *workspace, float *work, const float **out, problem *why) {
    const size_t bytes = lam_operator_work_bytes(s->op, count);
    const column_work w = split_work(s, count, work);
    const float *L, *D;
    lam_error error;
    void *room = bytes > 0 ? batch_workspace_get(workspace, bytes) : NULL;
    bool lit = room != NULL;
    for (size_t k = 0; lit && k < count; k++) lit = take_light(s, which[k], k, &w, &L, &D);
    if (!lit) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to solve for %zu lights", count);
    *out = w.B;
    return (s->n_emitters > 0 ? lam_operator_apply_emitters(s->op, count, quantity, w.W, s->n, NULL, w.B,
                                                            room, bytes, &error)
                              : lam_operator_apply_lit(s->op, count, quantity, w.E, w.H0, w.B, room, bytes,
                                                       &error)) == LAM_OK ||
           problem_set(why, PROBLEM_INTERNAL, "%s", error.message);
}

bool sensor_columns_make(const scene *s, size_t count, const uint32_t *which, batch_workspace *workspace,
                         float *work, float *out, problem *why) {
    const size_t vector = s->n_channels * s->n, width = sensor_column_width(s);
    const column_work w = split_work(s, count, work);
    const float *L, *D, *B;
    if (!light_vectors_make(s, LAM_RADIOSITY, count, which, workspace, work, &B, why)) return false;
    for (size_t k = 0; k < count; k++) {
        if (!take_light(s, which[k], 0, &w, &L, &D))
            return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to solve for %zu lights", count);
        float *column = out + k * width;
        const column_view view = sensor_column_view(s, column);
        lam_sensors_gather(s->sensors, 1, B + k * vector, L, D, column);
        sensors_gather_off(s->sensors, 1, B + k * vector, L, column + (view.off - column));
        if (!add_errors(s, &w, B + k * vector, L, D, column))
            return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the errors of %zu lights",
                               count);
    }
    return true;
}
