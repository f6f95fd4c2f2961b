/* Light at the corners of elements: linear light is reproduced on any mesh of a surface, and gradients are
 * bounded.
 */
#include "solver/render/smooth.h"
#include "support/box.h"
#include "support/suite.h"

#include <math.h>

/* A floor of tiles of several sizes, one of them cut into triangles, whose edges meet only in parts; and a
 * wall of the same group behind it. Tilted, so that no axis is special. */
typedef struct floor_mesh {
    mesh m;
    size_t n_floor;
} floor_mesh;

static void place(double x, double y, double z, double out[3]) {
    const double u[3] = {2. / 3, 1. / 3, 2. / 3}, v[3] = {-2. / 3, 2. / 3, 1. / 3},
                 w[3] = {-1. / 3, -2. / 3, 2. / 3};
    for (int d = 0; d < 3; d++) out[d] = x * u[d] + y * v[d] + z * w[d] + d;
}

static void add(mesh *m, const double corners[4][3]) {
    double at[4][3];
    for (int k = 0; k < 4; k++) place(corners[k][0], corners[k][1], corners[k][2], at[k]);
    mesh_add_quad(m, (const double(*)[3])at);
}

static void add_tile(mesh *m, double x, double y, double width, double height) {
    const double corners[4][3] = {
        {x, y, 0}, {x + width, y, 0}, {x + width, y + height, 0}, {x, y + height, 0}};
    add(m, corners);
}

static floor_mesh make_floor(void) {
    static const double tiles[][4] = {{0, 0, 1, 1}, {1, 0, 1, 1},  {2, 0, 1, 1},     {0, 1, 1, 1},
                                      {1, 1, 1, 1}, {2, 1, 1, .5}, {2, 1.5, .5, .5}, {2.5, 1.5, .5, .5},
                                      {0, 2, 2, 1}, {2, 2, 1, 1}};
    floor_mesh out = {.m = {0}};
    for (size_t k = 0; k < sizeof tiles / sizeof *tiles; k++)
        add_tile(&out.m, tiles[k][0], tiles[k][1], tiles[k][2], tiles[k][3]);
    out.n_floor = out.m.n;
    const double wall[4][3] = {{0, 3, 0}, {3, 3, 0}, {3, 3, 2}, {0, 3, 2}};
    add(&out.m, wall);
    /* A diagonal, so that one tile is a triangle and its other half another. */
    const uint32_t corner = out.m.elements[4][3];
    uint32_t(*grown)[4] = realloc(out.m.elements, (out.m.n + 1) * sizeof *grown);
    out.m.elements = grown;
    memmove(grown + 6, grown + 5, (out.m.n - 5) * sizeof *grown);
    memcpy(grown[5], (const uint32_t[4]){grown[4][0], grown[4][2], corner, MESH_NO_VERTEX}, sizeof *grown);
    grown[4][3] = MESH_NO_VERTEX;
    out.m.n++;
    out.n_floor++;
    free(out.m.area);
    free(out.m.normal);
    out.m.area = NULL;
    out.m.normal = NULL;
    mesh_finish(&out.m, .5f);
    return out;
}

static double linear(const double at[3], size_t channel) {
    return channel == 0 ? 20 + at[0] - 2 * at[1] + .5 * at[2] : 5 + .25 * at[1] + .125 * at[2];
}

static float *corners_of(const mesh *m, size_t n_channels, const float *values, const float *E) {
    lam_error error = {.message = ""};
    smooth_nodes nodes;
    float *corners = malloc(4 * n_channels * m->n * sizeof *corners);
    ck_ok(smooth_nodes_create(m, &nodes, &error));
    ck_ok(smooth_corners(&nodes, m, n_channels, values, E, corners, &error));
    smooth_nodes_free(&nodes);
    return corners;
}

/* Every element's mean is the value at its centroid; so are all its neighbours', whose differences give the
 * gradient. Singles at 20 round by 1e-6, over distances of .5. */
START_TEST(linear_light_is_reproduced) {
    floor_mesh f = make_floor();
    const mesh *m = &f.m;
    float *values = malloc(2 * m->n * sizeof *values);
    for (size_t c = 0; c < 2; c++)
        for (size_t i = 0; i < m->n; i++) {
            double at[3];
            mesh_centroid(m, i, at);
            values[c * m->n + i] = i < f.n_floor ? (float)linear(at, c) : 1000;
        }
    float *corners = corners_of(m, 2, values, NULL);
    size_t triangles = 0;
    for (size_t c = 0; c < 2; c++)
        for (size_t i = 0; i < m->n; i++) {
            const float *got = corners + 4 * (c * m->n + i);
            triangles += mesh_corners(m, i) == 3;
            if (mesh_corners(m, i) == 3) ck_assert(isnan(got[3]));
            for (size_t k = 0; k < mesh_corners(m, i); k++) {
                /* The wall has no neighbour: its own value. */
                const double want = i < f.n_floor ? linear(m->vertices[m->elements[i][k]], c) : 1000;
                ck_assert_double_eq_tol((double)got[k], want, 2e-5);
            }
        }
    ck_assert_uint_eq(triangles, 4);
    free(corners);
    free(values);
    mesh_free(&f.m);
}
END_TEST

/* Emission is added as it is, whatever it is beside. */
START_TEST(emission_does_not_spread) {
    floor_mesh f = make_floor();
    const mesh *m = &f.m;
    float *values = malloc(m->n * sizeof *values), *E = calloc(m->n, sizeof *E);
    for (size_t i = 0; i < m->n; i++) {
        double at[3];
        mesh_centroid(m, i, at);
        E[i] = i % 3 == 0 ? 100 : 0;
        values[i] = (float)linear(at, 0) + E[i];
    }
    float *corners = corners_of(m, 1, values, E);
    for (size_t i = 0; i < f.n_floor; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++)
            ck_assert_double_eq_tol((double)corners[4 * i + k],
                                    linear(m->vertices[m->elements[i][k]], 0) + (double)E[i], 2e-4);
    free(corners);
    free(values);
    free(E);
    mesh_free(&f.m);
}
END_TEST

/* A long tile beside a short one: the line through both would fall from 1 to -49 along the long one, 25 times
 * their difference; 2 are allowed. The short one is at the far end of the line. */
START_TEST(gradients_are_bounded) {
    mesh m = {0};
    add_tile(&m, 0, 0, 100, .01);
    add_tile(&m, 50, .01, .01, .01);
    mesh_finish(&m, .5f);
    const float values[2] = {10, 11};
    float *corners = corners_of(&m, 1, values, NULL);
    for (int k = 0; k < 4; k++) {
        ck_assert_float_ge(corners[k], 10 - 2 - 1e-4f);
        ck_assert_float_le(corners[k], 10 + 2 + 1e-4f);
    }
    free(corners);
    mesh_free(&m);
}
END_TEST

/* Bends of less than 20 degrees are one surface, in which light is carried over the bend; others are not. */
START_TEST(surfaces_end_at_bends) {
    for (int sharp = 0; sharp < 2; sharp++) {
        mesh m = {0};
        const double angle = (sharp ? 25 : 15) * M_PI / 180, c = cos(angle), s = sin(angle);
        const double flat[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
        const double bent[4][3] = {{1, 0, 0}, {1 + c, 0, s}, {1 + c, 1, s}, {1, 1, 0}};
        mesh_add_quad(&m, flat);
        mesh_add_quad(&m, bent);
        mesh_finish(&m, .5f);
        const float values[2] = {4, 6};
        float *corners = corners_of(&m, 1, values, NULL);
        /* At the bend both lines meet in the middle. At the far end the line falls by the step times .5 over
         * the projection of the step, .5 (1 + c); then half of what the mean of 4 is off by is added. */
        const double share = 1 / (1 + c), off = 4 - ((4 - 2 * share) + 5) / 2;
        const double end = 4 + off - (2 - 2 * off) * share;
        ck_assert_float_eq_tol(corners[1], sharp ? 4 : 5, 1e-5f);
        ck_assert_float_eq_tol(corners[4], sharp ? 6 : 5, 1e-5f);
        ck_assert_float_eq_tol(corners[0], sharp ? 4 : (float)end, 1e-5f);
        free(corners);
        mesh_free(&m);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("smooth");
    TCase *tests = tcase_create("smooth");
    tcase_add_test(tests, linear_light_is_reproduced);
    tcase_add_test(tests, emission_does_not_spread);
    tcase_add_test(tests, gradients_are_bounded);
    tcase_add_test(tests, surfaces_end_at_bends);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
