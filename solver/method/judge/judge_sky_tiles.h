/* The error of the first bounce of each tile of a sky, in each group of the scene and in the power that the
 * tile sends into it. Private to judge.c.
 *
 * Let e_it be the mean squared error of the first bounce f_it of element i. Errors of elements are
 * independent, so that sums tell those of a tile: sum A_i e_it / sum A_i of the elements of a group, sum
 * A_i^2 e_it / (sum A_i)^2 of their mean, and sum (A_i rho_i)^2 e_it of the power. The last two are large
 * where few elements have all the light of a tile, whatever that light is. */
#ifndef LAMBERT_METHOD_JUDGE_SKY_TILES_H
#define LAMBERT_METHOD_JUDGE_SKY_TILES_H

#include "solver/method/judge/judge.h"

/* Sums over elements of the weights above times one number of each element and tile. */
typedef struct tile_sums {
    double *elements, *means; /* [n_groups][n_tiles]; NULL: too many numbers */
    double *power;            /* [C][n_tiles], m^4 times the number's unit */
} tile_sums;

/* e_it is direct^2 f_it, direct^2 one number for the scene. Where few of an element's own rays met a tile,
 * f_it says next to nothing, and it is 0 where none did. Of the largest elements others are aimed at such
 * tiles, and the square of what the own rays are off by is added. */
typedef struct tile_errors {
    const judge_input *input;
    double *area;   /* [n_groups] */
    tile_sums seen; /* of f_it, sr */
    tile_sums rare; /* of e_it of pairs that few rays met, sr^2 */
} tile_errors;

/* Errors: LAM_ERR_MEMORY. Cost: O(C m n). */
lam_status tile_errors_begin(const judge_input *input, tile_errors *out, lam_error *error);
void tile_errors_free(tile_errors *t);

/* Fills rare by the sky's `pairs`, if it has any: of the elements of the largest A rho that see the sky,
 * those of the tiles that few of their own rays met. Errors: LAM_ERR_MEMORY, those of `pairs`. */
lam_status tile_errors_aim(tile_errors *t, lam_error *error);

/* sum_t w_t (L_t - M)^2 of a sky L [m] for one channel, M its mean. */
typedef struct tile_spread {
    double seen, rare;
} tile_spread;
tile_spread tile_errors_of_group(const tile_errors *t, size_t group, bool of_mean, const float *L,
                                 double mean);
tile_spread tile_errors_of_power(const tile_errors *t, size_t channel, const float *L, double mean);

/* Fills the sums of e_it in out. Errors: LAM_ERR_MEMORY. */
lam_status tile_errors_finish(const tile_errors *t, double direct2, group_errors *out, lam_error *error);

#endif
