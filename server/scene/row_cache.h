/* The cache of adjoint rows of one scene: rows are immutable, shared by reference counts, and the least
 * recently used is dropped when they are too many. Knows nothing of how a row is computed (adjoint_rows.h).
 * Any thread. */
#ifndef LAMBERT_SERVER_SCENE_ROW_CACHE_H
#define LAMBERT_SERVER_SCENE_ROW_CACHE_H

#include "lambert/lambert.h"
#include "server/scene/luminaire_sums.h"
#include "server/scene/memory_ledger.h"
#include "solver/codec/group_figures.h"

#include <stdint.h>

typedef struct row_cache row_cache;

/* w = (dq/dE)^T (A 1_group / sum A) of C channels: the mean of quantity q over a group is w^T E. Buried
 * elements are in neither. */
typedef struct adjoint_row {
    size_t references;
    uint64_t used; /* number of its last use */
    struct adjoint_row *next;
    size_t bytes;
    const uint32_t *groups; /* of the mean, as group_index_find gives them */
    size_t n_groups;
    lam_quantity quantity;
    double area;       /* sum A; 0: the row is 0, and the mean has no value */
    double buried;     /* share of the area of the groups that buried elements have */
    float *w;          /* [C][n]; NULL where the store answers for its own emitters only */
    float *emitters;   /* [C][s], by emitter, in place of w */
    double *of_group;  /* [C][groups of the scene], sum of w over each; NaN: not determined by the emitters */
    float *tiles;      /* [C][m], by radiance of a sky's tile; NaN likewise */
    float *luminaires; /* [C][k], by their dimmers */
} adjoint_row;

void adjoint_row_free(adjoint_row *row);

/* For a store of few emitters: the weights of emitters whose sum is one group of the scene alone, or one tile
 * of its sky. Any emission by groups and tiles is then known by its weights, without a vector. Immutable once
 * made; where no weights give a group or tile in a channel, the first weight is NaN. */
typedef struct emitter_weights {
    float *of_group; /* [groups][C][s] */
    float *of_tile;  /* [m][C][s] */
    size_t bytes;    /* taken of the ledger of the cache that it is set in */
} emitter_weights;

void emitter_weights_free(emitter_weights *weights);

/* max_bytes: limit of all rows together; rows are also counted in ledger (or NULL). Errors: LAM_ERR_MEMORY.
 */
lam_status row_cache_create(size_t max_bytes, memory_ledger *ledger, row_cache **out, lam_error *error);

/* No row may be in use. NULL is allowed. */
void row_cache_destroy(row_cache *rows);

/* Drops all rows; those in use are freed by their last user. */
void row_cache_clear(row_cache *rows);

/* Bytes taken of the ledger, for rows, weights and sums. */
size_t row_cache_held(row_cache *rows);

/* max_bytes. */
size_t row_cache_limit(const row_cache *rows);

/* found [count]: the rows of these names that are there, each released by row_cache_release, NULL for the
 * others. Returns true if all are there. */
bool row_cache_find(row_cache *rows, size_t count, const reduce_name *names, lam_quantity quantity,
                    adjoint_row **found);

/* Adds a new row if there is room, and returns it, to be released by the caller; or frees it and returns the
 * row of this name that another thread added meanwhile. */
adjoint_row *row_cache_publish(row_cache *rows, adjoint_row *made, const reduce_name *name);

/* Entries may be NULL. */
void row_cache_release(row_cache *rows, size_t count, adjoint_row **released);

/* The weights of the scene's emitters; NULL before they are set. Setting takes made over; the first one
 * stays. */
const emitter_weights *row_cache_weights(row_cache *rows);
const emitter_weights *row_cache_set_weights(row_cache *rows, emitter_weights *made);

/* The same of the sums of the scene's luminaires. */
const luminaire_sums *row_cache_luminaires(row_cache *rows);
const luminaire_sums *row_cache_set_luminaires(row_cache *rows, luminaire_sums *made);

#endif
