/* Occluders of a scene: their polygons, twins and slivers, and the search of their tree. */
#include "solver/base/random.h"
#include "solver/formfactor/visibility/occluders.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/plates.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>

/* Joined pieces cover the same area: a grid is one polygon, also where its cells share no vertices, one with
 * a hole is a few, and a bent one is not joined across the bend. */
START_TEST(pieces_are_joined) {
    static const struct {
        bool hole, bent;
        size_t most;
    } cases[] = {{false, false, 1}, {true, false, 8}, {false, true, 2}};
    for (size_t k = 0; k < 3; k++) {
        enum { N = 6 };
        mesh m = {0};
        lam_error error = {0};
        double area = 0, joined = 0;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++) {
                if (cases[k].hole && i >= 2 && i < 4 && j >= 2 && j < 4) continue;
                double corner[4][3];
                for (int c = 0; c < 4; c++) {
                    corner[c][0] = i + (c == 1 || c == 2);
                    corner[c][1] = j + (c >= 2);
                    corner[c][2] = cases[k].bent ? fmax(0, corner[c][0] - N / 2) : 0;
                }
                mesh_add_quad(&m, (const double(*)[3])corner);
            }
        mesh_finish(&m, .5f);
        visibility *v;
        occluders o;
        ck_assert(visibility_create_of_elements(&m, &v, &error) == LAM_OK);
        ck_assert(occluders_make(&m, visibility_facets(v), visibility_rounding(v), &o, &error) == LAM_OK);
        ck_assert_uint_ge(o.n, 1);
        ck_assert_uint_le(o.n, cases[k].most);
        for (size_t e = 0; e < m.n; e++) area += m.area[e];
        for (size_t p = 0; p < o.n; p++) {
            double twice[3] = {0};
            for (int c = 0; c < o.of[p].n; c++) {
                const double *x = o.of[p].corner[c], *y = o.of[p].corner[(c + 1) % o.of[p].n];
                for (int d = 0; d < 3; d++)
                    twice[d] += x[(d + 1) % 3] * y[(d + 2) % 3] - x[(d + 2) % 3] * y[(d + 1) % 3];
            }
            for (int d = 0; d < 3; d++) joined += .5 * twice[d] * o.of[p].normal[d];
        }
        ck_assert_double_eq_tol(joined, area, 1e-9 * area);
        occluders_free(&o);
        visibility_destroy(v);
        mesh_free(&m);
    }
}
END_TEST

static occluders occluders_of(const mesh *m, visibility **v) {
    lam_error error = {0};
    occluders o;
    ck_assert(visibility_create_of_elements(m, v, &error) == LAM_OK);
    ck_assert(occluders_make(m, visibility_facets(*v), visibility_rounding(*v), &o, &error) == LAM_OK);
    return o;
}

static void add_square(mesh *m, double z, double width, bool turned) {
    double corner[4][3] = {{0, 0, z}, {width, 0, z}, {width, 1, z}, {0, 1, z}};
    if (turned)
        for (int d = 0; d < 3; d++) {
            const double kept = corner[1][d];
            corner[1][d] = corner[3][d];
            corner[3][d] = kept;
        }
    mesh_add_quad(m, (const double(*)[3])corner);
}

/* A sheet with two faces is one occluder, a square behind it another, and a strip thinner than rounding none.
 */
START_TEST(sheets_count_once_and_slivers_not_at_all) {
    mesh m = {0};
    visibility *v;
    add_square(&m, 0, 1, false);
    add_square(&m, 0, 1, true);
    add_square(&m, .5, 1, false);
    add_square(&m, 1, 1e-9, false);
    mesh_finish(&m, .5f);
    occluders o = occluders_of(&m, &v);
    ck_assert_uint_eq(o.n, 2);
    ck_assert_double_eq(o.of[0].low[2], 0);
    ck_assert_double_eq(o.of[1].low[2], .5);
    occluders_free(&o);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Squares at random places: the search of a shaft finds each once that the shaft does not miss, and leaves
 * out most of the others. */
START_TEST(searches_find_all_that_reach_in) {
    enum { SQUARES = 300, SHAFTS = 200 };
    mesh m = {0};
    visibility *v;
    uint64_t state = 11;
    size_t all = 0, met = 0, within = 0, in_box = 0;
    for (int k = 0; k < SQUARES; k++) {
        double corner[4][3];
        const double x = random_unit(&state), y = random_unit(&state), z = random_unit(&state);
        for (int c = 0; c < 4; c++) {
            corner[c][0] = x + (c == 1 || c == 2 ? .04 : 0);
            corner[c][1] = y + (c >= 2 ? .04 : 0);
            corner[c][2] = z;
        }
        mesh_add_quad(&m, (const double(*)[3])corner);
    }
    mesh_finish(&m, .5f);
    occluders o = occluders_of(&m, &v);
    ck_assert_uint_eq(o.n, SQUARES);
    for (int k = 0; k < SHAFTS; k++) {
        shaft s;
        shaft_box box[2];
        int times[SQUARES] = {0};
        const uint32_t *found;
        uint32_t count;
        for (int b = 0; b < 2; b++)
            for (int d = 0; d < 3; d++) {
                box[b].low[d] = random_unit(&state);
                box[b].high[d] = box[b].low[d] + .1;
            }
        shaft_of_boxes(&s, &box[0], &box[1], 0);
        shaft_cut(&s, (double[3]){0, 0, 1}, .2);
        for (occluder_search search = occluder_search_begin(&o, &s);
             occluder_search_next(&search, &found, &count);)
            for (uint32_t c = 0; c < count; c++) times[found[c]]++;
        for (size_t p = 0; p < o.n; p++) {
            const bool reaches = !shaft_misses_points(&s, o.of[p].n, (const double(*)[3])o.of[p].corner);
            ck_assert_int_le(times[p], 1);
            if (reaches) ck_assert_int_eq(times[p], 1);
            if (reaches) ck_assert_double_gt(o.of[p].low[2], .2);
            /* One that lies in a box, in front of the plane, is in the shaft. */
            bool inside = o.of[p].low[2] > .2;
            for (int d = 0; d < 3; d++)
                inside = inside && o.of[p].low[d] > box[0].low[d] && o.of[p].high[d] < box[0].high[d];
            if (inside) ck_assert_int_eq(times[p], 1);
            in_box += inside;
            all++;
            met += (size_t)times[p];
            within += reaches;
        }
    }
    ck_assert_uint_gt(within, SHAFTS);
    ck_assert_uint_gt(in_box, 5);
    ck_assert_uint_lt(met, all / 4);
    occluders_free(&o);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("occluders");
    TCase *cases = tcase_create("occluders");
    tcase_add_test(cases, pieces_are_joined);
    tcase_add_test(cases, sheets_count_once_and_slivers_not_at_all);
    tcase_add_test(cases, searches_find_all_that_reach_in);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
