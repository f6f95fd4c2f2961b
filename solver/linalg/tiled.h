/* Sparse rows of which neighbours have their entries in the same columns, as coefficients of a wavelet basis
 * do: rows and columns are cut into groups of up to three, and where a group of rows has an entry in a group
 * of columns, all nine are stored as a tile, in half precision. A vector register holds a row of four tiles,
 * whose columns are read in four loads instead of twelve. */
#ifndef LAMBERT_LINALG_TILED_H
#define LAMBERT_LINALG_TILED_H

#include "solver/linalg/csr.h"

enum { TILE = 3, TILES_AT_ONCE = 4, TILE_LANES = TILE * TILES_AT_ONCE };

/* Floats behind a vector that a product may read; they must be finite. */
enum { TILED_PAST = 4 };

typedef struct tiled_rows {
    size_t n, n_groups;
    uint32_t *first; /* [n_groups + 1], rows of a group are first[g] to first[g + 1] - 1, and columns too */
    uint32_t *group_of; /* [n], of a row */
    uint64_t *begin;    /* [n_groups + 1]: fours of tiles of group g are begin[g] to begin[g + 1] - 1 */
    uint32_t *columns;  /* [fours][4], the first column of each tile */
    uint16_t *values;   /* [fours][3][12], f16: row r of four tiles side by side */
    float scale;        /* of values */
} tiled_rows;

/* first [n_groups + 1] (copied) begins with 0, ends with n, and no group has more than TILE rows. Every value
 * of a must be scale, a power of two, times an f16. The caller frees with tiled_free. Errors: LAM_ERR_MEMORY;
 * LAM_ERR_ARGUMENT for other groups or values. */
lam_status tiled_create(const csr *a, float scale, size_t n_groups, const uint32_t *first, tiled_rows *out,
                        lam_error *error);
void tiled_free(tiled_rows *t);

/* Floats of work for m vectors, at most 16. */
size_t tiled_work(size_t n, size_t m);

/* Y_v = A X_v, X_v = X + v n, Y_v = Y + v n, m at most 16; TILED_PAST floats behind X are readable and
 * finite. Every sum has one order, so that the bits of a vector depend on neither m nor n_threads. work is
 * aligned to a cache line. */
void tiled_multiply(const tiled_rows *t, size_t m, const float *X, float *Y, float *work, size_t n_threads);

/* y_i = (A x)_i for `count` rows i, with the bits of tiled_multiply; other entries of y may change. */
void tiled_multiply_rows(const tiled_rows *t, size_t count, const uint32_t *rows, const float *x, float *y);

/* Bytes that a product reads. */
size_t tiled_bytes(const tiled_rows *t);

#endif
