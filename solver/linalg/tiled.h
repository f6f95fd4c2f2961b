/* Products with a symmetric matrix of tiles (tiles.h). Both triangles are in memory, each digit as a byte. A
 * vector register holds a row of four tiles, whose columns are read in four loads instead of twelve. */
#ifndef LAMBERT_LINALG_TILED_H
#define LAMBERT_LINALG_TILED_H

#include "solver/linalg/tiles.h"

#include <stdbool.h>

enum { TILES_AT_ONCE = 4, TILE_LANES = TILE * TILES_AT_ONCE };

/* Four tiles of a group of rows: tile t begins at column base + beyond[t]; row r of all four side by side. */
typedef struct tile_four {
    uint32_t base;
    uint16_t beyond[TILES_AT_ONCE];
    int8_t values[TILE][TILE_LANES];
} tile_four;

typedef struct tiled_rows {
    size_t n, n_groups, n_planes;
    uint32_t *first; /* [n_groups + 1], rows of a group are first[g] to first[g + 1] - 1, and columns too */
    uint32_t *group_of; /* [n], of a row */
    float *step;        /* [n], of a row and of a column */
    uint64_t *begin;    /* [n_groups n_planes + 1]: the fours of plane d of group g are
                           begin[k] to begin[k + 1] - 1, k = (g + 1) n_planes - 1 - d: the highest plane first */
    tile_four *fours;
} tiled_rows;

/* Rows are numbered anew, without those outside all groups: group g has those after group g - 1. Errors:
 * LAM_ERR_MEMORY. */
lam_status tiled_create(const tile_matrix *upper, size_t n_groups, const tile_group *groups,
                        const float *step, tiled_rows *out, lam_error *error);
void tiled_free(tiled_rows *t);

/* The upper triangle again. Errors: LAM_ERR_MEMORY. */
lam_status tiled_upper(const tiled_rows *t, tile_matrix *out, lam_error *error);

/* Floats of work for m vectors, at most 16. */
size_t tiled_work(size_t n, size_t m);

/* Y_v = A X_v, X_v = X + v n, Y_v = Y + v n, m at most 16. Every sum has one order, so that the bits of a
 * vector depend on neither m nor n_threads. work is aligned to a cache line. */
void tiled_multiply(const tiled_rows *t, size_t m, const float *X, float *Y, float *work, size_t n_threads);

/* y_i = (A x)_i for `count` rows i, with the bits of tiled_multiply; other entries of y may change. work as
 * for one vector. */
void tiled_multiply_rows(const tiled_rows *t, size_t count, const uint32_t *rows, const float *x, float *y,
                         float *work);

/* True when the columns in which x is not 0 hold so few numbers that their sum costs less than the rows. */
bool tiled_few_columns(const tiled_rows *t, const float *x);

/* y = A x by the columns in which x is not 0, of which there may be none. work as for one vector. */
void tiled_multiply_columns(const tiled_rows *t, const float *x, float *y, float *work);

/* Bytes that a product reads. */
size_t tiled_bytes(const tiled_rows *t);

#endif
