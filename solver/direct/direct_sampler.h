/* Samples of the direct light of placed luminaires at near points, where differences between the points
 * matter and their number is large: unbiased but for housings, which hide nothing from any luminaire here.
 * Immutable once created: any number of threads may ask. */
#ifndef LAMBERT_DIRECT_DIRECT_SAMPLER_H
#define LAMBERT_DIRECT_DIRECT_SAMPLER_H

#include "solver/luminaire/placed.h"
#include "solver/scene/mesh.h"

/* Independent halves of an estimate, and samples of each. */
enum { DIRECT_HALVES = 2, DIRECT_SAMPLES = 32 };

typedef struct direct_sampler direct_sampler;

enum { DIRECT_SAMPLED = 1024 };

/* Luminaires shine as dim as the list says, or, where all are dark, in full; of more than DIRECT_SAMPLED as
 * many stand for all. Mesh and list must outlive it. Freed by direct_sampler_free. Errors: LAM_ERR_ARGUMENT
 * for a group that the scene does not have, LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status direct_sampler_create(const mesh *m, const placed_luminaires *p, direct_sampler **out,
                                 lam_error *error);
void direct_sampler_free(direct_sampler *s);

/* Adds the irradiance of points with one normal to E [n_points][DIRECT_HALVES][stride], of which the first
 * channels of the mesh get it. All points have the same places on the openings, which the key chooses. Cost:
 * O(luminaires), and 64 segments a point. */
void direct_sampler_add(const direct_sampler *s, const double normal[3], uint64_t key, size_t n_points,
                        const double (*points)[3], size_t stride, double *E);

#endif
