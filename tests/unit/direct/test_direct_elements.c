/* Direct light on elements: against sums over points in double, the flux of a closed room, the errors that it
 * states, housings, recessed luminaires, panes, and lists that cannot be. */
#include "solver/direct/direct_points.h"
#include "solver/scene/glass.h"
#include "support/placed_list.h"

#include <omp.h>

static lam_error error;
static const double low[3] = {0, 0, 0}, high[3] = {6, 6, 3};

#ifdef LAMBERT_FEW_CASES
enum { SEEDS = 4, DENSE = 30 };
#else
enum { SEEDS = 40, DENSE = 100 };
#endif

static direct_light light_of(const mesh *m, const placed_luminaires *p, uint64_t seed) {
    const direct_options options = {.seed = seed};
    direct_light light;
    ck_ok(direct_light_make(m, p, &options, &light, &error));
    ck_assert(light.n_luminaires == p->n && light.n == m->n && light.n_groups == m->n_groups);
    return light;
}

/* sum A H of a luminaire on the elements of a group, or of all. */
static double flux_on(const mesh *m, const direct_light *l, size_t k, const char *group) {
    double sum = 0;
    for (size_t i = 0; i < m->n; i++)
        if (group == NULL || strcmp(m->group_names[m->group[i]], group) == 0)
            sum += m->area[i] * (double)l->H[k * m->n + i];
    return sum;
}

/* A room with three boxes, which hide a third of its elements in part. */
static mesh furnished_room(int n) {
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, n);
    obj_text_block(&o, "table", (const double[3]){1, 1, .7}, (const double[3]){2.6, 2, .75}, 4);
    obj_text_block(&o, "cupboard", (const double[3]){4, 4.5, 0.01}, (const double[3]){5, 5.6, 1.9}, 4);
    obj_text_block(&o, "shelf", (const double[3]){3, .5, 1.4}, (const double[3]){5, .9, 1.5}, 4);
    return obj_text_mesh(&o);
}

static const char three[] =
    "{\"name\": \"panel\", \"file\": \"panel.ies\", \"at\": [2.1, 2.2, 2.6]},"
    "{\"name\": \"spot\", \"file\": \"" FIXTURES
    "/luminaires/made/asymmetric-0-360.ies\", \"at\": [3.6, 3, 2.2], "
    "\"aim\": [1, 1, -1]},"
    "{\"name\": \"ball\", \"file\": \"ball.ies\", \"at\": [4, 2, 2.2], \"dim\": 0.3, \"maintenance\": 0.8}";

/* A closed room receives all light: within .1 % of the lumens, in part behind furniture. H is at dim 1. */
START_TEST(rooms_receive_all_light) {
    mesh empty = furnished_room(10);
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 5);
    mesh bare = obj_text_mesh(&o);
    placed_luminaires p = placed_list("%s", three);
    const mesh *rooms[2] = {&bare, &empty};
    for (int r = 0; r < 2; r++) {
        direct_light light = light_of(rooms[r], &p, 1);
        for (size_t k = 0; k < p.n; k++) {
            const placed_luminaire *l = &p.luminaires[k];
            const double lumens = l->maintenance * p.files[l->file].lumens,
                         flux = flux_on(rooms[r], &light, k, NULL);
            ck_assert_msg(fabs(flux - lumens) <= 1e-3 * lumens, "room %d %s: %g of %g lm", r, l->name, flux,
                          lumens);
        }
        direct_light_free(&light);
    }
    placed_free(&p);
    mesh_free(&bare);
    mesh_free(&empty);
}
END_TEST

/* The mean irradiance of DENSE^2 points of an element of a grid, by points alone. */
static double *dense_light(const mesh *m, const placed_luminaires *p, size_t n, const size_t *elements) {
    const direct_options options = {.seed = 1};
    const size_t each = DENSE * DENSE;
    direct_point *points = calloc(n * each, sizeof *points);
    double(*normals)[3] = calloc(n * each, sizeof *normals), *mean = calloc(p->n * n, sizeof *mean);
    float *E = calloc(p->n * n * each, sizeof *E);
    ck_assert(points != NULL && normals != NULL && mean != NULL && E != NULL);
    for (size_t k = 0; k < n * each; k++) {
        const size_t i = elements[k / each];
        const uint32_t *corner = m->elements[i];
        points[k].element = i;
        for (int d = 0; d < 3; d++) {
            const double a = m->vertices[corner[0]][d];
            points[k].at[d] = a + ((double)(k % DENSE) + .5) / DENSE * (m->vertices[corner[1]][d] - a) +
                              ((double)(k % each / DENSE) + .5) / DENSE * (m->vertices[corner[3]][d] - a);
            normals[k][d] = (double)m->normal[i][d];
        }
    }
    ck_ok(direct_points_irradiance(m, p, &options, n * each, points, (const double(*)[3])normals, E, &error));
    for (size_t l = 0; l < p->n; l++)
        for (size_t k = 0; k < n * each; k++)
            mean[l * n + k / each] += (double)E[l * n * each + k] / (double)each;
    free(points);
    free(normals);
    free(E);
    return mean;
}

/* The elements of a furnished room against sums over their points. Where all is seen, .3 %: the two rules
 * agree to .8 % of a part (element_light.c), of which the better one has a third. Over all elements, and over
 * seeds, the squared error is what is stated, within a factor 2 of its root; the sums over points have an
 * error of their own, of shadows' edges between points: 1 / (2 DENSE) of an element, below a tenth of that.
 */
START_TEST(elements_are_means_of_their_points) {
    enum { EVERY = 5 };
    mesh m = furnished_room(6);
    placed_luminaires p = placed_list("%s", three);
    size_t n = 0;
    size_t *elements = calloc(m.n, sizeof *elements);
    double off[3] = {0}, stated[3] = {0};
    ck_assert_ptr_nonnull(elements);
    for (size_t i = 0; i < m.n; i += EVERY) elements[n++] = i;
    double *truth = dense_light(&m, &p, n, elements);
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        direct_light light = light_of(&m, &p, seed);
        for (size_t l = 0; l < p.n; l++) {
            for (size_t k = 0; k < n; k++) {
                const double found = (double)light.H[l * m.n + elements[k]], miss = found - truth[l * n + k];
                off[l] += m.area[elements[k]] * miss * miss;
            }
            for (size_t g = 0; g < m.n_groups; g++)
                for (size_t k = 0; k < n; k++)
                    if (m.group[elements[k]] == g)
                        stated[l] += m.area[elements[k]] * (double)light.elements_off[l * m.n_groups + g];
        }
        direct_light_free(&light);
    }
    for (size_t l = 0; l < p.n; l++)
        ck_assert_msg(sqrt(off[l]) < 2 * sqrt(stated[l]) && sqrt(stated[l]) < 2 * sqrt(off[l]),
                      "%s: %g for %g", p.luminaires[l].name, sqrt(off[l]), sqrt(stated[l]));
    free(truth);
    free(elements);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* Large elements that see all of a luminaire, near to it, crossed by edges of its light, and far: within .3 %
 * of the sum over their points, or of 1e-4 of the brightest. The two rules agree to .8 % of a part
 * (element_light.c), of which the better one has a third. */
START_TEST(elements_without_shadows_are_exact) {
    obj_text o = {.used = 0};
    size_t elements[54];
    obj_text_room(&o, low, high, 3);
    mesh m = obj_text_mesh(&o);
    placed_luminaires p = placed_list(
        "{\"name\": \"spot\", \"file\": \"" FIXTURES
        "/luminaires/made/cos4-2019.ies\", \"at\": [0.3, 3.2, 2.2], "
        "\"aim\": [-1, 1, -1]},"
        "{\"name\": \"flood\", \"file\": \"" FIXTURES "/luminaires/made/type-b.ies\", \"at\": [3, 3, 2], "
        "\"aim\": [1, 0.3, -1]},"
        "{\"name\": \"uplight\", \"file\": \"" FIXTURES
        "/luminaires/made/uplight-90-180.ies\", \"at\": [3, 3, 1]},"
        "{\"name\": \"panel\", \"file\": \"panel.ies\", \"at\": [3.1, 2.8, 0.3]},"
        "{\"name\": \"box\", \"file\": \"box.ies\", \"at\": [3.1, 2.8, 2.4], \"aim\": [1, 2, -1]}");
    ck_assert_uint_eq(m.n, 54);
    for (size_t i = 0; i < m.n; i++) elements[i] = i;
    double *truth = dense_light(&m, &p, m.n, elements);
    direct_light light = light_of(&m, &p, 1);
    for (size_t l = 0; l < p.n; l++) {
        double brightest = 0;
        for (size_t i = 0; i < m.n; i++) brightest = fmax(brightest, truth[l * m.n + i]);
        for (size_t i = 0; i < m.n; i++) {
            const double found = (double)light.H[l * m.n + i], wanted = truth[l * m.n + i];
            ck_assert_msg(fabs(found - wanted) <= 3e-3 * wanted + 1e-4 * brightest, "%s %zu: %g for %g",
                          p.luminaires[l].name, i, found, wanted);
        }
    }
    direct_light_free(&light);
    free(truth);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* Light that ends with a step, across elements of a metre: all lumens, 2 pi (1 - cos 60) 1000 = 1000 pi, to
 * .1 %. The last of six divisions leaves parts of 1/64 of an element, of which half a part at most is on the
 * wrong side; over 36 elements of the floor these errors have both signs. */
START_TEST(steps_of_light_are_found) {
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 6);
    mesh m = obj_text_mesh(&o);
    placed_luminaires p = placed_list("{\"name\": \"cone\", \"file\": \"cone.ies\", \"at\": [3, 3, 1.5]}");
    direct_light light = light_of(&m, &p, 1);
    ck_assert_double_eq_tol(flux_on(&m, &light, 0, NULL), 1000 * M_PI, M_PI);
    direct_light_free(&light);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* A luminaire in a housing that is open below gives the room what it gives without it; the line says so. */
START_TEST(housings_hide_nothing) {
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 4);
    mesh bare = obj_text_mesh(&o);
    obj_text_block(&o, "housing", (const double[3]){2.3, 2.8, 2.55}, (const double[3]){3.7, 3.2, 2.65}, 1);
    obj_text_block(&o, "shade", (const double[3]){2.8, 2.8, 2.3}, (const double[3]){3.2, 3.2, 2.4}, 1);
    mesh housed = obj_text_mesh(&o);
    char line[DIRECT_LINE];
    placed_luminaires p = placed_list(
        "{\"name\": \"a\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.6], \"ignore\": [\"shade\"]},"
        "{\"name\": \"b\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.6]}");
    placed_luminaires free_ones =
        placed_list("{\"name\": \"a\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.6]}");
    direct_light all = light_of(&housed, &p, 1), open = light_of(&bare, &free_ones, 1);
    const double lumens = flux_on(&bare, &open, 0, NULL);
    ck_assert_double_eq_tol(flux_on(&housed, &all, 0, "floor"), flux_on(&bare, &open, 0, "floor"),
                            1e-6 * lumens);
    ck_assert_double_gt(flux_on(&housed, &all, 0, "shade"), 0); /* it receives light */
    ck_assert_double_lt(flux_on(&housed, &all, 1, "floor"), .9 * flux_on(&bare, &open, 0, "floor"));
    direct_report_line(&housed, &p, &all.reports[0], line);
    ck_assert_str_eq(line, "luminaire a: not hidden by housing, shade");
    direct_report_line(&housed, &p, &all.reports[1], line);
    ck_assert_str_eq(line, "luminaire b: not hidden by housing");
    direct_light_free(&all);
    direct_light_free(&open);
    placed_free(&p);
    placed_free(&free_ones);
    mesh_free(&bare);
    mesh_free(&housed);
}
END_TEST

/* A small room of one group in a larger one, 3 m wide as a housing of a panel of 1.2 m would be along it,
 * lets nothing out: it is wider than a housing across the panel, and higher. */
START_TEST(a_small_room_is_no_housing) {
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 4);
    obj_text_block(&o, "walls", (const double[3]){1.5, 1.5, .1}, (const double[3]){4.5, 4.5, 2.9}, 1);
    mesh m = obj_text_mesh(&o);
    placed_luminaires p = placed_list("{\"name\": \"a\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.6]}");
    direct_light light = light_of(&m, &p, 1);
    ck_assert_uint_eq(light.reports[0].n_ignored, 0);
    ck_assert_double_eq(flux_on(&m, &light, 0, NULL), 0);
    direct_light_free(&light);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* Recessed at the ceiling's plane, and 3 mm above and below it by rounding: all of the light comes into the
 * room, and none to the ceiling. 3 mm move it by less than .3 % of any distance from 1 m on. */
START_TEST(recessed_luminaires_are_not_hidden) {
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 6);
    mesh m = obj_text_mesh(&o);
    placed_luminaires p =
        placed_list("{\"name\": \"at\", \"file\": \"panel.ies\", \"at\": [3, 3, 3]},"
                    "{\"name\": \"above\", \"file\": \"panel.ies\", \"at\": [3, 3, 3.003]},"
                    "{\"name\": \"point\", \"file\": \"panel.ies\", \"at\": [3, 3, 3.0000001], "
                    "\"opening\": \"point\"},"
                    "{\"name\": \"below\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.997]}");
    direct_light light = light_of(&m, &p, 1);
    for (size_t k = 0; k < p.n; k++) {
        const double lumens = placed_lumens(&p, &p.luminaires[k]), flux = flux_on(&m, &light, k, NULL);
        ck_assert_msg(fabs(flux - lumens) < 2e-3 * lumens, "%s: %g of %g lm", p.luminaires[k].name, flux,
                      lumens);
        ck_assert_double_lt(flux_on(&m, &light, k, "ceiling"), 1e-6 * lumens);
        ck_assert_double_lt(light.reports[k].near_share, .01);
    }
    direct_light_free(&light);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* Behind a pane across the room, floors get what it passes. */
START_TEST(panes_pass_light) {
    const struct group_glass glass = {.transmittance = .6, .faces = 1};
    glass_report report;
    obj_text o = {.used = 0};
    obj_text_room(&o, low, high, 4);
    mesh open = obj_text_mesh(&o);
    obj_text_squares(&o, "pane", (const double[3]){0, 0, 2}, (const double[3]){6, 0, 0},
                     (const double[3]){0, 6, 0}, 1);
    mesh m = obj_text_mesh(&o);
    ck_ok(mesh_set_glass(&m, group_find(&m, "pane"), &glass, &error));
    ck_ok(mesh_settle_glass(&m, &report, &error));
    ck_ok(mesh_make_backs(&m, &error));
    placed_luminaires p = placed_list("{\"name\": \"a\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.5]}");
    direct_light behind = light_of(&m, &p, 1), free_one = light_of(&open, &p, 1);
    for (size_t i = 0; i < open.n; i++) {
        if (strcmp(open.group_names[open.group[i]], "floor") != 0) continue;
        const double wanted = .6 * (double)free_one.H[i], found = (double)behind.H[i];
        ck_assert_msg(fabs(found - wanted) <= 1e-5 * wanted, "%zu: %g for %g", i, found, wanted);
    }
    direct_light_free(&behind);
    direct_light_free(&free_one);
    placed_free(&p);
    mesh_free(&m);
    mesh_free(&open);
}
END_TEST

/* Luminaires outside of the room, on a floor, dimmed to 0, and of no flux; and those that are wanted alone
 * have the bits that they have among all. */
START_TEST(odd_luminaires_are_right) {
    mesh m = furnished_room(4);
    placed_luminaires p = placed_list(
        "{\"name\": \"outside\", \"file\": \"panel.ies\", \"at\": [3, 3, 9]},"
        "{\"name\": \"on the floor\", \"file\": \"ball.ies\", \"at\": [3, 3, 0], \"opening\": \"point\"},"
        "{\"name\": \"off\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.5], \"dim\": 0},"
        "{\"name\": \"dead\", \"file\": \"panel.ies\", \"at\": [3, 3, 2.5], \"maintenance\": 0.5},"
        "{\"name\": \"buried\", \"file\": \"panel.ies\", \"at\": [4.5, 5, 1]}");
    p.luminaires[3].flux = 0;
    direct_light light = light_of(&m, &p, 3);
    for (size_t k = 0; k < p.n * m.n; k++) ck_assert(isfinite(light.H[k]) && light.H[k] >= 0);
    ck_assert_double_eq(flux_on(&m, &light, 0, NULL), 0);
    char line[DIRECT_LINE];
    direct_report_line(&m, &p, &light.reports[0], line);
    ck_assert_str_eq(line, "luminaire outside: less than 1 % of its light reaches a face");
    ck_assert_double_gt(flux_on(&m, &light, 1, "ceiling"), 1);
    ck_assert_double_gt(flux_on(&m, &light, 2, "floor"), 100);
    ck_assert_double_eq(flux_on(&m, &light, 3, NULL), 0);
    const size_t wanted[2] = {1, 2};
    const direct_options some = {.seed = 3, .n_wanted = 2, .wanted = wanted};
    direct_light two;
    ck_ok(direct_light_make(&m, &p, &some, &two, &error));
    ck_assert_uint_eq(two.n_luminaires, 2);
    ck_assert_int_eq(memcmp(two.H, light.H + m.n, 2 * m.n * sizeof *two.H), 0);
    ck_assert_uint_eq(two.reports[1].luminaire, 2);
    direct_light_free(&two);
    direct_light_free(&light);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

START_TEST(groups_that_are_not_there_are_refused) {
    mesh m = furnished_room(2);
    placed_luminaires p =
        placed_list("{\"name\": \"a\", \"file\": \"panel.ies\", \"at\": [3, 3, 2], \"ignore\": [\"tabel\"]}");
    const direct_options options = {.seed = 1};
    direct_light light = {.n = 7};
    ck_assert_int_eq(direct_light_make(&m, &p, &options, &light, &error), LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message,
                     "luminaire a: ignore = tabel, which is no group of the scene; did you mean table?");
    ck_assert_uint_eq(light.n, 7);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

/* One thread finds the bits that three find. */
START_TEST(bits_do_not_depend_on_threads) {
    const int threads = omp_get_max_threads();
    mesh m = furnished_room(6);
    placed_luminaires p = placed_list("%s", three);
    omp_set_num_threads(1);
    direct_light one = light_of(&m, &p, 5);
    omp_set_num_threads(3);
    direct_light more = light_of(&m, &p, 5);
    omp_set_num_threads(threads);
    ck_assert_int_eq(memcmp(one.H, more.H, p.n * m.n * sizeof *one.H), 0);
    ck_assert_int_eq(memcmp(one.elements_off, more.elements_off, p.n * m.n_groups * sizeof(float)), 0);
    ck_assert_int_eq(memcmp(one.means_off, more.means_off, p.n * m.n_groups * sizeof(float)), 0);
    direct_light_free(&one);
    direct_light_free(&more);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

static bool is_cancelled(void *context) {
    (void)context;
    return true;
}

START_TEST(work_is_cancelled) {
    mesh m = furnished_room(2);
    placed_luminaires p = placed_list("%s", three);
    const progress stop = {.cancelled = is_cancelled};
    const direct_options options = {.seed = 1, .progress = &stop, .stage = "luminaires"};
    direct_light light = {.n = 7};
    ck_assert_int_eq(direct_light_make(&m, &p, &options, &light, &error), LAM_ERR_CANCELLED);
    ck_assert_uint_eq(light.n, 7);
    placed_free(&p);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("direct elements");
    TCase *tests = tcase_create("direct elements");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, rooms_receive_all_light);
    tcase_add_test(tests, elements_are_means_of_their_points);
    tcase_add_test(tests, elements_without_shadows_are_exact);
    tcase_add_test(tests, steps_of_light_are_found);
    tcase_add_test(tests, housings_hide_nothing);
    tcase_add_test(tests, a_small_room_is_no_housing);
    tcase_add_test(tests, recessed_luminaires_are_not_hidden);
    tcase_add_test(tests, panes_pass_light);
    tcase_add_test(tests, odd_luminaires_are_right);
    tcase_add_test(tests, groups_that_are_not_there_are_refused);
    tcase_add_test(tests, bits_do_not_depend_on_threads);
    tcase_add_test(tests, work_is_cancelled);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
