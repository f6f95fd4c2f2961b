/* Form factors compressed, with a bound on what that changes. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_COMPRESS_H
#define LAMBERT_METHOD_HIERARCHICAL_COMPRESS_H

#include "solver/base/progress.h"
#include "solver/operator/refine/compressed_factors.h"

typedef struct compress_input {
    const csr *F;              /* rows, A_i F_ij = A_j F_ji but for rounding to single precision */
    const double *area;        /* [n] */
    const double (*centre)[3]; /* [n] */
    const float (*normal)[3];  /* [n] unit */
    const uint32_t *group;     /* [n] below n_groups */
    size_t n_groups;
    const bool *shines; /* [n_groups]: first light of those is kept before that of others */
    double threshold;   /* a number of S is kept that adds so much to an element's light, of norm 1 */
    size_t most;        /* numbers; where there were more there is no use in it. 0: any */
    size_t n_threads;
    const progress *progress;
} compress_input;

/* A threshold that suits an operator of this epsilon: far finer. */
double compress_threshold(double epsilon);

/* Groups whose first light is kept, at most. */
enum { COMPRESS_LIT_MOST = 16 };

/* Of S = W A^1/2 F A^-1/2 W^T the upper triangle as far as it is above the threshold; all of S is found, in
 * double, row by row of a node of the tree and those of what it hands up, so that what is left out is known
 * exactly. Not finished (compressed_finish); freed with compressed_free; n is 0 where it would have more
 * numbers than `most`. Cost: O(n^2), 500 n operations for each of n / 3 nodes; memory: about 60 n numbers a
 * thread. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_NUMERIC. */
lam_status compress_form_factors(const compress_input *input, compressed_factors *out, lam_error *error);

#endif
