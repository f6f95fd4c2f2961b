/* The weights by which values of elements give those at the corners that they share. */
#ifndef LAMBERT_OPERATOR_CORNERS_CORNER_WEIGHTS_H
#define LAMBERT_OPERATOR_CORNERS_CORNER_WEIGHTS_H

#include "solver/operator/corners/corner_nodes.h"
#include "solver/operator/corners/corner_rows.h"

/* The rows of the nodes that are not tied, over elements; the others are empty. The weights of a row sum to 1
 * and give each linear function of the place its value at the node, sum_k w_k (c_k - x) = 0 for centroids
 * c_k, projected along the mean normal there: the value at x of the linear function that fits the elements
 * around best, weighted by their angles. Where these lie to one side, at the border of a surface, the
 * elements around their corners take part, by 1 / distance^2. Of rows whose weights extrapolate too far, sum
 * |w| > 4, a part is the plain mean by angles. Cost: O(n). Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (more
 * than 2^32 weights). */
lam_status corner_weights_find(const corner_mesh *m, const corner_nodes *nodes, const bool *tied,
                               corner_rows *out, lam_error *error);

/* The rows of elements, over the nodes of their corners: the value at the centroid of light that is linear
 * between them, the mean of a triangle or a parallelogram. Errors: as above. */
lam_status corner_means_find(const corner_mesh *m, const corner_nodes *nodes, corner_rows *out,
                             lam_error *error);

#endif
