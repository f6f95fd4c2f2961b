#include "support/subject.h"

void subject_make(subject *s, const double size[3], unsigned divisions) {
    lam_error error = {0};
    s->f = fixture_box(size, divisions, .5f);
    row_source_of_csr(&s->rows, &s->f.F);
    ck_assert_int_eq(scaled_init(&s->S, &s->rows, s->f.m.area, s->f.order, &error), LAM_OK);
}

void subject_free(subject *s) {
    scaled_free(&s->S);
    fixture_free(&s->f);
}

tall_factors factors_of(const subject *s, const char *name, const factorizer_options *options,
                        factorizer_report *report) {
    tall_factors f = {0};
    lam_error error = {0};
    factorizer_report unread;
    ck_assert_msg(factorize(name, &s->S, options, &f, report != NULL ? report : &unread, &error) == LAM_OK,
                  "%s: %s", name, error.message);
    ck_assert_uint_eq(f.n, s->S.n);
    ck_assert_uint_eq(f.m, s->S.n);
    return f;
}

double *values_of_difference(const scaled_matrix *S, const tall_factors *f) {
    const size_t n = S->n;
    float *dense = malloc(n * n * sizeof *dense);
    double *D = malloc(n * n * sizeof *D), *values = malloc(n * sizeof *values),
           *extra = malloc(n * sizeof *extra);
    lam_error error = {0};
    ck_assert_int_eq(scaled_dense(S, dense, &error), LAM_OK);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double sum = (double)dense[i * n + j];
            for (size_t k = 0; f != NULL && k < f->rank; k++)
                sum -= (double)f->Q[i * f->rank + k] * (double)f->V[j * f->rank + k];
            D[i * n + j] = sum;
        }
    ck_assert_int_eq(LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', (int)n, (int)n, D, (int)n, values, NULL, 1,
                                    NULL, 1, extra),
                     0);
    free(dense);
    free(D);
    free(extra);
    return values;
}

double norm_of_difference(const scaled_matrix *S, const tall_factors *f) {
    double *values = values_of_difference(S, f);
    const double norm = values[0];
    free(values);
    return norm;
}

void check_orthonormal(const tall_factors *f) {
    for (size_t a = 0; a < f->rank; a++)
        for (size_t b = 0; b <= a; b++) {
            double dot = 0;
            for (size_t i = 0; i < f->m; i++)
                dot += (double)f->V[i * f->rank + a] * (double)f->V[i * f->rank + b];
            ck_assert_double_eq_tol(dot, a == b ? 1 : 0, 2e-5);
        }
}
