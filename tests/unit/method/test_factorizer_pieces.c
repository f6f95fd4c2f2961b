/* The parts of factorizers: products with S, Gram matrices and their eigenvectors, bases. */
#include "solver/method/low_rank/gram.h"
#include "solver/method/low_rank/sketch.h"
#include "support/subject.h"

START_TEST(products_are_right) {
    subject s;
    lam_error error = {0};
    subject_make(&s, room, 4);
    enum { W = 20 };
    const size_t n = s.S.n;
    float *dense = malloc(n * n * sizeof *dense), *X = malloc(n * W * sizeof *X),
          *Y = malloc(n * W * sizeof *Y);
    double *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y);
    ck_assert_int_eq(scaled_dense(&s.S, dense, &error), LAM_OK);
    sketch_gaussian(3, n, W, X);
    for (int by_blas = 0; by_blas < 2; by_blas++) {
        s.rows.density = by_blas ? 1 : 0;
        ck_assert_int_eq(scaled_multiply(&s.S, W, X, Y, &error), LAM_OK);
        for (size_t v = 0; v < W; v++) {
            for (size_t i = 0; i < n; i++) x[i] = (double)X[i * W + v];
            ck_assert_int_eq(scaled_multiply_double(&s.S, x, y, &error), LAM_OK);
            for (size_t i = 0; i < n; i++) {
                double sum = 0;
                for (size_t j = 0; j < n; j++) sum += (double)dense[i * n + j] * x[j];
                ck_assert_double_eq_tol(y[i], sum, 1e-6);
                ck_assert_double_eq_tol((double)Y[i * W + v], sum, 1e-5);
            }
        }
    }
    sparse_block block = {0};
    ck_assert_int_eq(scaled_block(&s.S, 10, 30, &block, &error), LAM_OK);
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = block.indptr[i]; p < block.indptr[i + 1]; p++) {
            ck_assert(p == block.indptr[i] || block.columns[p] > block.columns[p - 1]);
            ck_assert_float_eq_tol(block.data[p], dense[i * n + 10 + block.columns[p]], 1e-7f);
        }
    sparse_block_free(&block);
    free(dense);
    free(X);
    free(Y);
    free(x);
    free(y);
    subject_free(&s);
}
END_TEST

/* Rows of a source that fails once element `bad` is asked for. */
typedef struct failing_rows {
    row_source *good;
    uint32_t bad;
} failing_rows;

static lam_status rows_or_failure(void *context, const uint32_t *elements, size_t m, row_block *out,
                                  lam_error *error) {
    const failing_rows *f = context;
    for (size_t k = 0; k < m; k++)
        if (elements[k] == f->bad) return status_fail(error, LAM_ERR_IO, "element %u", f->bad);
    return f->good->rows(f->good->context, elements, m, out, error);
}

/* A block of more columns than are read at once is in order, and a failure of any of its pieces is told. */
START_TEST(blocks_of_several_pieces) {
    subject s;
    lam_error error = {0};
    sparse_block block = {0};
    subject_make(&s, room, 8); /* 384 elements, pieces of 128 */
    const size_t n = s.S.n, first = 7, last = n - 3;
    float *dense = malloc(n * n * sizeof *dense);
    size_t entries = 0;
    ck_assert_int_eq(scaled_dense(&s.S, dense, &error), LAM_OK);
    ck_assert_int_eq(scaled_block(&s.S, first, last, &block, &error), LAM_OK);
    ck_assert_uint_eq(block.m, last - first);
    for (size_t i = 0; i < n; i++) {
        for (uint64_t p = block.indptr[i]; p < block.indptr[i + 1]; p++) {
            ck_assert(p == block.indptr[i] || block.columns[p] > block.columns[p - 1]);
            ck_assert_float_eq_tol(block.data[p], dense[i * n + first + block.columns[p]], 1e-7f);
        }
        for (size_t j = first; j < last; j++) entries += dense[i * n + j] != 0;
    }
    ck_assert_uint_eq(block.indptr[n], entries);
    sparse_block_free(&block);
    for (size_t at = first; at < last; at += 90) {
        failing_rows f = {&s.rows, s.S.order[at]};
        row_source bad = {.n = n, .rows = rows_or_failure, .context = &f};
        scaled_matrix S = s.S;
        S.rows = &bad;
        ck_assert_int_eq(scaled_block(&S, first, last, &block, &error), LAM_ERR_IO);
        ck_assert_ptr_null(block.data);
        char expected[32];
        snprintf(expected, sizeof expected, "element %u", f.bad);
        ck_assert_str_eq(error.message, expected);
    }
    free(dense);
    subject_free(&s);
}
END_TEST

/* Parts of more rows than are joined at once, whose Q is freed on the way, give the factors of the whole. */
START_TEST(joined_parts_are_spent) {
    enum { N = 2 * TSVD_JOINED + 300, PARTS = 3, M = 12 };
    static const size_t widths[PARTS] = {5, 0, 7};
    lam_error error = {0};
    const truncation keep = {.epsilon = .5};
    tall_factors parts[PARTS] = {{0}}, joint = {0}, whole = {0};
    float *dense = malloc((size_t)N * M * sizeof *dense);
    for (size_t k = 0, column = 0; k < PARTS; column += widths[k++]) {
        parts[k] = (tall_factors){.n = N, .m = widths[k], .rank = widths[k]};
        parts[k].Q = malloc(N * (widths[k] + 1) * sizeof *parts[k].Q);
        for (size_t i = 0; i < N; i++)
            for (size_t c = 0; c < widths[k]; c++)
                parts[k].Q[i * widths[k] + c] = dense[i * M + column + c] =
                    (float)(sin((double)(i * (c + column + 1))) / pow(3, (double)c));
    }
    ck_assert_int_eq(tsvd_joined(PARTS, parts, &keep, &joint, &error), LAM_OK);
    ck_assert_int_eq(tsvd(N, M, dense, &keep, &whole, &error), LAM_OK);
    for (size_t k = 0; k < PARTS; k++) ck_assert_ptr_null(parts[k].Q);
    ck_assert_uint_eq(joint.rank, whole.rank);
    ck_assert_uint_gt(joint.rank, 2);
    ck_assert_uint_lt(joint.rank, M);
    for (size_t i = 0; i < N; i += 97) /* Q V^T, as vectors may change their signs */
        for (size_t j = 0; j < M; j++) {
            double one = 0, other = 0;
            for (size_t c = 0; c < joint.rank; c++) {
                one += (double)joint.Q[i * joint.rank + c] * (double)joint.V[j * joint.rank + c];
                other += (double)whole.Q[i * whole.rank + c] * (double)whole.V[j * whole.rank + c];
            }
            /* Gram matrices in single precision, summed in another order. */
            ck_assert_double_eq_tol(one, other, 1e-4);
        }
    tall_factors_free(&joint);
    tall_factors_free(&whole);
    free(dense);
}
END_TEST

/* Rows with few entries and rows that are spread out give the same Gram matrix, in either precision. */
START_TEST(gram_matrices_agree) {
    enum { N = 700, M = 300 };
    lam_error error = {0};
    sparse_block A = {.n = N, .m = M};
    A.indptr = calloc(N + 1, sizeof *A.indptr);
    A.columns = malloc(N * M * sizeof *A.columns);
    A.data = malloc(N * M * sizeof *A.data);
    float *dense = calloc(N * M, sizeof *dense);
    for (size_t i = 0; i < N; i++) {
        A.indptr[i + 1] = A.indptr[i];
        for (size_t j = i % 7; j < M; j += i % 3 == 0 ? 2 : 1 + i % 60) {
            A.columns[A.indptr[i + 1]] = (uint32_t)j;
            dense[i * M + j] = A.data[A.indptr[i + 1]++] = (float)sin((double)(i * 31 + j));
        }
    }
    gram g[4];
    for (int k = 0; k < 4; k++) {
        ck_assert_int_eq(gram_create(M, k % 2 == 0, &g[k], &error), LAM_OK);
        if (k < 2)
            ck_assert_int_eq(gram_add_sparse(&g[k], &A, &error), LAM_OK);
        else
            ck_assert_int_eq(gram_add(&g[k], N, dense, &error), LAM_OK);
    }
    for (size_t i = 0; i < M; i++)
        for (size_t j = i; j < M; j++) {
            const double truth = g[3].full[i * M + j];
            ck_assert_double_eq_tol(g[1].full[i * M + j], truth, 1e-10);
            ck_assert_double_eq_tol((double)g[0].single[i * M + j], truth, 2e-4);
            ck_assert_double_eq_tol((double)g[2].single[i * M + j], truth, 2e-4);
        }
    for (int k = 0; k < 4; k++) gram_free(&g[k]);
    sparse_block_free(&A);
    free(dense);
}
END_TEST

/* The largest x^T G x over |x| = 1 orthogonal to V, by all eigenvalues of (I - V V^T) G (I - V V^T). */
static double largest_orthogonal(const gram *g, const float *V, size_t rank) {
    lam_error error = {0};
    const size_t m = g->m;
    gram D;
    ck_assert_int_eq(gram_create(m, false, &D, &error), LAM_OK);
    double *P = calloc(m * m, sizeof *P), *half = calloc(m * m, sizeof *half),
           *values = malloc(m * sizeof *values);
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < m; j++) {
            double dot = 0;
            for (size_t c = 0; c < rank; c++) dot += (double)V[i * rank + c] * (double)V[j * rank + c];
            P[i * m + j] = (double)(i == j) - dot;
        }
    for (size_t i = 0; i < m; i++)
        for (size_t k = 0; k < m; k++)
            for (size_t j = 0; j < m; j++)
                half[i * m + j] += (double)g->single[(i < k ? i : k) * m + (i < k ? k : i)] * P[k * m + j];
    for (size_t i = 0; i < m; i++)
        for (size_t k = 0; k < m; k++)
            for (size_t j = 0; j < m; j++) D.full[i * m + j] += P[i * m + k] * half[k * m + j];
    ck_assert_int_eq(gram_eigen(&D, false, values, &error), LAM_OK);
    const double largest = values[m - 1];
    free(P);
    free(half);
    free(values);
    gram_free(&D);
    return largest;
}

/* Few eigenvectors above a floor: none that matters is missed, and many are left to the whole decomposition:
 * above or near the floor there are more than a tenth. */
static void check_leading(gram *g, double floor, size_t many) {
    lam_error error = {0};
    float *V = NULL;
    size_t rank = 0;
    ck_assert_int_eq(gram_leading(g, floor, 0, &V, &rank, &error), LAM_OK);
    if (V == NULL)
        ck_assert_uint_gt(many, g->m / 10);
    else
        ck_assert_double_le(largest_orthogonal(g, V, rank), 1.02 * floor + 1e-6);
    free(V);
}

START_TEST(leading_eigenvectors) {
    enum { M = 300 };
    lam_error error = {0};
    gram g, all;
    ck_assert_int_eq(gram_create(M, true, &g, &error), LAM_OK);
    ck_assert_int_eq(gram_create(M, true, &all, &error), LAM_OK);
    /* Columns of noise, falling from 1. */
    float *X = malloc(M * M * sizeof *X);
    sketch_gaussian(1, M, M, X);
    for (size_t c = 0; c < M; c++)
        for (size_t r = 0; r < M; r++) X[r * M + c] *= (float)(exp(-.05 * (double)c) / sqrt(M));
    ck_assert_int_eq(gram_add(&g, M, X, &error), LAM_OK);
    memcpy(all.single, g.single, M * M * sizeof *g.single);
    double values[M];
    ck_assert_int_eq(gram_eigen(&all, false, values, &error), LAM_OK);
    for (double floor = .3; floor > 1e-9; floor /= 9) {
        size_t above = 0;
        for (size_t k = 0; k < M; k++) above += values[k] >= floor;
        check_leading(&g, floor, above);
    }
    /* A plateau just above the floor on another just below: a few steps do not tell them apart. */
    for (size_t plateau = 1; plateau <= M; plateau *= 2) {
        memset(g.single, 0, M * M * sizeof *g.single);
        for (size_t i = 0; i < M; i++) g.single[i * M + i] = i < plateau ? 1.1f : .85f;
        check_leading(&g, 1, M);
    }
    free(X);
    gram_free(&g);
    gram_free(&all);
}
END_TEST

START_TEST(bases_are_orthonormal) {
    enum { N = 500, M = 40 };
    lam_error error = {0};
    float *Y = malloc(N * M * sizeof *Y);
    for (int dependent = 0; dependent < 2; dependent++) {
        size_t rank;
        sketch_gaussian(2, N, M, Y);
        for (size_t i = 0; i < N; i++)
            for (size_t c = 0; c < M; c++) {
                Y[i * M + c] *= (float)pow(10, -(double)c / 10);
                if (dependent && c >= M / 2) Y[i * M + c] = Y[i * M + c - M / 2];
            }
        ck_assert_int_eq(sketch_orthonormalize(N, M, Y, &rank, &error), LAM_OK);
        ck_assert_uint_eq(rank, dependent ? M / 2 : M);
        const tall_factors f = {.n = N, .m = N, .rank = rank, .V = Y};
        check_orthonormal(&f);
    }
    free(Y);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("factorizer pieces");
    TCase *cases = tcase_create("factorizer pieces");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, products_are_right);
    tcase_add_test(cases, blocks_of_several_pieces);
    tcase_add_test(cases, joined_parts_are_spent);
    tcase_add_test(cases, gram_matrices_agree);
    tcase_add_test(cases, leading_eigenvectors);
    tcase_add_test(cases, bases_are_orthonormal);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
