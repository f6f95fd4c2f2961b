/* Where rays start and where they go: low-discrepancy points over an element's area and its hemisphere.
 * A sample depends on (seed, element, index) alone, so results never depend on threads. */
#ifndef LAMBERT_FORMFACTOR_SAMPLE_H
#define LAMBERT_FORMFACTOR_SAMPLE_H

#include "solver/formfactor/visibility.h"

/* An element ready to be sampled: its pieces in recentred coordinates and its frame. */
typedef struct element_sampler {
    float corner[2][3]; /* origin of each half (a parallelogram has one piece) */
    float edge[2][2][3];
    bool parallelogram;
    float first_share; /* of the area that the first triangle takes */
    float tangent[3], bitangent[3], normal[3];
    uint32_t shift[4]; /* of the sequence, from (seed, element) */
} element_sampler;

void element_sampler_init(element_sampler *s, const mesh *m, const visibility *v, size_t element,
                          uint64_t seed);

/* Rays first ... first+7 of the element: origins uniform over its area, directions cosine-weighted. */
void element_sampler_packet(const element_sampler *s, uint32_t first, ray_packet *rays);

#endif
