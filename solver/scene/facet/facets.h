/* Facets: plane regions of many elements, each covered by a few triangles and parallelograms (pieces). Rays
 * are cast against tens of pieces where the mesh has thousands of elements. Knows no light. */
#ifndef LAMBERT_SCENE_FACET_FACETS_H
#define LAMBERT_SCENE_FACET_FACETS_H

#include "solver/scene/mesh.h"

typedef struct facets {
    size_t n;
    uint32_t *of_element; /* [n_elements], the facet of each */
    uint32_t *first;      /* [n + 1]: facet f holds elements[first[f]] ... elements[first[f + 1] - 1] */
    uint32_t *elements;   /* [n_elements] */
    float (*normal)[3];   /* [n], unit; an element's own where it is alone */
    size_t n_pieces;
    uint32_t (*pieces)[4]; /* [n_pieces] vertices of the mesh, counter-clockwise seen from the front; the 4th
                              MESH_NO_VERTEX: a triangle. With four the piece is an element that is alone, or
                              a parallelogram */
    uint32_t *piece_facet; /* [n_pieces] */
} facets;

/* Joins elements 0 ... n_elements-1 that share an edge and lie within flat metres of one plane. Facets that
 * meet share the corners of their pieces: a vertex is dropped only where it lies straight, within flat
 * metres, on the outline of every facet around it, so that no new crack opens between them. Elements stay
 * alone where their outline crosses itself, has thousands of corners, or takes a piece for only few elements.
 * Freed by facets_free. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status facets_join(const mesh *m, size_t n_elements, double flat, facets *out, lam_error *error);

/* Makes every element a facet. */
lam_status facets_alone(const mesh *m, size_t n_elements, facets *out, lam_error *error);
void facets_free(facets *f);

#endif
