#include "support/suite.h"

#include "support/scene.h"

static mesh city(const char *terrain, unsigned variant, size_t elements, uint64_t seed) {
    const generate_options options = {.kind = "city",
                                      .variant = variant,
                                      .terrain = terrain,
                                      .elements = elements,
                                      .reflectance = -1,
                                      .seed = seed};
    char folder[64], path[256];
    lam_error error = {0};
    import_report report;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/city.obj", folder);
    const lam_status status = scene_generate(&options, path, NULL, &error);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(report.dropped_faces, 0);
    ck_assert_str_eq(report.warnings, "");
    folder_remove(folder);
    return m;
}

static const char *const terrains[3] = {"flat", "valley", "hill"};

static const double *corner(const mesh *m, size_t i, size_t k) {
    return m->vertices[m->elements[i][k]];
}

/* The area that an element covers in plan; negative when it faces down. */
static double plan_area(const mesh *m, size_t i) {
    double twice = 0;
    for (size_t k = 0; k < 4; k++) {
        const double *a = corner(m, i, k), *b = corner(m, i, (k + 1) % 4);
        twice += a[0] * b[1] - b[0] * a[1];
    }
    return twice / 2;
}

static double group_plan_area(const mesh *m, const char *name) {
    const size_t g = group_find(m, name);
    double sum = 0;
    ck_assert_uint_lt(g, m->n_groups);
    for (size_t i = 0; i < m->n; i++) sum += m->group[i] == g ? plan_area(m, i) : 0;
    return sum;
}

static void site_bounds(const mesh *m, double low[3], double high[3]) {
    for (int c = 0; c < 3; c++) low[c] = HUGE_VAL, high[c] = -HUGE_VAL;
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], m->vertices[v][c]);
            high[c] = fmax(high[c], m->vertices[v][c]);
        }
}

START_TEST(city_has_the_elements_asked_for) {
    const size_t asked[] = {300, 2000, 8897};
    for (size_t a = 0; a < sizeof asked / sizeof *asked; a++)
        for (unsigned variant = 1; variant <= 3; variant++) {
            mesh m = city(terrains[(a + variant) % 3], variant, asked[a], 1);
            const double wanted = (double)asked[a], mean = total_area(&m) / (double)m.n;
            ck_assert_double_lt(fabs((double)m.n - wanted), .01 * wanted);
            ck_assert_uint_eq(m.n_groups, 4);
            ck_assert_uint_eq(m.n_channels, 1);
            for (size_t i = 0; i < m.n; i++) {
                ck_assert_float_eq(m.reflectance[i], .7f);
                ck_assert_float_eq(m.emission[i], 0);
                /* A strip of half a cell's width has cells twice as long as wide: half a cell; where a length
                 * is 1.5 of those, one or two take it. Fewer elements are wider than some houses and alleys,
                 * and on a slope a wall is as low as the ground leaves it. */
                if (asked[a] < 4000 || (a + variant) % 3 != 0) continue;
                ck_assert_double_gt(m.area[i], mean / 3);
                ck_assert_double_lt(m.area[i], mean * 3);
            }
            mesh_free(&m);
        }
}
END_TEST

/* Quads in a plane and convex, fronts up or outwards. */
START_TEST(city_has_plane_convex_quads) {
    for (unsigned variant = 1; variant <= 3; variant++) {
        mesh m = city(terrains[_i], variant, 1500, 1);
        const size_t facade = group_find(&m, "facade");
        for (size_t i = 0; i < m.n; i++) {
            double a[3], b[3], n[3];
            ck_assert_uint_ne(m.elements[i][3], MESH_NO_VERTEX);
            for (size_t k = 0; k < 4; k++) {
                for (int c = 0; c < 3; c++) {
                    a[c] = corner(&m, i, (k + 1) % 4)[c] - corner(&m, i, k)[c];
                    b[c] = corner(&m, i, (k + 2) % 4)[c] - corner(&m, i, (k + 1) % 4)[c];
                }
                double off = 0, turn = 0; /* of the next corner from the plane; of this corner to the left */
                for (int c = 0; c < 3; c++) {
                    n[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
                    turn += n[c] * m.normal[i][c];
                    off += (corner(&m, i, (k + 3) % 4)[c] - corner(&m, i, k)[c]) * m.normal[i][c];
                }
                ck_assert_double_gt(turn, 0);
                ck_assert_double_lt(fabs(off), 1e-5); /* metres: the normal is a float, right to 1e-7 */
            }
            if (m.group[i] == facade)
                ck_assert_float_eq_tol(m.normal[i][2], 0, 1e-6f);
            else if (_i == 0)
                ck_assert_float_eq_tol(m.normal[i][2], 1, 1e-6f);
            else
                ck_assert_float_gt(m.normal[i][2], .5f);
        }
        mesh_free(&m);
    }
}
END_TEST

/* Streets, yards and roofs, seen from above, are the site once; facades are lines there. */
START_TEST(city_covers_its_site_once) {
    for (int t = 0; t < 3; t++) {
        mesh m = city(terrains[t], 2, 1500, 5);
        double low[3], high[3];
        site_bounds(&m, low, high);
        const double site = (high[0] - low[0]) * (high[1] - low[1]);
        const double ground = group_plan_area(&m, "street") + group_plan_area(&m, "yard");
        const double roofs = group_plan_area(&m, "roof");
        ck_assert_double_eq_tol(ground + roofs, site, 1e-9 * site);
        ck_assert_double_gt(ground, .4 * site);
        ck_assert_double_gt(roofs, .1 * site);
        ck_assert_double_eq_tol(group_plan_area(&m, "facade"), 0, 1e-9 * site);
        ck_assert_double_ge(group_area(&m, "roof", NULL), roofs);
        if (t == 0) {
            ck_assert_double_eq_tol(group_area(&m, "roof", NULL), roofs, 1e-9 * site);
            ck_assert_double_eq_tol(group_area(&m, "street", NULL) + group_area(&m, "yard", NULL), ground,
                                    1e-9 * site);
        }
        mesh_free(&m);
    }
}
END_TEST

/* The surface has no gaps but around the site: the integral of the front's normal over it is that of any
 * surface with the same rim, and where the rim is flat, of the site. A wall that ended above its ground, a
 * roof beside its walls or a footprint with a floor would change the integral. */
START_TEST(city_has_no_gaps) {
    for (int t = 0; t < 3; t++) {
        mesh m = city(terrains[t], 3, 1500, 2);
        double sum[3] = {0}, low[3], high[3];
        site_bounds(&m, low, high);
        for (size_t i = 0; i < m.n; i++)
            for (int c = 0; c < 3; c++) sum[c] += m.area[i] * (double)m.normal[i][c];
        /* the rim is a rectangle whose height on opposite sides is the same */
        const double site = (high[0] - low[0]) * (high[1] - low[1]), tolerance = 1e-6 * total_area(&m);
        ck_assert_double_eq_tol(sum[2], site, tolerance);
        ck_assert_double_eq_tol(sum[0], 0, tolerance);
        ck_assert_double_eq_tol(sum[1], 0, tolerance);
        mesh_free(&m);
    }
}
END_TEST

/* Where elements of the ground meet in a corner, and where walls stand on it, heights agree; corners are
 * compared by position. */
START_TEST(city_ground_is_one_surface) {
    for (int t = 1; t < 3; t++) {
        mesh m = city(terrains[t], 1, 1000, 1);
        const size_t facade = group_find(&m, "facade"), roof = group_find(&m, "roof");
        double low[3], high[3], ground_low = HUGE_VAL, ground_high = -HUGE_VAL, middle = 0;
        site_bounds(&m, low, high);
        size_t found = 0;
        for (size_t i = 0; i < m.n; i++) {
            if (m.group[i] == roof || m.group[i] == facade) continue;
            for (size_t k = 0; k < 4; k++) {
                const double *p = corner(&m, i, k);
                ground_low = fmin(ground_low, p[2]), ground_high = fmax(ground_high, p[2]);
                const double from_middle =
                    hypot(p[0] - (low[0] + high[0]) / 2, p[1] - (low[1] + high[1]) / 2);
                if (from_middle < 20) middle = p[2];
            }
            /* every corner of another element of the ground that touches this one lies in its plane */
            for (size_t j = 0; j < m.n; j++) {
                if (j == i || m.group[j] == roof || m.group[j] == facade) continue;
                for (size_t k = 0; k < 4; k++) {
                    const double *p = corner(&m, j, k), *a = corner(&m, i, 0), *b = corner(&m, i, 2);
                    if (p[0] < a[0] || p[0] > b[0] || p[1] < a[1] || p[1] > b[1]) continue;
                    double off = 0;
                    for (int c = 0; c < 3; c++) off += (p[c] - a[c]) * (double)m.normal[i][c];
                    ck_assert_double_lt(fabs(off), 1e-5); /* metres: the normal is a float */
                    found++;
                }
            }
        }
        ck_assert_uint_gt(found, m.n / 2);
        const double rise = ground_high - ground_low;
        ck_assert_double_gt(rise, 12);
        if (t == 1) ck_assert_double_lt(middle, ground_low + .1 * rise);
        if (t == 2) ck_assert_double_gt(middle, ground_high - .1 * rise);
        mesh_free(&m);
    }
}
END_TEST

/* Four times the elements are the same cells, each cut into four of a quarter of its area. */
START_TEST(finer_cities_divide_each_cell) {
    mesh coarse = city("hill", 3, 8897, 1), fine = city("hill", 3, 4 * 8897, 1);
    double areas[2] = {total_area(&coarse), total_area(&fine)};
    ck_assert_uint_eq(fine.n, 4 * coarse.n);
    ck_assert_double_eq_tol(areas[1], areas[0], 1e-9 * areas[0]);
    double smallest[2] = {HUGE_VAL, HUGE_VAL}, largest[2] = {0};
    const mesh *const both[2] = {&coarse, &fine};
    for (int k = 0; k < 2; k++)
        for (size_t i = 0; i < both[k]->n; i++) {
            smallest[k] = fmin(smallest[k], both[k]->area[i]);
            largest[k] = fmax(largest[k], both[k]->area[i]);
        }
    ck_assert_double_eq_tol(4 * smallest[1], smallest[0], 1e-6 * smallest[0]);
    ck_assert_double_eq_tol(4 * largest[1], largest[0], 1e-6 * largest[0]);
    mesh_free(&coarse);
    mesh_free(&fine);
}
END_TEST

START_TEST(city_variants_differ_in_height_alone) {
    double highest[3], roofs[3], facades[3], streets[3];
    for (unsigned variant = 1; variant <= 3; variant++) {
        mesh m = city("flat", variant, 2000, 1);
        double low[3], high[3];
        site_bounds(&m, low, high);
        highest[variant - 1] = high[2];
        roofs[variant - 1] = group_area(&m, "roof", NULL);
        streets[variant - 1] = group_area(&m, "street", NULL);
        facades[variant - 1] = group_area(&m, "facade", NULL);
        ck_assert_double_eq(low[2], 0);
        mesh_free(&m);
    }
    ck_assert_double_lt(highest[0], 7);
    ck_assert_double_lt(highest[1], 14);
    ck_assert_double_gt(highest[1], 1.8 * highest[0]);
    ck_assert_double_gt(highest[2], 1.7 * 26); /* a tower stands out over the others, 21 to 26 m high */
    ck_assert_double_gt(facades[1], 1.2 * facades[0]);
    for (int v = 1; v < 3; v++) {
        ck_assert_double_eq_tol(roofs[v], roofs[0], 1e-8 * roofs[0]);
        ck_assert_double_eq_tol(streets[v], streets[0], 1e-8 * streets[0]);
    }
}
END_TEST

START_TEST(city_is_its_seed_s) {
    mesh a = city("hill", 3, 1000, 7), same = city("hill", 3, 1000, 7), other = city("hill", 3, 1000, 8);
    ck_assert_uint_eq(a.n, same.n);
    ck_assert_uint_eq(a.n_vertices, same.n_vertices);
    ck_assert_mem_eq(a.vertices, same.vertices, a.n_vertices * sizeof *a.vertices);
    ck_assert_mem_eq(a.elements, same.elements, a.n * sizeof *a.elements);
    ck_assert_double_ne(group_area(&a, "street", NULL), group_area(&other, "street", NULL));
    ck_assert_double_ne(group_area(&a, "roof", NULL), group_area(&other, "roof", NULL));
    mesh_free(&a);
    mesh_free(&same);
    mesh_free(&other);
}
END_TEST

START_TEST(city_refuses_what_it_does_not_know) {
    const struct {
        unsigned variant;
        const char *terrain, *word;
    } cases[] = {{0, "flat", "variant = 0"},
                 {4, "flat", "variant = 4"},
                 {1, "swamp", "'swamp'"},
                 {1, NULL, "terrain"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const generate_options options = {
            .kind = "city", .variant = cases[i].variant, .terrain = cases[i].terrain, .reflectance = -1};
        lam_error error = {0};
        ck_assert_int_eq(scene_generate(&options, "/nowhere/city.obj", NULL, &error), LAM_ERR_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(error.message, cases[i].word));
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("generate_city");
    TCase *tests = tcase_create("generate_city");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, city_has_the_elements_asked_for);
    tcase_add_loop_test(tests, city_has_plane_convex_quads, 0, 3);
    tcase_add_test(tests, city_covers_its_site_once);
    tcase_add_test(tests, city_has_no_gaps);
    tcase_add_test(tests, city_ground_is_one_surface);
    tcase_add_test(tests, finer_cities_divide_each_cell);
    tcase_add_test(tests, city_variants_differ_in_height_alone);
    tcase_add_test(tests, city_is_its_seed_s);
    tcase_add_test(tests, city_refuses_what_it_does_not_know);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
