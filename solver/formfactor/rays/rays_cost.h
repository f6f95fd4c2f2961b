/* Laws of rays: their cost in a scene, and how their noise falls. */
#ifndef LAMBERT_FORMFACTOR_RAYS_RAYS_COST_H
#define LAMBERT_FORMFACTOR_RAYS_RAYS_COST_H

#include "solver/formfactor/source.h"

/* Seconds of so many rays from every element, and the entries of the triangle that they make, as part of
 * another source. Cost: some thousand rays. Errors: LAM_ERR_MEMORY. */
lam_status rays_work(const mesh *m, size_t rays, factor_cost *out, lam_error *error);

/* The cost of a source of them alone: seconds and measured of so many rays from every element, by the boxes
 * that some rays cross, entries and hits. Cost and errors as above. */
lam_status rays_cost(const mesh *m, size_t rays, factor_cost *out, lam_error *error);

/* N rays of an element i: its row sums up to 1; the mean of both estimates of an exchange area, weighted by
 * inverse variances, has the variance g_ij / N A_i A_j / (A_i + A_j), so that the sum of a row has at most
 * sum_j F_ij A_j / (A_i + A_j) / N < 1 / N. 0 of no rays. */
double rays_repair(const recipe *r);

/* Columns of a source whose rows are those of its rays. The judge's samples are two, of half the rays each.
 */
recipe rays_halved(const recipe *r, size_t rays);
double rays_bytes(double n, const recipe *r);
double rays_packed_bytes(double n, const recipe *r);
double rays_stored_bytes(double n, const recipe *r);

/* Columns of a source whose noise falls as the root of its rays. */
void rays_finer(recipe *r, double error, double wanted, const factor_knobs *knobs);
void rays_advise(const recipe *r, double error, double most, bool finest, char option[64]);

#endif
