/* Products with a symmetric matrix of tiles (tiles.h). Both triangles are in memory, each digit as a byte. A
 * vector register holds a row of four tiles, whose columns are read in four loads instead of twelve. */
#ifndef LAMBERT_LINALG_TILED_H
#define LAMBERT_LINALG_TILED_H

#include "solver/linalg/tiles.h"
#include "store/store_map.h"

#include <stdbool.h>

enum { TILES_AT_ONCE = 4, TILE_LANES = TILE * TILES_AT_ONCE };

/* Columns and steps behind the last that a register may read; vectors that lie side by side; what the sum of
 * a plane is worth in the next lower one. */
enum { TILED_PAST = 8, TILED_WIDE = 16, TILED_RADIX = 256 };

/* Numbers behind n that tiled_multiply may read of a vector where tiles were changed in a mapped file, beside
 * which nothing is read or written then: their columns are not looked at one by one there. */
enum { TILED_BEYOND = UINT16_MAX + 1 + TILED_PAST };

/* Four tiles of a group of rows: tile t begins at column base + beyond[t]; row r of all four side by side. */
typedef struct tile_four {
    uint32_t base;
    uint16_t beyond[TILES_AT_ONCE];
    int8_t values[TILE][TILE_LANES];
} tile_four;

typedef struct tiled_rows {
    size_t n, n_groups, n_planes, n_fours;
    uint32_t *first; /* [n_groups + 1], rows of a group are first[g] to first[g + 1] - 1, and columns too */
    float *step;     /* [n], of a row and of a column */
    const uint32_t *begin;     /* [n_groups n_planes + 1]: the fours of plane d of group g are begin[k] to
                                  begin[k + 1] - 1, k = (g + 1) n_planes - 1 - d: the highest plane first */
    const tile_four *fours;    /* [n_fours] */
    store_view begins, values; /* they hold begin and fours, which may be mapped: tiled_begin, tiled_base */
    size_t n_numbers;          /* of the whole matrix that are not 0 */
} tiled_rows;

/* Rows are numbered anew, without those outside all groups: group g has those after group g - 1. Errors:
 * LAM_ERR_MEMORY. */
lam_status tiled_create(const tile_matrix *upper, size_t n_groups, const tile_group *groups,
                        const float *step, tiled_rows *out, lam_error *error);
void tiled_free(tiled_rows *t);

/* Makes first and step of the n_groups groups, which have n rows in all; tiled_rest frees them. Errors:
 * LAM_ERR_MEMORY. */
lam_status tiled_set_rows(tiled_rows *t, const tile_group *groups, const float *step, lam_error *error);
void tiled_rest(tiled_rows *t);

/* GROUP/begin [n_groups n_planes + 1] u32, four [n_fours][sizeof(tile_four)] i8 and the attribute `numbers`
 * of GROUP, as store/FORMAT.md says. tiled_load leaves them in place where the store is mapped, and first and
 * step to tiled_set_rows. Errors: as store_write; as store_read_view, LAM_ERR_NUMERIC for a tile that cannot
 * be. */
lam_status tiled_save(const tiled_rows *t, const char *group, store *s, lam_error *error);
lam_status tiled_load(store *s, const char *group, size_t n, size_t n_groups, tiled_rows *out,
                      lam_error *error);

/* Where a part of `begin` starts. A file that is changed while it is mapped leads nowhere else. */
static inline size_t tiled_begin(const tiled_rows *t, size_t part) {
    const size_t begin = t->begin[part];
    return begin < t->n_fours ? begin : t->n_fours;
}

/* The base of a four, and the column of one of its tiles, likewise at most n. */
static inline size_t tiled_base(const tiled_rows *t, const tile_four *four) {
    return four->base < t->n ? four->base : t->n;
}

static inline size_t tiled_column(const tiled_rows *t, const tile_four *four, size_t k) {
    const size_t column = (size_t)four->base + four->beyond[k];
    return column < t->n ? column : t->n;
}

/* The part of `begin` that has a plane of a group. */
static inline size_t tiled_part(const tiled_rows *t, size_t group, size_t plane) {
    return (group + 1) * t->n_planes - 1 - plane;
}

/* Vectors have room for TILED_PAST numbers behind n. Of a vector X a product takes `scaled`, step_i X_i, and
 * 0 behind them; the step of a row is in the product. Where begin and fours are mapped, the vector that
 * tiled_multiply and tiled_multiply_rows take has room for TILED_BEYOND numbers, which need not be set. */

/* y = A X. Every sum has one order, so that the bits do not depend on n_threads. */
void tiled_multiply(const tiled_rows *t, const float *scaled, float *y, size_t n_threads);

/* Y = A X of `count` vectors, at most TILED_WIDE, side by side, each with the bits of tiled_multiply, or,
 * where it has few columns, of tiled_multiply_columns: scaled and Y are [n + TILED_PAST][TILED_WIDE], work
 * has tiled_lanes_work bytes; all three are aligned to a cache line. */
size_t tiled_lanes_work(const tiled_rows *t);
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
