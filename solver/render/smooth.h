/* Light inside elements: reflected light that is linear between the corners of a surface. */
#ifndef LAMBERT_RENDER_SMOOTH_H
#define LAMBERT_RENDER_SMOOTH_H

#include "solver/operator/corners/corner_plan.h"
#include "solver/scene/mesh.h"

/* The corners that elements share (corner_nodes.h), and the weights of light there. */
typedef struct smooth_nodes {
    uint32_t (
        *corner)[4]; /* [n]: the node of each corner of an element; of a triangle CORNER_NONE is the 4th */
    corner_plan plan;
} smooth_nodes;

/* Cost: O(n log n). Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (corner_weights_find). */
lam_status smooth_nodes_create(const mesh *m, smooth_nodes *out, lam_error *error);
void smooth_nodes_free(smooth_nodes *nodes);

/* The values at the corners of elements, corners [C][n][4], of answers with the means values [C][n]. The 4th
 * of a triangle is NaN.
 *
 * E [C][n], NULL for none, is a part of the values that does not vary within elements: emission. The rest is
 * linear between corners by corner_plan_apply, as the daemon's answers at corners are. Cost: O(C n). Errors:
 * LAM_ERR_MEMORY. */
lam_status smooth_corners(const smooth_nodes *nodes, const mesh *m, size_t n_channels, const float *values,
                          const float *E, float *corners, lam_error *error);

/* Mean value coordinates (Floater 2003) of a point in a convex polygon of 3 or 4 corners: weights that sum to
 * 1, reproduce linear functions and are linear along each edge. */
void smooth_weights(const double (*corners)[3], size_t n_corners, const double normal[3],
                    const double point[3], double *weights);

#endif
