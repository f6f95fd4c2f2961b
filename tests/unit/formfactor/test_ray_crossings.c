/* The work of rays by a sample: exact where each ray crosses the same number of boxes, and by geometry. */
#include "solver/formfactor/rays/ray_crossings.h"
#include "support/scene.h"

static ray_crossings crossings(const mesh *m, uint64_t seed) {
    lam_error error = {.message = ""};
    ray_crossings w = {0};
    ck_ok(ray_crossings_sample(m, seed, &w, &error));
    return w;
}

/* A cube of six squares: from one of them a ray crosses its own box and that of the square it hits, which are
 * flat; each square is two triangles. */
START_TEST(a_cube) {
    const generate_options how = {.kind = "box", .size = {1, 1, 1}, .divisions = 1, .reflectance = .5};
    mesh m = generate_good(&how);
    ck_assert_uint_eq(m.n, 6);
    for (uint64_t seed = 1; seed <= 3; seed++) {
        const ray_crossings w = crossings(&m, seed);
        ck_assert_double_eq(w.boxes, 4);
        ck_assert_double_eq(w.hits, 1);
    }
    mesh_free(&m);
}
END_TEST

/* A scene in millimetres far from the origin, or in kilometres, costs what it costs in metres. */
START_TEST(scale_and_place_do_not_matter) {
    const generate_options how = {.kind = "canopy", .elements = 500, .seed = 1, .reflectance = .5};
    mesh m = generate_good(&how);
    const ray_crossings as_is = crossings(&m, 1);
    const double scales[] = {1e-3, 1e3}, places[] = {1e2, 1e6};
    for (int s = 0; s < 2; s++) {
        mesh other = generate_good(&how);
        for (size_t v = 0; v < other.n_vertices; v++)
            for (int k = 0; k < 3; k++) other.vertices[v][k] = places[s] + scales[s] * m.vertices[v][k];
        const ray_crossings w = crossings(&other, 1);
        /* Rounding moves a ray over an edge now and then: of 256 rays some four, each of some six boxes. */
        ck_assert_double_eq_tol(w.boxes, as_is.boxes, .1);
        ck_assert_double_eq_tol(w.hits, as_is.hits, 4. / 256);
        mesh_free(&other);
    }
    mesh_free(&m);
}
END_TEST

/* One square alone is hit by nothing; a ray crosses its own box. */
START_TEST(a_square_alone) {
    double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    uint32_t elements[1][4] = {{0, 1, 2, 3}};
    float normal[1][3] = {{0, 0, 1}};
    const mesh m = {.n_vertices = 4, .vertices = corners, .n = 1, .elements = elements, .normal = normal};
    const ray_crossings w = crossings(&m, 7);
    ck_assert_double_eq(w.boxes, 2);
    ck_assert_double_eq(w.hits, 0);
    /* Nor by its own ray, in a plane where rounding places the origin above or below. */
    const float tilted = (float)sqrt(1. / 3);
    double slope[3][3] = {{1.1, .3, .7}, {.3, 1.9, -.1}, {.6, .1, 1.4}};
    for (int v = 0; v < 3; v++) slope[v][2] = 2.1 - slope[v][0] - slope[v][1];
    uint32_t triangle[1][4] = {{0, 1, 2, MESH_NO_VERTEX}};
    float up[1][3] = {{tilted, tilted, tilted}};
    const mesh one = {.n_vertices = 3, .vertices = slope, .n = 1, .elements = triangle, .normal = up};
    ck_assert_double_eq(crossings(&one, 7).boxes, 1);
    ck_assert_double_eq(crossings(&one, 7).hits, 0);
}
END_TEST

/* A square of side 2 h at height h above a small one sees it with the factor of a point below its centre,
 * (4 / pi) X / sqrt(1 + X^2) atan(X / sqrt(1 + X^2)), X = 1 of a quarter: .5541. Of rays from both, half come
 * from the small one; those of the large one hit it with the factor times the ratio of areas, 1e-4. The
 * sample of 256 rays has a standard deviation of sqrt(.277 * .723 / 256) = .028, a quarter of that for 16 of
 * them. */
START_TEST(the_share_of_hits_is_a_form_factor) {
    const double e = .005;
    double corners[8][3] = {{-e, -e, 0}, {e, -e, 0}, {e, e, 0}, {-e, e, 0},
                            {-1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -1, 1}};
    uint32_t elements[2][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}};
    float normal[2][3] = {{0, 0, 1}, {0, 0, -1}};
    const mesh m = {.n_vertices = 8, .vertices = corners, .n = 2, .elements = elements, .normal = normal};
    double hits = 0;
    for (uint64_t seed = 1; seed <= 16; seed++) hits += crossings(&m, seed * 1000).hits / 16;
    ck_assert_double_eq_tol(hits, .5541 / 2, 4 * .028 / 4);
    /* Half of the square in the same box: half of the factor. */
    elements[1][3] = MESH_NO_VERTEX;
    hits = 0;
    for (uint64_t seed = 1; seed <= 16; seed++) hits += crossings(&m, seed * 1000).hits / 16;
    ck_assert_double_eq_tol(hits, .5541 / 4, 4 * .022 / 4);
}
END_TEST

/* A canopy of leaves costs more boxes than a room of as many elements, whose rays end at the first wall. */
START_TEST(leaves_cost_more_than_walls) {
    const generate_options leaves = {.kind = "canopy", .elements = 2000, .seed = 1, .reflectance = .5},
                           walls = {.kind = "cornell", .elements = 2000, .closed = true, .reflectance = .5};
    mesh m = generate_good(&leaves), room = generate_good(&walls);
    const ray_crossings of_leaves = crossings(&m, 1), of_walls = crossings(&room, 1);
    ck_assert_double_gt(of_leaves.boxes, 1.25 * of_walls.boxes);
    ck_assert_double_eq(of_walls.hits, 1);
    ck_assert_double_lt(of_leaves.hits, 1);
    mesh_free(&m);
    mesh_free(&room);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("ray crossings");
    TCase *cases = tcase_create("ray crossings");
    tcase_add_test(cases, a_cube);
    tcase_add_test(cases, scale_and_place_do_not_matter);
    tcase_add_test(cases, a_square_alone);
    tcase_add_test(cases, the_share_of_hits_is_a_form_factor);
    tcase_add_test(cases, leaves_cost_more_than_walls);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
