/* Windows between two plates, by the segments that brute force finds open. */
#include "solver/base/random.h"
#include "solver/formfactor/sight/windows.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/plates.h"
#include "support/suite.h"

#include <math.h>

static double unit(uint64_t *state) {
    return random_lcg_unit(state);
}

/* A wide wall with a rectangular hole: at `at`, with the unit axes given. */
typedef struct holed_wall {
    double at[3], axis[2][3], normal[3], half[2];
} holed_wall;

static void set_wall(holed_wall *w, const double at[3], double turn, double tilt, double one, double two) {
    const double axis[2][3] = {{cos(turn), sin(turn), 0},
                               {-sin(turn) * cos(tilt), cos(turn) * cos(tilt), sin(tilt)}};
    for (int d = 0; d < 3; d++) w->at[d] = at[d];
    for (int k = 0; k < 2; k++)
        for (int d = 0; d < 3; d++) w->axis[k][d] = axis[k][d];
    for (int d = 0; d < 3; d++)
        w->normal[d] =
            axis[0][(d + 1) % 3] * axis[1][(d + 2) % 3] - axis[0][(d + 2) % 3] * axis[1][(d + 1) % 3];
    w->half[0] = one, w->half[1] = two;
}

/* As four pieces about the hole. */
static void add_wall(mesh *m, const holed_wall *w) {
    enum { WIDE = 4 };
    const double h = w->half[0], k = w->half[1];
    const double pieces[4][4] = {
        {-WIDE, -h, -WIDE, WIDE}, {h, WIDE, -WIDE, WIDE}, {-h, h, -WIDE, -k}, {-h, h, k, WIDE}};
    for (int p = 0; p < 4; p++) {
        double corner[4][3];
        for (int c = 0; c < 4; c++)
            for (int d = 0; d < 3; d++)
                corner[c][d] = w->at[d] + pieces[p][c == 1 || c == 2] * w->axis[0][d] +
                               pieces[p][2 + (c >= 2)] * w->axis[1][d];
        mesh_add_quad(m, (const double(*)[3])corner);
    }
}

/* A segment passes the wall only where it meets the hole. */
static bool passes(const holed_wall *w, const double x[3], const double y[3]) {
    double from = 0, to = 0, place[2] = {0, 0};
    for (int d = 0; d < 3; d++) {
        from += w->normal[d] * (x[d] - w->at[d]);
        to += w->normal[d] * (y[d] - w->at[d]);
    }
    for (int k = 0; k < 2; k++)
        for (int d = 0; d < 3; d++)
            place[k] += w->axis[k][d] * (x[d] + from / (from - to) * (y[d] - x[d]) - w->at[d]);
    return fabs(place[0]) < w->half[0] && fabs(place[1]) < w->half[1];
}

static bool holds(const polygon *p, const double x[3]) {
    for (int c = 0; c < p->n; c++) {
        const double *a = p->corner[c], *b = p->corner[(c + 1) % p->n];
        if (((b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0])) * p->normal[2] < -1e-9)
            return false;
    }
    return true;
}

/* Finds the windows of walls between the plates; the areas of the parts, 0 where all is closed. */
static windows_found cut(const holed_wall *walls, int n, polygon parts[2]) {
    lam_error error = {0};
    mesh m = plates(NULL);
    for (int k = 0; k < n; k++) add_wall(&m, &walls[k]);
    free(m.area);
    free(m.normal);
    m.area = NULL;
    m.normal = NULL;
    ck_assert_msg(mesh_measure(&m, &error) == LAM_OK, "%s", error.message);
    visibility *v;
    occluders o;
    link_occluders among = {.count = 0};
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    ck_assert(occluders_make(&m, visibility_facets(v), visibility_rounding(v), &o, &error) == LAM_OK);
    const facets *f = visibility_facets(v);
    const uint32_t own[2] = {f->of_element[0], f->of_element[1]};
    for (size_t k = 0; k < o.n; k++) among.of[among.count++] = (uint32_t)k;
    polygon_of_element(&m, 0, &parts[0]);
    polygon_of_element(&m, 1, &parts[1]);
    const windows_found found = windows_cut(&o, &among, own, (const double[2]){0, 0}, &parts[0], &parts[1]);
    occluders_free(&o);
    visibility_destroy(v);
    mesh_free(&m);
    return found;
}

/* No open segment begins or ends outside of the parts. In a wall parallel to the plates the parts are no
 * wider than what segments fill: of N random ones that pass, the outermost come within a tenth. */
START_TEST(windows_keep_all_open_segments) {
    enum { SEGMENTS = 100000 };
    uint64_t state = 5 + (uint64_t)_i;
    size_t found_cut = 0, found_closed = 0;
    for (int trial = 0; trial < 40; trial++) {
        const int n = 1 + trial % 2;
        const bool parallel = trial % 4 < 2;
        holed_wall walls[2];
        polygon parts[2];
        for (int k = 0; k < n; k++) {
            const double at[3] = {1.2 * unit(&state) - .1, 1.2 * unit(&state) - .1, k == 0 ? .4 : .6};
            set_wall(&walls[k], at, parallel ? 0 : 3 * unit(&state), parallel ? 0 : .1 * unit(&state),
                     .02 + .2 * unit(&state), .02 + .2 * unit(&state));
            /* The second hole near the first one, so that many segments pass both. */
            for (int d = 0; d < 2 && k == 1; d++) walls[1].at[d] = walls[0].at[d] + .2 * (unit(&state) - .5);
        }
        const windows_found found = cut(walls, n, parts);
        ck_assert_int_ne(found, WINDOWS_NONE);
        found_cut += found == WINDOWS_CUT;
        found_closed += found == WINDOWS_CLOSED;
        double low[2][2] = {{1, 1}, {1, 1}}, high[2][2] = {{0, 0}, {0, 0}};
        size_t open = 0;
        for (int s = 0; s < SEGMENTS; s++) {
            const double x[3] = {unit(&state), unit(&state), 0}, y[3] = {unit(&state), unit(&state), 1};
            const double *ends[2] = {x, y};
            bool pass = true;
            for (int k = 0; k < n && pass; k++) pass = passes(&walls[k], x, y);
            if (!pass) continue;
            open++;
            ck_assert_int_eq(found, WINDOWS_CUT);
            for (int e = 0; e < 2; e++) {
                ck_assert(holds(&parts[e], ends[e]));
                for (int d = 0; d < 2; d++) {
                    low[e][d] = fmin(low[e][d], ends[e][d]);
                    high[e][d] = fmax(high[e][d], ends[e][d]);
                }
            }
        }
        for (int e = 0; e < 2 && parallel && open > 300; e++)
            for (int c = 0; c < parts[e].n; c++)
                for (int d = 0; d < 2; d++) {
                    ck_assert_double_ge(parts[e].corner[c][d], low[e][d] - .1);
                    ck_assert_double_le(parts[e].corner[c][d], high[e][d] + .1);
                }
    }
    ck_assert_uint_gt(found_cut, 10);
    ck_assert_uint_gt(found_closed, 0);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("windows");
    TCase *cases = tcase_create("windows");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, windows_keep_all_open_segments, 0, 4);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
