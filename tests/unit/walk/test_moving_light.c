/* The polygon of a moving light: its points, and what is no such light. */
#include "solver/walk/moving_light.h"
#include "support/dense.h"
#include "support/suite.h"

/* Points fill the polygon evenly: means of coordinates and of their squares. */
START_TEST(points_are_uniform) {
    static const double corners[5][3] = {{0, 0, 1}, {2, 0, 1}, {3, 1, 1}, {1, 2, 1}, {0, 1, 1}};
    moving_light l;
    lam_error error = {.message = ""};
    double(*corner)[3] = test_allocate(5, sizeof *corner), sum[3] = {0, 0, 0};
    memcpy(corner, corners, sizeof corners);
    ck_ok(moving_light_create(5, corner, &l, &error));
    enum { SIDE = 1000 };
    for (int a = 0; a < SIDE; a++)
        for (int b = 0; b < SIDE; b++) {
            double x[3];
            moving_light_point(&l, (a + .5) / SIDE, (b + .5) / SIDE, x);
            sum[0] += x[0] / (SIDE * SIDE);
            sum[1] += x[1] / (SIDE * SIDE);
            sum[2] += x[0] * x[1] / (SIDE * SIDE);
            ck_assert_double_eq_tol(x[2], 1, 1e-12);
        }
    /* Green's theorem gives the moments. */
    double area = 0, mx = 0, my = 0, mxy = 0;
    for (int k = 0; k < 5; k++) {
        const double *p = corners[k], *q = corners[(k + 1) % 5], c = p[0] * q[1] - q[0] * p[1];
        area += c / 2;
        mx += (p[0] + q[0]) * c / 6;
        my += (p[1] + q[1]) * c / 6;
        mxy += (p[0] * q[1] + 2 * p[0] * p[1] + 2 * q[0] * q[1] + q[0] * p[1]) * c / 24;
    }
    ck_assert_double_eq_tol(l.area, area, 1e-12);
    ck_assert_double_eq_tol(sum[0], mx / area, 2e-3);
    ck_assert_double_eq_tol(sum[1], my / area, 2e-3);
    ck_assert_double_eq_tol(sum[2], mxy / area, 4e-3);
    ck_assert_double_eq_tol(l.normal[2], 1, 1e-12);
    moving_light_free(&l);
}
END_TEST

static void refused(const char *says, size_t n, const double (*corners)[3]) {
    moving_light l;
    lam_error error = {.message = ""};
    double(*corner)[3] = test_allocate(n, sizeof *corner);
    memcpy(corner, corners, n * sizeof *corner);
    ck_assert_int_eq(moving_light_create(n, corner, &l, &error), LAM_ERR_ARGUMENT);
    ck_assert_msg(strstr(error.message, says) != NULL, "%s", error.message);
}

START_TEST(refuses_what_is_no_light) {
    refused("at least 3", 2, (const double[][3]){{0, 0, 0}, {1, 0, 0}});
    refused("no area", 3, (const double[][3]){{0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
    refused("off the plane", 4, (const double[][3]){{0, 0, 0}, {1, 0, 0}, {1, 1, .2}, {0, 1, 0}});
    refused("corner 2", 4, (const double[][3]){{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {.9, .1, 0}});
}
END_TEST

int main(void) {
    Suite *suite = suite_create("moving light");
    TCase *tests = tcase_create("moving light");
    tcase_add_test(tests, points_are_uniform);
    tcase_add_test(tests, refuses_what_is_no_light);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
