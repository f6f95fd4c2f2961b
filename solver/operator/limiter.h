/* The limiter of answers: no light below zero where no emission is. It works on values that an operator gave;
 * it knows neither kinds nor names of groups.
 *
 * Limited is x = out - direct, the part of an answer that is reflected: direct is E + rho H0 of radiosity, H0
 * of irradiance and 0 of indirect light; in a store of few emitters 0 of all. The elements of each group of
 * the scene stand in mesh order, cut into blocks of LIMITER_BLOCK, over which a binary tree adds up the sums
 * S = sum A x. From the root down a node hands its sum on to its children; where the sum of one is not above
 * 0 that child gets 0, and the sum of the other is scaled down to that of the node. In a block x becomes
 * max(x - l, 0), of the level l that leaves its sum: of all that are nowhere negative and have that sum it is
 * the one nearest to x, by area. Thus a group whose sum is not negative keeps it,
 * and so does each cluster beside which no cluster is negative; a group whose sum is negative gets 0. The
 * limiter is that of positivity-preserving finite volumes: Zhang, Shu 2010, J. Comput. Phys.
 * 229(9):3091-3120. */
#ifndef LAMBERT_OPERATOR_LIMITER_H
#define LAMBERT_OPERATOR_LIMITER_H

#include "solver/operator/operator.h"

#define LIMITER_BLOCK 32

/* Elements start[g] ... start[g + 1] - 1 of the list `elements` are those of group g, in mesh order; area is
 * [n]. All are borrowed, but of lam_limiter_open. */
struct lam_limiter {
    size_t n, n_groups, most; /* most: elements of the largest group */
    const uint32_t *start, *elements;
    const double *area;
    void *owned[3]; /* by lam_limiter_open */
};

/* A limiter of these arrays, which it borrows. */
lam_limiter limiter_of(size_t n, size_t n_groups, const uint32_t *start, const uint32_t *elements,
                       const double *area);

/* The light of an answer: E and H0 [n_rhs][C][n], where H0 may be NULL; of a store of few emitters W
 * [n_rhs][C][s] alone. A vector's channel in which one of them is negative is left as it is. */
typedef struct limiter_light {
    const float *E, *H0, *W;
} limiter_light;

/* Limits out [n_rhs][C][n], or, where selected is not NULL, [n_rhs][C][n_selected] of these elements, which
 * must be all elements of some groups, each once. limited (NULL: nobody asks) gets for each vector the number
 * of elements that were below zero, once for each channel. work holds lam_limiter_work_bytes. The bits of a
 * group depend on its own values alone, hence neither on the batch nor on threads or on what is selected. A
 * group with a value that is not finite stays as it is. Cost: a look at each value; where one of a row is
 * negative, two passes over the row. */
void limiter_limit(const lam_limiter *l, const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                   const limiter_light *light, size_t n_selected, const uint32_t *selected, float *out,
                   size_t *limited, void *work);

/* All elements of the groups of some elements: *elements (the caller frees) group by group, each in mesh
 * order. Errors: LAM_ERR_MEMORY. */
lam_status limiter_whole_groups(const lam_limiter *l, size_t n_selected, const uint32_t *selected,
                                uint32_t **elements, size_t *count, lam_error *error);

#endif
