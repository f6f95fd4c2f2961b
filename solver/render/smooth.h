/* Values at the corners of elements, averaged within a surface. They make a picture smooth, not more
 * accurate. */
#ifndef LAMBERT_RENDER_SMOOTH_H
#define LAMBERT_RENDER_SMOOTH_H

#include "solver/scene/mesh.h"

/* A node is a vertex of one surface, elements of one group that meet there at less than 20 degrees. Vertices
 * at one place are one. */
typedef struct smooth_nodes {
    size_t n_nodes;
    uint32_t (*corner)[4]; /* [n]: the node of each corner of an element; the 4th of a triangle is not used */
    float *values;         /* [n_nodes][C] */
} smooth_nodes;

/* values are [C][n]. Vertices closer than a millionth of the scene count as one; a node inside another
 * element's edge takes the value that the edge has there. Errors: LAM_ERR_MEMORY. */
lam_status smooth_create(const mesh *m, size_t n_channels, const float *values, smooth_nodes *out,
                         lam_error *error);
void smooth_free(smooth_nodes *nodes);

/* Mean value coordinates (Floater 2003) of a point in a convex polygon of 3 or 4 corners: weights that sum to
 * 1, reproduce linear functions and are linear along each edge. */
void smooth_weights(const double (*corners)[3], size_t n_corners, const double normal[3],
                    const double point[3], double *weights);

#endif
