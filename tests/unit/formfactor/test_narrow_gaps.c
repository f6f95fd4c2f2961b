/* The projected share of plates between which two occluders leave a narrow gap, beside many points. */
#include "solver/base/random.h"
#include "support/plates_pair.h"
#include "support/suite.h"

#include <math.h>

/* Gaps by chance; a sanitizer watches the same code in fewer. */
#ifdef LAMBERT_FEW_CASES
enum { GAPS = 1000, MANY = 0 };
#else
enum { GAPS = 5000, MANY = 1 };
#endif

static double unit(uint64_t *state) {
    return random_lcg_unit(state);
}

/* A half plane at height z, seen from above: side * (p . e) >= side * s for e at `angle`. */
static void add_half_plane(mesh *m, double z, double angle, double s, double side) {
    enum { FAR = 4 };
    const double e[2] = {cos(angle), sin(angle)}, middle[2] = {.5, .5};
    const double at = middle[0] * e[0] + middle[1] * e[1];
    double corner[4][3];
    for (int k = 0; k < 4; k++) {
        const double out = k == 1 || k == 2 ? side * FAR : s - at, along = k >= 2 ? FAR : -FAR;
        corner[k][0] = middle[0] + out * e[0] - along * e[1];
        corner[k][1] = middle[1] + out * e[1] + along * e[0];
        corner[k][2] = z;
    }
    mesh_add_quad(m, (const double(*)[3])corner);
}

/* Two plates and two half planes between them, which leave a gap about the line of sight from a point of one
 * to a point of the other, or past a side of either. */
static mesh plates_with_gap(uint64_t *state) {
    const double angle = unit(state) < .5 ? 0 : M_PI * unit(state);
    const double place[2] = {1.2 * unit(state) - .1, 1.2 * unit(state) - .1};
    const double z[2] = {.02 + .96 * unit(state), .02 + .96 * unit(state)},
                 gap = pow(10, -3 + 3 * unit(state));
    const double slope = place[1] - place[0];
    mesh m = plates(NULL);
    add_half_plane(&m, z[0], angle, place[0] + z[0] * slope, -1);
    add_half_plane(&m, z[1], angle, place[0] + z[1] * slope + gap, 1);
    return m;
}

/* The visible share of plates by product rules of n points along each side. */
static double share_by_rule(const projection *p, const projected_pair *pair, size_t n, const double *node,
                            const double *weight) {
    const double up[3] = {0, 0, 1};
    double visible = 0, full = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const double x[3] = {node[i], node[j], 0};
            double all;
            visible += weight[i] * weight[j] * projection_point_factor(p, pair, x, up, &all);
            full += weight[i] * weight[j] * all;
        }
    return visible / full;
}

/* A narrow gap through two occluders may send its light past all 16 points of a product rule; of random gaps
 * those count that do so over one of the plates. The tolerance is what is stated of a share. Answers are
 * honest where the error is below twice the stated one: then the mean square of error over tolerance is below
 * 4. The light of a group comes by many pairs, whose stated errors are taken for independent: the sum over
 * all gaps is to be within twice the root of the sum of squares. Of the light of all gaps .025 are lost; .040
 * are where no other element's corners are looked at, .062 where no cell's are. */
START_TEST(narrow_gaps_are_not_taken_for_dark) {
    enum { RULE = 3, POINTS = 4, MIDPOINTS = 100 };
    static const double tolerance = 3e-3;
    double node[MIDPOINTS], weight[MIDPOINTS];
    uint64_t state = 5;
    double squares = 0, sum = 0, counted = 0, light = 0, lost = 0;
    pair_factor_rules rules;
    pair_factor_rules_init(&rules);
    for (int k = 0; k < MIDPOINTS; k++) node[k] = (k + .5) / MIDPOINTS, weight[k] = 1. / MIDPOINTS;
    for (uint64_t trial = 0; trial < GAPS; trial++) {
        plates_pair s;
        double work = 0;
        plates_pair_open(&s, plates_with_gap(&state));
        ck_assert_int_eq(s.among.count, 2);
        const projection p = {&rules, &s.occluders, trial};
        const projected_pair pair = {0, 1, &s.a, &s.b, &s.among, 0};
        const gauss_rule *g = &rules.gauss[RULE];
        const bool dark = share_by_rule(&p, &pair, POINTS, g->node, g->weight) <= 0;
        const double truth = dark ? share_by_rule(&p, &pair, MIDPOINTS, node, weight) : 0;
        if (truth > 0) {
            const double found = projection_share(&p, &pair, tolerance, &work);
            const double error = (found - truth) / tolerance;
            light += truth;
            lost += fmax(0, truth - found);
            squares += error * error;
            sum += error;
            counted++;
        }
        plates_pair_close(&s);
    }
    ck_assert_double_gt(counted, GAPS / 50.);
    ck_assert_double_lt(squares / counted, 4);
    if (MANY) ck_assert_double_lt(lost, .033 * light); /* fewer tell less of a mean */
    ck_assert_msg(fabs(sum) < 2 * sqrt(counted), "%g of %g gaps", sum, counted);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("narrow_gaps");
    TCase *cases = tcase_create("narrow_gaps");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, narrow_gaps_are_not_taken_for_dark);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
