/* U and V of two meshes (Fernández et al. 2011, eq. 6), for its method and for tests. */
#ifndef LAMBERT_METHOD_TWO_MESH_METHOD_TWO_MESH_H
#define LAMBERT_METHOD_TWO_MESH_METHOD_TWO_MESH_H

#include "solver/linalg/scaled.h"
#include "solver/method/two_mesh/coarse_mesh.h"

/* --assign: an element belongs to the patch that it was split into, or to the nearest one. */
typedef enum patch_assignment { ASSIGN_INCLUSION, ASSIGN_PROXIMITY } patch_assignment;

/* The options of --method 2msc. */
typedef struct two_mesh_options {
    const char *factorizer; /* "auto" or "qr" */
    patch_assignment assign;
    uint64_t rank;              /* 0: by coherence and min_area */
    double coherence, min_area; /* smallest coherence; smallest area of a patch, m^2; 0: not given */
    bool keep_factors;
} two_mesh_options;

/* F ~ U V^T in its general form: U_ep = sum of F_ej over the elements j of patch p, V_jp = A_j / A_p. Each
 * patch is taken to send as one, so that rows keep their sums. With S = A^1/2 F A^-1/2 that is S W W^T for
 * W_jp = (A_j / A_p)^1/2, whose columns are orthonormal: S between projectors, so |U V^T| <= |S| <= 1 in the
 * same scaling whatever the patches, and reflectances below 1 keep I - R U V^T invertible.
 * Rows of U [n][k] (freed by the caller) are positions. *weight is V [n] by position, or NULL where the
 * elements of each patch are of equal area: then U holds F_ep / c_p, c_p their number, and V is 1 (eq. 6). */
lam_status two_mesh_factors(const build_problem *problem, const coarse_mesh *mesh, float **U, float **weight,
                            lam_error *error);

/* core [k][k] = (I - V^T R U)^-1 for one channel of reflectances (mesh order), in double and rounded at the
 * end. Cost: O(nk + k^3). Errors: as core_invert. */
lam_status two_mesh_core(const coarse_mesh *mesh, const float *U, const float *weight,
                         const float *reflectance, float *core, double *rcond, lam_error *error);

/* |S - S W W^T|_2 to about a per cent from below. */
lam_status two_mesh_norm(const build_problem *problem, const coarse_mesh *mesh, const scaled_matrix *S,
                         const progress *p, double *norm, lam_error *error);

#endif
