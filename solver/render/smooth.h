/* Light inside elements: reflected light that is linear between the corners of a surface. */
#ifndef LAMBERT_RENDER_SMOOTH_H
#define LAMBERT_RENDER_SMOOTH_H

#include "solver/render/smooth_nodes.h"

/* The values at the corners of elements, corners [C][n][4], of answers with the means values [C][n]. The 4th
 * of a triangle is NaN.
 *
 * E [C][n], NULL for none, is a part of the values that does not vary within elements: emission. The rest, R,
 * has in each element the gradient g that fits its neighbours best, min sum_j |R_j - R_i - g (c_j - c_i)|^2 /
 * |c_j - c_i|^2 with centroids c. A node has the mean over its elements, by their angles there, of
 * R_i + g_i (x - c_i), and at least 0; a node inside another element's edge has the value of that edge, so
 * that no crack shows. So linear light is reproduced. g is reduced where it would change R_i by more than
 * twice the largest step to a neighbour. Where elements resolve the shadows, the error against a finer mesh
 * falls faster than that of constant values (`lambert bench hierarchical`, table smooth). Source: gradients
 * by least squares as in Barth and Jespersen 1989 (AIAA 89-0366). Cost: O(C n). Errors: LAM_ERR_MEMORY. */
lam_status smooth_corners(const smooth_nodes *nodes, const mesh *m, size_t n_channels, const float *values,
                          const float *E, float *corners, lam_error *error);

/* Mean value coordinates (Floater 2003) of a point in a convex polygon of 3 or 4 corners: weights that sum to
 * 1, reproduce linear functions and are linear along each edge. */
void smooth_weights(const double (*corners)[3], size_t n_corners, const double normal[3],
                    const double point[3], double *weights);

#endif
