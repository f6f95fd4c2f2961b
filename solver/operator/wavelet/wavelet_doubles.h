/* The transforms of a basis in double, one vector at a time: where digits count more than time. */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELET_DOUBLES_H
#define LAMBERT_OPERATOR_WAVELET_WAVELET_DOUBLES_H

#include "solver/operator/wavelet/wavelets.h"

/* Doubles of work that a transform takes. */
static inline size_t wavelet_doubles_work(const wavelets *w) {
    return w->n_nodes * WAVELET_SCALING;
}

/* c = W x and x = W^T c: x [n] by position, c [n] by coefficient. Each number is rounded in sums of at most
 * eight products, once for every node above its element. */
void wavelet_doubles_forward(const wavelets *w, const double *x, double *c, double *work);
void wavelet_doubles_inverse(const wavelets *w, const double *c, double *x, double *work);

#endif
