/* A basis of wavelets on a random tree, and what it does, dense. */
#ifndef LAMBERT_TESTS_RANDOM_BASIS_H
#define LAMBERT_TESTS_RANDOM_BASIS_H

#include "solver/operator/wavelet/wavelets.h"
#include "support/dense.h"

/* A tree of leaves with 1 to 7 elements, every node with a matrix of its own that is not far from one that
 * only swaps and turns signs. W is what it does to all positions, size the magnitudes of the products behind
 * it, and the return value how often each of those is rounded. */
double random_basis(size_t n, uint64_t *state, wavelets *basis, double *W, double *size);

#endif
