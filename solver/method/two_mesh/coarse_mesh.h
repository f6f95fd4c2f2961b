/* The coarse mesh of 2MSC (Fernández et al. 2011, algorithm 1): patches of elements that see about the same.
 */
#ifndef LAMBERT_METHOD_TWO_MESH_COARSE_MESH_H
#define LAMBERT_METHOD_TWO_MESH_COARSE_MESH_H

#include "solver/method/method.h"

typedef struct coarse_options {
    size_t patches;   /* exactly min(patches, n), those split that lose most; 0: by the two below */
    double coherence; /* patches below it are split ... */
    double min_area;  /* ... if they are larger than this, m^2 */
    bool proximity;   /* elements go to the nearest patch, not to that which they were split into */
} coarse_options;

typedef struct coarse_mesh {
    size_t n, k;
    uint32_t *element; /* [n], patch by patch */
    uint64_t *begin;   /* [k+1]: patch p is element[begin[p]] ... element[begin[p+1]-1]; none is empty */
    double *area;      /* [k], m^2 */
    float *coherence;  /* [k], in [0, 1]: see coherence.h */
    double smallest_coherence, smallest_area;
} coarse_mesh;

/* Begins with the surfaces; where there are more of them than patches wanted, with the six main directions
 * that elements face, or with everything. A patch is halved by area across the longest side of its bounding
 * box. Proximity: the patch whose centroid is nearest among those whose mean normal is within 60 degrees of
 * the element's, the first where several are; of each patch the element nearest to its centroid stays, so
 * that none is emptied. Numbered along the way they were split, so that neighbours have near numbers.
 * Needs problem->centre, normal, surface. The same bits for any number of threads.
 * Cost: O(nnz + n log n), of proximity O(n k). Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status coarse_mesh_create(const build_problem *problem, const coarse_options *options, const progress *p,
                              coarse_mesh *out, lam_error *error);
void coarse_mesh_free(coarse_mesh *mesh);

#endif
