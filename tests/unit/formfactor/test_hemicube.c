/* Hemicubes: delta form factors, the row of one centroid against closed forms, and the invariants. */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rays/hemicube.h"
#include "solver/formfactor/source.h"
#include "support/box.h"
#include "support/found.h"
#include "support/plates.h"
#include "support/suite.h"

#include <omp.h>

static const size_t resolutions[] = {32, 128, 512};
enum { N_RESOLUTIONS = sizeof resolutions / sizeof *resolutions };

static hemicube cube(size_t resolution) {
    hemicube h = {0};
    lam_error error = {0};
    ck_assert_msg(hemicube_create(resolution, &h, &error) == LAM_OK, "%s", error.message);
    return h;
}

START_TEST(weights_sum_to_one) {
    static const size_t all[] = {4, 6, 10, 32, 128, 512};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        hemicube h = cube(all[k]);
        double sum = 0;
        for (int face = 0; face < HEMICUBE_FACES; face++)
            for (size_t row = 0; row < hemicube_rows(&h, face); row++)
                for (size_t column = 0; column < h.resolution; column++) {
                    const double weight = hemicube_weight(&h, face, row, column);
                    ck_assert_double_gt(weight, 0);
                    sum += weight;
                }
        ck_assert_double_eq_tol(sum, 1, 1e-9);
        hemicube_free(&h);
    }
}
END_TEST

/* Cohen and Greenberg's own formulas at the centres of pixels are the midpoint rule: they differ from the
 * integral by h^2/24 times the density's second derivatives, which are at most 24 times the density. */
START_TEST(weights_follow_the_densities) {
    hemicube h = cube(64);
    const double width = 2. / 64, area = width * width;
    for (int face = 0; face < HEMICUBE_FACES; face++)
        for (size_t row = 0; row < hemicube_rows(&h, face); row++)
            for (size_t column = 0; column < 64; column++) {
                const double x = width * ((double)column + .5) - 1;
                const double y = width * ((double)row + .5) - (face == HEMICUBE_TOP ? 1 : 0);
                const double height = face == HEMICUBE_TOP ? 1 : y;
                const double density = height / (M_PI * pow(x * x + y * y + 1, 2));
                ck_assert_double_eq_tol(hemicube_weight(&h, face, row, column), density * area,
                                        width * width * density * area);
            }
    hemicube_free(&h);
}
END_TEST

/* A square, or a triangle, about 1e-3 wide around the origin, its front towards +z, its first edge turned
 * from the x axis. */
static void add_tiny(mesh *m, bool triangle, double turn) {
    static const double square[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const double three[4][2] = {{-1, -1}, {1, -1}, {0, 2}, {0, 0}}; /* the fourth is cut off */
    double corners[4][3] = {{0}};
    for (int c = 0; c < 4; c++) {
        const double *p = triangle ? three[c] : square[c];
        corners[c][0] = 5e-4 * (cos(turn) * p[0] - sin(turn) * p[1]);
        corners[c][1] = 5e-4 * (sin(turn) * p[0] + cos(turn) * p[1]);
    }
    mesh_add_quad(m, (const double(*)[3])corners);
    if (triangle) m->elements[m->n - 1][3] = MESH_NO_VERTEX;
}

static const struct {
    box_cell plate;
    bool positive;
    double F;   /* truths: dA to a unit square at distance 1 */
    double arc; /* radians that its outline takes, seen from the origin */
} views[] = {
    /* parallel, under its centre: four edges of 2 atan(.5/sqrt(1.25)) */
    {{.axis = 2, .level = 1, .from = {-.5, -.5, 1}, .to = {.5, .5, 1}}, false, .239456470461, 3.365},
    /* perpendicular, at its corner: two edges of 45 degrees, two of acos(2/sqrt(6)) */
    {{.axis = 0, .level = 1, .from = {1, 0, 0}, .to = {1, 1, 1}}, false, .055734197003, 2.802},
};
enum { N_VIEWS = sizeof views / sizeof *views };

/* The one-sided rows of the centroids. */
static csr trace_rows(const mesh *m, size_t resolution, double *leaving, double *absorbed) {
    hemicube h = cube(resolution);
    visibility *v = NULL;
    packed_rows found = {0};
    lam_error error = {0};
    const form_factor_options how = {.recipe = {.source = &source_hemicube, .resolution = resolution}};
    const uint32_t order[4] = {0, 1, 2, 3};
    ck_assert_uint_le(m->n, 4);
    ck_assert_msg(visibility_create(m, &v, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(hemicube_trace(&h, m, v, order, &how, &found, leaving, absorbed, &error) == LAM_OK, "%s",
                  error.message);
    visibility_destroy(v);
    hemicube_free(&h);
    const csr rows = found_unpack(&found);
    packed_rows_free(&found);
    return rows;
}

static double seen_by_tiny(size_t view, bool triangle, double turn, size_t resolution) {
    mesh m = {0};
    double leaving[2], absorbed[2];
    add_tiny(&m, triangle, turn);
    mesh_add_cell(&m, &views[view].plate, views[view].positive);
    mesh_finish(&m, .5f);
    csr rows = trace_rows(&m, resolution, leaving, absorbed);
    const double F = csr_entry(&rows, 0, 1);
    ck_assert_double_eq(absorbed[0], 0);
    ck_assert_double_eq_tol(leaving[0] + F, 1, 1e-7); /* F is rounded to single precision */
    csr_free(&rows);
    mesh_free(&m);
    return F;
}

/* The outlines fall on the borders of pixels, whose weights are exact integrals: only rounding to single
 * precision is between the sum and the closed form. A triangle's centroid is rounded by 1e-11 besides. */
START_TEST(aligned_square_is_exact) {
    for (size_t r = 0; r < N_RESOLUTIONS; r++)
        for (int triangle = 0; triangle < 2; triangle++)
            ck_assert_double_eq_tol(seen_by_tiny((size_t)_i, triangle == 1, 0, resolutions[r]), views[_i].F,
                                    1e-7);
}
END_TEST

/* Turned, an outline cuts pixels. One that is cut by a straight line is wrong by at most half its weight,
 * which is at most h^2/(2 pi s^2) with h = 2/resolution and s = 1 + x^2 + y^2 on its face. An outline of arc
 * a is at most s a long there and cuts at most sqrt(2) s a/h + 1 pixels for each of its at most 12 straight
 * pieces (four edges, each on at most three faces). With s >= 1 the sum is (sqrt(2) a + 12 h) h/(2 pi). */
START_TEST(turned_square_within_its_outline) {
    double widest = 0;
    for (size_t r = 0; r < N_RESOLUTIONS; r++) {
        const double h = 2. / (double)resolutions[r];
        const double tolerance = (sqrt(2) * views[_i].arc + 12 * h) * h / (2 * M_PI);
        for (int step = 1; step < 12; step++) {
            const double F = seen_by_tiny((size_t)_i, false, step * M_PI / 6 + .1, resolutions[r]);
            ck_assert_double_eq_tol(F, views[_i].F, tolerance);
            widest = fmax(widest, fabs(F - views[_i].F));
        }
    }
    ck_assert_double_gt(widest, 1e-6); /* the frame does turn with the element */
}
END_TEST

/* The back of a two-sided element looks down, its front sees nothing. */
START_TEST(backs_have_hemicubes_of_their_own) {
    const box_cell low = {.axis = 2, .level = -1, .from = {-.5, -.5, -1}, .to = {.5, .5, -1}};
    mesh m = {0};
    lam_error error = {0};
    double leaving[4], absorbed[4];
    add_tiny(&m, false, 0);
    mesh_add_cell(&m, &low, true);
    mesh_finish(&m, .5f);
    ck_assert_msg(mesh_make_two_sided(&m, &error) == LAM_OK, "%s", error.message);
    csr rows = trace_rows(&m, 64, leaving, absorbed);
    ck_assert_double_eq_tol(leaving[0], 1, 1e-12);
    ck_assert_double_eq_tol(csr_entry(&rows, 2, 1), views[0].F, 1e-7);
    ck_assert_double_eq(csr_entry(&rows, 2, 3), 0);
    csr_free(&rows);
    mesh_free(&m);
}
END_TEST

static form_factors make(const mesh *m, size_t resolution, bool reversed) {
    uint32_t *order = malloc(m->n * sizeof *order);
    form_factors f = {0};
    lam_error error = {0};
    const form_factor_options how = {.recipe = {.source = &source_hemicube, .resolution = resolution}};
    ck_assert_ptr_nonnull(order);
    for (size_t i = 0; i < m->n; i++) order[i] = (uint32_t)(reversed ? m->n - 1 - i : i);
    ck_assert_msg(form_factors_make(m, order, &how, &f, &error) == LAM_OK, "%s", error.message);
    free(order);
    return f;
}

START_TEST(hidden_plate_is_exactly_hidden) {
    const double whole[4] = {0, 1, 0, 1};
    mesh open = plates(NULL), hidden = plates(whole);
    plates_move(&open, plates_places[_i][0], plates_places[_i][1]);
    plates_move(&hidden, plates_places[_i][0], plates_places[_i][1]);
    form_factors one = make(&open, 128, false), other = make(&hidden, 128, false);
    /* Both centroids see the same; single precision and the repair to 1e-7 are between. */
    ck_assert_double_eq_tol(csr_entry(&one.F, 0, 1), views[0].F, 1e-6);
    ck_assert(!one.closed);
    ck_assert_double_eq(csr_entry(&other.F, 0, 1), 0);
    ck_assert_double_eq(csr_entry(&other.F, 1, 0), 0);
    ck_assert_double_gt(csr_entry(&other.F, 0, 3), 0);
    form_factors_free(&one);
    form_factors_free(&other);
    mesh_free(&open);
    mesh_free(&hidden);
}
END_TEST

START_TEST(closed_box_keeps_the_invariants) {
    const double size[3] = {1, 2, 3};
    mesh m = box_mesh(size, 4, .5f);
    form_factors f = make(&m, 64, false);
    ck_assert_ptr_eq(f.recipe.source, &source_hemicube);
    ck_assert_uint_eq(f.recipe.resolution, 64);
    ck_assert_uint_eq(f.recipe.rays, 0);
    ck_assert(f.closed);
    ck_assert_double_le(f.reciprocity_error, 1e-6);
    for (size_t i = 0; i < m.n; i++) {
        double sum = 0;
        ck_assert_double_eq(f.leaving[i] + f.absorbed[i], 0);
        for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++) {
            const size_t j = f.F.indices[p];
            const double F = (double)f.F.data[p], back = csr_entry(&f.F, j, i);
            ck_assert_uint_ne(i, j);
            ck_assert(F > 0 && F <= 1);
            ck_assert_double_le(fabs(m.area[i] * F - m.area[j] * back), 1e-6 * m.area[i] * F);
            sum += F;
        }
        ck_assert_double_eq_tol(sum, 1, 1e-6);
        ck_assert_double_eq_tol(f.row_sums[i], sum, 1e-12);
    }
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

START_TEST(same_bits_for_any_threads_and_order) {
    const double size[3] = {2, 1, 1};
    mesh m = box_mesh(size, 4, .5f);
    omp_set_num_threads(1);
    form_factors one = make(&m, 50, false);
    omp_set_num_threads(2);
    form_factors two = make(&m, 50, true);
    const uint64_t nnz = one.F.indptr[m.n];
    ck_assert_mem_eq(one.F.indptr, two.F.indptr, (m.n + 1) * sizeof *one.F.indptr);
    ck_assert_mem_eq(one.F.indices, two.F.indices, nnz * sizeof *one.F.indices);
    ck_assert_mem_eq(one.F.data, two.F.data, nnz * sizeof *one.F.data);
    ck_assert_mem_eq(one.row_sums, two.row_sums, m.n * sizeof *one.row_sums);
    form_factors_free(&one);
    form_factors_free(&two);
    mesh_free(&m);
}
END_TEST

static bool stop_at_once(void *context) {
    (void)context;
    return true;
}

START_TEST(bad_requests_are_refused) {
    static const size_t bad[] = {0, 2, 5, 33, 4095, 4098, SIZE_MAX};
    mesh m = plates(NULL);
    const uint32_t order[2] = {0, 1};
    form_factors f = {0};
    lam_error error = {0};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const form_factor_options how = {.recipe = {.source = &source_hemicube, .resolution = bad[k]}};
        ck_assert_int_eq(form_factors_make(&m, order, &how, &f, &error), LAM_ERR_ARGUMENT);
    }
    const progress cancelled = {.cancelled = stop_at_once};
    const form_factor_options how = {.recipe = {.source = &source_hemicube, .resolution = 32},
                                     .progress = &cancelled};
    ck_assert_int_eq(form_factors_make(&m, order, &how, &f, &error), LAM_ERR_CANCELLED);
    ck_assert_ptr_null(f.F.indptr);
    mesh_free(&m);
}
END_TEST

/* Rows of form_factors_some_rows: one for each chosen element, as long as was counted. In a closed box their
 * entries sum to 1. Those by 64 rays are whole numbers of rays; those of a hemicube are near the closed form,
 * from which they differ as one point does from a mean over an element. */
static void check_rows(const mesh *m, const recipe *how, const uint32_t *chosen, size_t count,
                       const size_t *seen) {
    csr rows = {0}, exact = box_form_factors((const double[3]){2, 1, 1}, 3, m->area);
    lam_error error = {0};
    size_t total = 0;
    ck_assert_msg(form_factors_some_rows(m, how, chosen, count, NULL, "some", &rows, &error) == LAM_OK, "%s",
                  error.message);
    ck_assert_int_eq(csr_check(&rows, rows.indptr[m->n], "rows", &error), LAM_OK);
    for (size_t k = 0; k < count; k++) {
        const size_t i = chosen[k];
        double sum = 0;
        ck_assert_uint_eq(rows.indptr[i + 1] - rows.indptr[i], seen[k]);
        total += seen[k];
        for (uint64_t p = rows.indptr[i]; p < rows.indptr[i + 1]; p++) {
            const double x = (double)rows.data[p], truth = csr_entry(&exact, i, rows.indices[p]);
            sum += x;
            if (recipe_source(how) == &source_rays)
                ck_assert_double_eq_tol(x * 64, round(x * 64), 1e-9);
            else
                ck_assert_double_eq_tol(x, truth, .02);
        }
        ck_assert_double_eq_tol(sum, 1, 1e-5);
    }
    ck_assert_uint_eq(rows.indptr[m->n], total);
    csr_free(&rows);
    csr_free(&exact);
}

/* form_factors_count_seen of some rows in any order agrees with the one-sided rows of all elements. */
START_TEST(some_rows_are_those_of_all) {
    mesh m = box_mesh((const double[3]){2, 1, 1}, 3, .5f);
    const recipe ways[] = {{.source = &source_hemicube, .resolution = 32},
                           {.source = &source_rays, .rays = 64, .seed = 5},
                           {.source = &source_pairs}};
    const uint32_t chosen[] = {40, 3, 17, 0};
    enum { CHOSEN = sizeof chosen / sizeof *chosen };
    lam_error error = {0};
    uint32_t order[54];
    for (uint32_t i = 0; i < 54; i++) order[i] = i;
    ck_assert_uint_eq(m.n, 54);
    for (size_t w = 0; w < 2; w++) {
        size_t all[54], some[CHOSEN];
        ck_assert_msg(form_factors_count_seen(&m, &ways[w], order, 54, NULL, "all", all, &error) == LAM_OK,
                      "%s", error.message);
        ck_assert_msg(form_factors_count_seen(&m, &ways[w], chosen, CHOSEN, NULL, "some", some, &error) ==
                          LAM_OK,
                      "%s", error.message);
        for (size_t k = 0; k < CHOSEN; k++) ck_assert_uint_eq(some[k], all[chosen[k]]);
        check_rows(&m, &ways[w], chosen, CHOSEN, some);
        if (w == 0) /* all but its own wall, nine elements, and every one is larger than a pixel */
            for (size_t i = 0; i < 54; i++) ck_assert_uint_eq(all[i], 45);
    }
    size_t none[CHOSEN];
    ck_assert_int_eq(form_factors_count_seen(&m, &ways[2], chosen, CHOSEN, NULL, "none", none, &error),
                     LAM_ERR_ARGUMENT);
    ck_assert_int_eq(form_factors_count_seen(&m, &ways[0], chosen, 0, NULL, "none", none, &error),
                     LAM_ERR_ARGUMENT);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("hemicube");
    TCase *cases = tcase_create("hemicube");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, weights_sum_to_one);
    tcase_add_test(cases, weights_follow_the_densities);
    tcase_add_loop_test(cases, aligned_square_is_exact, 0, N_VIEWS);
    tcase_add_loop_test(cases, turned_square_within_its_outline, 0, N_VIEWS);
    tcase_add_test(cases, backs_have_hemicubes_of_their_own);
    tcase_add_loop_test(cases, hidden_plate_is_exactly_hidden, 0,
                        sizeof plates_places / sizeof *plates_places);
    tcase_add_test(cases, closed_box_keeps_the_invariants);
    tcase_add_test(cases, same_bits_for_any_threads_and_order);
    tcase_add_test(cases, some_rows_are_those_of_all);
    tcase_add_test(cases, bad_requests_are_refused);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
