#include "solver/method/low_rank/tsvd.h"

#include "solver/base/parallel.h"
#include "solver/linalg/dense.h"
#include "solver/method/low_rank/gram.h"
#include "store/status.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Above this share of the largest singular value, eigenvalues of a Gram matrix in single precision are
 * accurate to a few per cent (below 2.4e-4, the root of its rounding, they are useless). */
static const double single_share = 2e-3;

/* A sparse row with more than this share of nonzero entries is expanded and left to BLAS, whose products are
 * that much faster. */
static const double spread_above = 1. / 5;

/* Rows expanded at a time; columns from which on leading eigenvectors are tried before all. */
enum { PANEL = 1024, LEADING_LEAST = 768 };

/* Rows of parts joined by one thread at a time. */
enum { JOINED_PIECE = 256 };

size_t truncation_rank(const truncation *keep, size_t m, const double *values) {
    const double kept = keep->epsilon * keep->epsilon;
    size_t rank = 0;
    if (keep->rank > 0) return keep->rank < m ? keep->rank : m;
    const size_t round = keep->round > 0 ? keep->round : 1;
    while (rank < m && values[m - 1 - rank] >= kept) rank++;
    while (rank < m && rank % round != 0 && values[m - 1 - rank] >= kept / 4) rank++;
    return rank;
}

/* True if a Gram matrix in single precision may be accurate enough. */
static bool may_be_single(const truncation *keep) {
    return keep->rank == 0 && keep->epsilon >= 1e-3;
}

/* V [m][rank] from the eigenvectors, largest first. */
static lam_status take_vectors(const gram *g, size_t rank, float **V, lam_error *error) {
    const size_t m = g->m;
    float *v = memory_allocate(m, rank * sizeof *v, "factorization", error);
    if (v == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m; i++)
        for (size_t c = 0; c < rank; c++) {
            const size_t at = (m - 1 - c) * m + i;
            v[i * rank + c] = g->single != NULL ? g->single[at] : (float)g->full[at];
        }
    *V = v;
    return LAM_OK;
}

/* A dense block, a sparse one, or the Q of several parts side by side. */
typedef struct tall_block {
    size_t n, m;
    const float *dense;         /* [n][m] */
    const sparse_block *sparse; /* or this */
    tall_factors *parts;        /* or these; m is the sum of their ranks */
    size_t count;
} tall_block;

static size_t row_length(const sparse_block *A, size_t i) {
    return (size_t)(A->indptr[i + 1] - A->indptr[i]);
}

static void spread_row(const sparse_block *A, size_t i, float *row) {
    memset(row, 0, A->m * sizeof *row);
    for (uint64_t p = A->indptr[i]; p < A->indptr[i + 1]; p++) row[A->columns[p]] = A->data[p];
}

typedef struct join_job {
    const tall_block *A;
    size_t first, rows;
    float *panel;
} join_job;

/* Copies piece number `piece` of rows first ... first+rows-1 of the parts side by side. */
static void join_piece(const void *context, size_t piece) {
    const join_job *j = context;
    for (size_t i = piece * JOINED_PIECE; i < j->rows && i < (piece + 1) * JOINED_PIECE; i++) {
        float *to = j->panel + i * j->A->m;
        for (size_t k = 0; k < j->A->count; k++) {
            const size_t width = j->A->parts[k].rank;
            if (width > 0) memcpy(to, j->A->parts[k].Q + (j->first + i) * width, width * sizeof *to);
            to += width;
        }
    }
}

/* Keeps rows 0 ... rows-1 of the Q of the parts. A part that cannot be moved stays as long as it is. */
static void keep_rows(const tall_block *A, size_t rows) {
    for (size_t k = 0; k < A->count; k++) {
        tall_factors *part = &A->parts[k];
        if (rows == 0 || part->rank == 0) {
            free(part->Q);
            part->Q = NULL;
            continue;
        }
        float *shorter = realloc(part->Q, rows * part->rank * sizeof *part->Q);
        if (shorter != NULL) part->Q = shorter;
    }
}

/* Calls take for the rows of the parts side by side, a panel at a time. spent: the last one comes first, and
 * rows are freed once they were taken. */
static lam_status each_panel(const tall_block *A, bool spent,
                             lam_status (*take)(void *context, size_t first, size_t rows, const float *panel,
                                                lam_error *error),
                             void *context, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t most = A->n < TSVD_JOINED ? A->n : TSVD_JOINED;
    float *panel = memory_allocate(most, A->m * sizeof *panel, "factorization", error);
    if (panel == NULL) return LAM_ERR_MEMORY;
    const size_t count = (A->n + TSVD_JOINED - 1) / TSVD_JOINED;
    for (size_t k = 0; k < count; k++) {
        const size_t first = (spent ? count - 1 - k : k) * most;
        const size_t rows = A->n - first < most ? A->n - first : most;
        const join_job job = {A, first, rows, panel};
        parallel_for(join_piece, &job, (rows + JOINED_PIECE - 1) / JOINED_PIECE);
        TRY(take(context, first, rows, panel, error));
        if (spent) keep_rows(A, first);
    }
done:
    free(panel);
    return status;
}

static lam_status add_panel(void *context, size_t first, size_t rows, const float *panel, lam_error *error) {
    (void)first;
    return gram_add(context, rows, panel, error);
}

static lam_status gram_of(const tall_block *A, gram *g, lam_error *error) {
    if (A->dense != NULL) return gram_add(g, A->n, A->dense, error);
    return A->sparse != NULL ? gram_add_sparse(g, A->sparse, error)
                             : each_panel(A, false, add_panel, g, error);
}

/* q = sum_c A_ic V_c. */
static void project_row(const sparse_block *A, size_t i, size_t k, const float *V, float *q) {
    memset(q, 0, k * sizeof *q);
    for (uint64_t p = A->indptr[i]; p < A->indptr[i + 1]; p++) {
        const float a = A->data[p], *v = V + A->columns[p] * k;
#pragma omp simd
        for (size_t c = 0; c < k; c++) q[c] += a * v[c];
    }
}

typedef struct sparse_projection {
    const sparse_block *A;
    size_t k;
    const float *V;
    float *Q;
} sparse_projection;

static bool is_thin(const sparse_block *A, size_t i) {
    return (double)row_length(A, i) <= spread_above * (double)A->m;
}

static void project_thin_rows(const void *context, size_t piece) {
    const sparse_projection *p = context;
    for (size_t i = piece * PANEL; i < p->A->n && i < (piece + 1) * PANEL; i++)
        if (is_thin(p->A, i)) project_row(p->A, i, p->k, p->V, p->Q + i * p->k);
}

/* Q = A V of a panel. */
typedef struct projection {
    size_t m, k;
    const float *V;
    float *Q;
} projection;

static lam_status project_panel(void *context, size_t first, size_t rows, const float *panel,
                                lam_error *error) {
    (void)error;
    const projection *p = context;
    dense_multiply(rows, p->m, p->k, panel, p->V, false, p->Q + first * p->k);
    return LAM_OK;
}

/* Q = A V, [n][k]; parts lose their Q. */
static lam_status project(const tall_block *A, size_t k, const float *V, float *Q, lam_error *error) {
    const size_t m = A->m;
    if (A->dense != NULL) {
        dense_multiply(A->n, m, k, A->dense, V, false, Q);
        return LAM_OK;
    }
    if (A->sparse == NULL) {
        projection p = {.m = m, .k = k, .V = V, .Q = Q};
        return each_panel(A, true, project_panel, &p, error);
    }
    const sparse_projection thin = {A->sparse, k, V, Q};
    parallel_for(project_thin_rows, &thin, (A->n + PANEL - 1) / PANEL);
    float *panel = memory_allocate(PANEL, m * sizeof *panel, "factorization", error);
    if (panel == NULL) return LAM_ERR_MEMORY;
    for (size_t first = 0; first < A->n;) {
        size_t rows = 0;
        if (is_thin(A->sparse, first)) {
            first++;
            continue;
        }
        /* A run of rows with many entries. */
        while (rows < PANEL && first + rows < A->n && !is_thin(A->sparse, first + rows)) {
            spread_row(A->sparse, first + rows, panel + rows * m);
            rows++;
        }
        dense_multiply(rows, m, k, panel, V, false, Q + first * k);
        first += rows;
    }
    free(panel);
    return LAM_OK;
}

/* V from all eigenvectors of A^T A, in single precision if that is accurate enough. g is the Gram matrix in
 * single precision, or empty. */
static lam_status decompose(const tall_block *A, const truncation *keep, gram *g, float **V, size_t *rank,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = A->m;
    double *values = memory_allocate(m, sizeof *values, "factorization", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    for (;;) {
        const bool single = g->single != NULL;
        if (!single) {
            TRY(gram_create(m, false, g, error));
            TRY(gram_of(A, g, error));
        }
        TRY(gram_eigen(g, true, values, error));
        if (!single || m == 0 || keep->epsilon >= single_share * sqrt(fmax(values[m - 1], 0))) break;
        gram_free(g);
    }
    *rank = truncation_rank(keep, m, values);
    TRY(take_vectors(g, *rank, V, error));
done:
    free(values);
    return status;
}

static lam_status factorize(const tall_block *A, const truncation *keep, tall_factors *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors f = {.n = A->n, .m = A->m};
    gram g = {0};
    if (A->n > INT_MAX || A->m > INT_MAX)
        FAIL(error, LAM_ERR_ARGUMENT, "a block of %zu x %zu is beyond LAPACK's integers", A->n, A->m);
    if (may_be_single(keep)) {
        TRY(gram_create(A->m, true, &g, error));
        TRY(gram_of(A, &g, error));
        /* Blocks of S have |A| <= 1. */
        if (A->m >= LEADING_LEAST && keep->epsilon >= single_share)
            TRY(gram_leading(&g, keep->epsilon * keep->epsilon, keep->guess, &f.V, &f.rank, error));
    }
    if (f.V == NULL) TRY(decompose(A, keep, &g, &f.V, &f.rank, error));
    gram_free(&g);
    f.Q = memory_allocate(A->n, f.rank * sizeof *f.Q, "factorization", error);
    if (f.Q == NULL) TRY(LAM_ERR_MEMORY);
    TRY(project(A, f.rank, f.V, f.Q, error)); /* Q = A V */
    *out = f;
    f = (tall_factors){0};
done:
    gram_free(&g);
    tall_factors_free(&f);
    return status;
}

lam_status tsvd(size_t n, size_t m, const float *A, const truncation *keep, tall_factors *out,
                lam_error *error) {
    const tall_block block = {.n = n, .m = m, .dense = A};
    return factorize(&block, keep, out, error);
}

lam_status tsvd_joined(size_t count, tall_factors *parts, const truncation *keep, tall_factors *out,
                       lam_error *error) {
    tall_block block = {.parts = parts, .count = count};
    for (size_t k = 0; k < count; k++) {
        if (parts[k].n > block.n) block.n = parts[k].n;
        block.m += parts[k].rank;
    }
    return factorize(&block, keep, out, error);
}

lam_status tsvd_sparse(const sparse_block *A, const truncation *keep, tall_factors *out, lam_error *error) {
    const tall_block block = {.n = A->n, .m = A->m, .sparse = A};
    return factorize(&block, keep, out, error);
}

lam_status tsvd_values(const sparse_block *A, size_t m, double *values, lam_error *error) {
    lam_status status = LAM_OK;
    gram g = {0};
    TRY(gram_create(m, true, &g, error));
    TRY(gram_add_sparse(&g, A, error));
    TRY(gram_eigen(&g, false, values, error));
done:
    gram_free(&g);
    return status;
}
