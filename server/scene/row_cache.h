/* The cache of adjoint rows of one scene: rows are immutable, shared by reference counts, and the least
 * recently used is dropped when they are too many. Knows nothing of how a row is computed (adjoint_rows.h).
 * Any thread. */
#ifndef LAMBERT_SERVER_SCENE_ROW_CACHE_H
#define LAMBERT_SERVER_SCENE_ROW_CACHE_H

#include "lambert/lambert.h"
#include "server/scene/luminaire_sums.h"
#include "server/scene/memory_ledger.h"
#include "solver/operator/groups/adjoint_row.h"
#include "solver/operator/groups/group_statistics.h"

#include <stdint.h>

typedef struct row_cache row_cache;

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
