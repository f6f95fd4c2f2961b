/* The mesh of a store, for its corners; and lam_corners (lambert/lambert.h). */
#ifndef LAMBERT_OPERATOR_CORNERS_CORNER_STORE_H
#define LAMBERT_OPERATOR_CORNERS_CORNER_STORE_H

#include "solver/operator/corners/corner_nodes.h"
#include "store/store.h"

/* The arrays of a mesh that corners are found in; freed by corner_arrays_free, also after an error. */
typedef struct corner_arrays {
    void *vertices, *elements, *normal, *group; /* as in /mesh */
    bool *buried;                               /* [n]; NULL: none */
    size_t n_vertices, n;
} corner_arrays;

/* Reads them of an open store of n elements, and checks them. Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY, those
 * of store_read. */
lam_status corner_arrays_read(store *s, size_t n, corner_arrays *out, lam_error *error);
void corner_arrays_free(corner_arrays *a);
corner_mesh corner_arrays_mesh(const corner_arrays *a);

#endif
