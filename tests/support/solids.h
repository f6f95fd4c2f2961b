/* Small closed meshes. */
#ifndef LAMBERT_TESTS_SOLIDS_H
#define LAMBERT_TESTS_SOLIDS_H

#include "solver/scene/mesh.h"

/* A mesh of quads and triangles (4th index MESH_NO_VERTEX) in one group, grey .5, element i emits i. */
mesh make_mesh(const double (*vertices)[3], size_t n_vertices, const uint32_t (*elements)[4], size_t n);

extern const double cube_vertices[8][3];
extern const uint32_t cube_elements[6][4];

/* The unit cube, 6 quads; the octahedron, 8 triangles. */
mesh make_cube(void);
mesh make_octahedron(void);

#endif
