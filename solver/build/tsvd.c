#include "solver/build/tsvd.h"

#include <cblas.h>
#include <lapacke.h>

#include <limits.h>
#include <math.h>
#include <stdlib.h>

/* Above this share of the largest singular value the eigenvalues of a Gram matrix in single precision are
 * good to a few per cent (it is useless below the root of its rounding, 2.4e-4). */
static const double single_share = 2e-3;

/* Rows converted to double at a time. */
enum { PANEL = 512 };

void tall_factors_free(tall_factors *f) {
    free(f->Q);
    free(f->V);
    *f = (tall_factors){0};
}

/* G = A^T A in single precision; only the upper triangle (column-major) is set. */
static void gram_single(size_t n, size_t m, const float *A, float *G) {
    cblas_ssyrk(CblasColMajor, CblasUpper, CblasTrans, (int)m, (int)n, 1, A, (int)n, 0, G, (int)m);
}

/* G = A^T A in double, by panels of rows. */
static lam_status gram_double(size_t n, size_t m, const float *A, double *G, lam_error *error) {
    double *panel = memory_allocate(PANEL * m, sizeof *panel, "factorization", error);
    if (panel == NULL) return LAM_ERR_MEMORY;
    for (size_t first = 0; first < n; first += PANEL) {
        const size_t rows = n - first < PANEL ? n - first : PANEL;
        for (size_t c = 0; c < m; c++)
            for (size_t r = 0; r < rows; r++) panel[c * rows + r] = (double)A[c * n + first + r];
        cblas_dsyrk(CblasColMajor, CblasUpper, CblasTrans, (int)m, (int)rows, 1, panel, (int)rows,
                    first == 0 ? 0 : 1, G, (int)m);
    }
    free(panel);
    return LAM_OK;
}

/* As LAPACKE_ssyevd, whose own query for the size of the work area comes back rounded to single precision,
 * too small from about 2,900 columns on. The sizes are those of LAPACK's manual for ssyevd. */
static lapack_int eigen_single(size_t m, float *G, float *w) {
    const size_t n_work = 1 + 6 * m + 2 * m * m, n_integers = 3 + 5 * m;
    float *work = malloc(n_work * sizeof *work);
    lapack_int *integers = malloc(n_integers * sizeof *integers);
    lapack_int info = LAPACK_WORK_MEMORY_ERROR;
    if (n_work <= INT_MAX && work != NULL && integers != NULL)
        info = LAPACKE_ssyevd_work(LAPACK_COL_MAJOR, 'V', 'U', (lapack_int)m, G, (lapack_int)m, w, work,
                                   (lapack_int)n_work, integers, (lapack_int)n_integers);
    free(work);
    free(integers);
    return info;
}

/* Eigenvectors of A^T A into vectors ([m][m] columns, ascending) and their eigenvalues. */
static lam_status gram_eigen(size_t n, size_t m, const float *A, bool single, float *vectors, double *values,
                             lam_error *error) {
    lam_status status = LAM_OK;
    double *G = NULL;
    float *w = NULL;
    lapack_int info;
    if (single) {
        w = memory_allocate(m, sizeof *w, "factorization", error);
        if (w == NULL) TRY(LAM_ERR_MEMORY);
        gram_single(n, m, A, vectors);
        info = eigen_single(m, vectors, w);
        if (info == 0)
            for (size_t i = 0; i < m; i++) values[i] = (double)w[i];
    } else {
        G = memory_allocate(m * m, sizeof *G, "factorization", error);
        if (G == NULL) TRY(LAM_ERR_MEMORY);
        TRY(gram_double(n, m, A, G, error));
        info = LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'U', (lapack_int)m, G, (lapack_int)m, values);
        if (info == 0)
            for (size_t i = 0; i < m * m; i++) vectors[i] = (float)G[i];
    }
    if (info == LAPACK_WORK_MEMORY_ERROR)
        FAIL(error, LAM_ERR_MEMORY,
             "eigenvectors of a block of %zu columns: out of memory; use more --levels", m);
    if (info != 0)
        FAIL(error, LAM_ERR_NUMERIC, "eigenvectors of a block of %zu columns: LAPACK syevd returned %d", m,
             (int)info);
done:
    free(G);
    free(w);
    return status;
}

/* values are the squares of the singular values, ascending. */
static size_t choose_rank(size_t m, const double *values, const tsvd_options *options) {
    const double kept = options->epsilon * options->epsilon;
    size_t rank = 0;
    if (options->rank > 0) return options->rank < m ? options->rank : m;
    while (rank < m && values[m - 1 - rank] >= kept) rank++;
    while (rank < m && rank % options->round != 0 && values[m - 1 - rank] >= kept / 4) rank++;
    return rank;
}

lam_status tsvd(size_t n, size_t m, const float *A, const tsvd_options *options, tall_factors *out,
                lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors f = {.n = n, .m = m};
    float *vectors = NULL;
    double *values = NULL;
    if (n > INT_MAX || m > INT_MAX)
        FAIL(error, LAM_ERR_ARGUMENT, "a block of %zu x %zu is beyond LAPACK's integers", n, m);
    vectors = memory_allocate(m * m, sizeof *vectors, "factorization", error);
    values = memory_allocate(m, sizeof *values, "factorization", error);
    if (vectors == NULL || values == NULL) TRY(LAM_ERR_MEMORY);

    const double epsilon = options->epsilon;
    const bool single = options->rank == 0 && epsilon >= 1e-3;
    TRY(gram_eigen(n, m, A, single, vectors, values, error));
    if (single && m > 0 && epsilon < single_share * sqrt(fmax(values[m - 1], 0)))
        TRY(gram_eigen(n, m, A, false, vectors, values, error));

    f.rank = choose_rank(m, values, options);
    f.Q = memory_allocate(n * f.rank, sizeof *f.Q, "factorization", error);
    f.V = memory_allocate(m * f.rank, sizeof *f.V, "factorization", error);
    if (f.Q == NULL || f.V == NULL) TRY(LAM_ERR_MEMORY);
    /* LAPACK gives the largest last. */
    for (size_t c = 0; c < f.rank; c++) cblas_scopy((int)m, vectors + (m - 1 - c) * m, 1, f.V + c * m, 1);
    if (f.rank > 0) /* Q = A V */
        cblas_sgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, (int)n, (int)f.rank, (int)m, 1, A, (int)n, f.V,
                    (int)m, 0, f.Q, (int)n);
    *out = f;
    f = (tall_factors){0};
done:
    free(vectors);
    free(values);
    tall_factors_free(&f);
    return status;
}
