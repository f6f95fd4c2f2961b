/* How far the nodes of a tree look, and the clusters that the rows of a leaf begin on: near ones leaf by
 * leaf, and the farther the coarser, as no node that the rows go up to is going to tell their parts apart. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_REACH_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_REACH_H

#include "solver/method/hierarchical/plane_tree.h"
#include "solver/operator/wavelet/wavelets.h"

/* What a walk down the tree asks of a node, in half a line of the cache: a sphere that has all its elements,
 * how far it looks from the middle of that, and where it stands. */
typedef struct wavelet_extent {
    float centre[3], radius, reach;
    uint32_t height, left; /* WAVELET_NONE: it is a leaf */
    uint32_t unused;
} wavelet_extent;

/* What a node hands up, as functions of its elements, A_p^1/2 (f0 + f1 (u_p - u) + f2 (v_p - v)) with places
 * u, v in its plane. */
typedef struct wavelet_affine {
    float of[3][3];
    float u, v;
} wavelet_affine;

/* An element by position: A^1/2 and its place in its plane. */
typedef struct wavelet_place {
    float root, u, v;
} wavelet_place;

typedef struct wavelet_reach {
    const wavelets *basis;
    double radii;           /* a node looks so many of its radii around itself */
    uint32_t *height;       /* [n_nodes], 0: leaves */
    wavelet_extent *extent; /* [n_nodes] */
    wavelet_affine *affine; /* [n_nodes] */
    wavelet_place *place;   /* [n] */
    size_t n_leaves;
} wavelet_reach;

/* area, centre [n], by element; tree: that the basis is of. A node of one plane looks so many of its radii
 * around itself: far light is smooth there, and its wavelets are orthogonal to what is smooth. One of several
 * planes, which face here and there, looks everywhere. Nodes hand up three numbers at most. Freed with
 * wavelet_reach_free. Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT. */
lam_status wavelet_reach_make(const wavelets *basis, const plane_tree *tree, const double *area,
                              const double (*centre)[3], double radii, wavelet_reach *out, lam_error *error);
void wavelet_reach_free(wavelet_reach *r);

/* Whether wavelets of node a look at cluster b. Where a is above others, and b too, what is near to those is
 * near to them. */
static inline bool wavelet_is_near(const wavelet_reach *r, size_t a, size_t b) {
    const wavelet_extent *x = &r->extent[a], *y = &r->extent[b];
    const float far = x->reach + y->radius;
    float apart = 0;
    for (int d = 0; d < 3; d++) apart += (x->centre[d] - y->centre[d]) * (x->centre[d] - y->centre[d]);
    return !(apart > far * far);
}

/* Clusters that share out all positions, ascending: a node b is divided unless the highest node above `leaf`
 * that is no higher than b looks past it. out has room for n_leaves, work for twice the root's height and
 * four. Returns their number. */
size_t wavelet_cells(const wavelet_reach *r, size_t leaf, uint32_t *out, uint32_t *work);

#endif
