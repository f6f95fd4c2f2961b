/* The transforms of a basis of which only some coefficients are ever used: subtrees without any are one
 * matrix from their elements to what they hand up, and coefficients are numbered without those of nodes that
 * have none in use. */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELET_PLAN_H
#define LAMBERT_OPERATOR_WAVELET_WAVELET_PLAN_H

#include "solver/operator/wavelet/wavelets.h"

/* A node of the basis, or a whole subtree. */
typedef struct plan_step {
    const float *columns, *rows; /* of its shape, padded; of a subtree rows [scaling][count] alone */
    uint32_t begin, count;       /* its positions, where it takes them itself */
    uint32_t left;               /* the step of its left child; the right one is the step before it */
    uint32_t parent;             /* WAVELET_NONE: it is the root */
    uint32_t first;              /* its first coefficient */
    uint8_t inputs, scaling, from_left, own; /* own: coefficients, 0: none in use */
    bool whole;                              /* a subtree */
} plan_step;

typedef struct wavelet_plan {
    size_t n, n_used; /* elements, coefficients */
    size_t n_steps, n_pieces, n_above;
    plan_step *steps; /* postorder */
    float *matrices;  /* of subtrees, n_numbers in all */
    size_t n_numbers;
    uint32_t *coefficient; /* [n_used], its number in the basis, ascending */
    uint32_t *leaves;      /* [n_leaves], steps that take positions themselves, in their order */
    size_t n_leaves;
    wavelet_piece *pieces; /* [n_pieces], steps that a thread takes at once */
    uint32_t *above;       /* [n_above], steps in none */
} wavelet_plan;

void wavelet_plan_free(wavelet_plan *plan);

/* used: [n] by coefficient of the basis, which must outlive the plan. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_plan_create(const wavelets *basis, const bool *used, wavelet_plan *out, lam_error *error);

/* Floats of work for one vector. */
static inline size_t wavelet_plan_work(const wavelet_plan *plan) {
    return plan->n_steps * WAVELET_SCALING;
}

/* What is 0 in X is passed over.
 *
 * C_v = W X_v without what is not in use: X_v = X + v n, C_v = C + v n_used; and X_v = W^T C_v. The bits
 * depend on neither m nor n_threads. */
void wavelet_plan_forward(const wavelet_plan *plan, size_t m, const float *X, float *C, float *work,
                          size_t n_threads);
void wavelet_plan_inverse(const wavelet_plan *plan, size_t m, const float *C, float *X, float *work,
                          size_t n_threads);

/* The steps that some positions are made by, ascending: out has room for n_steps, flags [n_steps] are 0 and
 * are 0 again. Returns their number. */
size_t wavelet_plan_paths(const wavelet_plan *plan, size_t count, const uint32_t *positions, uint8_t *flags,
                          uint32_t *out);

/* The coefficients that these steps take, ascending: out has room for n_used. Returns their number. */
size_t wavelet_plan_coefficients(const wavelet_plan *plan, size_t n_steps, const uint32_t *steps,
                                 uint32_t *out);

/* The inverse of one vector where these steps end; the rest of X is not written. The same bits there. */
void wavelet_plan_inverse_some(const wavelet_plan *plan, size_t n_steps, const uint32_t *steps,
                               const float *C, float *X, float *work);

/* Bytes that a transform reads. */
size_t wavelet_plan_bytes(const wavelet_plan *plan);

#endif
