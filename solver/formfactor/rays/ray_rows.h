/* Rows of form factors that rays find as they are asked for, each once, and that nobody keeps: memory does
 * not grow with rays. Merging the two estimates of each pair is left to who takes them. */
#ifndef LAMBERT_FORMFACTOR_RAYS_RAY_ROWS_H
#define LAMBERT_FORMFACTOR_RAYS_RAY_ROWS_H

#include "solver/formfactor/formfactor.h"
#include "solver/linalg/row_source.h"

typedef struct ray_rows ray_rows;

/* Whether form factors of a recipe can come so: those of rays, with near pairs or without. */
bool ray_rows_can(const recipe *r);

/* Finds the near pairs, where the recipe has any, which are kept. The mesh must outlive the rows; of the
 * options neither a scratch folder nor a place for large arrays is used. Errors: as of form_factors_make. */
lam_status ray_rows_create(const mesh *m, const form_factor_options *options, ray_rows **out,
                           lam_error *error);
void ray_rows_destroy(ray_rows *r);

/* The rows as a stream, which lives no longer than they do:
 *
 * rows: F1, what the rays of an element give of F, so that A F = A F1 + F1^T A with
 *     A_i F1_ij = c_ij/rays * A_i A_j/(A_i + A_j)
 * which weighs both estimates of a pair by their inverse variances (upper.h); of near pairs half of F.
 * close: s = sum / (sum + outside) with the sums of A^-1 (A F1 + F1^T A) and the share of the rays that went
 * nowhere. The same in whatever sequence rows were found.
 * others: F by rays of another seed, scaled to those sums. */
void ray_rows_stream(ray_rows *r, uint64_t other_seed, row_stream *out);

/* All that form_factors says but the rows, after the stream was closed; not twice. */
form_factors ray_rows_take(ray_rows *r);

#endif
