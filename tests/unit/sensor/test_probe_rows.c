/* Rows of probes against closed forms: a furnace, a box whose upper half gives light, half a lamp, an even
 * sky, and axes that are turned. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/sensor/sensor_rows.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/scene.h"

static const double room[3] = {4, 3, 2.5};

/* sqrt(1 / 4 pi) and sqrt(3 / 4 pi) */
static const double c0 = .28209479177387814, c1 = .48860251190291992;

/* The nine of a probe at a place; z and x of its frame. */
static void probe_at(const double at[3], const double axis[3], const double look[3], receiver r[HARMONICS]) {
    for (int w = 0; w < HARMONICS; w++) {
        r[w] = (receiver){.kind = (receiver_kind)(RECEIVER_HARMONIC + w)};
        memcpy(r[w].at, at, sizeof r[w].at);
        memcpy(r[w].axis, axis, sizeof r[w].axis);
        memcpy(r[w].look, look, sizeof r[w].look);
    }
}

static const double x_axis[3] = {1, 0, 0}, z_axis[3] = {0, 0, 1};

static sensor_rows rows_of(const mesh *m, size_t n, const receiver *r, const sensor_rows_options *o) {
    lam_error error = {0};
    sensor_rows rows;
    ck_ok(sensor_rows_make(m, n, r, o, &rows, &error));
    return rows;
}

/* sum_j weight_kj B_j, of B = 1 for NULL */
static double value_of(const sensor_rows *rows, size_t k, const double *B) {
    double sum = 0;
    for (uint64_t i = rows->start[k]; i < rows->start[k + 1]; i++)
        sum += (double)rows->weight[i] * (B != NULL ? B[rows->element[i]] : 1);
    return sum;
}

/* The radiance B / pi from everywhere gives 2 / sqrt(pi) B, and eight zeros, by pairs (12 cells a side), by
 * rays (60) and by both; in the middle, on a face, and beside others in the list. Rays alone miss up to .02,
 * of which .1 / 512 over the .03 that pairs take is left: 2e-4. */
START_TEST(furnace) {
    enum { PLACES = 4, N = PLACES * HARMONICS + 1 };
    static const double places[PLACES][3] = {{1.3, 1.1, .8}, {1.3, 1.1, 0}, {0, 0, 0}, {3.9, 2.9, 2.4}};
    static const unsigned cells[] = {12, 30, 60};
    receiver r[N] = {{.kind = RECEIVER_SPHERE, .at = {1, 1, 1}}};
    for (size_t k = 0; k < PLACES; k++) probe_at(places[k], z_axis, x_axis, r + 1 + k * HARMONICS);
    for (size_t c = 0; c < sizeof cells / sizeof *cells; c++) {
        mesh m = box_mesh(room, cells[c], .5f);
        sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.seed = 1});
        ck_assert_double_eq_tol(value_of(&rows, 0, NULL), 1, 1e-6);
        for (size_t k = 0; k < PLACES * HARMONICS; k++) {
            const double sum = value_of(&rows, k + 1, NULL);
            printf("%2u cells, probe %zu, row %zu: %.2e\n", cells[c], k / HARMONICS, k % HARMONICS, sum);
            ck_assert_double_eq((double)rows.backs[k + 1], 0);
            if (k % HARMONICS == 0)
                ck_assert_double_eq_tol(sum, M_2_SQRTPI, 1e-6);
            else
                ck_assert_double_eq_tol(sum, 0, 2e-4 * M_2_SQRTPI);
        }
        sensor_rows_free(&rows);
        mesh_free(&m);
    }
}
END_TEST

/* Rows are found in runs of 256, none of which ends within a probe: here one would, with a receiver in front.
 * First rows are exact. Rays miss up to .04 of others, of which .1 / 128 over .03 is left. */
START_TEST(many) {
    enum { N = 1 + 60 * HARMONICS };
    receiver r[N] = {{.kind = RECEIVER_SPHERE, .at = {1, 1, 1}}};
    mesh m = box_mesh(room, 8, .5f);
    for (size_t k = 0; k < 60; k++)
        probe_at((double[3]){.1 + .06 * (double)k, 1, 1}, z_axis, x_axis, r + 1 + k * HARMONICS);
    sensor_rows rows = rows_of(&m, N, r, &(sensor_rows_options){.rays = 256});
    for (size_t k = 1; k < N; k++) {
        const bool first = (k - 1) % HARMONICS == 0;
        ck_assert_double_eq_tol(value_of(&rows, k, NULL), first ? M_2_SQRTPI : 0, first ? 1e-6 : 1e-3);
    }
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* The walls above half the height and the ceiling give the radiance L: 1.772454 L, 1.534990 L for z, and 0
 * for others and all of second order. They are the sources, so that all are pairs and only single precision
 * is left. */
START_TEST(upper_half) {
    receiver r[HARMONICS];
    mesh m = box_mesh(room, 8, .5f);
    double *B = test_allocate(m.n, sizeof *B);
    probe_at((double[3]){2, 1.5, 1.25}, z_axis, x_axis, r);
    for (size_t j = 0; j < m.n; j++) {
        double at[3];
        mesh_centroid(&m, j, at);
        m.emission[j] = at[2] > 1.25;
        B[j] = M_PI * (at[2] > 1.25);
    }
    sensor_rows rows = rows_of(&m, HARMONICS, r, &(sensor_rows_options){.rays = 256});
    const double expected[HARMONICS] = {2 * M_PI * c0, 0, M_PI * c1};
    for (size_t w = 0; w < HARMONICS; w++) ck_assert_double_eq_tol(value_of(&rows, w, B), expected[w], 1e-5);
    ck_assert_double_eq_tol(expected[0], 1.772454, 1e-6);
    ck_assert_double_eq_tol(expected[2], 1.534990, 1e-6);
    sensor_rows_free(&rows);
    free(B);
    mesh_free(&m);
}
END_TEST

/* y up: x, z and -y of the scene are x, y and z. Coefficients of the same light are those of the scene's
 * axes, in another order and sign: what 1, y, z, x, xy, yz, 3z^2-1, xz and x^2-y^2 become. */
START_TEST(axes) {
    static const double back[3] = {0, -1, 0};
    const double sqrt3 = sqrt(3);
    receiver r[2 * HARMONICS];
    mesh m = box_mesh(room, 30, .5f);
    double *B = test_allocate(m.n, sizeof *B), c[2][HARMONICS];
    const double at[3] = {1.3, 1.1, .8};
    uint64_t seed = 5;
    for (size_t j = 0; j < m.n; j++) B[j] = random_unit(&seed) * (double)(j % 7);
    probe_at(at, z_axis, x_axis, r);
    probe_at(at, back, x_axis, r + HARMONICS);
    for (int k = 0; k < 2; k++) {
        /* each alone, so that both have the same rays */
        sensor_rows rows = rows_of(&m, HARMONICS, r + k * HARMONICS, &(sensor_rows_options){.rays = 256});
        for (size_t w = 0; w < HARMONICS; w++) c[k][w] = value_of(&rows, w, B);
        sensor_rows_free(&rows);
    }
    /* 3 y^2 - 1 = - (3 z^2 - 1) / 2 - 3 (x^2 - y^2) / 2, x^2 - z^2 likewise; of Y, with their constants */
    const double *s = c[0], expected[HARMONICS] = {s[0],
                                                   s[2],
                                                   -s[1],
                                                   s[3],
                                                   s[7],
                                                   -s[5],
                                                   -s[6] / 2 - sqrt3 / 2 * s[8],
                                                   -s[4],
                                                   -sqrt3 / 2 * s[6] + s[8] / 2};
    for (size_t w = 0; w < HARMONICS; w++) ck_assert_double_eq_tol(c[1][w], expected[w], 1e-5 * fabs(s[0]));
    free(B);
    mesh_free(&m);
}
END_TEST

/* A lamp of 1 m^2 is 3 m above a probe, and a plate half way hides the half of it on one side of x = 0: the
 * factors are those of the other half. Of 2 x 144 segments, spread evenly, two of 17 columns lie at the edge:
 * by 1 / 17 of half of the lamp each half of the samples may be off. */
START_TEST(half_a_lamp) {
    receiver r[HARMONICS];
    mesh m = {0};
    double expected[HARMONICS];
    polygon seen = {.n = 4, .corner = {{0, -.5, 3}, {0, .5, 3}, {.5, .5, 3}, {.5, -.5, 3}}};
    polygon_measure(&seen);
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = 3, .from = {-.5, -.5, 3}, .to = {.5, .5, 3}}, false);
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = 1.5, .from = {-2, -2, 1.5}, .to = {0, 2, 1.5}}, true);
    mesh_finish(&m, .5f);
    m.emission[0] = 1;
    probe_at((double[3]){0, 0, 0}, z_axis, x_axis, r);
    sensor_rows rows = rows_of(&m, HARMONICS, r, &(sensor_rows_options){.rays = 256});
    receiver_factors(&r[0], &seen, expected);
    const double coarse = expected[0] / 17;
    for (size_t w = 0; w < HARMONICS; w++) {
        printf("row %zu: %.5f, must be %.5f\n", w, value_of(&rows, w, NULL), expected[w]);
        ck_assert_double_eq_tol(value_of(&rows, w, NULL), expected[w],
                                (w == 3 || w == 7 ? .25 : 2.3) * coarse);
    }
    /* x of the half is far from 0, which it is of the whole: by 4 times what it may be off. */
    ck_assert_double_gt(expected[3], coarse);
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

/* L = 1 of the sky and .3 of the ground: c0 4 pi .65, c1 pi .7 for z, and 0 of order 2, as both halves are
 * even. Rays are scaled to the integrals of the rows, and the tile of each is coarse: 1 %. */
START_TEST(even_sky) {
    lam_error error = {0};
    sky_bounce sky;
    receiver r[HARMONICS];
    mesh m = {0};
    mesh_add_cell(&m, &(box_cell){.axis = 2, .level = -1, .from = {90, 90, -1}, .to = {91, 91, -1}}, true);
    mesh_finish(&m, .5f);
    ck_ok(sky_bounce_create("tregenza", 'z', .3, 1, &sky, &error));
    probe_at((double[3]){0, 0, 1}, z_axis, x_axis, r);
    sensor_rows rows = rows_of(&m, HARMONICS, r, &(sensor_rows_options){.sky = &sky});
    const double expected[HARMONICS] = {4 * M_PI * c0 * .65, 0, M_PI * c1 * .7};
    for (size_t w = 0; w < HARMONICS; w++) {
        double sum = 0;
        for (size_t t = 0; t < rows.n_tiles; t++) sum += (double)rows.sky[t * HARMONICS + w];
        printf("row %zu: %.5f, must be %.5f\n", w, sum, expected[w]);
        ck_assert_double_eq_tol(sum, expected[w], .01 * expected[0]);
    }
    sensor_rows_free(&rows);
    sky_bounce_free(&sky);
    mesh_free(&m);
}
END_TEST

/* Beside a closed box, at some distance and just below its floor, all faces that are met turn their backs,
 * and no light comes from them. */
START_TEST(outside) {
    receiver r[3 * HARMONICS];
    mesh m = box_mesh(room, 8, .5f);
    probe_at((double[3]){2, 1.5, -.1}, z_axis, x_axis, r);
    probe_at((double[3]){12, 1.5, 1}, z_axis, x_axis, r + HARMONICS);
    probe_at((double[3]){1, 1.5, 1}, z_axis, x_axis, r + 2 * HARMONICS);
    sensor_rows rows = rows_of(&m, 3 * HARMONICS, r, &(sensor_rows_options){.rays = 256});
    ck_assert_uint_eq(rows.start[2 * HARMONICS], 0);
    for (size_t k = 0; k < 3 * HARMONICS; k++)
        ck_assert_double_eq_tol((double)rows.backs[k], k < 2 * HARMONICS, 1e-6);
    sensor_rows_free(&rows);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("rows of probes");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_test(c, furnace);
    tcase_add_test(c, many);
    tcase_add_test(c, upper_half);
    tcase_add_test(c, axes);
    tcase_add_test(c, half_a_lamp);
    tcase_add_test(c, even_sky);
    tcase_add_test(c, outside);
    suite_add_tcase(s, c);
    return suite_run(s);
}
