/* Matrices of derivatives of elements that were asked for last, of one scene: copies, counted in its ledger.
 * Any thread. */
#ifndef LAMBERT_SERVER_SCENE_MATRIX_CACHE_H
#define LAMBERT_SERVER_SCENE_MATRIX_CACHE_H

#include "lambert/lambert.h"
#include "server/scene/memory_ledger.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct matrix_cache matrix_cache;

/* A question for a matrix, whose lists are the caller's. */
typedef struct matrix_question {
    lam_quantity quantity;
    size_t n_by, n_elements;
    const lam_by *by;         /* [n_by], in the order asked */
    const uint32_t *elements; /* [n_elements], likewise */
} matrix_question;

/* At most MATRICES_KEPT matrices, of MATRIX_BYTES together; ledger (or NULL) outlives it. Errors:
 * LAM_ERR_MEMORY. */
enum { MATRICES_KEPT = 8 };
#define MATRIX_BYTES ((size_t)8 << 20)
lam_status matrix_cache_create(memory_ledger *ledger, matrix_cache **out, lam_error *error);

/* NULL is allowed, here and below: a cache that keeps nothing. */
void matrix_cache_destroy(matrix_cache *c);

/* Copies the matrix of a question, of `count` numbers, to values; false where it is not there. O(count). */
bool matrix_cache_find(matrix_cache *c, const matrix_question *asked, size_t count, float *values);

/* Keeps a copy of a matrix, in place of those that were asked for longest ago, unless there is no room. */
void matrix_cache_put(matrix_cache *c, const matrix_question *asked, size_t count, const float *values);

/* Drops all; and the bytes taken of the ledger. */
void matrix_cache_clear(matrix_cache *c);
size_t matrix_cache_held(matrix_cache *c);

#endif
