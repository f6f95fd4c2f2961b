/* The visible share of the light between two flat clusters, by segments. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCK_SHADE_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCK_SHADE_H

#include "solver/formfactor/blocks/block_numbers.h"
#include "solver/formfactor/blocks/candidates.h"
#include "solver/formfactor/visibility/visibility.h"

typedef struct shade_scene {
    const flat_clusters *f;
    const occluders *occluders;
    const visibility *v;
    uint64_t seed;
} shade_scene;

/* Segments between two nodes: with few candidates these alone are tested, else the whole scene by Embree. out
 * [SEGMENT_LANES]; kernel [SEGMENT_LANES], unless NULL, gets cos cos' / r^2 of each. first: the number of
 * segments of the pair before these. Deterministic in (seed, a, b, first). */
void shade_segments(const shade_scene *s, uint32_t a, uint32_t b, const candidates *among, size_t first,
                    seen_segment out[SEGMENT_LANES], double *kernel);

#endif
