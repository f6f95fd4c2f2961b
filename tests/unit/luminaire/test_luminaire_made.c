/* The tables of point and spot lights against the law of KHR_lights_punctual, in long double. */
#include "solver/luminaire/luminaire_made.h"
#include "support/suite.h"

#include <math.h>

static const double quarter = M_PI_4, half = M_PI_2;

START_TEST(points) {
    lam_error error = {0};
    luminaire l = {.n_planes = 0};
    ck_ok(luminaire_of_point(7, &l, &error));
    ck_assert(luminaire_is_sound(&l) && l.opening.shape == OPENING_POINT);
    ck_assert_str_eq(luminaire_format_name(l.format), "formula");
    for (int C = -90; C <= 360; C += 45)
        for (int gamma = 0; gamma <= 180; gamma += 15)
            ck_assert_double_eq_tol(luminaire_candela(&l, C, gamma), 7, 1e-14);
    ck_assert_double_eq_tol(luminaire_lumens(&l), 4 * M_PI * 7, 1e-12);
    luminaire_free(&l);
}
END_TEST

/* The angles of spots: usual ones, without an edge, as wide and as narrow as they may be, and such that the
 * least edge is wider than the cone. */
static const struct {
    double inner, outer;
} spots[] = {{0, quarter},  {.25, .5},    {0, half}, {half - 1e-4, half}, {half, half},   {.5, .5},
             {.6, .601},    {1e-3, 2e-3}, {0, .01},  {.01, .01},          {.0447, .0448}, {.05, .05},
             {1e-300, 1.2}, {1e-6, 1e-6}, {0, 1e-6}};

/* Both in parts of the intensity; t in rad. */
static long double law(long double inner, long double outer, long double t) {
    const long double D = fmaxl(.001L, cosl(inner) - cosl(outer));
    const long double s = t < outer ? fminl(1, fmaxl(0, (cosl(t) - cosl(outer)) / D)) : 0;
    return s * s;
}

/* 2 pi times the integral of the law over u = cos t: 1 - u1 + (u1 - u0)^3 / (3 D^2), u0 = cos outer, where it
 * is full from u1 = min(1, u0 + D) on. */
static long double lumens(long double inner, long double outer) {
    const long double D = fmaxl(.001L, cosl(inner) - cosl(outer)), edge = fminl(D, 1 - cosl(outer));
    return 2 * acosl(-1) * (1 - cosl(outer) - edge + edge * edge * edge / (3 * D * D));
}

/* The table may be off by 1e-4 of the peak, and so may the flux by that of the whole cone. The law here has
 * the rounding of cosines near 1, 2^-63 in each difference, which is squared. */
START_TEST(tables_follow_the_law) {
    enum { DIRECTIONS = 20000 };
    const double inner = spots[_i].inner, outer = spots[_i].outer, intensity = 300;
    const double peak = intensity * (double)law(inner, outer, 0), most = 1.0001e-4 * peak;
    lam_error error = {0};
    luminaire l = {.n_planes = 0};
    double C, gamma, worst = 0;
    ck_ok(luminaire_of_spot(intensity, inner, outer, &l, &error));
    ck_assert(luminaire_is_sound(&l) && l.symmetry == SYMMETRY_ROTATIONAL && l.n_angles <= 105);
    for (int k = 0; k <= DIRECTIONS; k++) {
        const double t = fmin(1, 1.1 * k / DIRECTIONS) * outer, degrees = t * (180 / M_PI);
        const double found = luminaire_candela(&l, k, degrees);
        worst = fmax(worst, fabs(found - intensity * (double)law(inner, outer, t)));
    }
    ck_assert_msg(worst <= most, "off by %g of %g cd", worst, peak);
    for (int k = 0; k <= 200; k++) {
        const double from = outer * (180 / M_PI);
        ck_assert(luminaire_candela(&l, k, from + k * (180 - from) / 200) == 0);
    }
    const double rounded = 1e-12 + 2 * 0x1p-63 / (double)(1 - cosl(outer));
    ck_assert_double_eq_tol(luminaire_peak(&l, &C, &gamma), peak, rounded * peak);
    ck_assert(gamma == 0);
    const double whole = 2 * M_PI * (double)(1 - cosl(outer)),
                 flux = intensity * (double)lumens(inner, outer);
    ck_assert_double_eq_tol(luminaire_lumens(&l), flux, whole * most);
    luminaire_free(&l);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("luminaire_made");
    TCase *tests = tcase_create("all");
    tcase_add_test(tests, points);
    tcase_add_loop_test(tests, tables_follow_the_law, 0, sizeof spots / sizeof *spots);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
