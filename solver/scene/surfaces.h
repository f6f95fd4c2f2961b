/* Surfaces: connected elements with similar normals. Knows no light. */
#ifndef LAMBERT_SCENE_SURFACES_H
#define LAMBERT_SCENE_SURFACES_H

#include "solver/scene/mesh.h"

/* surface[i], i < n, is the surface of element i: a connected component of the elements that share a corner
 * and whose normals differ by less than 30 degrees. Vertices closer than a millionth of the scene are one.
 * Surfaces are numbered from 0 by their first elements; the two sides of a face are never one surface. Cost:
 * O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status mesh_surfaces(const mesh *m, uint32_t *surface, size_t *n_surfaces, lam_error *error);

/* places[v], v < n_vertices: one number for all vertices that are closer than a millionth of the scene. */
lam_status mesh_places(const mesh *m, uint32_t *places, lam_error *error);

#endif
