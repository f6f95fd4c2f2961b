/* A symmetric sparse matrix of which neighbours have their numbers in the same columns, as coefficients of a
 * wavelet basis do: rows and columns are cut into groups of up to three, and where a group of rows has a
 * number in a group of columns, all nine are a tile. Numbers are integers times the steps of row and column,
 *     A_ij = step_i step_j sum_d 256^d Q_d,ij,
 * with Q_d of signed bytes: most numbers have one digit, so that the planes d > 0 have few tiles. */
#ifndef LAMBERT_LINALG_TILES_H
#define LAMBERT_LINALG_TILES_H

#include "solver/linalg/csr.h"

enum { TILE = 3, TILE_PLANES = 4 };

/* Rows first to first + size - 1, size from 1 to TILE, which share a step. */
typedef struct tile_group {
    uint32_t first, size;
} tile_group;

/* Digits of the numbers in group `column` of group `row`; 0 beyond the sizes of both. */
typedef struct tile_digits {
    uint32_t row, column;
    int8_t values[TILE][TILE];
} tile_digits;

/* The upper triangle: of each plane the tiles with column >= row, by ascending row, then column; those on
 * the diagonal are whole. */
typedef struct tile_matrix {
    size_t count[TILE_PLANES];
    tile_digits *tiles[TILE_PLANES];
} tile_matrix;

void tile_matrix_free(tile_matrix *m);

/* Rounds the upper triangle of a, finite, of which each number must lie in rows and columns of the groups,
 * ascending and apart. step [n_groups] is above 0; no number may be 2^30 times those of its row and column.
 * Errors: LAM_ERR_MEMORY. */
lam_status tile_matrix_round(const csr *a, size_t n_groups, const tile_group *groups, const float *step,
                             tile_matrix *out, lam_error *error);

/* Numbers of the whole matrix that are not 0. */
size_t tile_matrix_numbers(const tile_matrix *m);

/* Appends a tile to a plane of room[d] tiles. Errors: LAM_ERR_MEMORY. */
lam_status tile_matrix_append(tile_matrix *m, size_t plane, const tile_digits *t, size_t room[TILE_PLANES],
                              lam_error *error);

#endif
