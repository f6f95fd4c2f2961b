/* Near and far: a cluster b is near node a if it lies within a multiple of a's radius. Wavelets have
 * vanishing moments and F is smooth in the distance, so that coefficients of a with far clusters are
 * negligible (Gortler et al. 1993). The rows of a leaf therefore begin on clusters that are the
 * coarser the farther away they are. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_REACH_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_REACH_H

#include "solver/operator/blocks/plane_tree.h"
#include "solver/operator/wavelet/wavelets.h"

/* A node as the walk down the tree needs it, in half a cache line: a sphere around all its elements, and the
 * distance from its centre below which the surface of another sphere is near. */
typedef struct wavelet_extent {
    float centre[3], radius, reach;
    uint32_t height, left; /* left child; WAVELET_NONE: a leaf */
    uint32_t end;          /* the position behind its last */
} wavelet_extent;

/* The scaling functions of a node in closed form: function k at position p is
 *     A_p^1/2 (of[k][0] + of[k][1] (u_p - u) + of[k][2] (v_p - v)),
 * u_p, v_p being the coordinates of the element in the plane of the node. */
typedef struct wavelet_affine {
    float of[3][3];
    float u, v;
} wavelet_affine;

/* An element by position: A^1/2 and its coordinates in its plane. */
typedef struct wavelet_place {
    float root, u, v;
} wavelet_place;

typedef struct wavelet_reach {
    const wavelets *basis;
    double radii;           /* near: within this many radii of a node */
    uint32_t *height;       /* [n_nodes], 0: leaves */
    wavelet_extent *extent; /* [n_nodes] */
    wavelet_affine *affine; /* [n_nodes] */
    wavelet_place *place;   /* [n] */
    size_t n_leaves;
} wavelet_reach;

/* area, centre [n], by element; tree: of the basis. The reach of a node in one plane is `radii` times its
 * radius: its wavelets are orthogonal to the linear functions, and irradiance from far away is nearly linear
 * there. A node above planes has wavelets of constants only, and normals that differ: everything is near it.
 * One whose children are apart is near everything, too, so that it is no cell.
 * A node has three scaling functions at most. Freed with wavelet_reach_free. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_ARGUMENT. */
lam_status wavelet_reach_make(const wavelets *basis, const plane_tree *tree, const double *area,
                              const double (*centre)[3], double radii, wavelet_reach *out, lam_error *error);
void wavelet_reach_free(wavelet_reach *r);

/* True if cluster b is near node a. If b is near a, then the parent of b is near a, and b is near the parent
 * of a. */
static inline bool wavelet_is_near(const wavelet_reach *r, size_t a, size_t b) {
    const wavelet_extent *x = &r->extent[a], *y = &r->extent[b];
    const float far = x->reach + y->radius;
    float apart = 0;
    for (int d = 0; d < 3; d++) apart += (x->centre[d] - y->centre[d]) * (x->centre[d] - y->centre[d]);
    return !(apart > far * far);
}

/* The cells of a leaf: clusters that partition all positions, in ascending order. A node b is divided while
 * it is near the highest ancestor of `leaf` that is no higher than b: no ancestor needs its finer columns
 * otherwise. Only those that hold one of the positions lit [n_lit], ascending, are found. out has room for
 * n_leaves or n_lit, whichever is less, work for 2 height(root) + 4 numbers. Returns their number. Cost: the
 * nodes above lit positions, not all nodes, which a leaf in a crowd of planes is near. */
size_t wavelet_cells(const wavelet_reach *r, size_t leaf, const uint32_t *lit, size_t n_lit, uint32_t *out,
                     uint32_t *work);

#endif
