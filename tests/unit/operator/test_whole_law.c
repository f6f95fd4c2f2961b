/* The errors of answers to light that whole groups emit, against sums by hand: five elements of three groups,
 * two of which are stated, and two channels. */
#include "solver/operator/stated/whole_law.h"
#include "support/suite.h"

#include <math.h>

enum { N = 5, C = 2, G = 3, WHOLE = 2, DESK = 0, LAMP = 1, WALL = 2 };
static const double area[N] = {1, 2, 4, 3, 5};
static const float rho[C * N] = {.5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f};
static const uint32_t start[] = {0, 1, 3, 5}, members[] = {0, 1, 2, 3, 4};
static const error_scene scene = {.n = N,
                                  .n_channels = C,
                                  .n_groups = G,
                                  .area = area,
                                  .reflectance = rho,
                                  .start = start,
                                  .members = members};

/* Lamp and wall are stated; their errors are alike in the desk, cancel in the lamp, and go apart in the wall.
 */
static uint32_t whole_groups[WHOLE] = {WALL, LAMP}, whole_of[G] = {WHOLE_NONE, 1, 0},
                bin[N] = {0, 1, 1, 2, 2};
static double rms[G * WHOLE * WHOLE] = {4, 6, 6, 9, 1, -1, -1, 1, 2, 0, 0, 3};
static double means[G * WHOLE * WHOLE] = {2, 3, 3, 4.5, 1e-9, 0, 0, 1e-9, 1, 0, 0, 1};
static double bin_area[G] = {1, 6, 8}, squares[G] = {1, 20, 34};
static const error_by_group stated = {.figures = {.n_groups = G,
                                                  .n_rows = 1,
                                                  .n_channels = C,
                                                  .n_whole = WHOLE,
                                                  .whole_groups = whole_groups,
                                                  .whole_rms = rms,
                                                  .whole_mean = means},
                                      .n_bins = G,
                                      .area = bin_area,
                                      .squares = squares,
                                      .bin = bin,
                                      .whole_of = whole_of};

START_TEST(even_groups_are_told_from_the_rest) {
    /* The lamp shines evenly in both channels, the wall in the second alone; the desk is none of them. */
    const float E[C * N] = {1, 2, 2, 1, 3, 0, 4, 4, 5, 5};
    whole_light found;
    ck_assert(whole_light_find(&stated, &scene, E, &found));
    const double expected[C * WHOLE] = {0, 2, 5, 4};
    for (size_t k = 0; k < C * WHOLE; k++) ck_assert_double_eq(found.weights[k], expected[k]);
    /* In the first channel 1, 3 and 15 W are left, in the second nothing. */
    ck_assert_double_eq(found.rest.power2, 19 * 19);
    ck_assert_double_eq(found.rest.squares, 1 + 9 + 225);
    whole_light_free(&found);
}
END_TEST

START_TEST(sources_count_alone) {
    const float E[C * N] = {0, 2, 0, 0, 0, 0, 0, 0, 0, 0};
    const bool emits[N] = {false, true, false, false, false};
    error_scene of_sources = scene;
    whole_light found;
    ck_assert(whole_light_find(&stated, &scene, E, &found));
    ck_assert_double_eq(found.weights[1], 0);
    ck_assert_double_eq(found.rest.power2, 16);
    whole_light_free(&found);
    of_sources.emits = emits;
    ck_assert(whole_light_find(&stated, &of_sources, E, &found));
    ck_assert_double_eq(found.weights[1], 2);
    ck_assert_double_eq(found.rest.power2, 0);
    whole_light_free(&found);
}
END_TEST

START_TEST(light_that_has_signs_counts_by_its_size) {
    const float E[C * N] = {0, -2, -2, 0, 0, 0, 0, 0, 1, -1};
    whole_light found;
    ck_assert(whole_light_find(&stated, &scene, E, &found));
    ck_assert_double_eq(found.weights[1], 2);
    ck_assert_double_eq(found.weights[C * WHOLE - 2], 0);
    ck_assert_double_eq(found.rest.power2, 64);
    whole_light_free(&found);
}
END_TEST

START_TEST(errors_together_are_those_of_sums) {
    const double w[C * WHOLE] = {1, 2, 0, 1};
    /* 4 + 2 * 2 * 6 + 4 * 9 and 9, over two channels; the mean of the desk, one element, is no better. */
    const bin_error desk = whole_law(&stated, w, DESK), lamp = whole_law(&stated, w, LAMP),
                    wall = whole_law(&stated, w, WALL);
    ck_assert_double_eq_tol(desk.elements2, (64 + 9) / 2., 1e-12);
    ck_assert_double_eq_tol(desk.mean2, (64 + 9) / 2., 1e-12);
    /* 1 - 4 + 4 is less than a quarter of 1 + 4, which stays; the mean has the errors of two elements. */
    ck_assert_double_eq_tol(lamp.elements2, (1.25 + 1) / 2, 1e-12);
    ck_assert_double_eq_tol(lamp.mean2, (1.25 + 1) / 2 * 20 / 36, 1e-12);
    ck_assert_double_eq_tol(wall.elements2, (2 + 12 + 3) / 2., 1e-12);
    ck_assert_double_eq_tol(wall.mean2, fmax((1 + 4 + 1) / 2., 8.5 * 34 / 64), 1e-12);
}
END_TEST

static mesh_shares shares_of(const mesh_figures *from) {
    mesh_shares m;
    lam_error error = {0};
    ck_ok(mesh_shares_make(from, G, bin_area, 0, &m, &error));
    return m;
}

/* A group that shines evenly has the mesh's figure of groups, what else shines that of elements. All groups
 * are alike, so that elements lack m^2 (1 + s_1^2 / 2). */
START_TEST(the_mesh_tells_whole_groups_from_elements) {
    const double sent = 1 + .16 / 2;
    mesh_figures figures = {.n_groups = G,
                            .has_single = true,
                            .has_groups = true,
                            .single = .4,
                            .groups = .1,
                            .groups_emitters = 16};
    error_by_group with = stated;
    with.mesh = shares_of(&figures);
    /* 6 W of the lamp, in one channel 3 W of an element of the wall, alone as no other shines there. */
    const float E[C * N] = {0, 1, 1, 1, 0, 0, 0, 0, 0, 0};
    light_sizes of = {.quantity = LAM_RADIOSITY};
    for (size_t c = 0; c < C; c++) emission_size_add(&of.size, N, area, E + c * N);
    ck_assert(whole_light_find(&with, &scene, E, &of.whole));
    const mesh_lack lack = mesh_lack_of_bin(&with, &of, DESK);
    ck_assert_double_eq_tol(lack.elements2 / sent, (6 * .01 + 3 * .16) / 9, 1e-12);
    whole_light_free(&of.whole);
    mesh_shares_free(&with.mesh);
    /* A lamp that was lit alone, and left a quarter of the square of what groups leave, has that, although an
     * even light has fewer emitters than it. */
    double share[G] = {.1, .05, .2}, light[G] = {2, 3, 1}, lamps[G] = {0, 5, 0};
    figures.group_share = share;
    figures.group_light = light;
    figures.has_even = true;
    figures.even = sqrt(.001);
    figures.even_emitters = 1;
    figures.light_of[MESH_OF_EVEN] = 2.5;
    with.mesh = shares_of(&figures);
    ck_assert(whole_light_find(&with, &scene, E, &of.whole));
    const mesh_lack lit = mesh_lack_of_bin(&with, &of, DESK);
    ck_assert_double_eq_tol(lit.elements2 / sent, (6 * .0025 + 3 * .16) / 9, 1e-12);
    ck_assert_double_eq_tol(lit.mean2, 2 * lit.elements2 / sent * .01, 1e-12); /* s_g of the desk */
    whole_light_free(&of.whole);
    /* Lamp and wall together, 6 W and 8 W of one channel, by the squares of their powers and what all groups
     * light in common; a lamp of the scene has no part in it. */
    const float both[C * N] = {0, 1, 1, 1, 1, 0, 0, 0, 0, 0};
    double of_areas = 0, alone_light = 0, alone_varies = 0;
    for (size_t g = 0; g < G; g++) {
        const double a = bin_area[g] / 15;
        of_areas += a * a;
        alone_light += a * a * light[g];
        alone_varies += a * a * light[g] * share[g] * share[g];
    }
    const double in_common = (2.5 - alone_light) / (1 - of_areas), one_light = 36 * 3 + 64,
                 varies = (2.5 * .001 - alone_varies) / (1 - of_areas), pairs = 14 * 14 - 36 - 64;
    ck_assert_double_gt(in_common, 0);
    ck_assert(whole_light_find(&with, &scene, both, &of.whole));
    const mesh_light shines = {.power = 14, .of_whole = 14, .emitters = 2, .whole = of.whole.mesh};
    const mesh_lack together = mesh_lack_of(&with.mesh, &shines, DESK);
    ck_assert_double_eq_tol(together.elements2 / sent,
                            (36 * 3 * .0025 + 64 * .04 + pairs * varies) / (one_light + pairs * in_common),
                            1e-12);
    whole_light_free(&of.whole);
    mesh_shares_free(&with.mesh);
    figures.lights_power = lamps;
    with.mesh = shares_of(&figures);
    ck_assert(whole_light_find(&with, &scene, both, &of.whole));
    ck_assert_double_eq_tol(of.whole.mesh.scale, 4, 1e-12);
    ck_assert_double_eq_tol(of.whole.mesh.alone, 1, 1e-12);
    whole_light_free(&of.whole);
    mesh_shares_free(&with.mesh);
}
END_TEST

START_TEST(older_stores_state_none) {
    error_by_group older = stated;
    whole_light found;
    const float E[C * N] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    older.whole_of = NULL;
    ck_assert(whole_light_find(&older, &scene, E, &found));
    ck_assert_ptr_null(found.weights);
    ck_assert_uint_eq(whole_place(&older, LAMP), WHOLE_NONE);
    ck_assert_uint_eq(whole_place(&stated, LAMP), 1);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("whole_law");
    TCase *cases = tcase_create("whole_law");
    tcase_add_test(cases, even_groups_are_told_from_the_rest);
    tcase_add_test(cases, sources_count_alone);
    tcase_add_test(cases, light_that_has_signs_counts_by_its_size);
    tcase_add_test(cases, errors_together_are_those_of_sums);
    tcase_add_test(cases, the_mesh_tells_whole_groups_from_elements);
    tcase_add_test(cases, older_stores_state_none);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
