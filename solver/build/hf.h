/* The hierarchical factorization (Aguerre 2016; thesis chapter 3, algorithm 4). */
#ifndef LAMBERT_BUILD_HF_H
#define LAMBERT_BUILD_HF_H

#include "solver/build/tsvd.h"
#include "solver/matrix/scaled.h"
#include "solver/progress.h"

typedef struct hf_options {
    double epsilon; /* |S - Q V^T|_2 <= epsilon (eq. 3.10) */
    double alpha;   /* its share between parents and children (eq. 3.11), in (0, 1) */
    int levels;     /* of the recursion */
    size_t rank;    /* 0, or the number of columns kept at every node in place of epsilon */
    const progress *progress;
} hf_options;

/* Levels that suit n columns: leaves of 512 columns or more, but no leaf asked for less than half of noise,
 * the sampling error of S in the 2-norm (0: none known): below it every column is kept and nothing is gained.
 * Leaves beyond 8,192 columns are split all the same: their eigenvectors would cost more than that. */
int hf_levels(size_t n, double epsilon, double alpha, double noise);

/* S ~ Q V^T with V orthonormal; Q has rows in mesh order, V rows in position order (order[position] = element
 * gives the columns of S their place). Both column-major, out->n = out->m = n. One pass over the columns.
 * Cost: O(n^2 leaf + n k^2 levels). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED. */
lam_status hf_factorize(const scaled_matrix *S, const uint32_t *order, const hf_options *options,
                        tall_factors *out, lam_error *error);

#endif
