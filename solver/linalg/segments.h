/* Sums over runs of consecutive numbers: a V with one entry a row, kept as the index vector I (Fernández et
 * al. 2011, eq. 7). It knows runs, weights and vectors, no light. */
#ifndef LAMBERT_LINALG_SEGMENTS_H
#define LAMBERT_LINALG_SEGMENTS_H

#include "solver/base/cpu.h"
#include "store/status.h"

#include <stdint.h>

typedef struct segment_kernels segment_kernels;

/* Row j of V has weight_j in column p, where begin[p] <= j < begin[p+1], and nothing else. */
typedef struct segments {
    size_t n, k;
    uint64_t *begin;                /* [k+1], ascending from 0 to n, owned: the index vector I */
    float *weight;                  /* [n], owned; NULL: 1 */
    const segment_kernels *kernels; /* for this CPU */
} segments;

/* Takes begin and weight over when begin ascends from 0 to n and weights are finite; else the caller keeps
 * them and LAM_ERR_NUMERIC names the entry. */
lam_status segments_create(size_t n, size_t k, uint64_t *begin, float *weight, segments *s, lam_error *error);

/* A zeroed one is allowed. */
void segments_free(segments *s);

size_t segments_bytes(const segments *s);

/* t = V^T x: t_p = sum over run p of weight_j x_j, in double and rounded once. Products of two floats are
 * exact in double, and every run has one order of additions: the bits depend on x alone. Cost: O(n). */
void segments_sum(const segments *s, const float *x, float *t);

/* x = V t: x_j = weight_j t_p. Cost: O(n). */
void segments_spread(const segments *s, const float *t, float *x);

/* The kernels of one level, at most cpu_best(), which segments_create takes. For tests. */
const segment_kernels *segment_kernels_of(cpu_level level);

#endif
