/* Splits a polygon into planar convex quads or triangles by cutting ears. Private to solver/scene. */
#ifndef LAMBERT_SCENE_POLYGON_SPLIT_H
#define LAMBERT_SCENE_POLYGON_SPLIT_H

#include "store/status.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct polygon_split_scratch {
    uint32_t *corners; /* of the remaining polygon */
    double (*flat)[2];
    double *quality; /* of the ear at each corner; negative: not an ear */
    uint32_t (*pieces)[4];
    size_t corner_capacity, flat_capacity, quality_capacity, piece_capacity;
    size_t n_pieces;
} polygon_split_scratch;

/* Cuts one polygon into at most n - 2 pieces (4th index TABLE_NONE: a triangle) in scratch.pieces, none where
 * its area is at most least_area. Corners that are straight to 1e-6 of the diameter are dropped; with
 * keep_straight each of them is a corner of some piece. O(n^2). Errors: LAM_ERR_MEMORY. */
lam_status polygon_split(const double (*vertices)[3], const uint32_t *corners, size_t n, double least_area,
                         bool keep_straight, polygon_split_scratch *scratch, lam_error *error);
void polygon_split_scratch_free(polygon_split_scratch *scratch);

#endif
