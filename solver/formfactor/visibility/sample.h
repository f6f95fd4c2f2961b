/* Samples: low-discrepancy origins over an element's area and cosine-weighted directions over its hemisphere,
 * and point pairs on two elements. A sample depends on (seed, element, index) alone, never on threads. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_SAMPLE_H
#define LAMBERT_FORMFACTOR_VISIBILITY_SAMPLE_H

#include "solver/formfactor/visibility/visibility.h"

/* A right-handed orthonormal frame of an element; the tangent runs along its first edge. */
typedef struct element_frame {
    float tangent[3], bitangent[3], normal[3];
} element_frame;

/* Sets the frame of an element. */
void element_frame_init(element_frame *f, const mesh *m, size_t element);

enum { SAMPLE_TABLE_BITS = 5, SAMPLE_TABLE = 1 << SAMPLE_TABLE_BITS };

/* The constants of sampling one element: its pieces in recentred coordinates and its frame. */
typedef struct element_sampler {
    float corner[2][3]; /* origin of each half (a parallelogram has one piece) */
    float edge[2][2][3];
    bool parallelogram;
    float first_share; /* of the area that the first triangle takes */
    element_frame frame;
    /* Sobol's sequence (sobol.h), shifted by random bits of (seed, element): coordinate d of point k is
     * low[d][k mod 32] ^ middle[d][k / 32 mod 32] ^ that of the higher bits of k. */
    uint32_t low[4][SAMPLE_TABLE], middle[4][SAMPLE_TABLE];
} element_sampler;

void element_sampler_init(element_sampler *s, const mesh *m, const visibility *v, size_t element,
                          uint64_t seed);

/* Rays first ... first+7 of the element: origins uniform over its area, directions cosine-weighted. */
void element_sampler_packet(const element_sampler *s, uint32_t first, ray_packet *rays);

/* The same for any eight rays. */
void element_sampler_packet_of(const element_sampler *s, const uint32_t index[VISIBILITY_PACKET],
                               ray_packet *rays);

/* Turns rays of the element about its plane, so that they go from its back. */
void element_sampler_turn(const element_sampler *s, ray_packet *rays);

/* Rays that element_sampler_order sorts at most. */
enum { SAMPLE_ORDERED = 1024 };

/* order, [count]: the rays first ... first+count-1, those of similar directions beside each other. A packet
 * of such rays meets the same parts of the scene and is cast in about 60 % of the time. */
void element_sampler_order(const element_sampler *s, uint32_t first, size_t count,
                           uint32_t order[SAMPLE_ORDERED]);

/* The point of the element at (u, w) in the unit square, its sides included; the map preserves area. */
void element_sampler_point(const element_sampler *s, float u, float w, float point[3]);

/* Point pairs on two elements: a Sobol' sequence, digitally shifted, so that each point is uniform in the
 * cube. A sample depends on (seed, i, j, index) alone. Its first 2^k points are spread evenly; other numbers
 * are hardly better than the next smaller power of two. */
typedef struct pair_sampler {
    uint32_t shift[4];
} pair_sampler;

void pair_sampler_init(pair_sampler *s, uint64_t seed, size_t i, size_t j);

/* The index-th point of the unit cube in four dimensions: two for each of the elements. */
void pair_sampler_place(const pair_sampler *s, uint32_t index, double x[4]);

/* The points first ... first+7, one array for each dimension; first is a multiple of 8. */
void pair_sampler_packet(const pair_sampler *s, uint32_t first, double x[4][VISIBILITY_PACKET]);

#endif
