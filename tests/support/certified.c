#include "support/certified.h"

certified certified_make(const char *name, lam_operator *op, lam_form_factors *F) {
    certified s = {.name = name, .op = op, .F = F};
    lam_error error = {0};
    const size_t C = lam_operator_channels(op);
    ck_assert_msg(lam_refiner_create(op, F, &s.refiner, &error) == LAM_OK, "%s: %s", name, error.message);
    s.truth = calloc(C, sizeof *s.truth);
    for (size_t c = 0; c < C; c++)
        ck_assert_msg(reference_create(&F->F, F->area, op->reflectance + c * op->n, REFERENCE_DENSE,
                                       &s.truth[c], &error) == LAM_OK,
                      "%s: %s", name, error.message);
    return s;
}

void certified_free(certified *s) {
    for (size_t c = 0; c < lam_operator_channels(s->op); c++) reference_destroy(s->truth[c]);
    free(s->truth);
    lam_refiner_free(s->refiner);
    lam_form_factors_close(s->F);
    lam_operator_close(s->op);
}

/* sum_j F_ij x_j */
static long double certified_received(const csr *F, size_t i, const long double *x) {
    long double sum = 0;
    for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
        sum += (long double)F->data[p] * x[F->indices[p]];
    return sum;
}

/* B [n] of one channel, and E' [n]. */
static void certified_truth(const certified *s, size_t c, const double *E, const double *H0, long double *lit,
                            long double *B) {
    const size_t n = s->op->n;
    const float *rho = s->op->reflectance + c * n;
    double *right = calloc(n, sizeof *right), *step = calloc(n, sizeof *step);
    lam_error error;
    for (size_t i = 0; i < n; i++) {
        lit[i] = (long double)E[i] + (H0 != NULL ? (long double)rho[i] * (long double)H0[i] : 0);
        B[i] = 0;
    }
    /* Each round leaves about n cond u = 1e-8 of the error at most (cond < 1e5 here). */
    for (int round = 0; round < 3; round++) {
        for (size_t i = 0; i < n; i++)
            right[i] = (double)(lit[i] - B[i] + (long double)rho[i] * certified_received(&s->F->F, i, B));
        ck_assert(reference_solve(s->truth[c], 1, right, step, 1e-15, NULL, &error) == LAM_OK);
        for (size_t i = 0; i < n; i++) B[i] += (long double)step[i];
    }
    free(right);
    free(step);
}

double certified_check(const certified *s, size_t n_rhs, lam_quantity quantity, const double *E,
                       const double *H0, const float *start, double tolerance) {
    const size_t n = s->op->n, C = s->op->n_channels;
    double *out = malloc((n_rhs * C * n + 1) * sizeof *out),
           *certificates = malloc((n_rhs + 1) * sizeof *out);
    size_t *iterations = malloc((n_rhs + 1) * sizeof *iterations);
    long double *lit = calloc(n, sizeof *lit), *B = calloc(n, sizeof *B);
    double share = 0;
    lam_error error = {.message = ""};
    for (size_t k = 0; k < n_rhs * C * n; k++) out[k] = NAN;
    ck_assert_msg(lam_refine(s->refiner, n_rhs, quantity, E, H0, start, tolerance, out, certificates,
                             iterations, &error) == LAM_OK,
                  "%s: %s", s->name, error.message);
    for (size_t row = 0; row < n_rhs * C; row++) {
        const size_t v = row / C, c = row % C, at = row * n;
        const float *rho = s->op->reflectance + c * n;
        long double worst = 0, indirect = 0, largest = 0;
        certified_truth(s, c, E + at, H0 != NULL ? H0 + at : NULL, lit, B);
        for (size_t i = 0; i < n; i++) {
            long double right = B[i];
            if (quantity == LAM_INDIRECT) right -= lit[i];
            if (quantity == LAM_IRRADIANCE)
                right = (H0 != NULL ? (long double)H0[at + i] : 0) + certified_received(&s->F->F, i, B);
            worst = fmaxl(worst, fabsl((long double)out[at + i] - right));
            indirect = fmaxl(indirect, fabsl(B[i] - lit[i]));
            largest = fmaxl(largest, fabsl(right));
            if (rho[i] == 0 && H0 == NULL && quantity == LAM_RADIOSITY) ck_assert(out[at + i] == E[at + i]);
        }
        /* The truth is sums of n products in long double: n 2^-64 of the largest, n below 2^10. */
        const double slack = 0x1p-54 * (double)largest;
        ck_assert_msg((double)worst <= certificates[v] + slack,
                      "%s, quantity %d, tolerance %g, row %zu: error %Lg, certified %g after %zu", s->name,
                      (int)quantity, tolerance, row, worst, certificates[v], iterations[v]);
        if (certificates[v] > 0) share = fmax(share, (double)worst / certificates[v]);
        /* B~ - E' is within the tolerance of B - E'. Irradiance has a certificate of its own: rows sum to 1.
         * A vector's certificate is that of its worst channel. Where nothing bounces only E + rho H0 is
         * rounded. */
        if (quantity != LAM_IRRADIANCE && C == 1)
            ck_assert_msg(certificates[v] <= (indirect > 0 ? tolerance * (1 + tolerance) * (double)indirect
                                                           : 0x1p-51 * (double)largest),
                          "%s: certificate %g of %Lg, tolerance %g", s->name, certificates[v], indirect,
                          tolerance);
    }
    free(out);
    free(certificates);
    free(iterations);
    free(lit);
    free(B);
    return share;
}
