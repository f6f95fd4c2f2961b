#include "solver/build/hf.h"

#include <cblas.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* At the root the rank goes up to a multiple of ROOT_ROUND where the spectrum still has something to give:
 * the online kernels work in vectors and panels of that width, and the tail of the spectrum is steep (on the
 * Cornell box 6 % more columns take 20 % off the error). */
enum { LEAF_COLUMNS = 1024, LEAF_COLUMNS_MOST = 8192, MAX_LEVELS = 20, ROOT_ROUND = 64 };

typedef struct hf_run {
    const scaled_matrix *S;
    const uint32_t *order;
    const hf_options *options;
    size_t columns_done;
} hf_run;

/* What a node of this epsilon leaves to each of its two children (eq. 3.11). */
static double epsilon_of_child(double epsilon, double alpha) {
    return (1 - alpha) * epsilon / sqrt(2);
}

int hf_levels(size_t n, double epsilon, double alpha, double noise) {
    int levels = 0;
    for (double leaf = epsilon_of_child(epsilon, alpha); levels < MAX_LEVELS;
         leaf = epsilon_of_child(leaf, alpha)) {
        const size_t columns = n >> levels;
        if (columns < LEAF_COLUMNS || (leaf < noise / 2 && columns <= LEAF_COLUMNS_MOST)) break;
        levels++;
    }
    return levels;
}

/* (Q1 | Q2) = Q_r V_r^T and V^T = (V_r1^T V1^T | V_r2^T V2^T), eqs. 3.3, 3.5, 3.6. Takes one and two over. */
static lam_status combine(tall_factors *one, tall_factors *two, const tsvd_options *keep, tall_factors *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = one->n, k1 = one->rank, k2 = two->rank, k = k1 + k2, m = one->m + two->m;
    tall_factors joint = {0};
    float *Q = NULL, *V = NULL;
    size_t values;
    if (!size_multiply(n, k, &values)) FAIL(error, LAM_ERR_MEMORY, "a node of %zu columns is too large", k);
    Q = memory_allocate(values, sizeof *Q, "factorization", error);
    if (Q == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(Q, one->Q, n * k1 * sizeof *Q);
    memcpy(Q + n * k1, two->Q, n * k2 * sizeof *Q);
    free(one->Q);
    free(two->Q);
    one->Q = two->Q = NULL;
    TRY(tsvd(n, k, Q, keep, &joint, error));
    free(Q);
    Q = NULL;

    const size_t r = joint.rank;
    V = memory_allocate(m * r, sizeof *V, "factorization", error);
    if (V == NULL) TRY(LAM_ERR_MEMORY);
    if (r > 0 && k1 > 0)
        cblas_sgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, (int)one->m, (int)r, (int)k1, 1, one->V,
                    (int)one->m, joint.V, (int)k, 0, V, (int)m);
    if (r > 0 && k2 > 0)
        cblas_sgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, (int)two->m, (int)r, (int)k2, 1, two->V,
                    (int)two->m, joint.V + k1, (int)k, 0, V + one->m, (int)m);
    free(joint.V);
    joint.V = V;
    joint.m = m;
    V = NULL;
    *out = joint;
    joint = (tall_factors){0};
done:
    free(Q);
    free(V);
    tall_factors_free(&joint);
    tall_factors_free(one);
    tall_factors_free(two);
    return status;
}

static lam_status leaf(hf_run *run, size_t first, size_t last, const tsvd_options *keep, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = run->S->F->n, m = last - first;
    float *block = NULL;
    size_t values;
    if (!size_multiply(n, m, &values)) FAIL(error, LAM_ERR_MEMORY, "a leaf of %zu columns is too large", m);
    block = memory_allocate(values, sizeof *block, "a leaf of the factorization", error);
    if (block == NULL) TRY(LAM_ERR_MEMORY);
    scaled_columns(run->S, run->order + first, m, block);
    TRY(tsvd(n, m, block, keep, out, error));
    run->columns_done += m;
    progress_report(run->options->progress, "factorize", (double)run->columns_done / (double)n);
done:
    free(block);
    return status;
}

/* Columns first ... last-1 (algorithm 4, HF). */
static lam_status node(hf_run *run, size_t first, size_t last, double epsilon, int levels, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const double alpha = run->options->alpha;
    const bool root = last - first == run->S->F->n;
    tsvd_options keep = {.epsilon = epsilon, .rank = run->options->rank, .round = root ? ROOT_ROUND : 1};
    tall_factors one = {0}, two = {0};
    if (progress_cancelled(run->options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    if (levels <= 0 || last - first < 2) {
        TRY(leaf(run, first, last, &keep, out, error));
    } else {
        const double epsilon_ch = epsilon_of_child(epsilon, alpha);
        const size_t middle = first + (last - first) / 2;
        TRY(node(run, first, middle, epsilon_ch, levels - 1, &one, error));
        TRY(node(run, middle, last, epsilon_ch, levels - 1, &two, error));
        keep.epsilon = alpha * epsilon; /* epsilon_p */
        TRY(combine(&one, &two, &keep, out, error));
    }
done:
    tall_factors_free(&one);
    tall_factors_free(&two);
    return status;
}

lam_status hf_factorize(const scaled_matrix *S, const uint32_t *order, const hf_options *options,
                        tall_factors *out, lam_error *error) {
    hf_run run = {.S = S, .order = order, .options = options};
    const size_t n = S->F->n;
    return node(&run, 0, n, options->epsilon, options->levels, out, error);
}
