/* Blocks of form factors in a basis of wavelets, against dense matrices in double. */
#include "solver/base/random.h"
#include "solver/method/hierarchical/wavelet_blocks.h"
#include "solver/method/hierarchical/wavelet_norm.h"
#include "support/failing_memory.h"
#include "support/random_blocks.h"
#include "support/wavelet_subject.h"

static lam_error error;

enum { ROUNDS = 20000 };

/* W S W^T of the tree's blocks. */
static csr blocks_of(const subject *s, const block_factors *f, float threshold, const float *weight,
                     size_t n_threads) {
    csr S;
    const wavelet_blocks_input input = {
        .blocks = f, .basis = &s->basis, .threshold = threshold, .weight = weight, .n_threads = n_threads};
    ck_ok(wavelet_blocks(&input, &S, &error));
    return S;
}

static block_factors begin(const subject *s) {
    block_factors f;
    ck_ok(block_factors_begin(&s->tree, s->m.area, (const double(*)[3])s->centre, &f, &error));
    return f;
}

/* S by positions. */
static double *dense_of_blocks(const block_factors *f) {
    const size_t n = f->n;
    double *F = test_allocate(n * n, sizeof *F), *size = test_allocate(n * n, sizeof *size);
    for (size_t k = 0; k < f->n_blocks; k++) block_add_dense(f, &f->blocks[k], F, size);
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) F[p * n + q] *= sqrt(f->area[p] / f->area[q]);
    free(size);
    return F;
}

static double frobenius(size_t n, const double *A) {
    double sum = 0;
    for (size_t k = 0; k < n * n; k++) sum += A[k] * A[k];
    return sqrt(sum);
}

static void same_bits(const csr *a, const csr *b) {
    ck_assert_mem_eq(a->indptr, b->indptr, (a->n + 1) * sizeof *a->indptr);
    ck_assert_mem_eq(a->indices, b->indices, a->indptr[a->n] * sizeof *a->indices);
    ck_assert_mem_eq(a->data, b->data, a->indptr[a->n] * sizeof *a->data);
}

/* Every coefficient; then those above a threshold, and no others. */
START_TEST(random_blocks_in_the_basis) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    block_factors f = begin(&s);
    uint64_t seed = 5;
    random_blocks(&f, ROUNDS, &seed);
    double *S = dense_of_blocks(&f), *truth = in_basis(&s, S);
    const double norm = frobenius(n, S);
    ck_ok(block_factors_end(&f, &error));
    float *weight = ones(&s.basis);
    csr found = blocks_of(&s, &f, 0, weight, 1), again = blocks_of(&s, &f, 0, weight, 3);
    double *all = whole(&found);
    /* Rows and columns are transformed once each. */
    ck_assert_double_le(largest_difference(n * n, all, truth), 2 * TRANSFORM_U * norm);
    same_bits(&found, &again);
    csr_free(&found);
    csr_free(&again);
    for (size_t t = 0; t < s.basis.n_nodes; t++) weight[t] = t % 2 == 0 ? 1 : .5f;
    const float threshold = (float)(3e-3 * norm);
    found = blocks_of(&s, &f, threshold, weight, 2);
    again = blocks_of(&s, &f, threshold, weight, 1);
    same_bits(&found, &again);
    double *some = whole(&found);
    size_t kept = 0, off = 0;
    for (size_t t = 0; t < s.basis.n_nodes; t++)
        for (size_t u = 0; u < s.basis.n_nodes; u++) {
            const wavelet_node *a = &s.basis.nodes[t], *b = &s.basis.nodes[u];
            for (size_t i = a->first; i < a->first + a->inputs - a->scaling; i++)
                for (size_t j = b->first; j < b->first + b->inputs - b->scaling; j++) {
                    const double least = (double)threshold * (double)weight[t] * (double)weight[u],
                                 size = fabs(all[i * n + j]), value = some[i * n + j];
                    /* Of two numbers at one place one may be lost below a fifth of the threshold, and on the
                     * way up numbers below a tenth are; of those, several may add up. */
                    if (value != 0)
                        ck_assert(fabs(value - all[i * n + j]) < .5 * least && size > .5 * least);
                    else
                        ck_assert(size < 1.5 * least);
                    kept += size > least;
                    off += (value != 0) != (size > least);
                }
        }
    ck_assert_uint_gt(kept, n);
    ck_assert_uint_lt(off, kept / 200);
    block_factors_free(&f);
    csr_free(&found);
    csr_free(&again);
    free(weight);
    free(S);
    free(truth);
    free(all);
    free(some);
    wavelet_subject_free(&s);
}
END_TEST

/* F of pairs of elements, each a block. */
static block_factors pairs_of(const subject *s) {
    block_factors f = begin(s);
    blocks_of_pairs(&s->F, &f);
    ck_ok(block_factors_end(&f, &error));
    return f;
}

START_TEST(pairs_give_what_rows_give) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    block_factors f = pairs_of(&s);
    float *weight = ones(&s.basis);
    csr found = blocks_of(&s, &f, 0, weight, 2), wanted = pass(&s, 0, weight, 2);
    double *some = whole(&found), *all = whole(&wanted);
    /* |S| <= 1; F is symmetric up to its own rounding. */
    ck_assert_double_le(largest_difference(n * n, some, all), 3 * TRANSFORM_U);
    ck_assert_double_gt(frobenius(n, all), .5);
    block_factors_free(&f);
    csr_free(&found);
    csr_free(&wanted);
    free(weight);
    free(some);
    free(all);
    wavelet_subject_free(&s);
}
END_TEST

/* Of pairs of elements any balance is found exactly, of clusters one that is the same all over. */
START_TEST(balance_is_kept) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    uint64_t seed = 5;
    for (int clusters = 0; clusters < 2; clusters++) {
        block_factors f = begin(&s);
        f.balance = test_allocate(n, sizeof *f.balance);
        for (size_t p = 0; p < n; p++) f.balance[p] = clusters ? .8 : .5 + random_lcg_unit(&seed);
        if (clusters)
            random_blocks(&f, ROUNDS, &seed);
        else
            blocks_of_pairs(&s.F, &f);
        double *S = dense_of_blocks(&f), *truth = in_basis(&s, S);
        ck_ok(block_factors_end(&f, &error));
        float *weight = ones(&s.basis);
        csr found = blocks_of(&s, &f, 0, weight, 2);
        double *all = whole(&found);
        ck_assert_double_le(largest_difference(n * n, all, truth), 3 * TRANSFORM_U * frobenius(n, S));
        block_factors_free(&f);
        csr_free(&found);
        free(weight);
        free(S);
        free(truth);
        free(all);
    }
    wavelet_subject_free(&s);
}
END_TEST

/* Two squares of one element each: the root is the only node above the leaves. */
START_TEST(the_smallest_tree) {
    const double area[2] = {4, 1}, centre[2][3] = {{0, 0, 0}, {0, 0, 1}};
    const float normal[2][3] = {{0, 0, 1}, {0, 0, -1}};
    subject s = {.W = NULL};
    block_factors f;
    csr none, S;
    ck_ok(plane_tree_make(2, centre, normal, NULL, NULL, 6, &s.tree, &error));
    ck_ok(wavelet_basis_make(&s.tree, area, centre, &s.basis, &error));
    ck_ok(block_factors_begin(&s.tree, area, centre, &f, &error));
    ck_ok(block_factors_end(&f, &error));
    float *weight = ones(&s.basis);
    none = blocks_of(&s, &f, 0, weight, 1);
    ck_assert_uint_eq(none.indptr[2], 0);
    block_factors_free(&f);
    ck_ok(block_factors_begin(&s.tree, area, centre, &f, &error));
    f.n_blocks = 1;
    f.blocks = test_allocate(1, sizeof *f.blocks);
    f.blocks[0] = (cluster_block){(uint32_t)f.n_clusters + 1, (uint32_t)f.n_clusters, .L[0][0] = .1f};
    ck_ok(block_factors_end(&f, &error));
    S = blocks_of(&s, &f, 0, weight, 1);
    /* S = .2 (0 1; 1 0) in the basis (1, -2) / 5^1/2 or its negative, (2, 1) / 5^1/2. */
    double *all = whole(&S);
    const double truth[3] = {-.16, .12, .16};
    ck_assert_double_le(fabs(all[0] - truth[0]), 1e-7);
    ck_assert_double_le(fabs(fabs(all[1]) - truth[1]), 1e-7);
    ck_assert_double_le(fabs(all[3] - truth[2]), 1e-7);
    /* Its Frobenius norm, also where F is balanced to halves of it. */
    double norm = 0, halves[2] = {.5, 1};
    ck_ok(wavelet_norm_of_blocks(&f, &norm, &error));
    ck_assert_double_eq_tol(norm, .2 * sqrt(2), 1e-7);
    f.balance = halves;
    ck_ok(wavelet_norm_of_blocks(&f, &norm, &error));
    ck_assert_double_eq_tol(norm, .1 * sqrt(2), 1e-7);
    f.balance = NULL;
    block_factors_free(&f);
    plane_tree_free(&s.tree);
    wavelets_free(&s.basis);
    csr_free(&none);
    csr_free(&S);
    free(weight);
    free(all);
}
END_TEST

/* The share that was reported last. */
static void note_share(void *context, const char *stage, double share) {
    double *last = context;
    ck_assert_str_eq(stage, "wavelets");
    ck_assert_double_ge(share, *last);
    *last = share;
}

static bool cancel_halfway(void *context) {
    const double *last = context;
    return *last > .5;
}

START_TEST(progress_is_told_and_stops) {
    subject s = wavelet_subject_make(ROOM);
    block_factors f = pairs_of(&s);
    float *weight = ones(&s.basis);
    double last = 0;
    csr S = {.n = 0};
    progress p = {.report = note_share, .context = &last};
    const wavelet_blocks_input input = {
        .blocks = &f, .basis = &s.basis, .weight = weight, .n_threads = 2, .progress = &p};
    ck_ok(wavelet_blocks(&input, &S, &error));
    ck_assert_double_eq_tol(last, 1, 1e-12);
    csr_free(&S);
    last = 0;
    p.cancelled = cancel_halfway;
    ck_assert_int_eq(wavelet_blocks(&input, &S, &error), LAM_ERR_CANCELLED);
    block_factors_free(&f);
    free(weight);
    wavelet_subject_free(&s);
}
END_TEST

START_TEST(memory_runs_out) {
    subject s = wavelet_subject_make(BOX);
    block_factors f = pairs_of(&s);
    float *weight = ones(&s.basis);
    csr S = {.n = 0};
    const wavelet_blocks_input input = {.blocks = &f, .basis = &s.basis, .weight = weight, .n_threads = 1};
    long failed = 0;
    for (;; failed++) {
        allocations_left = failed;
        const lam_status status = wavelet_blocks(&input, &S, &error);
        allocations_left = -1;
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        ck_assert_ptr_null(S.indptr);
    }
    ck_assert_int_gt(failed, 20);
    csr_free(&S);
    block_factors_free(&f);
    free(weight);
    wavelet_subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet blocks");
    TCase *tests = tcase_create("wavelet blocks");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, random_blocks_in_the_basis, 0, SUBJECTS);
    tcase_add_loop_test(tests, pairs_give_what_rows_give, 0, SUBJECTS);
    tcase_add_loop_test(tests, balance_is_kept, 0, SUBJECTS);
    tcase_add_test(tests, the_smallest_tree);
    tcase_add_test(tests, progress_is_told_and_stops);
    tcase_add_test(tests, memory_runs_out);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
