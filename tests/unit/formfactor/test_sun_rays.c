/* Rays to the sun: what a table in the open shades, whatever the threads, the batch and the elements asked
 * for. */
#include "solver/formfactor/visibility/sun_rays.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <math.h>
#include <omp.h>
#include <string.h>

enum { SIDE = 24, N = SIDE * SIDE + 1 };

/* A floor of 24 x 24 squares of 1 m and, 2 m above its middle, a table of 6 x 6 m that faces up. */
static mesh make_table(void) {
    lam_error error = {0};
    mesh m = {.n = N, .n_vertices = (SIDE + 1) * (SIDE + 1) + 4, .n_channels = 1};
    m.vertices = calloc(m.n_vertices, sizeof *m.vertices);
    m.elements = calloc(N, sizeof *m.elements);
    for (uint32_t y = 0; y <= SIDE; y++)
        for (uint32_t x = 0; x <= SIDE; x++) {
            double *v = m.vertices[y * (SIDE + 1) + x];
            v[0] = x;
            v[1] = y;
        }
    for (uint32_t i = 0; i + 1 < N; i++) {
        const uint32_t first = i / SIDE * (SIDE + 1) + i % SIDE;
        const uint32_t corners[4] = {first, first + 1, first + SIDE + 2, first + SIDE + 1};
        memcpy(m.elements[i], corners, sizeof corners);
    }
    static const double table[4][3] = {{9, 9, 2}, {15, 9, 2}, {15, 15, 2}, {9, 15, 2}};
    memcpy(m.vertices + m.n_vertices - 4, table, sizeof table);
    for (uint32_t k = 0; k < 4; k++) m.elements[N - 1][k] = (uint32_t)m.n_vertices - 4 + k;
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_OK);
    return m;
}

static sun_rays *make(const mesh *m, size_t n_points, size_t n_wanted, const uint32_t *wanted) {
    sun_rays *s = NULL;
    lam_error error = {0};
    ck_assert_msg(sun_rays_create(m, n_points, 5, n_wanted, wanted, &s, &error) == LAM_OK, "%s",
                  error.message);
    return s;
}

/* The part of unit square i that lies from low to high along one axis. */
static double overlap(double low, double high, double i) {
    return fmax(0, fmin(high, i + 1) - fmax(low, i));
}

/* A point p of the floor is shaded where p + 2 d / d_z is on the table. */
START_TEST(shade) {
    static const double ways[][3] = {{0, 0, 1},     {.6, 0, .8}, {-.48, .36, .8},
                                     {.3, -.9, .2}, {0, 0, -1},  {.8, .6, 0}};
    mesh m = make_table();
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
        double d[3],
            length = sqrt(ways[w][0] * ways[w][0] + ways[w][1] * ways[w][1] + ways[w][2] * ways[w][2]);
        for (int k = 0; k < 3; k++) d[k] = ways[w][k] / length;
        const size_t n_points = 64;
        sun_rays *s = make(&m, n_points, 0, NULL);
        float seen[N];
        sun_rays_cast(s, 1, (const double(*)[3])d, (float *[]){seen});
        double shaded = 0;
        for (size_t i = 0; i + 1 < N; i++) {
            const double dx = 2 * d[0] / d[2], dy = 2 * d[1] / d[2];
            const double part = d[2] <= 0 ? 1
                                          : overlap(9 - dx, 15 - dx, (double)(i % SIDE)) *
                                                overlap(9 - dy, 15 - dy, (double)(i / SIDE));
            const double right = fmax(d[2], 0) * (1 - part);
            /* Sure where all of it is one or the other; of 64 points, and then of 512, else. A part that 64
             * miss is a strip of a 64th and less; an edge cuts one strip in 22 of 512 points at most. */
            const double tolerance = part == 0 || part == 1 ? 1e-6 : .05;
            ck_assert_msg(fabs((double)seen[i] - right) <= tolerance, "way %zu, %zu: %g, is %g", w, i,
                          (double)seen[i], right);
            shaded += d[2] > 0 ? 1 - (double)seen[i] / d[2] : 0;
        }
        if (d[2] > .5) ck_assert_double_eq_tol(shaded, 36, .12); /* the whole shadow, of 24 edges' squares */
        ck_assert_double_eq_tol((double)seen[N - 1], fmax(d[2], 0), 1e-6);
        sun_rays_free(s);
    }
    mesh_free(&m);
}
END_TEST

/* Bits do not depend on threads, on the batch, or on the elements beside; with points of both kinds. */
static void check_bits(size_t n_points) {
    enum { WAYS = 7 };
    static const uint32_t some[] = {N - 1, 3, 250, 251, 300};
    mesh m = make_table();
    double d[WAYS][3];
    float batch[WAYS][N], one[N], few[N];
    float *rows[WAYS];
    for (size_t k = 0; k < WAYS; k++) {
        const double turn = .9 * (double)k;
        d[k][0] = .6 * cos(turn);
        d[k][1] = .6 * sin(turn);
        d[k][2] = .8;
        rows[k] = batch[k];
    }
    sun_rays *all = make(&m, n_points, 0, NULL), *chosen = make(&m, n_points, 5, some);
    omp_set_num_threads(3);
    sun_rays_cast(all, WAYS, (const double(*)[3])d, rows);
    omp_set_num_threads(1);
    for (size_t k = 0; k < WAYS; k++) {
        sun_rays_cast(all, 1, (const double(*)[3])d[k], (float *[]){one});
        ck_assert_mem_eq(one, batch[k], sizeof one);
        for (size_t i = 0; i < N; i++) few[i] = -7;
        sun_rays_cast(chosen, 1, (const double(*)[3])d[k], (float *[]){few});
        for (size_t i = 0; i < N; i++) {
            bool asked = false;
            for (size_t j = 0; j < 5; j++) asked = asked || some[j] == i;
            ck_assert(few[i] == (asked ? one[i] : -7));
        }
    }
    sun_rays_free(all);
    sun_rays_free(chosen);
    mesh_free(&m);
}

START_TEST(same_bits) {
    check_bits(4);
    check_bits(16);
}
END_TEST

START_TEST(no_memory) {
    mesh m = make_table();
    sun_rays *s = NULL;
    lam_error error = {0};
    long failed = 0;
    for (lam_status status = LAM_ERR_MEMORY; status != LAM_OK; failed++) {
        allocations_left = failed;
        status = sun_rays_create(&m, 4, 5, 0, NULL, &s, &error);
        allocations_left = -1;
        ck_assert(status == LAM_OK || (status == LAM_ERR_MEMORY && s == NULL));
    }
    ck_assert_int_gt(failed, 4);
    sun_rays_free(s);
    sun_rays_free(NULL);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("sun_rays");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, shade);
    tcase_add_test(c, same_bits);
    tcase_add_test(c, no_memory);
    suite_add_tcase(s, c);
    return suite_run(s);
}
