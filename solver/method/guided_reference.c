#include "solver/method/guided_reference.h"

#include "solver/operator/emitters.h"

#include <stdlib.h>

/* Residual at which a reference counts as converged: four digits below the smallest error worth printing. */
static const double reference_tolerance = 1e-8;
/* The same where F is no rows, and each step costs as much as all of the operator's answers. */
static const double guided_tolerance = 1e-6;

/* The operator that is judged, on one channel, as the guide of an iteration. */
typedef struct operator_guide {
    const lam_operator *op;
    size_t channel;
} operator_guide;

static lam_status answer_one(const operator_guide *g, const double *E, float *in, float *out, void *work,
                             size_t bytes, double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(g->op), at = g->channel * n;
    for (size_t i = 0; i < n; i++) in[at + i] = (float)E[i];
    TRY(lam_operator_apply(g->op, 1, LAM_RADIOSITY, in, out, work, bytes, error));
    for (size_t i = 0; i < n; i++) B[i] = (double)out[at + i];
done:
    return status;
}

static lam_status answer_by_operator(void *context, size_t m, const double *E, double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const operator_guide *g = context;
    const size_t n = lam_operator_elements(g->op), vector = n * lam_operator_channels(g->op);
    const size_t bytes = lam_operator_work_bytes(g->op, 1);
    float *in = memory_allocate(vector, sizeof *in, "reference", error);
    float *out = memory_allocate(vector, sizeof *out, "reference", error);
    void *work = memory_allocate(1, bytes, "reference", error);
    if (in == NULL || out == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < m; v++) TRY(answer_one(g, E + v * n, in, out, work, bytes, B + v * n, error));
done:
    free(in);
    free(out);
    free(work);
    return status;
}

lam_status guided_reference_solve(const reference *r, const factor_product *F, const lam_operator *op,
                                  size_t channel, size_t m, const double *E, double *B, const progress *p,
                                  lam_error *error) {
    operator_guide of = {op, channel};
    const reference_guide guide = {answer_by_operator, &of};
    if (reference_is_dense(r) || lam_operator_emitters(op) > 0)
        return reference_solve(r, m, E, B, reference_tolerance, p, error);
    return reference_solve_guided(r, m, E, B, F->rows != NULL ? reference_tolerance : guided_tolerance,
                                  &guide, p, error);
}
