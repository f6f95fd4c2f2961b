#include "solver/method/reference.h"

#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Vectors iterated together: a row of them is a few cache lines. */
enum { BLOCK = 32, MAX_SWEEPS = 5000 };

struct reference {
    size_t n;
    factor_product F;
    const double *area;
    const float *rho;
    double *lu; /* I - R F, row-major, factorized as its transpose; NULL: iterated */
    lapack_int *pivots;
};

static lam_status factorize(reference *r, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = r->n;
    const csr *F = r->F.rows;
    r->lu = memory_allocate(n * n, sizeof *r->lu, "dense reference", error);
    r->pivots = memory_allocate(n, sizeof *r->pivots, "dense reference", error);
    if (r->lu == NULL || r->pivots == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        r->lu[i * n + i] = 1;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
            r->lu[i * n + F->indices[p]] -= (double)r->rho[i] * (double)F->data[p];
    }
    const lapack_int info =
        LAPACKE_dgetrf(LAPACK_COL_MAJOR, (lapack_int)n, (lapack_int)n, r->lu, (lapack_int)n, r->pivots);
    if (info != 0)
        FAIL(error, LAM_ERR_NUMERIC,
             "reference of %zu elements: LU returned %d; lower the largest reflectance", n, (int)info);
done:
    return status;
}

lam_status reference_create(const csr *F, const double *area, const float *reflectance, reference_way way,
                            reference **out, lam_error *error) {
    const factor_product product = factor_product_of_rows(F);
    return reference_create_of(&product, area, reflectance, way, out, error);
}

lam_status reference_create_of(const factor_product *F, const double *area, const float *reflectance,
                               reference_way way, reference **out, lam_error *error) {
    lam_status status = LAM_OK;
    reference *r = memory_allocate(1, sizeof *r, "reference", error);
    if (r == NULL) return LAM_ERR_MEMORY;
    *r = (reference){.n = F->n, .F = *F, .area = area, .rho = reflectance};
    if (F->rows != NULL && way == REFERENCE_DENSE) TRY(factorize(r, error));
    *out = r;
    r = NULL;
done:
    reference_destroy(r);
    return status;
}

void reference_destroy(reference *r) {
    if (r == NULL) return;
    free(r->lu);
    free(r->pivots);
    free(r);
}

/* Seconds of one thread of an AMD EPYC with AVX-512, 2026: of an LU per n^3, of its solves per n^2 and
 * emission, of an iteration per entry of F, emission and sweep. */
static const double lu_seconds = 1.6e-11, solve_seconds = 6e-11, sweep_seconds = 1e-10;

/* Sweeps of conjugate gradients from a guess that is off by a tenth to eight digits. The eigenvalues of
 * I - R^1/2 S R^1/2 lie between 1 - rho and about 1, with rho near the mean of the reflectance. */
static double sweeps_expected(size_t n, const double *area, const float *rho) {
    static const double digits = 2e7, most = .99;
    double reflected = 0, all = 0;
    for (size_t i = 0; i < n; i++) {
        reflected += area[i] * (double)rho[i];
        all += area[i];
    }
    const double root = 1 / sqrt(1 - fmin(reflected / all, most));
    return 2 + log(digits) / log((root + 1) / fmax(root - 1, 1e-3));
}

/* Products with a guide: what the operator's answer lacks is wanted to four digits of itself, and each step
 * gives about two. Measured 2, and 3 where the operator is poor. */
static const double guided_steps = 3;

static double dense_seconds(double n, double m) {
    return n * n * (n * lu_seconds + m * solve_seconds);
}

double reference_seconds(double n, double entries, double m) {
    const double iterated = entries * m * guided_steps * sweep_seconds;
    return n > REFERENCE_DENSE_ELEMENTS ? iterated : fmin(iterated, dense_seconds(n, m));
}

reference_way reference_choose(const factor_product *F, const double *area, const float *rho, size_t m,
                               bool guided) {
    if (F->rows == NULL || F->n > REFERENCE_DENSE_ELEMENTS) return REFERENCE_ITERATED;
    const double entries = (double)F->rows->indptr[F->n];
    const double sweeps = guided ? guided_steps : sweeps_expected(F->n, area, rho);
    const double iterated = entries * (double)m * sweeps * sweep_seconds;
    return dense_seconds((double)F->n, (double)m) <= iterated ? REFERENCE_DENSE : REFERENCE_ITERATED;
}

static lam_status solve_dense(const reference *r, size_t m, const double *E, double *B, lam_error *error) {
    /* The row-major matrix is its own transpose to LAPACK, hence 'T'; a row of B is a column of it. */
    memcpy(B, E, m * r->n * sizeof *B);
    const lapack_int n = (lapack_int)r->n;
    const lapack_int info =
        LAPACKE_dgetrs(LAPACK_COL_MAJOR, 'T', n, (lapack_int)m, r->lu, n, r->pivots, B, n);
    if (info != 0)
        return status_fail(error, LAM_ERR_INTERNAL, "reference: LAPACK dgetrs returned %d", (int)info);
    return LAM_OK;
}

/* The space of an iteration on m vectors, each [n][m] with the vectors side by side. */
typedef struct iteration {
    size_t n, m;
    double *e, *u, *r, *p, *Kp, *t;
    double *root_area, *root_rho; /* [n] */
} iteration;

/* out = S in: S = A^1/2 F A^-1/2. t is scratch. */
static lam_status multiply_S(const reference *ref, iteration *it, const double *in, double *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = it->n, m = it->m;
#pragma omp parallel for schedule(static) if (n >= 2048)
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++) it->t[i * m + v] = in[i * m + v] / it->root_area[i];
    TRY(ref->F.multiply(ref->F.context, m, it->t, out, error));
#pragma omp parallel for schedule(static) if (n >= 2048)
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++) out[i * m + v] *= it->root_area[i];
done:
    return status;
}

/* sums[v] = sum_i x_iv y_iv */
static void dots(const iteration *it, const double *x, const double *y, double *sums) {
    memset(sums, 0, it->m * sizeof *sums);
    for (size_t i = 0; i < it->n; i++)
        for (size_t v = 0; v < it->m; v++) sums[v] += x[i * it->m + v] * y[i * it->m + v];
}

/* Conjugate gradients for (I - R^1/2 S R^1/2) u = R^1/2 S e, from the guess in u. Then h = S (e + R^1/2 u) is
 * A^1/2 times the irradiance: b = e + R h, safe where rho = 0. */
static lam_status iterate(const reference *ref, iteration *it, double tolerance, const progress *p,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = it->n, m = it->m;
    double rr[BLOCK], uu[BLOCK], pKp[BLOCK], next[BLOCK];
    /* r = R^1/2 S (e + R^1/2 u) - u */
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++)
            it->p[i * m + v] = it->e[i * m + v] + it->root_rho[i] * it->u[i * m + v];
    TRY(multiply_S(ref, it, it->p, it->r, error));
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++)
            it->r[i * m + v] = it->root_rho[i] * it->r[i * m + v] - it->u[i * m + v];
    memcpy(it->p, it->r, n * m * sizeof *it->p);
    dots(it, it->r, it->r, rr);

    for (int sweep = 0; sweep < MAX_SWEEPS; sweep++) {
        if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        dots(it, it->u, it->u, uu);
        bool converged = true;
        for (size_t v = 0; v < m; v++) converged = converged && rr[v] <= tolerance * tolerance * uu[v];
        if (converged) goto done;

        /* Kp = p - R^1/2 S R^1/2 p; Kp holds R^1/2 p meanwhile, its second half the image. */
        for (size_t i = 0; i < n; i++)
            for (size_t v = 0; v < m; v++) it->Kp[i * m + v] = it->root_rho[i] * it->p[i * m + v];
        double *image = it->Kp + n * m;
        TRY(multiply_S(ref, it, it->Kp, image, error));
        for (size_t i = 0; i < n; i++)
            for (size_t v = 0; v < m; v++)
                it->Kp[i * m + v] = it->p[i * m + v] - it->root_rho[i] * image[i * m + v];
        dots(it, it->p, it->Kp, pKp);
        for (size_t v = 0; v < m; v++) pKp[v] = pKp[v] > 0 ? rr[v] / pKp[v] : 0;
        for (size_t i = 0; i < n; i++)
            for (size_t v = 0; v < m; v++) {
                it->u[i * m + v] += pKp[v] * it->p[i * m + v];
                it->r[i * m + v] -= pKp[v] * it->Kp[i * m + v];
            }
        dots(it, it->r, it->r, next);
        for (size_t v = 0; v < m; v++) pKp[v] = rr[v] > 0 ? next[v] / rr[v] : 0;
        for (size_t i = 0; i < n; i++)
            for (size_t v = 0; v < m; v++) it->p[i * m + v] = it->r[i * m + v] + pKp[v] * it->p[i * m + v];
        memcpy(rr, next, sizeof rr);
    }
    FAIL(error, LAM_ERR_NUMERIC, "the reference did not converge in %d sweeps; lower the largest reflectance",
         MAX_SWEEPS);
done:
    return status;
}

static lam_status iteration_init(iteration *it, const reference *ref, size_t m, lam_error *error) {
    const size_t n = ref->n, values = n * m;
    *it = (iteration){.n = n, .m = m};
    it->e = memory_allocate(values, sizeof *it->e, "reference", error);
    it->u = memory_allocate(values, sizeof *it->u, "reference", error);
    it->r = memory_allocate(values, sizeof *it->r, "reference", error);
    it->p = memory_allocate(values, sizeof *it->p, "reference", error);
    it->Kp = memory_allocate(values, 2 * sizeof *it->Kp, "reference", error);
    it->t = memory_allocate(values, sizeof *it->t, "reference", error);
    it->root_area = memory_allocate(n, sizeof *it->root_area, "reference", error);
    it->root_rho = memory_allocate(n, sizeof *it->root_rho, "reference", error);
    if (it->e == NULL || it->u == NULL || it->r == NULL || it->p == NULL || it->Kp == NULL || it->t == NULL ||
        it->root_area == NULL || it->root_rho == NULL)
        return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        it->root_area[i] = sqrt(ref->area[i]);
        it->root_rho[i] = sqrt((double)ref->rho[i]);
    }
    return LAM_OK;
}

static void iteration_free(iteration *it) {
    free(it->e);
    free(it->u);
    free(it->r);
    free(it->p);
    free(it->Kp);
    free(it->t);
    free(it->root_area);
    free(it->root_rho);
}

/* One block of at most BLOCK vectors. */
static lam_status solve_block(const reference *ref, iteration *it, const double *E, double *B,
                              double tolerance, const progress *p, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = it->n, m = it->m;
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++) {
            /* The guess: rho h = b - e, so u = R^1/2 h = (b - e) / R^1/2. */
            it->e[i * m + v] = it->root_area[i] * E[v * n + i];
            const double bounced = it->root_area[i] * (B[v * n + i] - E[v * n + i]);
            it->u[i * m + v] = it->root_rho[i] > 0 ? bounced / it->root_rho[i] : 0;
        }
    TRY(iterate(ref, it, tolerance, p, error));
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++)
            it->p[i * m + v] = it->e[i * m + v] + it->root_rho[i] * it->u[i * m + v];
    TRY(multiply_S(ref, it, it->p, it->r, error));
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++)
            B[v * n + i] = E[v * n + i] + (double)ref->rho[i] * it->r[i * m + v] / it->root_area[i];
done:
    return status;
}

lam_status reference_solve(const reference *r, size_t m, const double *E, double *B, double tolerance,
                           const progress *p, lam_error *error) {
    lam_status status = LAM_OK;
    iteration it = {0};
    if (r->lu != NULL) return solve_dense(r, m, E, B, error);
    for (size_t first = 0; first < m; first += BLOCK) {
        const size_t count = m - first < BLOCK ? m - first : BLOCK;
        if (it.m != count) {
            iteration_free(&it);
            TRY(iteration_init(&it, r, count, error));
        }
        TRY(solve_block(r, &it, E + first * r->n, B + first * r->n, tolerance, p, error));
    }
done:
    iteration_free(&it);
    return status;
}
