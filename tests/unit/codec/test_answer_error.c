/* The error of an answer against the same by plain sums: three elements of two groups, two channels. */
#include "solver/codec/answer_error.h"
#include "solver/operator/stated/whole_law.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 3, C = 2, G = 2, TILES = 2 };
static const double area[N] = {1, 2, 4};
static const float rho[C * N] = {.5f, .5f, .25f, .5f, .5f, .75f};
static const uint32_t start[] = {0, 2, 3}, members[] = {0, 1, 2}; /* of desk and lamp */
static const error_scene scene = {.n = N,
                                  .n_channels = C,
                                  .n_groups = G,
                                  .area = area,
                                  .reflectance = rho,
                                  .start = start,
                                  .members = members};

/* Figures of the groups, as a store states them. */
static double one[] = {.03, .01}, many[] = {.04, .005}, even[] = {.01, .02};
static double mean_one[] = {.03, .01}, mean_many[] = {.02, .005}, mean_even[] = {.001, .002};
static double sky_tiles[] = {.07, .06}, sky_even[] = {.01, .02}, sky_mean_tiles[] = {.03, .04},
              sky_mean_even[] = {.002, .003};
static double bin_area[] = {3, 4}, squares[] = {5, 16}, mean_rho[] = {.5, .25, .5, .75};
static uint32_t bin[] = {0, 0, 1};
/* Means over elements and channels of rho^2; of lamp (.0625 + .5625) / 2. */
static reflecting of_group[] = {{.25, .25, false}, {.3125, .3125, false}};
/* Tiles are off by half of the root of the mean first bounce {.1, .2, .3, .4}, in a mean of the 2 elements of
 * desk by 5 / 9 of that square; the power that they send is not off. */
static double sky_power[] = {2, 1, 3, 1}, elements_off[] = {.025, .05, .075, .1};
static double means_off[] = {.025 * 5 / 9, .05 * 5 / 9, .075, .1}, zeros[C * TILES], no_bounce[G];
static const error_by_group stated = {
    .figures = {.n_groups = G,
                .n_rows = 1,
                .n_channels = C,
                .n_tiles = TILES,
                .of = {[GROUP_RMS_ONE] = one,
                       [GROUP_RMS_MANY] = many,
                       [GROUP_RMS_EVEN] = even,
                       [GROUP_MEAN_ONE] = mean_one,
                       [GROUP_MEAN_MANY] = mean_many,
                       [GROUP_MEAN_EVEN] = mean_even},
                .sky = {[SKY_RMS_TILES] = sky_tiles,
                        [SKY_RMS_EVEN] = sky_even,
                        [SKY_RMS_BOUNCED] = no_bounce,
                        [SKY_MEAN_TILES] = sky_mean_tiles,
                        [SKY_MEAN_EVEN] = sky_mean_even,
                        [SKY_MEAN_BOUNCED] = no_bounce},
                .sky_power = sky_power,
                .sky_elements_off = elements_off,
                .sky_means_off = means_off,
                .sky_power_off = zeros},
    .n_bins = G,
    .area = bin_area,
    .squares = squares,
    .reflectance = mean_rho,
    .of_group = of_group,
    .bin = bin,
};

/* P^2 (a^2 / N^2 + b^2 (1 - 1 / N) / N + c^2). */
static double law(double P2, double number, double a, double b, double c) {
    return P2 * (a * a / number / number + b * b / number * (1 - 1 / number) + c * c);
}

/* An error over the light without it, and where it is more than half of that, over half of it. */
static double ratio(double off2, double light2) {
    return 2 * off2 < light2 ? sqrt(off2 / (light2 - off2)) : sqrt(2 * off2 / light2);
}

/* A sky: P_c = 2 + 3 and 6 + 2, P^2 = 89, sum (L Q)^2 = 4 + 9 + 36 + 4; the mean radiances are 5/3 and 2, so
 * that S = 2 (2/3)^2 + (4/3)^2 = 8/3, and D = rho^2 (f_0 (2/3)^2 + f_1 (4/3)^2) = .25 * .4 and .0625 * 7.6
 * / 9. */
static const float L[C * TILES] = {1, 3, 2, 2};
static const double sky_P2 = 89, sky_squares = 53, sky_S = 8. / 3, sky_D[G] = {.25 * .4, .0625 * 7.6 / 9};

/* The same for irradiance, rho being 1 in D: .4 and 7.6 / 9. */
static const double white_D[G] = {.1 * 4 / 9 + .2 * 16 / 9, .3 * 4 / 9 + .4 * 16 / 9};

/* D / 4 + tiles^2 S + even^2 P^2, the last two over rho^2. */
static double law_over(double D, double tiles, double evenly, double rho2) {
    return .25 * D + (tiles * tiles * sky_S + evenly * evenly * sky_P2) / rho2;
}

/* The law of light that is reflected alone, whose bounced light is not off, is that without D, or that of an
 * emission of all elements, whose number is (sum A)^2 / sum A^2 = 49 / 21, where that is less. */
static double law_of_sent(double tiles, double evenly, double a, double b, double c) {
    return fmin(law_over(0, tiles, evenly, 1), law(sky_P2, 49. / 21, a, b, c));
}

/* Emission of elements 0 and 2 and the direct light of a sky; the reflected light r. */
static const float E[C * N] = {1, 0, 2, 3, 0, 0}, H0[C * N] = {.1f, .1f, .3f, .2f, .2f, .4f};
static const double r[C * N] = {.5, .25, .125, 1, .5, .25};

/* P_c = 1 + 8 and 3; sum A^2 E^2 = 1 + 64 + 9. */
static const double P2 = 81 + 9, A2E2 = 74;

static void fill(lam_quantity quantity, bool lit, float values[C * N]) {
    for (size_t k = 0; k < C * N; k++) {
        const double sky = lit ? (double)H0[k] : 0;
        values[k] = (float)(quantity == LAM_INDIRECT     ? r[k]
                            : quantity == LAM_IRRADIANCE ? r[k] / (double)rho[k] + sky
                                                         : r[k] + (double)E[k] + (double)rho[k] * sky);
    }
}

static error_answer answer_of(lam_quantity quantity, const float *values) {
    error_answer of = {.quantity = quantity, .E = E, .count = N, .values = values};
    for (size_t c = 0; c < C; c++) emission_size_add(&of.size, N, area, E + c * N);
    return of;
}

START_TEST(all_elements_count_by_their_group) {
    const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[_i % 3];
    const bool lit = _i >= 3;
    float values[C * N];
    answer_error found;
    fill(quantity, lit, values);
    error_answer of = answer_of(quantity, values);
    /* Of H all of it is over rho^2, and D is that of white elements. */
    const bool white = quantity == LAM_IRRADIANCE;
    const double desk = white ? .25 : 1, lamp = white ? .3125 : 1;
    double off = 3 * law(P2, P2 / A2E2, .03, .04, .01) / desk + 4 * law(P2, P2 / A2E2, .01, .005, .02) / lamp;
    if (lit) {
        of.H0 = H0;
        of.L = L;
        for (size_t c = 0; c < C; c++)
            emission_size_add(&of.sky, TILES, sky_power + c * TILES, L + c * TILES);
        const double *D = white ? white_D : sky_D;
        off += quantity == LAM_INDIRECT
                   ? 3 * law_of_sent(.07, .01, .03, .04, .01) + 4 * law_of_sent(.06, .02, .01, .005, .02)
                   : 3 * law_over(D[0], .07, .01, desk) + 4 * law_over(D[1], .06, .02, lamp);
    }
    double reflected = 0, radiosity = 0;
    for (size_t k = 0; k < C * N; k++) {
        const double sky = lit ? (double)H0[k] : 0, h = r[k] / (double)rho[k];
        const double d = white ? h : r[k], b = white ? h + sky : r[k] + (double)E[k] + (double)rho[k] * sky;
        reflected += area[k % N] * d * d;
        radiosity += area[k % N] * b * b;
    }
    ck_assert(answer_error_of(&stated, &scene, &of, &found));
    ck_assert_double_eq_tol(found.indirect, ratio(off, reflected), 1e-5 * found.indirect);
    ck_assert_double_eq_tol(found.relative, ratio(off, radiosity), 1e-5 * found.relative);
    const double power = sqrt(P2) + (lit ? sqrt(sky_P2) : 0);
    ck_assert_double_eq_tol(found.emitters, power * power / (A2E2 + (lit ? sky_squares : 0)), 1e-6);
}
END_TEST

START_TEST(selected_elements_are_those_of_the_answer) {
    float values[C * N], some[C] = {0};
    const uint32_t selected[] = {2};
    answer_error found;
    fill(LAM_RADIOSITY, false, values);
    error_answer of = answer_of(LAM_RADIOSITY, some);
    for (size_t c = 0; c < C; c++) some[c] = values[c * N + 2];
    of.count = 1;
    of.selected = selected;
    ck_assert(answer_error_of(&stated, &scene, &of, &found));
    const double off = law(P2, P2 / A2E2, .01, .005, .02), reflected = .125 * .125 + .25 * .25;
    ck_assert_double_eq_tol(found.indirect, ratio(off, reflected), 1e-5);
    /* The same of whole vectors. */
    answer_error again;
    of.values = values;
    of.whole = true;
    ck_assert(answer_error_of(&stated, &scene, &of, &again));
    ck_assert(again.indirect == found.indirect && again.relative == found.relative);
}
END_TEST

START_TEST(names_have_errors_of_their_means) {
    const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[_i];
    const uint32_t desk[] = {0}, both[] = {0, 1};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}, {.groups = both, .n_groups = 2}};
    const reduce_request request = {.on = true, .names = list, .n_names = 2};
    float values[C * N];
    name_error found[2] = {{.name = "kept"}};
    fill(quantity, false, values);
    const error_answer of = answer_of(quantity, values);
    ck_assert(name_errors_of(&stated, &scene, &of, &request, found));
    const bool white = quantity == LAM_IRRADIANCE;
    const double desk_rho2 = white ? .25 : 1, lamp_rho2 = white ? .3125 : 1, rho0 = white ? .25 : 1,
                 rho1 = white ? .75 : 1, desk_rho = white ? .5 : 1;
    const double number = P2 / A2E2, mean0 = law(P2, number, .03, .02, .001) / desk_rho2,
                 rms0 = law(P2, number, .03, .04, .01) / desk_rho2;
    const double r0 = (.5 + 2 * .25) / 3 / desk_rho, r1 = (1 + 2 * .5) / 3 / desk_rho,
                 reflected = r0 * r0 + r1 * r1;
    ck_assert_str_eq(found[0].name, "kept");
    ck_assert_double_eq_tol(found[0].mean, ratio(mean0, reflected), 1e-5);
    ck_assert_double_eq_tol(found[0].elements, ratio(rms0, reflected), 1e-4);
    const double all = (3 * mean0 + 4 * law(P2, number, .01, .005, .002) / lamp_rho2) / 7;
    const double a0 = (3 * r0 + 4 * .125 / rho0) / 7, a1 = (3 * r1 + 4 * .25 / rho1) / 7;
    ck_assert_double_eq_tol(found[1].mean, sqrt(all / (a0 * a0 + a1 * a1 - all)), 1e-5);
    /* The means alone give the same, in a group that has one reflectance. */
    double value[C] = {0}, emission[C] = {0};
    const double direct[C] = {0};
    for (size_t k = 0; k < C * 2; k++) {
        const size_t c = k / 2, i = k % 2;
        value[c] += area[i] * (double)values[c * N + i] / 3;
        emission[c] += area[i] * (double)E[c * N + i] / 3;
    }
    const name_means means = {
        .quantity = quantity, .size = of.size, .value = value, .emission = emission, .direct = direct};
    const name_error same = name_error_of_means(&stated, &list[0], &means);
    ck_assert_double_eq_tol(same.mean, found[0].mean, 1e-6);
    ck_assert_double_eq_tol(same.elements, found[0].elements, 1e-5);
    ck_assert_double_eq_tol(same.relative, found[0].relative, 1e-6);
}
END_TEST

/* Element 1 is buried, two thirds of desk: the same power on a third of the area is thrice as far off. */
START_TEST(buried_elements_have_no_part) {
    static const bool buried[N] = {false, true, false};
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const reduce_request request = {.on = true, .names = list, .n_names = 1};
    float values[C * N];
    name_error found;
    error_scene standing = scene;
    standing.buried = buried;
    fill(LAM_INDIRECT, false, values);
    const error_answer of = answer_of(LAM_INDIRECT, values);
    ck_assert(name_errors_of(&stated, &standing, &of, &request, &found));
    const double number = P2 / A2E2, reflected = r[0] * r[0] + r[N] * r[N];
    ck_assert_double_eq_tol(found.mean, ratio(9 * law(P2, number, .03, .02, .001), reflected), 1e-5);
    ck_assert_double_eq_tol(found.elements, ratio(3 * law(P2, number, .03, .04, .01), reflected), 1e-4);
    const double value[C] = {r[0], r[N]}, nothing[C] = {0};
    const name_means means = {.quantity = LAM_INDIRECT,
                              .size = of.size,
                              .buried = 2. / 3,
                              .value = value,
                              .emission = nothing,
                              .direct = nothing};
    const name_error same = name_error_of_means(&stated, &list[0], &means);
    ck_assert_double_eq_tol(same.mean, found.mean, 1e-6);
    ck_assert_double_eq_tol(same.elements, found.elements, 1e-5);
}
END_TEST

/* Single tiles are off each by its own: with spreads (2/3)^2 and (4/3)^2 of the first channel D = rho^2 (4
 * d_0 + 16 d_1) / 9, the second has none, and W likewise. A tile that no ray met may be off by all that it
 * sends. */
START_TEST(single_tiles_have_their_own_errors) {
    static double off[] = {.01, .02, .03, .04}, mean_off[] = {.001, .002, .003, .004};
    static double power_off[] = {.5, .25, 8, 9}, bounced[] = {.2, .3}, mean_bounced[] = {.1, .15};
    const double W = (.5 * 4 + .25 * 16) / 9, D = .25 * (.01 * 4 + .02 * 16) / 9;
    const double D_mean = .25 * (.001 * 4 + .002 * 16) / 9;
    error_by_group by_tile = stated;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const double direct[C] = {.1, .2}, none[C] = {0}, value[C] = {1 + .5 * .1, 2 + .5 * .2};
    const name_means means = {
        .quantity = LAM_RADIOSITY, .L = L, .value = value, .emission = none, .direct = direct};
    by_tile.figures.sky[SKY_RMS_BOUNCED] = bounced;
    by_tile.figures.sky[SKY_MEAN_BOUNCED] = mean_bounced;
    by_tile.figures.sky_elements_off = off;
    by_tile.figures.sky_means_off = mean_off;
    by_tile.figures.sky_power_off = power_off;
    const double rms = D + .04 * W + .07 * .07 * sky_S + .01 * .01 * sky_P2;
    const double mean = D_mean + .01 * W + .03 * .03 * sky_S + .002 * .002 * sky_P2;
    const name_error found = name_error_of_means(&by_tile, &list[0], &means);
    ck_assert_double_eq_tol(found.mean, ratio(mean, 5), 1e-6);
    ck_assert_double_eq_tol(found.elements, ratio(rms, 5), 1e-6);
    /* Of too many groups the powers alone are known. */
    by_tile.figures.sky_elements_off = by_tile.figures.sky_means_off = NULL;
    const name_error without = name_error_of_means(&by_tile, &list[0], &means);
    ck_assert_double_eq_tol(without.elements, sqrt((rms - D) / (5 - rms + D)), 1e-6);
}
END_TEST

/* Light that is reflected has no errors of what is direct: bounced^2 times those of the power, W and (A
 * mean_even)^2 P^2 of the groups, and the law of an emission of all elements, whose number is (sum A)^2 / sum
 * A^2 = 49 / 21; or what tiles^2 S and even^2 P^2 say, where that is less, as it is here of the mean. */
START_TEST(reflected_light_has_no_direct_errors) {
    static double off[] = {.01, .02, .03, .04}, power_off[] = {.5, .25, 8, 9};
    static double bounced[] = {.02, .3}, mean_bounced[] = {.1, .15};
    const double W = (.5 * 4 + .25 * 16) / 9, even2 = (9 * .002 * .002 + 16 * .003 * .003) * sky_P2;
    error_by_group by_tile = stated;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const double direct[C] = {.1, .2}, none[C] = {0}, value[C] = {3, 4};
    const name_means means = {
        .quantity = LAM_INDIRECT, .L = L, .value = value, .emission = none, .direct = direct};
    by_tile.figures.sky[SKY_RMS_BOUNCED] = bounced;
    by_tile.figures.sky[SKY_MEAN_BOUNCED] = mean_bounced;
    by_tile.figures.sky_elements_off = by_tile.figures.sky_means_off = off;
    by_tile.figures.sky_power_off = power_off;
    const double sent = .0004 * (W + even2) + law(sky_P2, 49. / 21, .03, .04, .01);
    const double all = .0004 * W + .07 * .07 * sky_S + .01 * .01 * sky_P2;
    const double mean_all = .01 * W + .03 * .03 * sky_S + .002 * .002 * sky_P2;
    const double mean_sent = .01 * (W + even2) + law(sky_P2, 49. / 21, .03, .02, .001);
    const double rms = fmin(all, sent), mean = fmin(mean_all, mean_sent);
    const name_error found = name_error_of_means(&by_tile, &list[0], &means);
    ck_assert_double_eq_tol(found.elements, ratio(rms, 25), 1e-6);
    ck_assert_double_eq_tol(found.mean, ratio(mean, 25), 1e-6);
}
END_TEST

/* Two luminaires under the dimmers d and colours f: D = sum_c rho_c^2 sum_k (d_kc f_kc)^2 off_kg, of
 * irradiance without rho, and none of light that is bounced, beside the law of the whole size. */
START_TEST(luminaires_have_errors_of_their_own) {
    static const float dimmers[C * 2] = {1, 2, 0, 3};
    static const double factors[C * 2] = {1, .5, 2, 1.5}, off[2 * G] = {.01, .02, .03, .04};
    static const double mean_off[2 * G] = {.001, .002, .003, .004};
    static const double lumens[2] = {100, 300};
    const lit_luminaires lit = {.k = 2,
                                .dimmers = dimmers,
                                .factors = factors,
                                .elements_off = off,
                                .means_off = mean_off,
                                .lumens = lumens};
    const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[_i];
    const bool white = quantity == LAM_IRRADIANCE, sees = quantity != LAM_INDIRECT;
    /* (d f)^2 is 1 and 1 in the first channel, 0 and 20.25 in the second; rho is .5 of desk in both. */
    const double D = sees ? (white ? 1 : .25) * (.01 + .03 + 20.25 * .03) : 0,
                 D_mean = sees ? (white ? 1 : .25) * (.001 + .003 + 20.25 * .003) : 0, rho2 = white ? .25 : 1;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const reduce_request request = {.on = true, .names = list, .n_names = 1};
    float values[C * N];
    name_error found = {.name = "desk"};
    answer_error all;
    fill(quantity, true, values);
    error_answer of = answer_of(quantity, values);
    of.H0 = H0;
    of.luminaires = lit;
    const double number = P2 / A2E2, rms = law(P2, number, .03, .04, .01) / rho2 + D,
                 mean = law(P2, number, .03, .02, .001) / rho2 + D_mean;
    const double r0 = (.5 + 2 * .25) / 3 / sqrt(rho2), r1 = (1 + 2 * .5) / 3 / sqrt(rho2);
    ck_assert(name_errors_of(&stated, &scene, &of, &request, &found));
    ck_assert_double_eq_tol(found.mean, ratio(mean, r0 * r0 + r1 * r1), 1e-5);
    ck_assert_double_eq_tol(found.elements, ratio(rms, r0 * r0 + r1 * r1), 1e-4);
    /* The same of the mean alone, and of all elements selected. */
    double value[C] = {0}, emission[C] = {0}, direct[C] = {0};
    for (size_t k = 0; k < C * 2; k++) {
        const size_t c = k / 2, i = k % 2;
        value[c] += area[i] * (double)values[c * N + i] / 3;
        emission[c] += area[i] * (double)E[c * N + i] / 3;
        direct[c] += area[i] * (double)H0[c * N + i] / 3;
    }
    const name_means means = {.quantity = quantity,
                              .size = of.size,
                              .luminaires = lit,
                              .value = value,
                              .emission = emission,
                              .direct = direct};
    /* (100 + 5 300)^2 / (100^2 + (5 300)^2), dimmers of both channels together. */
    ck_assert_double_eq_tol(lit_luminaires_number(&lit, C), 2560000. / 2260000., 1e-12);
    const name_error same = name_error_of_means(&stated, &list[0], &means);
    ck_assert_double_eq_tol(same.mean, found.mean, 1e-6);
    ck_assert_double_eq_tol(same.elements, found.elements, 1e-5);
    of.count = 2;
    of.selected = members;
    of.whole = true;
    ck_assert(answer_error_of(&stated, &scene, &of, &all));
    double reflected = 0;
    for (size_t k = 0; k < C * 2; k++)
        reflected += area[k % 2] * r[k / 2 * N + k % 2] * r[k / 2 * N + k % 2] / rho2;
    ck_assert_double_eq_tol(all.indirect, ratio(3 * rms, reflected), 1e-5);
}
END_TEST

/* Where whole groups have errors of their own, what elements send on of a sun or of luminaires, which E has
 * not, has those of its size. */
START_TEST(reflected_light_is_no_whole_group) {
    static uint32_t whole_groups[] = {1}, whole_of[] = {WHOLE_NONE, 0};
    static double whole_rms[G] = {.0004, .0009}, whole_mean[G] = {.0001, .0004};
    const float lamp[C * N] = {0, 0, 2, 0, 0, 0}, reflected[C * N] = {.5f, .25f, .75f, .25f, 0, 0};
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const reduce_request request = {.on = true, .names = list, .n_names = 1};
    float values[C * N];
    name_error found = {.name = "desk"};
    error_by_group whole = stated;
    whole.figures.n_whole = 1;
    whole.figures.whole_groups = whole_groups;
    whole.figures.whole_rms = whole_rms;
    whole.figures.whole_mean = whole_mean;
    whole.whole_of = whole_of;
    fill(LAM_INDIRECT, false, values);
    error_answer of = {.quantity = LAM_INDIRECT, .E = lamp, .count = N, .values = values};
    for (size_t c = 0; c < C; c++) emission_size_add(&of.reflected, N, area, reflected + c * N);
    ck_assert(name_errors_of(&whole, &scene, &of, &request, &found));
    /* P_c is .5 + .5 + 3 and .25; 2^2 / C of what the lamp alone is off by. */
    const double power2 = 16 + .0625, number = power2 / (.25 + .25 + 9 + .0625);
    const double rms = .0004 * 4 / C + law(power2, number, .03, .04, .01);
    const double r0 = (.5 + 2 * .25) / 3, r1 = (1 + 2 * .5) / 3;
    ck_assert_double_eq_tol(found.elements, ratio(rms, r0 * r0 + r1 * r1), 1e-5);
}
END_TEST

/* The figures of a group that reflects nothing are those of its irradiance alone. */
START_TEST(black_groups_have_errors_of_their_irradiance) {
    static reflecting with_black[] = {{1, 1, true}, {.3125, .3125, false}};
    error_by_group black = stated;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const double none[C] = {0}, value[C] = {3, 4};
    black.of_group = with_black;
    for (int k = 0; k < 3; k++) {
        const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[k];
        const name_means means = {
            .quantity = quantity, .size = {P2, A2E2, 0}, .value = value, .emission = none, .direct = none};
        const name_error found = name_error_of_means(&black, &list[0], &means);
        const double off = quantity == LAM_IRRADIANCE ? law(P2, P2 / A2E2, .03, .02, .001) : 0;
        ck_assert_double_eq_tol(found.mean, ratio(off, 25), 1e-6);
    }
}
END_TEST

/* Means of rho^2 over elements and channels, of a group of two reflectances and of a black one. */
START_TEST(reflectances_of_groups) {
    static const double areas[N] = {1, 3, 4};
    static const float two[C * N] = {.5f, 0, 0, .25f, .75f, 0};
    static const uint32_t group[N] = {0, 0, 1};
    reflecting *of = NULL;
    lam_error error = {.message = ""};
    ck_ok(reflecting_make(N, C, areas, two, G, group, &of, &error));
    ck_assert_double_eq_tol(of[0].square, (.25 + .0625 + 3 * .5625) / 4 / 2, 1e-12);
    ck_assert_double_eq_tol(of[0].mean_square, (.125 * .125 + .625 * .625) / 2, 1e-12);
    ck_assert(!of[0].black && of[1].black);
    ck_assert(reflecting_of_mean(&of[1], LAM_IRRADIANCE, 2) == 2 &&
              reflecting_of_mean(&of[1], LAM_RADIOSITY, 2) == 0);
    free(of);
}
END_TEST

/* Faces that count twice: s = .1 of all light, and half of group 0 overlaps. Of B - E of values r + rho H0
 * the squared error has s^2 + o / 2 of the elements of a group and s^2 + o^2 / 2 of its mean; of a name of
 * both groups what overlaps is half of the light in the first. */
START_TEST(faces_that_count_twice_are_off_by_their_light) {
    double overlap[G] = {.5, 0};
    const uint32_t desk[] = {0}, both[] = {0, 1};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}, {.groups = both, .n_groups = 2}};
    const reduce_request request = {.on = true, .names = list, .n_names = 2};
    error_by_group off = stated;
    float values[C * N];
    answer_error before, found;
    name_error means_before[2], means_found[2];
    off.repair = .1;
    off.overlap = overlap;
    fill(LAM_INDIRECT, false, values);
    error_answer of = answer_of(LAM_INDIRECT, values);
    ck_assert(answer_error_of(&stated, &scene, &of, &before));
    ck_assert(answer_error_of(&off, &scene, &of, &found));
    double light2 = 0, added = 0;
    for (size_t k = 0; k < C * N; k++) {
        light2 += area[k % N] * r[k] * r[k];
        added += area[k % N] * r[k] * r[k] * (.01 + (bin[k % N] == 0 ? .25 : 0));
    }
    /* x = e^2 / (l^2 - e^2), so that e^2 = l^2 x / (1 + x). */
    const double square = before.indirect * before.indirect, own = light2 * square / (1 + square) + added;
    ck_assert_double_eq_tol(found.indirect, ratio(own, light2), 1e-6);
    ck_assert(name_errors_of(&stated, &scene, &of, &request, means_before));
    ck_assert(name_errors_of(&off, &scene, &of, &request, means_found));
    const double r0[C] = {(.5 + 2 * .25) / 3, (1 + 2 * .5) / 3}, r1[C] = {.125, .25};
    for (int name = 0; name < 2; name++) {
        double mean2 = 0, more = 0;
        for (size_t c = 0; c < C; c++) {
            const double mean = name == 0 ? r0[c] : (3 * r0[c] + 4 * r1[c]) / 7;
            const double covered = .5 * r0[c] * (name == 0 ? 1 : 3. / 7);
            mean2 += mean * mean;
            more += .01 * mean * mean + covered * covered / 2;
        }
        const double x = means_before[name].mean * means_before[name].mean, e2 = mean2 * x / (1 + x) + more;
        ck_assert_double_eq_tol(means_found[name].mean, ratio(e2, mean2), 1e-5);
        ck_assert_double_gt(means_found[name].elements, means_before[name].elements);
    }
    /* The means alone give the same. */
    const double none[C] = {0};
    const name_means means = {
        .quantity = LAM_INDIRECT, .size = of.size, .value = r0, .emission = none, .direct = none};
    ck_assert_double_eq_tol(name_error_of_means(&off, &list[0], &means).mean, means_found[0].mean, 1e-5);
    /* The light of a sky counts too, as a face that is hidden has none of it. */
    fill(LAM_IRRADIANCE, true, values);
    of = answer_of(LAM_IRRADIANCE, values);
    of.H0 = H0;
    ck_assert(answer_error_of(&stated, &scene, &of, &before));
    ck_assert(answer_error_of(&off, &scene, &of, &found));
    double reflected2 = 0;
    added = 0;
    for (size_t k = 0; k < C * N; k++) {
        const double H = (double)values[k], reflected = H - (double)H0[k];
        reflected2 += area[k % N] * reflected * reflected;
        added += area[k % N] * H * H * (.01 + (bin[k % N] == 0 ? .25 : 0));
    }
    const double x = before.indirect * before.indirect, e2 = reflected2 * x / (1 + x) + added;
    ck_assert_double_eq_tol(found.indirect, ratio(e2, reflected2), 1e-5 * found.indirect);
}
END_TEST

/* A sky of a store that states nothing of skies adds nothing. */
START_TEST(unknown_skies_are_left) {
    float values[C * N];
    answer_error found, again;
    error_by_group none = stated;
    none.figures.n_tiles = 0;
    fill(LAM_RADIOSITY, false, values);
    error_answer of = answer_of(LAM_RADIOSITY, values);
    ck_assert(answer_error_of(&none, &scene, &of, &found));
    of.L = L;
    ck_assert(answer_error_of(&none, &scene, &of, &again));
    ck_assert(again.indirect == found.indirect);
}
END_TEST

/* The mesh lacks more of the light of few tiles than of all, whether the sky is in the light or its first
 * bounce is sent alone. */
START_TEST(the_mesh_has_its_part_of_skies) {
    double all[] = {.01, .04, .02}, tile[] = {.25, .36, .3};
    error_by_group with = stated;
    with.mesh =
        (mesh_shares){.n_groups = G,
                      .of = {[MESH_OF_SKY_EVEN] = all, [MESH_OF_SKY_CLOUDY] = all, [MESH_OF_SKY_TILE] = tile},
                      .even_tiles = 2,
                      .common_sky = .5};
    /* N = 89 / 53 tiles of 2. */
    const double s = (sky_squares / sky_P2 - .5) / .5, q = (1 - s) * .5;
    double m2[G + 1], lacks2 = 0, light2 = 0;
    for (int g = 0; g <= G; g++) m2[g] = (s * tile[g] + q * all[g]) / (s + q);
    for (size_t k = 0; k < C * N; k++) {
        const double light = r[k] + (double)rho[k] * (double)H0[k], A = area[k % N];
        const double c = fmax(m2[bin[k % N]], m2[G]);
        light2 += A * light * light;
        lacks2 += A * light * light * (m2[bin[k % N]] + c * c / 2);
    }
    for (int sent = 0; sent < 2; sent++) {
        float values[C * N];
        answer_error found;
        const float dark[C * N] = {0};
        for (size_t k = 0; k < C * N; k++) values[k] = (float)(r[k] + (double)rho[k] * (double)H0[k]);
        error_answer of = {.quantity = LAM_RADIOSITY, .E = dark, .count = N, .values = values, .H0 = H0};
        *(sent ? &of.L_sent : &of.L) = L;
        for (size_t c = 0; c < C; c++)
            emission_size_add(&of.sky, TILES, sky_power + c * TILES, L + c * TILES);
        ck_assert(answer_error_of(&with, &scene, &of, &found));
        ck_assert_double_eq_tol(found.parts.mesh, sqrt(lacks2 / light2), 1e-6);
    }
}
END_TEST

/* The mesh lacks .1 of the light in desk and .3 in lamp, of any emission: errors of elements add up in
 * squares by the light of each group, and what a mean lacks, of second order, is less. */
START_TEST(the_mesh_is_a_part) {
    double of_lamps[] = {.01, .09, .04};
    const uint32_t selected[] = {2}, desk[] = {0}, both[] = {0, 1};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}, {.groups = both, .n_groups = 2}};
    const reduce_request request = {.on = true, .names = list, .n_names = 2};
    error_by_group with = stated;
    with.mesh = (mesh_shares){.n_groups = G, .of = {[MESH_OF_LAMPS] = of_lamps}};
    float values[C * N];
    answer_error found, before;
    name_error names[2];
    fill(LAM_RADIOSITY, false, values);
    error_answer of = answer_of(LAM_RADIOSITY, values);
    ck_assert(answer_error_of(&with, &scene, &of, &found));
    double light2[G] = {0};
    for (size_t k = 0; k < C * N; k++) light2[bin[k % N]] += area[k % N] * r[k] * r[k];
    const double c[] = {.04, .09}; /* that of the scene, and the own one */
    const double lacks2 = light2[0] * (.01 + c[0] * c[0] / 2) + light2[1] * (.09 + c[1] * c[1] / 2);
    ck_assert_double_eq_tol(found.parts.mesh, sqrt(lacks2 / (light2[0] + light2[1])), 1e-6);
    /* Without a sky the rest is the indirect error, where that is small. */
    ck_assert(answer_error_of(&stated, &scene, &of, &before));
    ck_assert(before.parts.mesh == -1 && before.parts.rest == found.parts.rest);
    ck_assert(found.indirect == before.indirect && found.relative == before.relative);
    of.count = 1;
    of.selected = selected;
    of.whole = true;
    ck_assert(answer_error_of(&with, &scene, &of, &found));
    ck_assert_double_eq_tol(found.parts.mesh, sqrt(.09 + c[1] * c[1] / 2), 1e-6);
    of = answer_of(LAM_RADIOSITY, values);
    ck_assert(name_errors_of(&with, &scene, &of, &request, names));
    ck_assert_double_eq_tol(names[0].parts.mesh, sqrt(2) * c[0], 1e-6);
    ck_assert_double_eq_tol(names[1].parts.mesh, sqrt(2) * (3 * c[0] + 4 * c[1]) / 7, 1e-6);
}
END_TEST

/* An error as large as the light is stated as a number that rises with it. */
START_TEST(large_errors_are_numbers) {
    float values[C * N];
    double larger[G], last = 0;
    fill(LAM_RADIOSITY, false, values);
    error_by_group off = stated;
    off.figures.of[GROUP_RMS_EVEN] = larger;
    for (double scale = .01; scale < 1e4; scale *= 2) {
        answer_error found;
        for (size_t g = 0; g < G; g++) larger[g] = scale * even[g];
        const error_answer of = answer_of(LAM_RADIOSITY, values);
        ck_assert(answer_error_of(&off, &scene, &of, &found));
        ck_assert(isfinite(found.parts.rest) && found.parts.rest > last);
        ck_assert_double_eq_tol(found.parts.rest, found.indirect, 1e-12 * found.indirect);
        last = found.parts.rest;
    }
    ck_assert_double_gt(last, 1);
}
END_TEST

START_TEST(darkness_has_no_error_and_no_light_no_ratio) {
    const float dark[C * N] = {0};
    answer_error found;
    error_answer of = {.quantity = LAM_RADIOSITY, .E = dark, .count = N, .values = dark};
    ck_assert(answer_error_of(&stated, &scene, &of, &found));
    ck_assert(found.relative == 0 && found.indirect == 0 && found.emitters == 0);
    of = answer_of(LAM_INDIRECT, dark);
    ck_assert(answer_error_of(&stated, &scene, &of, &found));
    ck_assert(isinf(found.indirect) && isfinite(found.relative));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("answer_error");
    TCase *cases = tcase_create("answer_error");
    tcase_add_loop_test(cases, all_elements_count_by_their_group, 0, 6);
    tcase_add_test(cases, selected_elements_are_those_of_the_answer);
    tcase_add_loop_test(cases, names_have_errors_of_their_means, 0, 3);
    tcase_add_test(cases, buried_elements_have_no_part);
    tcase_add_test(cases, single_tiles_have_their_own_errors);
    tcase_add_test(cases, faces_that_count_twice_are_off_by_their_light);
    tcase_add_test(cases, reflected_light_has_no_direct_errors);
    tcase_add_loop_test(cases, luminaires_have_errors_of_their_own, 0, 3);
    tcase_add_test(cases, reflected_light_is_no_whole_group);
    tcase_add_test(cases, black_groups_have_errors_of_their_irradiance);
    tcase_add_test(cases, reflectances_of_groups);
    tcase_add_test(cases, unknown_skies_are_left);
    tcase_add_test(cases, the_mesh_is_a_part);
    tcase_add_test(cases, the_mesh_has_its_part_of_skies);
    tcase_add_test(cases, large_errors_are_numbers);
    tcase_add_test(cases, darkness_has_no_error_and_no_light_no_ratio);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
