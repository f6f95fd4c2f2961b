/* Products with a symmetric matrix of tiles (tiles.h). Both triangles are in memory, each digit as a byte. A
 * vector register holds a row of four tiles, whose columns are read in four loads instead of twelve. */
#ifndef LAMBERT_LINALG_TILED_H
#define LAMBERT_LINALG_TILED_H

#include "solver/linalg/tiles.h"

#include <stdbool.h>

enum { TILES_AT_ONCE = 4, TILE_LANES = TILE * TILES_AT_ONCE };

/* Columns and steps behind the last that a register may read; vectors that lie side by side; what the sum of
 * a plane is worth in the next lower one. */
enum { TILED_PAST = 8, TILED_WIDE = 16, TILED_RADIX = 256 };

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

/* The part of `begin` that has a plane of a group. */
static inline size_t tiled_part(const tiled_rows *t, size_t group, size_t plane) {
    return (group + 1) * t->n_planes - 1 - plane;
}

/* Vectors have room for TILED_PAST numbers behind n. Of a vector X a product takes `scaled`, step_i X_i, and
 * 0 behind them; the step of a row is in the product. */

/* y = A X. Every sum has one order, so that the bits do not depend on n_threads. */
void tiled_multiply(const tiled_rows *t, const float *scaled, float *y, size_t n_threads);

/* Y = A X of `count` vectors, at most TILED_WIDE, side by side, each with the bits of tiled_multiply, or,
 * where it has few columns, of tiled_multiply_columns: scaled and Y are [n + TILED_PAST][TILED_WIDE], as is
 * work; all three are aligned to a cache line. */
void tiled_multiply_lanes(const tiled_rows *t, size_t count, const float *scaled, float *Y, float *work,
                          size_t n_threads);

/* y_i = (A X)_i for the rows of `count` groups, with the bits of tiled_multiply. */
void tiled_multiply_rows(const tiled_rows *t, size_t count, const uint32_t *groups, const float *scaled,
                         float *y);

/* The fours of columns up to which their sum costs less than the rows. */
uint64_t tiled_few(const tiled_rows *t);

/* True when the columns in which X is not 0 have no more fours. In the second form these are among the
 * columns of `count` groups. */
bool tiled_few_columns(const tiled_rows *t, const float *scaled);
bool tiled_few_columns_of(const tiled_rows *t, size_t count, const uint32_t *groups, const float *scaled);

/* y += the columns of group g, whose scaled numbers are x [TILE], 0 behind the group's: y_i lacks step_i. */
void tiled_add_columns(const tiled_rows *t, size_t g, const float *x, float *y);

/* y = A X by the columns in which X is not 0, of which there may be none. */
void tiled_multiply_columns(const tiled_rows *t, const float *scaled, float *y);

/* The same bits in the rows of n_asked groups, where the columns in which X is not 0 are among those of n_lit
 * groups, ascending; wanted [n] is not 0 at the first row of the groups asked, and 0 at that of others. Other
 * entries of y may change. */
void tiled_multiply_columns_of(const tiled_rows *t, size_t n_lit, const uint32_t *lit, size_t n_asked,
                               const uint32_t *asked, const uint8_t *wanted, const float *scaled, float *y);

/* Bytes that a product reads. */
size_t tiled_bytes(const tiled_rows *t);

#endif
