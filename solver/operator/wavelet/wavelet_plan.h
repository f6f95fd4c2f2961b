/* The transforms of a basis when only some coefficients are used. A subtree with none in use becomes one
 * matrix from its elements to its scaling coefficients, and coefficients are renumbered without those of
 * unused nodes. */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELET_PLAN_H
#define LAMBERT_OPERATOR_WAVELET_WAVELET_PLAN_H

#include "solver/operator/wavelet/wavelets.h"

/* A node of the basis, or a subtree that is one matrix. */
typedef struct plan_step {
    const float *columns,
        *rows;             /* the padded matrix of its shape; a subtree has rows [scaling][count] alone */
    uint32_t begin, count; /* its positions, when it is a leaf or a subtree */
    uint32_t left;         /* the step of its left child; the right one is the step before it */
    uint32_t parent;       /* WAVELET_NONE: it is the root */
    uint32_t first;        /* its first coefficient */
    uint8_t inputs, scaling, from_left, own; /* own: wavelet coefficients; 0: none in use */
    bool whole;                              /* a subtree */
} plan_step;

typedef struct wavelet_plan {
    size_t n, n_used; /* elements, coefficients */
    size_t n_steps, n_pieces, n_above;
    plan_step *steps; /* postorder */
    float *matrices;  /* of subtrees, n_numbers floats */
    size_t n_numbers;
    uint32_t *coefficient; /* [n_used], its number in the basis, ascending */
    uint32_t *leaves;      /* [n_leaves], leaves and subtrees in the order of positions */
    size_t n_leaves;
    wavelet_piece *pieces;             /* [n_pieces], steps that one thread takes at a time */
    size_t most_steps, most_positions; /* of a piece */
    uint32_t *above;                   /* [n_above], steps outside all pieces */
} wavelet_plan;

void wavelet_plan_free(wavelet_plan *plan);

/* Frees the arrays; the numbers of steps, pieces and so on stay. */
void wavelet_plan_rest(wavelet_plan *plan);

/* used: [n] by coefficient of the basis, which must outlive the plan. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_plan_create(const wavelets *basis, const bool *used, wavelet_plan *out, lam_error *error);

/* The first position of a piece, and that behind its last. */
static inline size_t wavelet_piece_begin(const wavelet_plan *plan, const wavelet_piece *piece) {
    return plan->steps[piece->last - 1].begin;
}

static inline size_t wavelet_piece_end(const wavelet_plan *plan, const wavelet_piece *piece) {
    return wavelet_piece_begin(plan, piece) + plan->steps[piece->last - 1].count;
}

/* Floats of work for a transform. */
static inline size_t wavelet_plan_work(const wavelet_plan *plan) {
    return plan->n_steps * WAVELET_SCALING;
}

/* True when all of x [count] is 0. */
bool wavelet_is_dark(const float *x, size_t count);

/* Work on one piece, its positions first to last - 1, by the thread that transforms it while they are in its
 * cache: X gets its numbers before the forward transform, or is read after the inverse. Either may be NULL.
 */
typedef void wavelet_visit(void *context, size_t piece, size_t first, size_t last);

/* C_i = scale_i (W X)_i, the used coefficients alone, and X = W^T C. scale is [n_used], with 8 numbers more;
 * NULL: 1. The forward transform skips pieces in which X is 0. The bits do not depend on n_threads. */
void wavelet_plan_forward(const wavelet_plan *plan, wavelet_visit *fill, void *context, const float *X,
                          const float *scale, float *C, float *work, size_t n_threads);
void wavelet_plan_inverse(const wavelet_plan *plan, const float *C, float *X, wavelet_visit *use,
                          void *context, float *work, size_t n_threads);

/* Both transforms of one vector at the positions of some steps alone, which are ascending and reach up to the
 * root (wavelet_paths.h). The forward one, of an X that is 0 wherever else, writes all C; it has the numbers
 * of wavelet_plan_forward, but that a 0 may have another sign. The inverse one has the bits of
 * wavelet_plan_inverse; the rest of X is not written. */
void wavelet_plan_forward_some(const wavelet_plan *plan, size_t n_steps, const uint32_t *steps,
                               const float *X, const float *scale, float *C, float *work);
void wavelet_plan_inverse_some(const wavelet_plan *plan, size_t n_steps, const uint32_t *steps,
                               const float *C, float *X, float *work);

/* Bytes that a transform reads. */
size_t wavelet_plan_bytes(const wavelet_plan *plan);

#endif
