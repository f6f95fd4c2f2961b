/* The measures that decide the kind of an operator: rows of inverses, how much of them may go, and the
 * choice. */
#include "solver/base/random.h"
#include "solver/method/choice.h"
#include "solver/method/reference.h"
#include "solver/method/sparse/sparse_inverse.h"
#include "support/box_problem.h"
#include "support/building.h"

#include <math.h>
#include <string.h>

/* A room whose elements reflect unlike, some not at all. */
static fixture uneven_room(void) {
    fixture f = fixture_box(room, 4, .5f);
    for (size_t i = 0; i < f.m.n; i++) f.m.reflectance[i] = i % 7 == 0 ? 0 : .3f + .1f * (float)(i % 5);
    return f;
}

/* Rows against columns of the inverse by LU in double. A row of what does not reflect is kept as if it did.
 * Allowed is what conjugate gradients to 1e-5 leave, of the largest entry. */
START_TEST(rows_are_those_of_the_inverse) {
    fixture f = uneven_room();
    const build_problem *p = problem_of(&f);
    const size_t n = p->n;
    lam_error error = {0};
    inverse_rows rows;
    reference *r = NULL;
    double *E = calloc(n * n, sizeof *E), *B = calloc(n * n, sizeof *B), *H = calloc(n * n, sizeof *H);
    for (size_t j = 0; j < n; j++) E[j * n + j] = 1;
    ck_assert_msg(inverse_rows_find(p, p->reflectance, NULL, &rows, &error) == LAM_OK, "%s", error.message);
    ck_assert_int_eq(reference_create(p->F, p->area, p->reflectance, REFERENCE_DENSE, &r, &error), LAM_OK);
    ck_assert_int_eq(reference_solve(r, n, E, B, 0, NULL, &error), LAM_OK);
    for (size_t j = 0; j < n; j++) csr_multiply_rows(p->F, 0, n, 1, B + j * n, H + j * n);
    double square = 0;
    for (size_t k = 0; k < rows.count; k++) {
        const size_t i = p->order[k * n / rows.count];
        for (size_t position = 0; position < n; position++) {
            const size_t j = p->order[position];
            const double rho = f.m.reflectance[i] > 0 ? (double)f.m.reflectance[i] : 1;
            const double truth = rho * H[j * n + i];
            square += truth * truth;
            ck_assert_double_eq_tol((double)rows.rows[k * n + position], truth, 1e-5);
        }
    }
    ck_assert_double_eq_tol(rows.square, square, 1e-4 * square);
    inverse_rows_free(&rows);
    reference_destroy(r);
    free(E);
    free(B);
    free(H);
    fixture_free(&f);
}
END_TEST

/* All thresholds between nothing kept and all of it; a sparse inverse leaves out more than what is small in
 * the end, and its entries are counted as they are. */
START_TEST(samples_tell_of_the_whole) {
    fixture f = uneven_room();
    const build_problem *p = problem_of(&f);
    lam_error error = {0};
    inverse_rows rows;
    sparse_sample made, last = {.entries = 0, .single = 2, .everywhere = 2};
    ck_assert_int_eq(inverse_rows_find(p, p->reflectance, NULL, &rows, &error), LAM_OK);
    const sparse_sample none = inverse_rows_truncated(&rows, 10), all = inverse_rows_truncated(&rows, 0);
    ck_assert_double_eq(none.entries, 0);
    ck_assert_double_eq_tol(none.single, 1, 1e-9);
    ck_assert_double_eq_tol(none.everywhere, 1, 1e-9);
    ck_assert_double_eq_tol(all.entries, (double)(p->n * p->n), 1e-6 * (double)(p->n * p->n));
    ck_assert_double_eq(all.single, 0);
    for (double threshold = .1; threshold > 1e-9; threshold /= 10) {
        const sparse_sample cut = inverse_rows_truncated(&rows, threshold);
        ck_assert_int_eq(sparse_inverse_sample(p, p->reflectance, &(sparse_limits){threshold, false}, &rows,
                                               &made, &error),
                         LAM_OK);
        ck_assert_double_le(made.entries, cut.entries);
        ck_assert_double_ge(made.single, cut.single - 1e-6);
        ck_assert_double_ge(made.everywhere, cut.everywhere - 1e-6);
        ck_assert_double_ge(made.entries, last.entries);
        ck_assert_double_le(made.single, last.single + 1e-6);
        last = made;
    }
    ck_assert_double_le(last.single, 1e-4);
    ck_assert_double_le(last.everywhere, 1e-4);
    sparse_inverse whole;
    double entries;
    ck_assert_int_eq(
        sparse_inverse_rows(p, p->reflectance, &(sparse_limits){1e-2, false}, 0, NULL, &whole, &error),
        LAM_OK);
    ck_assert_int_eq(
        sparse_inverse_sample(p, p->reflectance, &(sparse_limits){1e-2, false}, &rows, &made, &error),
        LAM_OK);
    entries = (double)whole.M.indptr[p->n];
    ck_assert_double_eq_tol(made.entries, entries, .2 * entries); /* a third of the rows, in order */
    sparse_inverse_free(&whole);
    inverse_rows_free(&rows);
    fixture_free(&f);
}
END_TEST

enum { N = 1200, EACH = 330 };

/* F of N like elements: one neighbour takes the share near of what each sees, and as many others as each
 * says, met at random in pairs, take the rest alike. */
static fixture random_pairs(size_t each, float near) {
    fixture f = {.m = {.n = N, .n_channels = 1}};
    float *dense = calloc((size_t)N * N, sizeof *dense);
    uint64_t state = 7;
    uint32_t partner[N];
    for (size_t i = 0; i < N; i++) dense[i * N + (i ^ 1u)] = near;
    for (size_t round = 0; round < each; round++) {
        for (uint32_t i = 0; i < N; i++) partner[i] = i;
        for (size_t i = N - 1; i > 0; i--) {
            const size_t j = (size_t)(random_lcg(&state) >> 33) % (i + 1);
            const uint32_t swap = partner[i];
            partner[i] = partner[j];
            partner[j] = swap;
        }
        for (size_t i = 0; i + 1 < N; i += 2) {
            dense[(size_t)partner[i] * N + partner[i + 1]] += (1 - near) / (float)each;
            dense[(size_t)partner[i + 1] * N + partner[i]] += (1 - near) / (float)each;
        }
    }
    lam_error error = {0};
    size_t entries = 0;
    for (size_t k = 0; k < (size_t)N * N; k++) entries += dense[k] > 0;
    f.F = (csr){.n = N, .indptr = calloc(N + 1, sizeof *f.F.indptr)};
    ck_assert_int_eq(csr_reserve(&f.F, entries, &error), LAM_OK);
    f.order = malloc(N * sizeof *f.order);
    f.m.area = malloc(N * sizeof *f.m.area);
    f.m.reflectance = malloc(N * sizeof *f.m.reflectance);
    for (size_t i = 0; i < N; i++) {
        f.F.indptr[i + 1] = f.F.indptr[i];
        for (size_t j = 0; j < N; j++) {
            if (!(dense[i * N + j] > 0)) continue;
            f.F.indices[f.F.indptr[i + 1]] = (uint32_t)j;
            f.F.data[f.F.indptr[i + 1]++] = dense[i * N + j];
        }
        f.order[i] = (uint32_t)i;
        f.m.area[i] = 1;
        f.m.reflectance[i] = .5f;
    }
    free(dense);
    return f;
}

static decision chosen(const build_problem *problem, const build_options *options, bool thorough) {
    lam_error error = {0};
    decision d;
    ck_assert_msg(choose_method(problem, options, thorough, &d, &error) == LAM_OK, "%s", error.message);
    printf("%s: %s\n", d.taken->method->name, d.reason);
    ck_assert(d.final && d.reason[0] != '\0');
    return d;
}

static double cost(const decision *d, const char *method) {
    return decision_find(d, method)->cost;
}

/* The four corners of the map. A box: dense, and smooth. */
START_TEST(a_box_is_of_low_rank) {
    fixture f = fixture_box(unit_cube, 15, .5f);
    const build_options how = build_presets("auto");
    decision d = chosen(problem_of(&f), &how, false);
    ck_assert_str_eq(d.taken->method->name, "low-rank");
    ck_assert_double_gt(d.density, .5);
    ck_assert_double_lt(decision_figure(&d, "rank", "estimate", -1),
                        .5 * (double)f.m.n); /* else the whole inverse is smaller */
    ck_assert_double_lt(decision_figure(&d, "sparse", "entries", -1), 0); /* F is too dense: not looked at */
    decision_free(&d);
    fixture_free(&f);
}
END_TEST

/* Each sees one other: 2 n numbers, and every singular value is 1. */
START_TEST(pairs_are_sparse) {
    fixture f = random_pairs(1, 0);
    const build_options how = build_presets("auto");
    decision d = chosen(problem_of(&f), &how, false);
    ck_assert_str_eq(d.taken->method->name, "sparse");
    ck_assert_double_eq_tol(decision_figure(&d, "rank", "estimate", -1), N, 1e-3 * N);
    ck_assert_double_eq_tol(decision_figure(&d, "sparse", "entries", -1), 2 * N,
                            1e-6 * N); /* it and, by way of it, itself */
    ck_assert_double_gt(decision_figure(&d, "sparse", "threshold", -1), 0);
    ck_assert_double_eq(cost(&d, "sparse"), 4 * decision_figure(&d, "sparse", "entries", -1));
    decision_free(&d);
    fixture_free(&f);
}
END_TEST

/* Half of the light comes in crumbs. Without them single elements are right to .1, the crumbs' 1 / sqrt(100)
 * of the other half, but light from everywhere lacks a half: they must stay, and nothing is sparse. */
START_TEST(crumbs_that_add_up_are_kept) {
    fixture f = random_pairs(100, .5f);
    const build_options how = options_with("auto", .15);
    decision d = chosen(problem_of(&f), &how, false);
    ck_assert(decision_figure(&d, "sparse", "entries", -1) < 0 ||
              decision_figure(&d, "sparse", "entries", -1) > 100. * N);
    decision_free(&d);
    fixture_free(&f);
}
END_TEST

/* A quarter of all others, without order: neither. Their singular values lie within 2 / sqrt(EACH) = .11 (the
 * semicircle law), and most of them above .035. */
START_TEST(noise_is_neither) {
    fixture f = random_pairs(EACH, 0);
    build_options how = build_presets("auto");
    decision d = chosen(problem_of(&f), &how, false);
    ck_assert_str_eq(d.taken->method->name, "exact");
    const double x = .035 / (2 / sqrt(EACH)),
                 above = 1 - 2 / M_PI * (x * sqrt(1 - x * x) + asin(x)); /* of the semicircle */
    ck_assert_double_eq_tol(decision_figure(&d, "rank", "estimate", -1), above * N, .06 * N);
    how.memory = N * N; /* bytes: a quarter of the whole inverse */
    decision_free(&d);
    d = chosen(problem_of(&f), &how, false);
    ck_assert(!isfinite(cost(&d, "exact")));
    ck_assert_str_eq(d.taken->method->name, "low-rank");
    decision_free(&d);
    fixture_free(&f);
}
END_TEST

static void add_entry(csr *F, size_t row, size_t column, float value) {
    F->indices[F->indptr[row + 1]] = (uint32_t)column;
    F->data[F->indptr[row + 1]++] = value;
}

/* Groups that see one other group each, of rank GROUPS and few entries: low rank is cheapest, but no rival of
 * a hierarchical operator, which places that say nothing of who sees whom make a large one; a sparse inverse
 * is. A look at all of it ends as the short one does. */
START_TEST(low_rank_is_no_rival) {
    enum { GROUPS = 20, OF_GROUP = N / GROUPS };
    fixture f = {.m = {.n = N, .n_channels = 1}};
    lam_error error = {0};
    double(*centre)[3] = calloc(N, sizeof *centre);
    float(*normal)[3] = calloc(N, sizeof *normal);
    uint64_t state = 11;
    f.F = (csr){.n = N, .indptr = calloc(N + 1, sizeof *f.F.indptr)};
    ck_assert_int_eq(csr_reserve(&f.F, (size_t)N * OF_GROUP + GROUPS, &error), LAM_OK);
    f.order = malloc(N * sizeof *f.order);
    f.m.area = malloc(N * sizeof *f.m.area);
    f.m.reflectance = malloc(N * sizeof *f.m.reflectance);
    for (size_t i = 0; i < N; i++) {
        const size_t group = i / OF_GROUP;
        const bool first = i % OF_GROUP == 0;
        f.F.indptr[i + 1] = f.F.indptr[i];
        /* A trace of light joins pairs of groups, so that the scene is one part. */
        if (first && group % 2 == 0 && group > 0) add_entry(&f.F, i, (group - 1) * OF_GROUP, 1e-6f);
        for (size_t k = 0; k < OF_GROUP; k++) add_entry(&f.F, i, (group ^ 1) * OF_GROUP + k, 1.f / OF_GROUP);
        if (first && group % 2 == 1 && group + 1 < GROUPS) add_entry(&f.F, i, (group + 1) * OF_GROUP, 1e-6f);
        f.order[i] = (uint32_t)i;
        f.m.area[i] = 1;
        f.m.reflectance[i] = .5f;
        normal[i][2] = 1;
        for (int d = 0; d < 2; d++) centre[i][d] = (double)(random_lcg(&state) >> 40);
    }
    build_problem p = *problem_of(&f);
    p.centre = (const double(*)[3])centre;
    p.normal = (const float(*)[3])normal;
    const build_options how = build_presets("auto");
    decision brief = chosen(&p, &how, false), whole = chosen(&p, &how, true);
    ck_assert_double_lt(cost(&whole, "low-rank"), cost(&whole, "sparse"));
    ck_assert_double_lt(cost(&whole, "sparse"), cost(&whole, "hierarchical"));
    ck_assert_str_eq(brief.taken->method->name, "sparse");
    ck_assert_str_eq(whole.taken->method->name, "sparse");
    decision_free(&brief);
    decision_free(&whole);
    free(centre);
    free(normal);
    fixture_free(&f);
}
END_TEST

START_TEST(a_threshold_that_is_given_stays) {
    fixture f = random_pairs(1, 0);
    build_options how = build_presets("auto");
    set_number(&how, "threshold", 1e-3);
    decision d = chosen(problem_of(&f), &how, false);
    ck_assert_double_eq(decision_figure(&d, "sparse", "threshold", -1), 1e-3);
    ck_assert_double_gt(decision_figure(&d, "sparse", "entries", -1), 0);
    decision_free(&d);
    fixture_free(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("classify");
    TCase *cases = tcase_create("classify");
    tcase_set_timeout(cases, 240);
    tcase_add_test(cases, rows_are_those_of_the_inverse);
    tcase_add_test(cases, samples_tell_of_the_whole);
    tcase_add_test(cases, a_box_is_of_low_rank);
    tcase_add_test(cases, pairs_are_sparse);
    tcase_add_test(cases, crumbs_that_add_up_are_kept);
    tcase_add_test(cases, noise_is_neither);
    tcase_add_test(cases, low_rank_is_no_rival);
    tcase_add_test(cases, a_threshold_that_is_given_stays);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
