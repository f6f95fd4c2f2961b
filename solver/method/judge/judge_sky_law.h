/* The error of light from any sky in each group of the scene, by the errors of a few (sky_errors). Private to
 * judge.c. */
#ifndef LAMBERT_METHOD_JUDGE_SKY_LAW_H
#define LAMBERT_METHOD_JUDGE_SKY_LAW_H

#include "solver/method/judge/judge_by_group.h"
#include "solver/method/judge/judge_sky_tiles.h"

/* Errors of one sky, by bin, [n_bins] each: mean squares of elements, squares of means, less the noise, and
 * the least that is known of them; the squares of its reflected light; its size, D, W, S and P^2 (judge.h),
 * both D and W in two parts. */
typedef struct sky_probe {
    double *rms, *rms_least, *mean, *mean_least, *light, *light_mean;
    double *direct, *direct_mean, *rare, *rare_mean;
    double spread, power2;
    tile_spread power_off;
} sky_probe;

/* Sums over tiles: of what their direct light is off by, sum A off^2 less the noise, over root(sum A D), of
 * the squares of its terms over sum A D, and of root(sum A D). Bright tiles, which have the most rays, err
 * least for what they are, and dim ones may have next to no rays; so weighted neither decides alone. */
typedef struct direct_sums {
    double off, off2, direct;
} direct_sums;

typedef struct sky_law_sums {
    const judge_input *input;
    const group_errors *errors; /* with sky_power and sky_first */
    tile_errors tiles;
    size_t n_bins;
    double *numbers;       /* of all skies */
    double *reflectance;   /* [C][n_groups], mean */
    double *area, *square; /* [n_groups], and sum A^2 / (sum A)^2 */
    sky_probe of[JUDGE_EVEN_SKIES + JUDGE_SUNS];
    size_t count;
    direct_sums direct;
} sky_law_sums;

/* errors has the powers of the tiles (judge_sky_powers). Errors: LAM_ERR_MEMORY, those of
 * tile_errors_aim. */
lam_status sky_law_begin(const judge_input *input, const group_errors *errors, sky_law_sums *out,
                         lam_error *error);
void sky_law_free(sky_law_sums *s);

/* Adds the next sky of radiances L [m]: even, cloudy, or a single tile. In the noise of the first, that of
 * the operator's own first bounce has the share own_share. bins is for numbers. Cost: O(C n + m groups). */
void sky_law_add(sky_law_sums *s, const figure_probe *one, const float *L, double own_share,
                 by_group_sums *bins);

/* Adds the direct light of a single tile: its first bounce [n] by both samples, between which no noise is
 * shared, beside the operator's own. Cost: O(C n + m groups). */
void sky_law_add_direct(sky_law_sums *s, size_t tile, const float *one, const float *other);

/* Light that is too much at a window is too much in all groups that it bounces into: their errors over their
 * light are alike, and one sky is a single sample of each, small by chance in some. even [n]: squares of
 * errors of means by a sky of power 1, light [n] of that light, weight [n]. Where an error is less than the
 * weighted median of all over their light leaves it, the mean of both squares counts. Errors: LAM_ERR_MEMORY.
 */
lam_status sky_law_share_even(size_t n, const double *light, const double *weight, double *even,
                              lam_error *error);

/* Fills errors->sky, sky_direct and what tiles are off by. Errors: LAM_ERR_MEMORY. */
lam_status sky_law_finish(const sky_law_sums *s, group_errors *errors, lam_error *error);

#endif
