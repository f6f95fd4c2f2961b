/* Where rays start and where they go: low-discrepancy points over an element's area and its hemisphere.
 * A sample depends on (seed, element, index) alone, so results never depend on threads. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_SAMPLE_H
#define LAMBERT_FORMFACTOR_VISIBILITY_SAMPLE_H

#include "solver/formfactor/visibility/visibility.h"

/* Unit vectors along and across an element and away from its front: right-handed. */
typedef struct element_frame {
    float tangent[3], bitangent[3], normal[3];
} element_frame;

/* Turned so that the tangent runs along the first edge. */
void element_frame_init(element_frame *f, const mesh *m, size_t element);

/* An element ready to be sampled: its pieces in recentred coordinates and its frame. */
typedef struct element_sampler {
    float corner[2][3]; /* origin of each half (a parallelogram has one piece) */
    float edge[2][2][3];
    bool parallelogram;
    float first_share; /* of the area that the first triangle takes */
    element_frame frame;
    uint32_t shift[4]; /* of the sequence, from (seed, element) */
} element_sampler;

void element_sampler_init(element_sampler *s, const mesh *m, const visibility *v, size_t element,
                          uint64_t seed);

/* Rays first ... first+7 of the element: origins uniform over its area, directions cosine-weighted. */
void element_sampler_packet(const element_sampler *s, uint32_t first, ray_packet *rays);

/* The point of the element at (u, w) in the unit square, which is mapped to it with one area everywhere. */
void element_sampler_point(const element_sampler *s, float u, float w, float point[3]);

/* Pairs of points on two elements. A sample depends on (seed, i, j, index) alone. */
typedef struct pair_sampler {
    uint32_t shift[4];
} pair_sampler;

void pair_sampler_init(pair_sampler *s, uint64_t seed, size_t i, size_t j);

/* The index-th point of the unit cube in four dimensions: two for each of the elements. */
void pair_sampler_place(const pair_sampler *s, uint32_t index, double x[4]);

/* The same from index first on, for a packet. */
void pair_sampler_packet(const pair_sampler *s, uint32_t first, double x[4][VISIBILITY_PACKET]);

#endif
