/* The coarse mesh of 2MSC (Fernández et al. 2011, algorithm 1): patches of elements with nearly equal rows of
 * F, measured by the spatial coherence of their section 3.2. */
#ifndef LAMBERT_METHOD_TWO_MESH_COARSE_MESH_H
#define LAMBERT_METHOD_TWO_MESH_COARSE_MESH_H

#include "solver/method/method.h"

typedef struct coarse_options {
    size_t
        patches; /* exactly min(patches, n), the patch of largest loss split first; 0: the two limits below */
    double coherence; /* a patch below this coherence is split ... */
    double min_area;  /* ... if it is larger than this, m^2 */
    bool proximity; /* elements are assigned to the nearest patch, not to the one that splitting gave them */
} coarse_options;

typedef struct coarse_mesh {
    size_t n, k;
    uint32_t *element; /* [n], patch by patch */
    uint64_t *begin;   /* [k+1]: patch p is element[begin[p]] ... element[begin[p+1]-1]; none is empty */
    double *area;      /* [k], m^2 */
    float *coherence;  /* [k], in [0, 1]: see coherence_measure */
    double smallest_coherence, smallest_area;
} coarse_mesh;

/* Splitting begins with the surfaces of the mesh; if these are more than `patches`, with the six main
 * directions of the normals, else with one patch. A patch is halved by area across the longest side of its
 * bounding box. With `proximity` an element goes to the patch of nearest centroid whose mean normal is within
 * 60 degrees of its own. Patches are numbered in the order of splitting, so that neighbours have near
 * numbers. Needs problem->centre, normal, surface. The bits do not depend on the number of threads. Cost:
 * O(nnz + n log n), of proximity O(n k). Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status coarse_mesh_create(const build_problem *problem, const coarse_options *options, const progress *p,
                              coarse_mesh *out, lam_error *error);
void coarse_mesh_free(coarse_mesh *mesh);

/* Few groups, so that each gathers many rays of an element and sampling noise does not look like incoherence.
 */
#define VIEWS_MOST 64

/* The view of element e: v_eg = F_eg / A_g^1/2, F_eg being the form factor from e to all of group g. */
typedef struct group_views {
    size_t n_groups; /* at most VIEWS_MOST */
    float *v;        /* [n][n_groups] */
} group_views;

/* With v the area-weighted mean of the views v_e of a patch:
 *     loss = sum_e A_e |v_e - v|^2,    coherence = 1 - loss / sum_e A_e |v_e|^2,    in [0, 1].
 * For reciprocal F, replacing F_ej by F_ep A_j/A_p changes the columns of S in the patch by
 * sum_e A_e |F_e - F|^2 in the squared Frobenius norm (entry j weighted by 1/A_j); loss is this at the
 * resolution of the groups. Coherence is 1 where all elements have the same view, or none. */
typedef struct coherence_figures {
    double area, loss, coherence;
} coherence_figures;

coherence_figures coherence_measure(const group_views *v, const double *area, const uint32_t *elements,
                                    size_t count);

#endif
