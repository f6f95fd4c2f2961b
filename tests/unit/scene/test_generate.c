#include "support/suite.h"

#include "solver/scene/generate/convex.h"
#include "support/scene.h"

#include <dirent.h>

static generate_options options_of(const char *kind) {
    return (generate_options){.kind = kind, .size = {1, 1, 1}, .reflectance = -1};
}

/* Generates and imports again; the test fails when either does or anything else is left in the folder. */
static mesh generated(const generate_options *options, size_t *faces) {
    char folder[64], path[256];
    lam_error error = {0};
    import_report report;
    size_t n = 0, files = 0;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    const lam_status status = scene_generate(options, path, &n, &error);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    mesh m = import_good(path, &report);
    ck_assert_uint_eq(m.n, n);
    ck_assert_uint_eq(report.dropped_faces, 0);
    ck_assert_str_eq(report.warnings, "");
    DIR *entries = opendir(folder);
    while (readdir(entries) != NULL) files++;
    closedir(entries);
    ck_assert_uint_eq(files, 4); /* scene.obj, scene.mtl, . and .. */
    folder_remove(folder);
    if (faces != NULL) *faces = n;
    return m;
}

static void assert_sees(const mesh *m, double x, double y, double z, double expected) {
    /* Sums of n terms, each right to about 1e-15, and vertices that are 1e-16 off a neighbour's edge. */
    ck_assert_double_eq_tol(seen_from(m, (const double[3]){x, y, z}), expected, 1e-9);
}

START_TEST(box_has_6_m_squared_equal_elements) {
    for (unsigned divisions = 1; divisions <= 16; divisions *= 2) {
        generate_options options = options_of("box");
        options.divisions = divisions;
        mesh m = generated(&options, NULL);
        ck_assert_uint_eq(m.n, 6 * divisions * divisions);
        ck_assert_uint_eq(m.n_vertices, m.n + 2); /* Euler: closed, every vertex shared */
        ck_assert_uint_eq(m.n_channels, 1);
        for (size_t i = 0; i < m.n; i++) {
            ck_assert_uint_ne(m.elements[i][3], MESH_NO_VERTEX);
            ck_assert_double_eq(m.area[i], 1.0 / (divisions * divisions));
            ck_assert_float_eq(m.reflectance[i], .5f);
            ck_assert_float_eq(m.emission[i], 0);
        }
        assert_sees(&m, .3, .4, .8, 4 * M_PI);
        assert_sees(&m, 1.3, .4, .8, 0);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(box_groups_are_where_they_say) {
    generate_options options = options_of("box");
    options.size[0] = 3, options.size[1] = 4, options.size[2] = 2.5;
    options.divisions = 3;
    options.reflectance = .25;
    mesh m = generated(&options, NULL);
    const struct {
        const char *name;
        double area;
        float normal[3];
    } expected[6] = {{"floor", 12, {0, 0, 1}},    {"ceiling", 12, {0, 0, -1}}, {"wall-x0", 10, {1, 0, 0}},
                     {"wall-x1", 10, {-1, 0, 0}}, {"wall-y0", 7.5, {0, 1, 0}}, {"wall-y1", 7.5, {0, -1, 0}}};
    ck_assert_uint_eq(m.n_groups, 6);
    for (int g = 0; g < 6; g++) {
        const size_t found = group_find(&m, expected[g].name);
        ck_assert_double_eq_tol(group_area(&m, expected[g].name, NULL), expected[g].area, 1e-12);
        for (size_t i = 0; i < m.n; i++)
            for (int k = 0; m.group[i] == found && k < 3; k++)
                ck_assert_float_eq(m.normal[i][k], expected[g].normal[k]);
    }
    for (size_t i = 0; i < m.n; i++) ck_assert_float_eq(m.reflectance[i], .25f);
    assert_sees(&m, 1, 1, 1, 4 * M_PI);
    mesh_free(&m);
}
END_TEST

START_TEST(box_takes_the_nearest_divisions) {
    const size_t asked[] = {1, 6, 14, 16, 600, 650, 663, 664}, given[] = {6, 6, 6, 24, 600, 600, 600, 726};
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
        generate_options options = options_of("box");
        options.elements = asked[i];
        mesh m = generated(&options, NULL);
        ck_assert_uint_eq(m.n, given[i]);
        mesh_free(&m);
    }
}
END_TEST

/* Areas of the published footprints, by the shoelace formula in mm^2. */
static double footprint_area(const double p[4][2]) {
    double twice = 0;
    for (int i = 0; i < 4; i++) twice += p[i][0] * p[(i + 1) % 4][1] - p[(i + 1) % 4][0] * p[i][1];
    return fabs(twice) / 2 * 1e-6;
}

static const double short_block[4][2] = {{130, 65}, {82, 225}, {240, 272}, {290, 114}};
static const double tall_block[4][2] = {{423, 247}, {265, 296}, {314, 456}, {472, 406}};

START_TEST(cornell_box_is_whole) {
    const size_t sizes[] = {1, 40, 100, 200, 320, 470, 700, 1000, 1500, 2560, 4000, 10240};
    generate_options options = options_of("cornell");
    options.closed = true;
    options.elements = sizes[_i];
    mesh m = generated(&options, NULL);
    size_t lamps = 0;
    /* the floor is the room's less both footprints, whatever the grid: no floor lies under a block */
    ck_assert_double_eq_tol(group_area(&m, "floor", NULL),
                            .556 * .5592 - footprint_area(short_block) - footprint_area(tall_block), 1e-12);
    ck_assert_double_eq_tol(group_area(&m, "lamp", &lamps), .130 * .105, 1e-15);
    ck_assert_double_eq_tol(group_area(&m, "ceiling", NULL), .556 * .5592 - .130 * .105, 1e-12);
    ck_assert_double_eq_tol(group_area(&m, "back-wall", NULL), .556 * .5488, 1e-12);
    ck_assert_double_eq_tol(group_area(&m, "front-wall", NULL), .556 * .5488, 1e-12);
    ck_assert_double_eq_tol(group_area(&m, "left-wall", NULL), .5592 * .5488, 1e-12);
    ck_assert_double_eq_tol(group_area(&m, "right-wall", NULL), .5592 * .5488, 1e-12);
    ck_assert_uint_ge(lamps, 1);
    ck_assert_uint_eq(m.n_groups, 9);
    /* Inside, in a corner, between the blocks; outside; inside either block (the left wall is at x = 0). */
    assert_sees(&m, .28, .3, .5, 4 * M_PI);
    assert_sees(&m, .001, .001, .001, 4 * M_PI);
    assert_sees(&m, .556 - .27, .27, .1, 4 * M_PI);
    assert_sees(&m, .28, -.8, .27, 0);
    assert_sees(&m, .556 - .186, .169, .08, 0);
    assert_sees(&m, .556 - .368, .351, .3, 0);
    mesh_free(&m);
}
END_TEST

START_TEST(cornell_box_has_its_materials) {
    generate_options options = options_of("cornell");
    mesh m = generated(&options, NULL);
    ck_assert_uint_eq(m.n_channels, 3);
    ck_assert_uint_eq(m.n_groups, 8);
    ck_assert_uint_eq(group_find(&m, "front-wall"), 8);
    const struct {
        const char *group;
        float reflectance[3], emission[3];
    } expected[] = {{"floor", {.725f, .71f, .68f}, {0, 0, 0}},
                    {"left-wall", {.63f, .065f, .05f}, {0, 0, 0}},
                    {"right-wall", {.14f, .45f, .091f}, {0, 0, 0}},
                    {"lamp", {.78f, .78f, .78f}, {17, 12, 4}},
                    {"tall-block", {.725f, .71f, .68f}, {0, 0, 0}}};
    for (size_t e = 0; e < sizeof expected / sizeof *expected; e++)
        for (size_t i = 0; i < m.n; i++)
            for (size_t c = 0; c < 3 && m.group[i] == group_find(&m, expected[e].group); c++) {
                ck_assert_float_eq(m.reflectance[c * m.n + i], expected[e].reflectance[c]);
                ck_assert_float_eq(m.emission[c * m.n + i], expected[e].emission[c]);
            }
    /* the open front: half of all directions from its middle leave */
    assert_sees(&m, .278, 0, .27, 2 * M_PI);
    mesh_free(&m);
    options.reflectance = .5;
    m = generated(&options, NULL);
    ck_assert_uint_eq(m.n_channels, 1);
    for (size_t i = 0; i < m.n; i++) {
        ck_assert_float_eq(m.reflectance[i], .5f);
        ck_assert_float_eq(m.emission[i], m.group[i] == group_find(&m, "lamp") ? 11.f : 0.f);
    }
    mesh_free(&m);
}
END_TEST

START_TEST(cornell_box_has_even_elements) {
    const size_t asked[] = {0, 500, 2560, 10240, 40000};
    generate_options options = options_of("cornell");
    options.elements = asked[_i];
    mesh m = generated(&options, NULL);
    const double wanted = asked[_i] == 0 ? 2560 : (double)asked[_i], mean = total_area(&m) / (double)m.n;
    /* one row more or less on one of the larger surfaces, of about a seventh of all elements each */
    ck_assert_double_lt(fabs((double)m.n - wanted), sqrt(wanted / 7));
    /* Only what the footprints cut from floor cells may be small or a triangle: their outlines, 1.31 m, cross
     * at most two cells per cell's width, each in at most three pieces. */
    size_t uneven = 0;
    for (size_t i = 0; i < m.n; i++)
        uneven += m.area[i] < .7 * mean || m.area[i] > 1.4 * mean || m.elements[i][3] == MESH_NO_VERTEX;
    ck_assert_double_lt((double)uneven, 6 * 1.31 / sqrt(mean));
    mesh_free(&m);
}
END_TEST

START_TEST(convex_pieces_add_up) {
    const convex cell = {.n = 4, .p = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    /* A turned square of area .5, moved across the cell: the shared part is cut off once in either order. */
    for (int step = 0; step <= 60; step++) {
        const double x = -.6 + .0371 * step, y = -.3 + .0273 * step;
        const convex block = {.n = 4, .p = {{x, y - .5}, {x + .5, y}, {x, y + .5}, {x - .5, y}}};
        convex left[4], right[4];
        double left_area = 0, right_area = 0;
        const size_t n_left = convex_subtract(&cell, &block, 1e-12, left);
        const size_t n_right = convex_subtract(&block, &cell, 1e-12, right);
        for (size_t i = 0; i < n_left; i++) left_area += convex_area(&left[i]);
        for (size_t i = 0; i < n_right; i++) right_area += convex_area(&right[i]);
        ck_assert_double_eq_tol(1 - left_area, .5 - right_area, 1e-11);
        for (size_t i = 0; i < n_left; i++) {
            convex faces[CONVEX_MOST];
            double area = 0;
            const size_t n = convex_split(&left[i], faces);
            for (size_t f = 0; f < n; f++) {
                ck_assert_uint_le(faces[f].n, 4);
                area += convex_area(&faces[f]);
            }
            ck_assert_double_eq_tol(area, convex_area(&left[i]), 1e-14);
        }
    }
}
END_TEST

START_TEST(convex_pieces_merge_only_to_convex_quads) {
    const convex low = {.n = 3, .p = {{0, 0}, {1, 0}, {1, 1}}},
                 high = {.n = 3, .p = {{0, 0}, {1, 1}, {0, 1}}};
    const convex fin = {.n = 3, .p = {{1, 1}, {1, 0}, {1.1, 5}}}; /* on the edge of low: a dart */
    const convex roof = {.n = 3, .p = {{0, 1}, {1, 1}, {.5, 2}}};
    const convex strip = {.n = 4, .p = {{0, 1}, {1, 1}, {1, 1.1}, {0, 1.2}}};
    convex square, merged;
    ck_assert(convex_merge(&low, &high, 1e-10, &square));
    ck_assert_uint_eq(square.n, 4);
    ck_assert_double_eq(convex_area(&square), 1);
    ck_assert(!convex_merge(&low, &fin, 1e-10, &merged));
    ck_assert(!convex_merge(&square, &roof, 1e-10, &merged)); /* a house: five corners */
    ck_assert(convex_merge(&square, &strip, 1e-10, &merged)); /* its straight corners go */
    ck_assert_uint_eq(merged.n, 4);
    ck_assert_double_eq_tol(convex_area(&merged), 1.15, 1e-15);
}
END_TEST

START_TEST(furnace_is_closed) {
    const size_t asked[] = {0, 24, 300, 5000};
    for (size_t s = 0; s < sizeof asked / sizeof *asked; s++) {
        generate_options options = options_of("furnace");
        options.elements = asked[s];
        mesh m = generated(&options, NULL);
        const double wanted = asked[s] == 0 ? 1000 : (double)asked[s];
        ck_assert_double_lt(fabs((double)m.n - wanted), 4 + sqrt(wanted / 7));
        ck_assert_uint_eq(m.n_groups, 9);
        assert_sees(&m, 2, 1.2, .2, 4 * M_PI);
        assert_sees(&m, .01, 2.99, 2.49, 4 * M_PI);
        assert_sees(&m, 1.1, .9, .8, 0); /* within each block: the room's 4 pi less the block's back faces */
        assert_sees(&m, 2.8, 1.75, 1.4, 0);
        assert_sees(&m, .9, 2.2, 1.45, 0);
        for (size_t i = 0; i < m.n; i++) ck_assert_float_eq(m.reflectance[i], .5f);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(generating_refuses_what_it_cannot) {
    char folder[64], path[256];
    lam_error error = {0};
    size_t files = 0, faces = 77;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    generate_options options = options_of("castle");
    ck_assert_int_eq(scene_generate(&options, path, &faces, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "canopy"));
    options = options_of("box");
    options.reflectance = 1;
    ck_assert_int_eq(scene_generate(&options, path, &faces, &error), LAM_ERR_ARGUMENT);
    options = options_of("box");
    options.size[1] = 0;
    ck_assert_int_eq(scene_generate(&options, path, &faces, &error), LAM_ERR_ARGUMENT);
    options = options_of("box");
    options.divisions = 4000000000u;
    ck_assert_int_eq(scene_generate(&options, path, &faces, &error), LAM_ERR_ARGUMENT);
    options = options_of("cornell");
    options.elements = SIZE_MAX;
    ck_assert_int_eq(scene_generate(&options, path, &faces, &error), LAM_ERR_ARGUMENT);
    options = options_of("box");
    ck_assert_int_eq(scene_generate(&options, "scene.ply", &faces, &error), LAM_ERR_ARGUMENT);
    snprintf(path, sizeof path, "%s/missing/scene.obj", folder);
    ck_assert_int_eq(scene_generate(&options, path, &faces, &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, "missing/scene.mtl"));
    ck_assert_uint_eq(faces, 77);
    DIR *entries = opendir(folder);
    while (readdir(entries) != NULL) files++;
    closedir(entries);
    ck_assert_uint_eq(files, 2);
    folder_remove(folder);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("generate");
    TCase *tests = tcase_create("generate");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, box_has_6_m_squared_equal_elements);
    tcase_add_test(tests, box_groups_are_where_they_say);
    tcase_add_test(tests, box_takes_the_nearest_divisions);
    tcase_add_loop_test(tests, cornell_box_is_whole, 0, 12);
    tcase_add_test(tests, cornell_box_has_its_materials);
    tcase_add_loop_test(tests, cornell_box_has_even_elements, 0, 5);
    tcase_add_test(tests, convex_pieces_add_up);
    tcase_add_test(tests, convex_pieces_merge_only_to_convex_quads);
    tcase_add_test(tests, furnace_is_closed);
    tcase_add_test(tests, generating_refuses_what_it_cannot);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
