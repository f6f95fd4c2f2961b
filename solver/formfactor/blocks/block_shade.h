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
    const mesh *glass; /* has panes; NULL: there are none */
    uint64_t seed;
} shade_scene;

/* Segments between two nodes: with few candidates these alone are tested, else the whole scene by Embree. out
 * [SEGMENT_LANES]. Deterministic in (seed, a, b). */
void shade_segments(const shade_scene *s, uint32_t a, uint32_t b, const candidates *among,
                    seen_segment out[SEGMENT_LANES]);

#endif
