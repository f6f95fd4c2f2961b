/* A stream of rows of form factors: each row is computed by rays when it is asked for, once, and not kept, so
 * that memory does not grow with rays. The consumer merges the two estimates of each pair. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_RAY_ROWS_H
#define LAMBERT_FORMFACTOR_PAIRS_RAY_ROWS_H

#include "solver/formfactor/formfactor.h"
#include "solver/linalg/row_source.h"

typedef struct ray_rows ray_rows;

/* True for recipes that can be streamed: rays, with or without near pairs. */
bool ray_rows_can(const recipe *r);

/* Computes and keeps the near pairs, where the recipe has any. The mesh must outlive the rows. The options'
 * scratch folder and place for large arrays are not used. Errors: as for form_factors_make. */
lam_status ray_rows_create(const mesh *m, const form_factor_options *options, ray_rows **out,
                           lam_error *error);
void ray_rows_destroy(ray_rows *r);

/* The rows as a stream, which must not outlive r:
 *
 * rows: F1, one side of F, so that A F = A F1 + (A F1)^T with
 *     A_i F1_ij = c_ij/rays * A_i A_j/(A_i + A_j)
 * which weighs the two estimates of a pair by their inverse variances (upper.h); for near pairs F1 = F/2.
 * close: the row sums s = sum / (sum + outside), with sum of A^-1 (A F1 + (A F1)^T) and outside the share of
 * the rays that hit no front. The same for any sequence of rows. others: one-sided F by rays of another seed,
 * scaled to those sums. noise_share: the root of the mean of sum_j 2 A_i F_ij / (A_i + A_j), by 64 rays of
 * each of 1,024 elements, to about 1 %. */
void ray_rows_stream(ray_rows *r, uint64_t other_seed, row_stream *out);

/* Moves everything of form_factors but the rows out of r, after the stream was closed. */
form_factors ray_rows_take(ray_rows *r);

#endif
