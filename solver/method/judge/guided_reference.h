/* Corrections of an operator's answers to the converged solution of given form factors, in double: the
 * operator that is judged guides the iteration, but decides nothing about where it ends. */
#ifndef LAMBERT_METHOD_GUIDED_REFERENCE_H
#define LAMBERT_METHOD_GUIDED_REFERENCE_H

#include "solver/method/reference.h"
#include "solver/operator/operator.h"

/* An approximate answer X to emissions r, both [m][C][n], by an operator that is judged. */
typedef struct reference_guide {
    lam_status (*answer)(void *context, size_t m, const double *r, double *X, lam_error *error);
    void *context;
} reference_guide;

/* A system of C channels: (I - R F) x = r. */
typedef struct reference_system {
    size_t n, n_channels;
    const factor_product *F;  /* with reciprocity */
    const double *area;       /* [n] */
    const float *reflectance; /* [C][n] */
    const bool *black;        /* [n], true of elements that reflect nothing and are judged by their irradiance
                                 (reference_answers); NULL: none is */
} reference_system;

/* X of m right sides r, both [m][C][n]; r is used up. Each is X := X + M r, r := r - (I - R F) M r with the
 * guide M, until the steps that are left, a geometric series, are below tolerance |X|; where a step is more
 * than half of the one before, by reference_solve from there on. Right sides come to their ends one by one.
 * With a guide that is off by a few hundredths it takes one product with F for each two digits. rate as in
 * reference_answers, NULL: no probe is trusted.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED, and those of the guide. */
lam_status guided_reference_correct(const reference_system *s, size_t m, double *r, double *X,
                                    double tolerance, const reference_guide *guide, double *rate,
                                    const progress *p, lam_error *error);

/* Emissions of an operator, and its answers. */
typedef struct reference_answers {
    const lam_operator *op;
    const float *E, *B; /* [][C][n] emission and the operator's radiosity, its irradiance of black elements */
    const float *direct; /* [][C][n] irradiance of black elements that comes from no element; NULL: 0 */
    const double
        *first; /* [][C][n] H, the light that E itself gives, in place of F E where `known`; NULL: F E
                 */
    const bool *known;
    const double *spread; /* [][C][n] D: H + share D is taken in place of H; NULL: H */
    double share;
    double *rate; /* the largest ratio of a step to the one before, of this operator and F so far; 0: of none.
                     Below .005 of eight probes or more, others are left with their first step, which is then
                     off by about so much. NULL: none is */
    const progress *progress;
} reference_answers;

/* Gets x [n], the converged B - B~ of answer v in a channel, of black elements H - H~. */
typedef void visit_correction(void *context, size_t v, size_t channel, const double *x);

/* Vectors of so many elements are most of a judge's memory, and fewer of them together cost no time. */
#define REFERENCE_MANY_ELEMENTS ((size_t)1 << 18)

/* Columns, of a probe and a channel, that guided_reference_each solves together: a whole number of probes. */
size_t guided_reference_columns(size_t n, size_t n_channels);

/* True where guided_reference_each takes an LU for m answers. */
bool guided_reference_is_dense(const reference_system *s, const lam_operator *op, size_t m);

/* Visits the corrections of the answers which[m], converged to .002 of themselves, or to .005 where `rate`
 * allows it: of an LU where that takes less time, else guided by the operator, unless it answers only to
 * emitters. Errors: those above. */
lam_status guided_reference_each(const reference_system *s, const reference_answers *a, size_t m,
                                 const size_t *which, visit_correction *visit, void *context,
                                 lam_error *error);

#endif
