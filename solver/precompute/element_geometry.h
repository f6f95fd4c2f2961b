/* What a method of building wants to know of the elements' geometry. */
#ifndef LAMBERT_PRECOMPUTE_ELEMENT_GEOMETRY_H
#define LAMBERT_PRECOMPUTE_ELEMENT_GEOMETRY_H

#include "solver/method/method.h"
#include "solver/scene/mesh.h"

typedef struct element_geometry {
    double (*centre)[3]; /* [n] */
    uint32_t *surface;   /* [n] */
} element_geometry;

/* Fills g and points the problem to it and to the mesh's normals; freed by element_geometry_free after the
 * problem's last use. */
lam_status element_geometry_add(const mesh *m, element_geometry *g, build_problem *problem, lam_error *error);
void element_geometry_free(element_geometry *g);

#endif
