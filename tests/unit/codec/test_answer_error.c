/* The error of an answer against the same by plain sums: three elements of two groups, two channels. */
#include "solver/operator/stated/whole_law.h"
#include "support/answer_scene.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

START_TEST(all_elements_count_by_their_group) {
    const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[_i % 3];
    const bool lit = _i >= 3;
    float values[C * N];
    answer_error found;
    answer_fill(quantity, lit, values);
    error_answer of = answer_of(quantity, values);
    /* Of H all of it is over rho^2, and D is that of white elements. */
    const bool white = quantity == LAM_IRRADIANCE;
    const double desk = white ? .25 : 1, lamp = white ? .3125 : 1;
    double off = 3 * answer_law(answer_P2, answer_P2 / answer_A2E2, .03, .04, .01) / desk +
                 4 * answer_law(answer_P2, answer_P2 / answer_A2E2, .01, .005, .02) / lamp;
    if (lit) {
        of.H0 = answer_H0;
        of.L = answer_L;
        for (size_t c = 0; c < C; c++)
            emission_size_add(&of.sky, TILES, answer_sky_power + c * TILES, answer_L + c * TILES);
        const double *D = white ? answer_white_D : answer_sky_D;
        off += quantity == LAM_INDIRECT
                   ? 3 * answer_law_of_sent(.07, .01, .03, .04, .01) +
                         4 * answer_law_of_sent(.06, .02, .01, .005, .02)
                   : 3 * answer_law_over(D[0], .07, .01, desk) + 4 * answer_law_over(D[1], .06, .02, lamp);
    }
    double reflected = 0, radiosity = 0;
    for (size_t k = 0; k < C * N; k++) {
        const double sky = lit ? (double)answer_H0[k] : 0, h = answer_reflected[k] / (double)answer_rho[k];
        const double d = white ? h : answer_reflected[k],
                     b = white ? h + sky
                               : answer_reflected[k] + (double)answer_E[k] + (double)answer_rho[k] * sky;
        reflected += answer_area[k % N] * d * d;
        radiosity += answer_area[k % N] * b * b;
    }
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &found));
    ck_assert_double_eq_tol(found.indirect, answer_ratio(off, reflected), 1e-5 * found.indirect);
    ck_assert_double_eq_tol(found.relative, answer_ratio(off, radiosity), 1e-5 * found.relative);
    const double power = sqrt(answer_P2) + (lit ? sqrt(answer_sky_P2) : 0);
    ck_assert_double_eq_tol(found.emitters, power * power / (answer_A2E2 + (lit ? answer_sky_squares : 0)),
                            1e-6);
}
END_TEST

START_TEST(selected_elements_are_those_of_the_answer) {
    float values[C * N], some[C] = {0};
    const uint32_t selected[] = {2};
    answer_error found;
    answer_fill(LAM_RADIOSITY, false, values);
    error_answer of = answer_of(LAM_RADIOSITY, some);
    for (size_t c = 0; c < C; c++) some[c] = values[c * N + 2];
    of.count = 1;
    of.selected = selected;
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &found));
    const double off = answer_law(answer_P2, answer_P2 / answer_A2E2, .01, .005, .02),
                 reflected = .125 * .125 + .25 * .25;
    ck_assert_double_eq_tol(found.indirect, answer_ratio(off, reflected), 1e-5);
    /* The same of whole vectors. */
    answer_error again;
    of.values = values;
    of.whole = true;
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &again));
    ck_assert(again.indirect == found.indirect && again.relative == found.relative);
}
END_TEST

START_TEST(names_have_errors_of_their_means) {
    const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[_i];
    const uint32_t desk[] = {0}, both[] = {0, 1};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}, {.groups = both, .n_groups = 2}};
    float values[C * N];
    name_error found[2] = {{.name = "kept"}};
    answer_fill(quantity, false, values);
    const error_answer of = answer_of(quantity, values);
    ck_assert(name_errors_of(&answer_stated, &answer_scene, &of, 2, list, found));
    const bool white = quantity == LAM_IRRADIANCE;
    const double desk_rho2 = white ? .25 : 1, lamp_rho2 = white ? .3125 : 1, rho0 = white ? .25 : 1,
                 rho1 = white ? .75 : 1, desk_rho = white ? .5 : 1;
    const double number = answer_P2 / answer_A2E2,
                 mean0 = answer_law(answer_P2, number, .03, .02, .001) / desk_rho2,
                 rms0 = answer_law(answer_P2, number, .03, .04, .01) / desk_rho2;
    const double r0 = (.5 + 2 * .25) / 3 / desk_rho, r1 = (1 + 2 * .5) / 3 / desk_rho,
                 reflected = r0 * r0 + r1 * r1;
    ck_assert_str_eq(found[0].name, "kept");
    ck_assert_double_eq_tol(found[0].mean, answer_ratio(mean0, reflected), 1e-5);
    ck_assert_double_eq_tol(found[0].elements, answer_ratio(rms0, reflected), 1e-4);
    const double all = (3 * mean0 + 4 * answer_law(answer_P2, number, .01, .005, .002) / lamp_rho2) / 7;
    const double a0 = (3 * r0 + 4 * .125 / rho0) / 7, a1 = (3 * r1 + 4 * .25 / rho1) / 7;
    ck_assert_double_eq_tol(found[1].mean, sqrt(all / (a0 * a0 + a1 * a1 - all)), 1e-5);
    /* The means alone give the same, in a group that has one reflectance. */
    double value[C] = {0}, emission[C] = {0};
    const double direct[C] = {0};
    for (size_t k = 0; k < C * 2; k++) {
        const size_t c = k / 2, i = k % 2;
        value[c] += answer_area[i] * (double)values[c * N + i] / 3;
        emission[c] += answer_area[i] * (double)answer_E[c * N + i] / 3;
    }
    const name_means means = {
        .quantity = quantity, .size = of.size, .value = value, .emission = emission, .direct = direct};
    const name_error same = name_error_of_means(&answer_stated, &list[0], &means);
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
    float values[C * N];
    name_error found;
    error_scene standing = answer_scene;
    standing.buried = buried;
    answer_fill(LAM_INDIRECT, false, values);
    const error_answer of = answer_of(LAM_INDIRECT, values);
    ck_assert(name_errors_of(&answer_stated, &standing, &of, 1, list, &found));
    const double number = answer_P2 / answer_A2E2, reflected = answer_reflected[0] * answer_reflected[0] +
                                                               answer_reflected[N] * answer_reflected[N];
    ck_assert_double_eq_tol(found.mean,
                            answer_ratio(9 * answer_law(answer_P2, number, .03, .02, .001), reflected), 1e-5);
    ck_assert_double_eq_tol(found.elements,
                            answer_ratio(3 * answer_law(answer_P2, number, .03, .04, .01), reflected), 1e-4);
    const double value[C] = {answer_reflected[0], answer_reflected[N]}, nothing[C] = {0};
    const name_means means = {.quantity = LAM_INDIRECT,
                              .size = of.size,
                              .buried = 2. / 3,
                              .value = value,
                              .emission = nothing,
                              .direct = nothing};
    const name_error same = name_error_of_means(&answer_stated, &list[0], &means);
    ck_assert_double_eq_tol(same.mean, found.mean, 1e-6);
    ck_assert_double_eq_tol(same.elements, found.elements, 1e-5);
}
END_TEST

/* The figures of a group that reflects nothing are those of its irradiance alone. */
START_TEST(black_groups_have_errors_of_their_irradiance) {
    static reflecting with_black[] = {{1, 1, true}, {.3125, .3125, false}};
    error_by_group black = answer_stated;
    const uint32_t desk[] = {0};
    reduce_name list[] = {{.groups = desk, .n_groups = 1}};
    const double none[C] = {0}, value[C] = {3, 4};
    black.of_group = with_black;
    for (int k = 0; k < 3; k++) {
        const lam_quantity quantity = (lam_quantity[]){LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT}[k];
        const name_means means = {.quantity = quantity,
                                  .size = {answer_P2, answer_A2E2, 0},
                                  .value = value,
                                  .emission = none,
                                  .direct = none};
        const name_error found = name_error_of_means(&black, &list[0], &means);
        const double off =
            quantity == LAM_IRRADIANCE ? answer_law(answer_P2, answer_P2 / answer_A2E2, .03, .02, .001) : 0;
        ck_assert_double_eq_tol(found.mean, answer_ratio(off, 25), 1e-6);
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
    error_by_group off = answer_stated;
    float values[C * N];
    answer_error before, found;
    name_error means_before[2], means_found[2];
    off.repair = .1;
    off.overlap = overlap;
    answer_fill(LAM_INDIRECT, false, values);
    error_answer of = answer_of(LAM_INDIRECT, values);
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &before));
    ck_assert(answer_error_of(&off, &answer_scene, &of, &found));
    double light2 = 0, added = 0;
    for (size_t k = 0; k < C * N; k++) {
        light2 += answer_area[k % N] * answer_reflected[k] * answer_reflected[k];
        added += answer_area[k % N] * answer_reflected[k] * answer_reflected[k] *
                 (.01 + (answer_bin[k % N] == 0 ? .25 : 0));
    }
    /* x = e^2 / (l^2 - e^2), so that e^2 = l^2 x / (1 + x). */
    const double square = before.indirect * before.indirect, own = light2 * square / (1 + square) + added;
    ck_assert_double_eq_tol(found.indirect, answer_ratio(own, light2), 1e-6);
    ck_assert(name_errors_of(&answer_stated, &answer_scene, &of, 2, list, means_before));
    ck_assert(name_errors_of(&off, &answer_scene, &of, 2, list, means_found));
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
        ck_assert_double_eq_tol(means_found[name].mean, answer_ratio(e2, mean2), 1e-5);
        ck_assert_double_gt(means_found[name].elements, means_before[name].elements);
    }
    /* The means alone give the same. */
    const double none[C] = {0};
    const name_means means = {
        .quantity = LAM_INDIRECT, .size = of.size, .value = r0, .emission = none, .direct = none};
    ck_assert_double_eq_tol(name_error_of_means(&off, &list[0], &means).mean, means_found[0].mean, 1e-5);
    /* The light of a sky counts too, as a face that is hidden has none of it. */
    answer_fill(LAM_IRRADIANCE, true, values);
    of = answer_of(LAM_IRRADIANCE, values);
    of.H0 = answer_H0;
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &before));
    ck_assert(answer_error_of(&off, &answer_scene, &of, &found));
    double reflected2 = 0;
    added = 0;
    for (size_t k = 0; k < C * N; k++) {
        const double H = (double)values[k], reflected = H - (double)answer_H0[k];
        reflected2 += answer_area[k % N] * reflected * reflected;
        added += answer_area[k % N] * H * H * (.01 + (answer_bin[k % N] == 0 ? .25 : 0));
    }
    const double x = before.indirect * before.indirect, e2 = reflected2 * x / (1 + x) + added;
    ck_assert_double_eq_tol(found.indirect, answer_ratio(e2, reflected2), 1e-5 * found.indirect);
}
END_TEST

/* An error as large as the light is stated as a number that rises with it. */
START_TEST(large_errors_are_numbers) {
    float values[C * N];
    double larger[G], last = 0;
    answer_fill(LAM_RADIOSITY, false, values);
    error_by_group off = answer_stated;
    off.figures.of[GROUP_RMS_EVEN] = larger;
    for (double scale = .01; scale < 1e4; scale *= 2) {
        answer_error found;
        for (size_t g = 0; g < G; g++) larger[g] = scale * answer_even[g];
        const error_answer of = answer_of(LAM_RADIOSITY, values);
        ck_assert(answer_error_of(&off, &answer_scene, &of, &found));
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
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &found));
    ck_assert(found.relative == 0 && found.indirect == 0 && found.emitters == 0);
    of = answer_of(LAM_INDIRECT, dark);
    ck_assert(answer_error_of(&answer_stated, &answer_scene, &of, &found));
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
    tcase_add_test(cases, faces_that_count_twice_are_off_by_their_light);
    tcase_add_test(cases, black_groups_have_errors_of_their_irradiance);
    tcase_add_test(cases, reflectances_of_groups);
    tcase_add_test(cases, large_errors_are_numbers);
    tcase_add_test(cases, darkness_has_no_error_and_no_light_no_ratio);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
