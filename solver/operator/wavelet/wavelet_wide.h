/* The transforms of a plan for WAVELET_WIDE vectors side by side, each with the bits that it has alone
 * (wavelet_plan.h): the tree is read once for all of them, and a lane never waits for another. */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELET_WIDE_H
#define LAMBERT_OPERATOR_WAVELET_WAVELET_WIDE_H

#include "solver/operator/wavelet/wavelet_plan.h"

enum { WAVELET_WIDE = 16 };

/* Work on one piece, its positions first to last - 1: X [last - first][WAVELET_WIDE] gets their numbers
 * before the forward transform, or has them after the inverse. */
typedef void wavelet_wide_visit(void *context, size_t piece, size_t first, size_t last, float *X);

/* Floats of work for a transform by so many threads. */
size_t wavelet_wide_work(const wavelet_plan *plan, size_t n_threads);

/* C_i = scale_i (W X)_i and X = W^T C: C is [n_used][WAVELET_WIDE], scale [n_used]. X is in memory piece by
 * piece, as fill writes it and use reads it, and is in the second cache of a core meanwhile. The inverse does
 * not change C. C and work are aligned to a cache line. The bits do not depend on n_threads. */
void wavelet_wide_forward(const wavelet_plan *plan, wavelet_wide_visit *fill, void *context,
                          const float *scale, float *C, float *work, size_t n_threads);
void wavelet_wide_inverse(const wavelet_plan *plan, float *C, wavelet_wide_visit *use, void *context,
                          float *work, size_t n_threads);

#endif
