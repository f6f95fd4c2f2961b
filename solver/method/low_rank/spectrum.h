/* Estimates how the singular values of S fall, without computing any of them. */
#ifndef LAMBERT_METHOD_LOW_RANK_SPECTRUM_H
#define LAMBERT_METHOD_LOW_RANK_SPECTRUM_H

#include "solver/base/progress.h"
#include "solver/linalg/scaled.h"

/* Where the singular values of S, n of them, lie: count[k] of them about value[k]. */
typedef struct spectrum {
    size_t nodes;
    double *value; /* [nodes], falling */
    double *count; /* [nodes], together n */
} spectrum;

void spectrum_free(spectrum *s);

/* Stochastic Lanczos quadrature (Golub and Meurant 2010, ch. 11): a random unit vector meets all
 * eigenvectors of S alike, so the Gauss rule of the Lanczos steps from it counts eigenvalues; the rules of
 * eight vectors are joined. The number above x is accurate to a few per cent where the values lie close, and
 * useless for the few largest. Cost: `steps` products
 * of S with eight vectors, memory for 24 n numbers. Deterministic in seed.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED, those of the source of S. */
lam_status spectrum_find(const scaled_matrix *S, size_t steps, uint64_t seed, const progress *told,
                         spectrum *out, lam_error *error);

/* About how many singular values are above x. Between two nodes the count is taken to change evenly. */
double spectrum_above(const spectrum *s, double x);

/* Sum of the squares of those up to x over that of all: the square of |S - S_k|_F / |S|_F for the best S_k
 * that keeps what is above x. 0 where S is 0. */
double spectrum_tail(const spectrum *s, double x);

/* Factorizers keep their bound everywhere and so more columns than a rank needs: their error is about .7 of
 * the bound. The rank that one of bound epsilon is going to have, and the square of what it leaves out of S
 * over |S|_F^2, by this measure. */
double spectrum_rank(const spectrum *s, double epsilon);
double spectrum_left(const spectrum *s, double epsilon);

/* Lanczos steps that are enough for these. */
enum { SPECTRUM_STEPS = 40 };

#endif
