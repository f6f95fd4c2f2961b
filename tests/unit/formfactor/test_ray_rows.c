/* Rows that rays find as they are asked for: what both sides of each pair make together is what merging makes
 * of rows that are held. */
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/pairs/ray_rows.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/rows/upper.h"
#include "solver/formfactor/source.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/method/method.h"
#include "solver/method/reference.h"
#include "support/building.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <omp.h>

static lam_error error;

enum { CLOSED, CLOSED_NEAR, OPEN, OPEN_NEAR, CASES };
/* Operators are built in each; a sanitizer watches the same code in a closed and in an open one. */
#ifdef LAMBERT_FEW_CASES
enum { BUILT_FIRST = CLOSED_NEAR, BUILT_LAST = OPEN_NEAR };
#else
enum { BUILT_FIRST = CLOSED, BUILT_LAST = CASES };
#endif

/* A scene and how its form factors are found. */
typedef struct subject {
    mesh m;
    uint32_t *order;
    form_factor_options how;
    ray_rows *rays;
    row_stream stream;
} subject;

/* Makes the subject in place, as the rows know where the mesh is. */
static void subject_make(int which, size_t elements, const char *sky, subject *to) {
    const bool open = which == OPEN || which == OPEN_NEAR, near = which == CLOSED_NEAR || which == OPEN_NEAR;
    const generate_options how = {.kind = open ? "city" : "cornell",
                                  .closed = !open,
                                  .variant = 1,
                                  .terrain = "flat",
                                  .elements = elements,
                                  .reflectance = .6,
                                  .seed = 1};
    *to = (subject){.rays = NULL};
    ck_ok(scene_generated(&how, &to->m, &error));
    to->order = test_allocate(to->m.n, sizeof *to->order);
    ck_ok(mesh_z_order(&to->m, to->order, &error));
    to->how = (form_factor_options){.recipe = {.source = near ? &source_near_pairs : &source_rays,
                                               .rays = 320,
                                               .accuracy = near ? 7e-5 : 0,
                                               .seed = 5},
                                    .sky = sky};
    ck_ok(ray_rows_create(&to->m, &to->how, &to->rays, &error));
    ray_rows_stream(to->rays, 77, &to->stream);
}

static void subject_free(subject *s) {
    ray_rows_destroy(s->rays);
    mesh_free(&s->m);
    free(s->order);
}

/* A F1 + F1^T A, [n][n], of all rows; from the last or the first, by so many threads. */
static double *both_sides(subject *s, bool backwards, int n_threads) {
    const size_t n = s->m.n;
    double *G = test_allocate(n * n, sizeof *G);
#pragma omp parallel for schedule(dynamic, 5) num_threads(n_threads)
    for (size_t k = 0; k < n; k++) {
        const uint32_t i = s->order[backwards ? n - 1 - k : k];
        row_block rows;
        lam_error why;
        if (row_source_get(&s->stream.rows, &i, 1, &rows, &why) != LAM_OK) abort();
#pragma omp critical
        for (size_t e = 0; e < rows.length[0]; e++) {
            const uint32_t j = rows.indices[0][e];
            const double g = s->m.area[i] * (double)rows.data[0][e];
            G[i * n + j] += g;
            G[j * n + i] += g;
        }
        row_block_free(&rows);
    }
    return G;
}

/* The merged upper triangle of held rows with near pairs replaced, before the repair. */
static double *merged(const subject *s) {
    const size_t n = s->m.n;
    const recipe *r = &s->how.recipe;
    double *G = test_allocate(n * n, sizeof *G), *out = test_allocate(2 * n, sizeof *out);
    visibility *v;
    packed_rows counts = {0};
    csr upper, near;
    ck_ok(visibility_create(&s->m, &v, &error));
    ck_ok(rays_count(&s->m, v, s->order, &s->how, &counts, out, out + n, &error));
    ck_ok(upper_merge(&counts, r->rays, s->m.area, NULL, &upper, &error));
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = upper.indptr[i]; e < upper.indptr[i + 1]; e++)
            G[i * n + upper.indices[e]] = G[upper.indices[e] * n + i] = (double)upper.data[e];
    if (recipe_source(r) == &source_near_pairs) {
        form_factors f = {.recipe = *r};
        ck_ok(pairs_find(&s->m, v, &s->how, recipe_near(r), &f, &near, &error));
        ck_assert_uint_gt(near.indptr[n], n);
        for (size_t i = 0; i < n; i++)
            for (uint64_t e = near.indptr[i]; e < near.indptr[i + 1]; e++)
                G[i * n + near.indices[e]] = G[near.indices[e] * n + i] = (double)near.data[e];
        csr_free(&near);
        form_factors_free(&f);
    }
    csr_free(&upper);
    packed_rows_free(&counts);
    visibility_destroy(v);
    free(out);
    return G;
}

START_TEST(both_sides_are_what_is_merged) {
    subject s, again;
    subject_make(_i, 500, NULL, &s);
    subject_make(_i, 500, NULL, &again);
    const size_t n = s.m.n;
    double *G = both_sides(&s, false, 1), *held = merged(&s), worst = 0, largest = 0;
    for (size_t k = 0; k < n * n; k++) {
        worst = fmax(worst, fabs(G[k] - held[k]));
        largest = fmax(largest, held[k]);
    }
    ck_assert_double_lt(worst, 1e-6 * largest);
    /* Closed, they are what form factors are: the same in any sequence. */
    const double *sums, *sums_again;
    double *other = both_sides(&again, true, 3);
    ck_ok(s.stream.close(s.stream.context, &sums, &error));
    ck_ok(again.stream.close(again.stream.context, &sums_again, &error));
    ck_assert_mem_eq(sums, sums_again, n * sizeof *sums);
    form_factors f, closed = ray_rows_take(s.rays);
    ck_ok(form_factors_make(&s.m, s.order, &s.how, &f, &error));
    ck_assert_mem_eq(closed.leaving, f.leaving, n * sizeof *f.leaving);
    ck_assert_mem_eq(closed.absorbed, f.absorbed, n * sizeof *f.absorbed);
    ck_assert_int_eq(closed.closed, f.closed);
    ck_assert_double_eq_tol(closed.repair_mean, f.repair_mean, 1e-6);
    double apart = 0, total = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        total += s.m.area[i];
        for (size_t j = 0; j < n; j++) sum += G[i * n + j];
        ck_assert(fabs(closed.repair[i] - f.repair[i]) < 1e-5);
        ck_assert(closed.row_sums[i] >= 0 && closed.row_sums[i] < 1 + 1e-12);
        if (f.closed) ck_assert(fabs(closed.row_sums[i] - 1) < 1e-12);
        if (!f.closed && sum > 0)
            ck_assert(fabs(closed.row_sums[i] / (1 - closed.row_sums[i]) -
                           sum / s.m.area[i] / (f.leaving[i] + f.absorbed[i])) <
                      1e-6 * (1 + closed.row_sums[i] / (1 - closed.row_sums[i])));
        apart += s.m.area[i] * fabs(closed.row_sums[i] - f.row_sums[i]);
    }
    /* Held rows are scaled until all of them close; one step is not far from that. */
    ck_assert_double_lt(apart, .02 * total);
    form_factors_free(&f);
    form_factors_free(&closed);
    free(G);
    free(held);
    free(other);
    subject_free(&s);
    subject_free(&again);
}
END_TEST

/* Other rows estimate the same F: alike on average, with the same sums, and by other rays. */
START_TEST(other_rows_are_another_sample) {
    subject s;
    subject_make(_i, 500, NULL, &s);
    const size_t n = s.m.n;
    const double *sums;
    double *G = both_sides(&s, false, 2), product = 0, own = 0, others = 0;
    size_t same = 0, there = 0;
    row_block rows;
    ck_ok(s.stream.close(s.stream.context, &sums, &error));
    ck_ok(row_source_get(&s.stream.others, s.order, n, &rows, &error));
    double *row = test_allocate(n, sizeof *row);
    for (size_t k = 0; k < n; k++) {
        const uint32_t i = s.order[k];
        double sum = 0;
        memset(row, 0, n * sizeof *row);
        for (size_t e = 0; e < rows.length[k]; e++) {
            row[rows.indices[k][e]] += (double)rows.data[k][e];
            sum += (double)rows.data[k][e];
        }
        if (rows.length[k] > 0) ck_assert(fabs(sum - sums[i]) < 1e-5);
        for (size_t j = 0; j < n; j++) {
            const double g = G[i * n + j] / s.m.area[i];
            product += g * row[j];
            own += g * g;
            others += row[j] * row[j];
            same += g > 0 && fabs(g - row[j]) < 1e-7;
            there += g > 0;
        }
    }
    ck_assert_double_gt(product / sqrt(own * others), .8);
    if (_i == CLOSED || _i == OPEN) ck_assert_uint_lt(same, there / 20);
    row_block_free(&rows);
    free(row);
    free(G);
    subject_free(&s);
}
END_TEST

/* Of a sky each element gets what held rows say, and together no more than there is. */
START_TEST(a_sky_is_shared_out) {
    subject s;
    subject_make(OPEN, 400, "reinhart:1", &s);
    const size_t n = s.m.n;
    const double *sums;
    form_factors f;
    free(both_sides(&s, false, 2));
    ck_ok(s.stream.close(s.stream.context, &sums, &error));
    form_factors closed = ray_rows_take(s.rays);
    ck_ok(form_factors_make(&s.m, s.order, &s.how, &f, &error));
    const size_t tiles = closed.sky.tiling.n_tiles;
    ck_assert_uint_eq(tiles, f.sky.tiling.n_tiles);
    double apart = 0, all = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = closed.row_sums[i];
        for (size_t t = 0; t < tiles; t++) {
            const double one = (double)closed.sky.first_bounce[t * n + i],
                         held = (double)f.sky.first_bounce[t * n + i];
            sum += one / 3.14159265358979;
            apart += s.m.area[i] * fabs(one - held);
            all += s.m.area[i] * held;
        }
        ck_assert(sum < 1 + 1e-5);
    }
    ck_assert_double_gt(all, 0);
    ck_assert_double_lt(apart, .02 * all);
    form_factors_free(&f);
    form_factors_free(&closed);
    subject_free(&s);
}
END_TEST

START_TEST(pairs_do_not_come_row_by_row) {
    subject s;
    subject_make(CLOSED, 100, NULL, &s);
    ray_rows *none = NULL;
    form_factor_options how = s.how;
    how.recipe = (recipe){.source = &source_pairs, .rays = 256, .accuracy = 7e-5};
    ck_assert_int_eq(ray_rows_create(&s.m, &how, &none, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "pairs"));
    ck_assert_ptr_null(none);
    ray_rows_destroy(none);
    subject_free(&s);
}
END_TEST

/* |B~ - B| / |B - E| of some lights, against a solution by form factors of far more rays. */
static double indirect_error(const build_problem *problem, reference *truth, const lam_operator *op,
                             size_t light) {
    const size_t n = problem->n, bytes = lam_operator_work_bytes(op, 1);
    double *e = test_allocate(n, sizeof *e), *B = test_allocate(n, sizeof *B), wrong = 0, all = 0;
    float *E = test_allocate(n, sizeof *E), *out = test_allocate(n, sizeof *out);
    void *work = test_allocate(1, bytes);
    for (size_t i = 0; i < n; i++) {
        e[i] = light == 0 ? (double)(i % 7) : i >= light * n / 8 && i < light * n / 8 + 12 ? 1 : 0;
        E[i] = (float)e[i];
    }
    ck_ok(reference_solve(truth, 1, e, B, 1e-12, NULL, &error));
    ck_ok(lam_operator_apply(op, 1, LAM_RADIOSITY, E, out, work, bytes, &error));
    for (size_t i = 0; i < n; i++) {
        wrong += problem->area[i] * ((double)out[i] - B[i]) * ((double)out[i] - B[i]);
        all += problem->area[i] * (B[i] - e[i]) * (B[i] - e[i]);
    }
    free(e);
    free(B);
    free(E);
    free(out);
    free(work);
    return sqrt(wrong / all);
}

/* An operator of rows that nobody held is as near as one of rows that were. */
START_TEST(operators_are_as_good) {
    subject s;
    subject_make(_i, 900, NULL, &s);
    const size_t n = s.m.n;
    form_factor_options finer = s.how;
    form_factors held, fine;
    build_report reports[2];
    reference *truth = NULL;
    lam_operator *ops[2] = {NULL, NULL};
    double(*centre)[3] = test_allocate(n, sizeof *centre), sums[2] = {0, 0};
    float *rho = test_allocate(n, sizeof *rho);
    finer.recipe = (recipe){.source = &source_pairs, .rays = 4096, .accuracy = 7e-5, .seed = 9};
    ck_ok(form_factors_make(&s.m, s.order, &s.how, &held, &error));
    ck_ok(form_factors_make(&s.m, s.order, &finer, &fine, &error));
    for (size_t i = 0; i < n; i++) mesh_centroid(&s.m, i, centre[i]);
    for (size_t i = 0; i < n; i++) rho[i] = .6f;
    build_options options = options_with("hierarchical", .02);
    options.seed = 4;
    build_problem problem = {.n = n,
                             .n_channels = 1,
                             .area = s.m.area,
                             .reflectance = rho,
                             .F = &held.F,
                             .order = s.order,
                             .noise = recipe_noise(&s.how.recipe),
                             .centre = (const double(*)[3])centre,
                             .normal = (const float(*)[3])s.m.normal};
    ck_ok(build_operator(&problem, &options, &ops[0], &reports[0], &error));
    problem.F = NULL;
    problem.stream = &s.stream;
    ck_ok(build_operator(&problem, &options, &ops[1], &reports[1], &error));
    ck_ok(reference_create(&fine.F, s.m.area, rho, REFERENCE_DENSE, &truth, &error));
    for (size_t light = 0; light < 8; light++)
        for (int k = 0; k < 2; k++) sums[k] += indirect_error(&problem, truth, ops[k], light);
    ck_assert_msg(sums[1] < 1.1 * sums[0], "%g of streamed rows, %g of held ones", sums[1] / 8, sums[0] / 8);
    /* One even light is exact as it was put there; other rows have their own noise. */
    ck_assert_double_lt(report_get(&reports[1], "uniform_error", -1), _i < OPEN ? 2e-6 : 1e-3);
    ck_assert_double_lt(report_get(&reports[1], "probe_residual", -1), .1);
    ck_assert_double_gt(report_get(&reports[1], "probe_residual", -1), 0);
    reference_destroy(truth);
    lam_operator_close(ops[0]);
    lam_operator_close(ops[1]);
    form_factors_free(&held);
    form_factors_free(&fine);
    free(centre);
    free(rho);
    subject_free(&s);
}
END_TEST

/* Methods that need rows at hand say so; auto takes the one that does not. */
START_TEST(only_one_method_does_with_a_stream) {
    subject s;
    subject_make(CLOSED, 300, NULL, &s);
    const size_t n = s.m.n;
    double(*centre)[3] = test_allocate(n, sizeof *centre);
    float *rho = test_allocate(n, sizeof *rho);
    for (size_t i = 0; i < n; i++) mesh_centroid(&s.m, i, centre[i]);
    const build_problem problem = {.n = n,
                                   .n_channels = 1,
                                   .area = s.m.area,
                                   .reflectance = rho,
                                   .order = s.order,
                                   .stream = &s.stream,
                                   .centre = (const double(*)[3])centre,
                                   .normal = (const float(*)[3])s.m.normal};
    build_options options = options_with("low-rank", .1);
    build_report report;
    lam_operator *op = NULL;
    ck_assert_int_eq(build_operator(&problem, &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "--method low-rank"));
    options.method = "auto";
    ck_ok(build_operator(&problem, &options, &op, &report, &error));
    ck_assert_str_eq(report.method, "hierarchical");
    ck_assert_ptr_nonnull(strstr(report.reason, "too large for the whole inverse"));
    lam_operator_close(op);
    free(centre);
    free(rho);
    subject_free(&s);
}
END_TEST

/* The share of the noise is that of all rows. Terms 2 A_i / (A_i + A_j) of 64 rays lie between 0 and 2, so
 * that the mean over n elements has a standard error of 1 / (64 n)^1/2 at most, .005 of 600. */
START_TEST(noise_is_known_before_the_rows) {
    subject s;
    subject_make(_i, 600, NULL, &s);
    const size_t n = s.m.n;
    double *G = both_sides(&s, false, 4), sum = 0;
    ck_assert_uint_ge(n, 500);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) sum += 2 * G[i * n + j] / (s.m.area[i] + s.m.area[j]) / (double)n;
    ck_assert_double_eq_tol(s.stream.noise_share * s.stream.noise_share, sum, 3 * .006);
    ck_assert(_i == OPEN || _i == OPEN_NEAR ? sum < .6 : sum > .95);
    free(G);
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("ray rows");
    TCase *tests = tcase_create("ray rows");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, both_sides_are_what_is_merged, 0, CASES);
    tcase_add_loop_test(tests, other_rows_are_another_sample, 0, CASES);
    tcase_add_loop_test(tests, noise_is_known_before_the_rows, 0, CASES);
    tcase_add_test(tests, a_sky_is_shared_out);
    tcase_add_test(tests, pairs_do_not_come_row_by_row);
    tcase_add_loop_test(tests, operators_are_as_good, BUILT_FIRST, BUILT_LAST);
    tcase_add_test(tests, only_one_method_does_with_a_stream);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
