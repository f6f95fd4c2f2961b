/* The parts of the error of an answer that its lights make, a sky, luminaires and the mesh, by plain sums. */
#include "solver/operator/stated/whole_law.h"
#include "support/answer_scene.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Single tiles are off each by its own: with spreads (2/3)^2 and (4/3)^2 of the first channel D = rho^2 (4
 * d_0 + 16 d_1) / 9, the second has none, and W likewise. A tile that no ray met may be off by all that it
 * sends. */
START_TEST(single_tiles_have_their_own_errors) {
    static double off[] = {.01, .02, .03, .04}, mean_off[] = {.001, .002, .003, .004};
    static double power_off[] = {.5, .25, 8, 9}, bounced[] = {.2, .3}, mean_bounced[] = {.1, .15};
    const double W = (.5 * 4 + .25 * 16) / 9, D = .25 * (.01 * 4 + .02 * 16) / 9;
    const double D_mean = .25 * (.001 * 4 + .002 * 16) / 9;
    error_by_group by_tile = answer_stated;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const double direct[C] = {.1, .2}, none[C] = {0}, value[C] = {1 + .5 * .1, 2 + .5 * .2};
    const name_means means = {
        .quantity = LAM_RADIOSITY, .L = answer_L, .value = value, .emission = none, .direct = direct};
    by_tile.figures.sky[SKY_RMS_BOUNCED] = bounced;
    by_tile.figures.sky[SKY_MEAN_BOUNCED] = mean_bounced;
    by_tile.figures.sky_elements_off = off;
    by_tile.figures.sky_means_off = mean_off;
    by_tile.figures.sky_power_off = power_off;
    const double rms = D + .04 * W + .07 * .07 * answer_sky_S + .01 * .01 * answer_sky_P2;
    const double mean = D_mean + .01 * W + .03 * .03 * answer_sky_S + .002 * .002 * answer_sky_P2;
    const name_error found = name_error_of_means(&by_tile, &list[0], &means);
    ck_assert_double_eq_tol(found.mean, answer_ratio(mean, 5), 1e-6);
    ck_assert_double_eq_tol(found.elements, answer_ratio(rms, 5), 1e-6);
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
    const double W = (.5 * 4 + .25 * 16) / 9, even2 = (9 * .002 * .002 + 16 * .003 * .003) * answer_sky_P2;
    error_by_group by_tile = answer_stated;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const double direct[C] = {.1, .2}, none[C] = {0}, value[C] = {3, 4};
    const name_means means = {
        .quantity = LAM_INDIRECT, .L = answer_L, .value = value, .emission = none, .direct = direct};
    by_tile.figures.sky[SKY_RMS_BOUNCED] = bounced;
    by_tile.figures.sky[SKY_MEAN_BOUNCED] = mean_bounced;
    by_tile.figures.sky_elements_off = by_tile.figures.sky_means_off = off;
    by_tile.figures.sky_power_off = power_off;
    const double sent = .0004 * (W + even2) + answer_law(answer_sky_P2, 49. / 21, .03, .04, .01);
    const double all = .0004 * W + .07 * .07 * answer_sky_S + .01 * .01 * answer_sky_P2;
    const double mean_all = .01 * W + .03 * .03 * answer_sky_S + .002 * .002 * answer_sky_P2;
    const double mean_sent = .01 * (W + even2) + answer_law(answer_sky_P2, 49. / 21, .03, .02, .001);
    const double rms = fmin(all, sent), mean = fmin(mean_all, mean_sent);
    const name_error found = name_error_of_means(&by_tile, &list[0], &means);
    ck_assert_double_eq_tol(found.elements, answer_ratio(rms, 25), 1e-6);
    ck_assert_double_eq_tol(found.mean, answer_ratio(mean, 25), 1e-6);
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
    float values[C * N];
    name_error found = {.name = "desk"};
    answer_error all;
    answer_fill(quantity, true, values);
    error_answer of = answer_of(quantity, values);
    of.H0 = answer_H0;
    of.luminaires = lit;
    const double number = answer_P2 / answer_A2E2,
                 rms = answer_law(answer_P2, number, .03, .04, .01) / rho2 + D,
                 mean = answer_law(answer_P2, number, .03, .02, .001) / rho2 + D_mean;
    const double r0 = (.5 + 2 * .25) / 3 / sqrt(rho2), r1 = (1 + 2 * .5) / 3 / sqrt(rho2);
    ck_assert(name_errors_of(&answer_stated, &answer_scene, &of, 1, list, &found));
    ck_assert_double_eq_tol(found.mean, answer_ratio(mean, r0 * r0 + r1 * r1), 1e-5);
    ck_assert_double_eq_tol(found.elements, answer_ratio(rms, r0 * r0 + r1 * r1), 1e-4);
    /* The same of the mean alone, and of all elements selected. */
    double value[C] = {0}, emission[C] = {0}, direct[C] = {0};
    for (size_t k = 0; k < C * 2; k++) {
        const size_t c = k / 2, i = k % 2;
        value[c] += answer_area[i] * (double)values[c * N + i] / 3;
        emission[c] += answer_area[i] * (double)answer_E[c * N + i] / 3;
        direct[c] += answer_area[i] * (double)answer_H0[c * N + i] / 3;
    }
    const name_means means = {.quantity = quantity,
                              .size = of.size,
                              .luminaires = lit,
                              .value = value,
                              .emission = emission,
                              .direct = direct};
    /* (100 + 5 300)^2 / (100^2 + (5 300)^2), dimmers of both channels together. */
    ck_assert_double_eq_tol(lit_luminaires_number(&lit, C), 2560000. / 2260000., 1e-12);
    const name_error same = name_error_of_means(&answer_stated, &list[0], &means);
    ck_assert_double_eq_tol(same.mean, found.mean, 1e-6);
    ck_assert_double_eq_tol(same.elements, found.elements, 1e-5);
    of.count = 2;
    of.selected = answer_members;
    of.whole = true;
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &all));
    double reflected = 0;
    for (size_t k = 0; k < C * 2; k++)
        reflected += answer_area[k % 2] * answer_reflected[k / 2 * N + k % 2] *
                     answer_reflected[k / 2 * N + k % 2] / rho2;
    ck_assert_double_eq_tol(all.indirect, answer_ratio(3 * rms, reflected), 1e-5);
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
    float values[C * N];
    name_error found = {.name = "desk"};
    error_by_group whole = answer_stated;
    whole.figures.n_whole = 1;
    whole.figures.whole_groups = whole_groups;
    whole.figures.whole_rms = whole_rms;
    whole.figures.whole_mean = whole_mean;
    whole.whole_of = whole_of;
    answer_fill(LAM_INDIRECT, false, values);
    error_answer of = {.quantity = LAM_INDIRECT, .E = lamp, .count = N, .values = values};
    for (size_t c = 0; c < C; c++) emission_size_add(&of.reflected, N, answer_area, reflected + c * N);
    ck_assert(name_errors_of(&whole, &answer_scene, &of, 1, list, &found));
    /* P_c is .5 + .5 + 3 and .25; 2^2 / C of what the lamp alone is off by. */
    const double power2 = 16 + .0625, number = power2 / (.25 + .25 + 9 + .0625);
    const double rms = .0004 * 4 / C + answer_law(power2, number, .03, .04, .01);
    const double r0 = (.5 + 2 * .25) / 3, r1 = (1 + 2 * .5) / 3;
    ck_assert_double_eq_tol(found.elements, answer_ratio(rms, r0 * r0 + r1 * r1), 1e-5);
}
END_TEST

/* A sky of a store that states nothing of skies adds nothing. */
START_TEST(unknown_skies_are_left) {
    float values[C * N];
    answer_error found, again;
    error_by_group none = answer_stated;
    none.figures.n_tiles = 0;
    answer_fill(LAM_RADIOSITY, false, values);
    error_answer of = answer_of(LAM_RADIOSITY, values);
    ck_assert(answer_error_of(&none, &answer_scene, &of, &found));
    of.L = answer_L;
    ck_assert(answer_error_of(&none, &answer_scene, &of, &again));
    ck_assert(again.indirect == found.indirect);
}
END_TEST

/* The mesh lacks more of the light of few tiles than of all, whether the sky is in the light or its first
 * bounce is sent alone. */
START_TEST(the_mesh_has_its_part_of_skies) {
    double all[] = {.01, .04, .02}, tile[] = {.25, .36, .3};
    error_by_group with = answer_stated;
    with.mesh =
        (mesh_shares){.n_groups = G,
                      .of = {[MESH_OF_SKY_EVEN] = all, [MESH_OF_SKY_CLOUDY] = all, [MESH_OF_SKY_TILE] = tile},
                      .even_tiles = 2,
                      .common_sky = .5};
    /* N = 89 / 53 tiles of 2. */
    const double s = (answer_sky_squares / answer_sky_P2 - .5) / .5, q = (1 - s) * .5;
    double m2[G + 1], lacks2 = 0, light2 = 0;
    for (int g = 0; g <= G; g++) m2[g] = (s * tile[g] + q * all[g]) / (s + q);
    for (size_t k = 0; k < C * N; k++) {
        const double light = answer_reflected[k] + (double)answer_rho[k] * (double)answer_H0[k],
                     A = answer_area[k % N];
        const double c = fmax(m2[answer_bin[k % N]], m2[G]);
        light2 += A * light * light;
        lacks2 += A * light * light * (m2[answer_bin[k % N]] + c * c / 2);
    }
    for (int sent = 0; sent < 2; sent++) {
        float values[C * N];
        answer_error found;
        const float dark[C * N] = {0};
        for (size_t k = 0; k < C * N; k++)
            values[k] = (float)(answer_reflected[k] + (double)answer_rho[k] * (double)answer_H0[k]);
        error_answer of = {
            .quantity = LAM_RADIOSITY, .E = dark, .count = N, .values = values, .H0 = answer_H0};
        *(sent ? &of.L_sent : &of.L) = answer_L;
        for (size_t c = 0; c < C; c++)
            emission_size_add(&of.sky, TILES, answer_sky_power + c * TILES, answer_L + c * TILES);
        ck_assert(answer_error_of(&with, &answer_scene, &of, &found));
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
    error_by_group with = answer_stated;
    with.mesh = (mesh_shares){.n_groups = G, .of = {[MESH_OF_LAMPS] = of_lamps}};
    float values[C * N];
    answer_error found, before;
    name_error names[2];
    answer_fill(LAM_RADIOSITY, false, values);
    error_answer of = answer_of(LAM_RADIOSITY, values);
    ck_assert(answer_error_of(&with, &answer_scene, &of, &found));
    double light2[G] = {0};
    for (size_t k = 0; k < C * N; k++)
        light2[answer_bin[k % N]] += answer_area[k % N] * answer_reflected[k] * answer_reflected[k];
    const double c[] = {.04, .09}; /* that of the scene, and the own one */
    const double lacks2 = light2[0] * (.01 + c[0] * c[0] / 2) + light2[1] * (.09 + c[1] * c[1] / 2);
    ck_assert_double_eq_tol(found.parts.mesh, sqrt(lacks2 / (light2[0] + light2[1])), 1e-6);
    /* Without a sky the rest is the indirect error, where that is small. */
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &before));
    ck_assert(before.parts.mesh == -1 && before.parts.rest == found.parts.rest);
    ck_assert(found.indirect == before.indirect && found.relative == before.relative);
    of.count = 1;
    of.selected = selected;
    of.whole = true;
    ck_assert(answer_error_of(&with, &answer_scene, &of, &found));
    ck_assert_double_eq_tol(found.parts.mesh, sqrt(.09 + c[1] * c[1] / 2), 1e-6);
    of = answer_of(LAM_RADIOSITY, values);
    ck_assert(name_errors_of(&with, &answer_scene, &of, 2, list, names));
    ck_assert_double_eq_tol(names[0].parts.mesh, sqrt(2) * c[0], 1e-6);
    ck_assert_double_eq_tol(names[1].parts.mesh, sqrt(2) * (3 * c[0] + 4 * c[1]) / 7, 1e-6);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("answer_lights");
    TCase *cases = tcase_create("answer_lights");
    tcase_add_test(cases, single_tiles_have_their_own_errors);
    tcase_add_test(cases, reflected_light_has_no_direct_errors);
    tcase_add_loop_test(cases, luminaires_have_errors_of_their_own, 0, 3);
    tcase_add_test(cases, reflected_light_is_no_whole_group);
    tcase_add_test(cases, unknown_skies_are_left);
    tcase_add_test(cases, the_mesh_is_a_part);
    tcase_add_test(cases, the_mesh_has_its_part_of_skies);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
