#include "support/answer_scene.h"

#include <math.h>

const double answer_area[N] = {1, 2, 4};
const float answer_rho[C * N] = {.5f, .5f, .25f, .5f, .5f, .75f};
const uint32_t start[] = {0, 2, 3}, answer_members[] = {0, 1, 2}; /* of desk and lamp */
const error_scene answer_scene = {.n = N,
                                  .n_channels = C,
                                  .n_groups = G,
                                  .area = answer_area,
                                  .reflectance = answer_rho,
                                  .start = start,
                                  .members = answer_members};

/* Figures of the groups, as a store states them. */
double answer_one[] = {.03, .01}, answer_many[] = {.04, .005}, answer_even[] = {.01, .02};
double mean_one[] = {.03, .01}, mean_many[] = {.02, .005}, answer_mean_even[] = {.001, .002};
static double sky_tiles[] = {.07, .06}, sky_even[] = {.01, .02}, sky_mean_tiles[] = {.03, .04},
              sky_mean_even[] = {.002, .003};
double bin_area[] = {3, 4}, answer_squares[] = {5, 16}, mean_rho[] = {.5, .25, .5, .75};
uint32_t answer_bin[] = {0, 0, 1};
/* Means over elements and channels of rho^2; of lamp (.0625 + .5625) / 2. */
static reflecting of_group[] = {{.25, .25, false}, {.3125, .3125, false}};
/* Tiles are off by half of the root of the mean first bounce {.1, .2, .3, .4}, in a mean of the 2 elements of
 * desk by 5 / 9 of that square; the power that they send is not off. */
double answer_sky_power[] = {2, 1, 3, 1}, elements_off[] = {.025, .05, .075, .1};
static double means_off[] = {.025 * 5 / 9, .05 * 5 / 9, .075, .1}, zeros[C * TILES], no_bounce[G];
const error_by_group answer_stated = {
    .figures = {.n_groups = G,
                .n_rows = 1,
                .n_channels = C,
                .n_tiles = TILES,
                .of = {[GROUP_RMS_ONE] = answer_one,
                       [GROUP_RMS_MANY] = answer_many,
                       [GROUP_RMS_EVEN] = answer_even,
                       [GROUP_MEAN_ONE] = mean_one,
                       [GROUP_MEAN_MANY] = mean_many,
                       [GROUP_MEAN_EVEN] = answer_mean_even},
                .sky = {[SKY_RMS_TILES] = sky_tiles,
                        [SKY_RMS_EVEN] = sky_even,
                        [SKY_RMS_BOUNCED] = no_bounce,
                        [SKY_MEAN_TILES] = sky_mean_tiles,
                        [SKY_MEAN_EVEN] = sky_mean_even,
                        [SKY_MEAN_BOUNCED] = no_bounce},
                .sky_power = answer_sky_power,
                .sky_elements_off = elements_off,
                .sky_means_off = means_off,
                .sky_power_off = zeros},
    .n_bins = G,
    .area = bin_area,
    .squares = answer_squares,
    .reflectance = mean_rho,
    .of_group = of_group,
    .bin = answer_bin,
};

/* P^2 (a^2 / N^2 + b^2 (1 - 1 / N) / N + c^2). */
double answer_law(double P2, double number, double a, double b, double c) {
    return P2 * (a * a / number / number + b * b / number * (1 - 1 / number) + c * c);
}

/* An error over the light without it, and where it is more than half of that, over half of it. */
double answer_ratio(double off2, double light2) {
    return 2 * off2 < light2 ? sqrt(off2 / (light2 - off2)) : sqrt(2 * off2 / light2);
}

/* A sky: P_c = 2 + 3 and 6 + 2, P^2 = 89, sum (L Q)^2 = 4 + 9 + 36 + 4; the mean radiances are 5/3 and 2, so
 * that S = 2 (2/3)^2 + (4/3)^2 = 8/3, and D = rho^2 (f_0 (2/3)^2 + f_1 (4/3)^2) = .25 * .4 and .0625 * 7.6
 * / 9. */
const float answer_L[C * TILES] = {1, 3, 2, 2};
const double answer_sky_P2 = 89, answer_sky_squares = 53, answer_sky_S = 8. / 3,
             answer_sky_D[G] = {.25 * .4, .0625 * 7.6 / 9};

/* The same for irradiance, rho being 1 in D: .4 and 7.6 / 9. */
const double answer_white_D[G] = {.1 * 4 / 9 + .2 * 16 / 9, .3 * 4 / 9 + .4 * 16 / 9};

/* D / 4 + tiles^2 S + even^2 P^2, the last two over rho^2. */
double answer_law_over(double D, double tiles, double evenly, double rho2) {
    return .25 * D + (tiles * tiles * answer_sky_S + evenly * evenly * answer_sky_P2) / rho2;
}

/* The law of light that is reflected alone, whose bounced light is not off, is that without D, or that of an
 * emission of all elements, whose number is (sum A)^2 / sum A^2 = 49 / 21, where that is less. */
double answer_law_of_sent(double tiles, double evenly, double a, double b, double c) {
    return fmin(answer_law_over(0, tiles, evenly, 1), answer_law(answer_sky_P2, 49. / 21, a, b, c));
}

/* Emission of elements 0 and 2 and the direct light of a sky; the reflected light r. */
const float answer_E[C * N] = {1, 0, 2, 3, 0, 0}, answer_H0[C * N] = {.1f, .1f, .3f, .2f, .2f, .4f};
const double answer_reflected[C * N] = {.5, .25, .125, 1, .5, .25};

/* P_c = 1 + 8 and 3; sum A^2 E^2 = 1 + 64 + 9. */
const double answer_P2 = 81 + 9, answer_A2E2 = 74;

void answer_fill(lam_quantity quantity, bool lit, float values[C * N]) {
    for (size_t k = 0; k < C * N; k++) {
        const double sky = lit ? (double)answer_H0[k] : 0;
        values[k] = (float)(quantity == LAM_INDIRECT ? answer_reflected[k]
                            : quantity == LAM_IRRADIANCE
                                ? answer_reflected[k] / (double)answer_rho[k] + sky
                                : answer_reflected[k] + (double)answer_E[k] + (double)answer_rho[k] * sky);
    }
}

error_answer answer_of(lam_quantity quantity, const float *values) {
    error_answer of = {.quantity = quantity, .E = answer_E, .count = N, .values = values};
    for (size_t c = 0; c < C; c++) emission_size_add(&of.size, N, answer_area, answer_E + c * N);
    return of;
}
