/* Columns of sensors: what comes to every receiver of a scene from one light alone, a group of which all
 * elements emit 1 in every channel, a luminaire at dimmer 1, or a tile of radiance 1; of a store of few
 * emitters each of these with weight 1. Answers are linear in
 * these lights, so that columns, computed when first needed, give each of them
 *     value_s = sum_k weight_k column_ks
 * without a vector of elements, and are the derivatives by these weights. They are those of the linear map,
 * which puts nothing below zero up. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SENSOR_COLUMNS_H
#define LAMBERT_SERVER_SCENE_SENSOR_COLUMNS_H

#include "server/queue/batch.h"
#include "server/scene/memory_ledger.h"
#include "solver/codec/problem.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct scene scene;

/* The lights of a scene by number: groups first, then luminaires, then tiles. A store of few emitters
 * has these in their order: its emitters but luminaires stand in the place of groups, and it has no tiles. */
typedef struct sensor_lights {
    size_t groups, luminaires, tiles;
} sensor_lights;
sensor_lights scene_sensor_lights(const scene *s);

static inline size_t sensor_lights_count(const sensor_lights *l) {
    return l->groups + l->luminaires + l->tiles;
}

/* A column: the values, and their halves' differences by sampling (sensor_weights.off), of which the latter
 * give the variance of any mixture; and by set the roots of the sums of squares that values are off by in a
 * channel, of operator and form factors, and by the mesh (negative: not stated), which of a mixture have one
 * sign at worst. Where nothing is stated of errors these are 0. */
typedef struct column_view {
    const float *values, *off; /* [C][receivers] */
    const float *rest, *mesh;  /* [sets] */
} column_view;
column_view sensor_column_view(const scene *s, const float *column);
size_t sensor_column_width(const scene *s);

/* The columns that a scene keeps, until it drops them all at once. */
typedef struct sensor_columns sensor_columns;

/* Columns of one time: those that were found stay valid until it is released, whatever is dropped. */
typedef struct column_table column_table;

/* n_columns of `width` floats, of max_bytes together, counted in ledger (or NULL). Errors: LAM_ERR_MEMORY. */
lam_status sensor_columns_create(size_t n_columns, size_t width, size_t max_bytes, memory_ledger *ledger,
                                 sensor_columns **out, lam_error *error);

/* NULL is allowed; no table may be in use. */
void sensor_columns_destroy(sensor_columns *c);
void sensor_columns_clear(sensor_columns *c);
size_t sensor_columns_held(sensor_columns *c);

column_table *sensor_columns_acquire(sensor_columns *c);
void sensor_columns_release(sensor_columns *c, column_table *table);

/* Column k, of sensor_column_width numbers; NULL: it is not there. */
const float *column_table_get(const column_table *table, size_t k);

/* Keeps a copy of a column unless there is no room, or another thread has put it there. */
void sensor_columns_put(sensor_columns *c, column_table *table, size_t k, const float *column);

/* *out, in work, [count][C][n]: a quantity under each of these lights, at most BATCH_PASS, by one pass over
 * the operator. work is sensor_columns_work(s, count) floats. Their bits do not depend on each other. False
 * with *why. */
bool light_vectors_make(const scene *s, lam_quantity quantity, size_t count, const uint32_t *which,
                        batch_workspace *workspace, float *work, const float **out, problem *why);

/* out [count][sensor_column_width]: the columns of these lights, at most BATCH_PASS, by one pass over the
 * operator. work is sensor_columns_work(s, count) floats. Their bits do not depend on each other. False with
 * *why. */
bool sensor_columns_make(const scene *s, size_t count, const uint32_t *which, batch_workspace *workspace,
                         float *work, float *out, problem *why);
size_t sensor_columns_work(const scene *s, size_t count);

#endif
