/* Rows of terms: made by any number of threads, sorted by magnitude, summed up. */
#include "solver/base/random.h"
#include "solver/method/hierarchical/wavelet_terms.h"
#include "support/dense.h"
#include "support/suite.h"

#include <string.h>

/* More rows than a few blocks of them, the last block not full. */
enum { N = 1100, MOST = 40, SORTED_MOST = 3000 };

static lam_error error;

/* A symmetric matrix of up to MOST terms a row of its upper triangle. */
static double *random_matrix(uint64_t *state) {
    double *a = test_allocate((size_t)N * N, sizeof *a);
    for (size_t i = 0; i < N; i++)
        for (size_t k = 0; k < i % MOST; k++) {
            const size_t j = (size_t)(random_lcg_unit(state) * N);
            a[i * N + j] = a[j * N + i] = (double)(float)(random_lcg_unit(state) - .5);
        }
    return a;
}

/* Takes the row that is summed up as one of an output, and begins another. */
static lam_status take_row(row_work *w, size_t output, lam_error *e) {
    row_term *to = NULL;
    if (row_work_room(w, output, w->count, &to, e) != LAM_OK) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < w->count; k++) {
        to[k] = (row_term){w->columns[k], w->sums[w->columns[k]]};
        w->sums[w->columns[k]] = 0;
    }
    w->done[output].used += w->count;
    w->count = 0;
    return LAM_OK;
}

/* Row i of A in output 0, and of A A in output 1. */
typedef struct square {
    const double *a;
    size_t fails; /* at this row; N: nowhere */
} square;

static lam_status make_square(const void *context, size_t i, row_work *w, lam_error *e) {
    lam_status status = LAM_OK;
    const square *s = context;
    w->count = 0;
    if (i == s->fails) FAIL(e, LAM_ERR_NUMERIC, "row %zu", i);
    for (size_t j = 0; j < N; j++)
        if (s->a[i * N + j] != 0) row_work_add(w, (uint32_t)j, (float)s->a[i * N + j]);
    TRY(take_row(w, 0, e));
    for (size_t k = 0; k < N; k++)
        for (size_t j = 0; s->a[i * N + k] != 0 && j < N; j++)
            if (s->a[k * N + j] != 0)
                row_work_add(w, (uint32_t)j, (float)(s->a[i * N + k] * s->a[k * N + j]));
    TRY(take_row(w, 1, e));
done:
    return status;
}

static rows_pass pass_of(size_t n_threads, row_work *works, const square *s) {
    return (rows_pass){
        .n = N, .n_threads = n_threads, .n_outputs = 2, .works = works, .make = make_square, .context = s};
}

/* Each column of a row once, and every number of the dense matrix. */
static void compare(const term_rows *found, const double *truth, double tolerance) {
    double *row = test_allocate(N, sizeof *row);
    for (size_t i = 0; i < N; i++) {
        memset(row, 0, N * sizeof *row);
        for (size_t e = 0; e < found->length[i]; e++) {
            const row_term t = found->row[i][e];
            ck_assert_uint_lt(t.column, N);
            ck_assert(row[t.column] == 0 && t.value != 0);
            row[t.column] = (double)t.value;
        }
        for (size_t j = 0; j < N; j++) ck_assert_double_le(fabs(row[j] - truth[i * N + j]), tolerance);
    }
    free(row);
}

START_TEST(rows_are_those_of_any_threads) {
    const size_t n_threads[] = {1, 2, 5};
    uint64_t state = 3;
    double *a = random_matrix(&state), *aa = test_allocate((size_t)N * N, sizeof *aa);
    term_rows first[2];
    for (size_t i = 0; i < N; i++)
        for (size_t k = 0; k < N; k++)
            for (size_t j = 0; a[i * N + k] != 0 && j < N; j++) aa[i * N + j] += a[i * N + k] * a[k * N + j];
    const square s = {a, N};
    for (size_t t = 0; t < 3; t++) {
        row_work *works = NULL;
        term_rows found[2];
        ck_ok(row_works_make(N, n_threads[t], &works, &error));
        const rows_pass pass = pass_of(n_threads[t], works, &s);
        for (int again = 0; again < 2; again++) {
            ck_ok(term_rows_make(&pass, found, &error));
            compare(&found[0], a, 0);
            /* A sum of at most N products below 1/4 and its roundings of 2^-24. */
            compare(&found[1], aa, 6e-8 * N / 4);
            for (size_t o = 0; o < 2 && (t > 0 || again > 0); o++) {
                ck_assert_uint_eq(term_rows_count(&found[o]), term_rows_count(&first[o]));
                for (size_t i = 0; i < N; i++) {
                    ck_assert_uint_eq(found[o].length[i], first[o].length[i]);
                    if (found[o].length[i] > 0)
                        ck_assert_mem_eq(found[o].row[i], first[o].row[i],
                                         found[o].length[i] * sizeof(row_term));
                }
                term_rows_free(&found[o]);
            }
            if (t == 0 && again == 0) memcpy(first, found, sizeof first);
        }
        row_works_free(works, n_threads[t]);
    }
    for (size_t o = 0; o < 2; o++) term_rows_free(&first[o]);
    free(a);
    free(aa);
}
END_TEST

static bool always(void *context) {
    (void)context;
    return true;
}

START_TEST(a_pass_that_fails_leaves_its_outputs) {
    uint64_t state = 4;
    double *a = random_matrix(&state);
    row_work *works = NULL;
    term_rows found[2] = {{.n = 7}, {.n = 8}};
    square s = {a, 700};
    const progress stopped = {.cancelled = always};
    ck_ok(row_works_make(N, 2, &works, &error));
    rows_pass pass = pass_of(2, works, &s);
    ck_assert_int_eq(term_rows_make(&pass, found, &error), LAM_ERR_NUMERIC);
    ck_assert_str_eq(error.message, "row 700");
    s.fails = N;
    pass.progress = &stopped;
    ck_assert_int_eq(term_rows_make(&pass, found, &error), LAM_ERR_CANCELLED);
    ck_assert_uint_eq(found[0].n, 7);
    ck_assert_uint_eq(found[1].n, 8);
    pass.progress = NULL;
    ck_ok(term_rows_make(&pass, found, &error));
    compare(&found[0], a, 0);
    for (size_t o = 0; o < 2; o++) term_rows_free(&found[o]);
    row_works_free(works, 2);
    free(a);
}
END_TEST

/* Row i of A + B, of two matrices that are used up. */
typedef struct summed {
    const term_rows *a, *b;
    size_t fails;
} summed;

static lam_status make_sum(const void *context, size_t i, row_work *w, lam_error *e) {
    lam_status status = LAM_OK;
    const summed *s = context;
    w->count = 0;
    if (i == s->fails) FAIL(e, LAM_ERR_NUMERIC, "row %zu", i);
    for (size_t k = 0; k < s->a->length[i]; k++)
        row_work_add(w, s->a->row[i][k].column, s->a->row[i][k].value);
    for (size_t k = 0; k < s->b->length[i]; k++)
        row_work_add(w, s->b->row[i][k].column, s->b->row[i][k].value);
    TRY(take_row(w, 0, e));
done:
    return status;
}

/* Matrices that are used up are empty afterwards, and what is left of them after a failure can be freed. */
START_TEST(used_up_rows_are_freed) {
    uint64_t state = 6;
    double *a = random_matrix(&state), *sum = test_allocate((size_t)N * N, sizeof *sum);
    const square s = {a, N};
    for (size_t n_threads = 1; n_threads <= 3; n_threads += 2)
        for (int fails = 0; fails < 2; fails++) {
            row_work *works = NULL;
            term_rows from[2], found = {.n = 0};
            ck_ok(row_works_make(N, n_threads, &works, &error));
            const rows_pass first = pass_of(n_threads, works, &s);
            ck_ok(term_rows_make(&first, from, &error));
            for (size_t i = 0; i < (size_t)N * N; i++) sum[i] = 0;
            for (size_t i = 0; i < N; i++)
                for (int o = 0; o < 2; o++)
                    for (size_t k = 0; k < from[o].length[i]; k++)
                        sum[i * N + from[o].row[i][k].column] += (double)from[o].row[i][k].value;
            const summed both = {&from[0], &from[1], fails == 1 ? 700 : N};
            const rows_pass second = {.n = N,
                                      .n_threads = n_threads,
                                      .n_outputs = 1,
                                      .works = works,
                                      .make = make_sum,
                                      .context = &both,
                                      .spent = {&from[0], &from[1]}};
            ck_assert_int_eq(term_rows_make(&second, &found, &error), fails == 1 ? LAM_ERR_NUMERIC : LAM_OK);
            /* One rounding of a sum below N. */
            if (fails == 0) compare(&found, sum, 6e-8 * N);
            for (int o = 0; o < 2; o++)
                if (fails == 0) ck_assert_uint_eq(term_rows_count(&from[o]), 0);
            for (size_t k = 0; k < found.n_blocks; k++)
                for (int o = 0; o < 2; o++) ck_assert_ptr_null(from[o].blocks[k]);
            for (int o = 0; o < 2; o++) term_rows_free(&from[o]);
            term_rows_free(&found);
            row_works_free(works, n_threads);
        }
    free(a);
    free(sum);
}
END_TEST

/* A sum that cancels keeps its place and is not listed again. */
START_TEST(sums_that_cancel_are_listed_once) {
    row_work *works = NULL;
    ck_ok(row_works_make(4, 1, &works, &error));
    row_work_add(works, 2, 1.5f);
    row_work_add(works, 2, -1.5f);
    row_work_add(works, 0, 3);
    row_work_add(works, 2, .25f);
    ck_assert_uint_eq(works->count, 2);
    ck_assert_uint_eq(works->columns[0], 2);
    ck_assert_uint_eq(works->columns[1], 0);
    ck_assert(works->sums[2] == .25f && works->sums[0] == 3);
    row_works_free(works, 1);
}
END_TEST

START_TEST(terms_are_sorted_to_an_eighth) {
    uint64_t state = 5;
    row_term *from = test_allocate(SORTED_MOST, sizeof *from), *to = test_allocate(SORTED_MOST, sizeof *to);
    bool *seen = test_allocate(SORTED_MOST, sizeof *seen);
    for (size_t count = 0; count <= SORTED_MOST; count = count < 40 ? count + 1 : count * 3 / 2) {
        memset(seen, 0, SORTED_MOST * sizeof *seen);
        for (size_t k = 0; k < count; k++) {
            const double size = exp2(-30 * random_lcg_unit(&state));
            from[k] = (row_term){(uint32_t)k, (float)(random_lcg_unit(&state) < .5 ? size : -size)};
        }
        if (count > 20) from[7].value = 1e-30f, from[9].value = 0;
        row_terms_sort(count, from, to);
        for (size_t k = 0; k < count; k++) {
            ck_assert(!seen[to[k].column] && to[k].value == from[to[k].column].value);
            seen[to[k].column] = true;
            /* Eighths begin at 2^m (1 + p / 8), p < 8; the first is the widest. */
            if (k > 0 && fabsf(to[k].value) > 0x1p-30f)
                ck_assert_float_le(fabsf(to[k].value), 1.125f * fabsf(to[k - 1].value));
        }
    }
    free(from);
    free(to);
    free(seen);
}
END_TEST

/* Ascending columns; terms of one column, of which there are many, in their order. */
START_TEST(terms_are_sorted_by_column) {
    uint64_t state = 11;
    row_term *terms = test_allocate(SORTED_MOST, sizeof *terms);
    row_term *spare = test_allocate(SORTED_MOST, sizeof *spare);
    uint32_t *column = test_allocate(SORTED_MOST, sizeof *column);
    bool *seen = test_allocate(SORTED_MOST, sizeof *seen);
    for (size_t count = 0; count <= SORTED_MOST; count = count < 40 ? count + 1 : count * 3 / 2) {
        memset(seen, 0, SORTED_MOST * sizeof *seen);
        for (size_t k = 0; k < count; k++) {
            column[k] = (uint32_t)(random_lcg_unit(&state) * (double)count / 2);
            terms[k] = (row_term){column[k], (float)k};
        }
        row_terms_by_column(count, terms, spare);
        for (size_t k = 0; k < count; k++) {
            const size_t was = (size_t)terms[k].value;
            ck_assert(!seen[was] && column[was] == terms[k].column);
            seen[was] = true;
            if (k == 0) continue;
            ck_assert_uint_le(terms[k - 1].column, terms[k].column);
            if (terms[k - 1].column == terms[k].column) ck_assert(terms[k - 1].value < terms[k].value);
        }
    }
    free(terms);
    free(spare);
    free(column);
    free(seen);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet terms");
    TCase *tests = tcase_create("wavelet terms");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, rows_are_those_of_any_threads);
    tcase_add_test(tests, a_pass_that_fails_leaves_its_outputs);
    tcase_add_test(tests, used_up_rows_are_freed);
    tcase_add_test(tests, sums_that_cancel_are_listed_once);
    tcase_add_test(tests, terms_are_sorted_to_an_eighth);
    tcase_add_test(tests, terms_are_sorted_by_column);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
