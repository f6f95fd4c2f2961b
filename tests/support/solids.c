#include "support/solids.h"

#include "support/suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRIANGLE MESH_NO_VERTEX

const double cube_vertices[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                    {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
const uint32_t cube_elements[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                                      {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}};
static const double octahedron_vertices[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                                 {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
static const uint32_t octahedron_elements[8][4] = {
    {0, 2, 4, TRIANGLE}, {2, 1, 4, TRIANGLE}, {1, 3, 4, TRIANGLE}, {3, 0, 4, TRIANGLE},
    {2, 0, 5, TRIANGLE}, {1, 2, 5, TRIANGLE}, {3, 1, 5, TRIANGLE}, {0, 3, 5, TRIANGLE}};

mesh make_mesh(const double (*vertices)[3], size_t n_vertices, const uint32_t (*elements)[4], size_t n) {
    lam_error error;
    mesh m = {.n_vertices = n_vertices, .n = n, .n_groups = 1, .n_channels = 1, .unit = 1, .up = 'z'};
    m.vertices = malloc(n_vertices * sizeof *m.vertices);
    m.elements = malloc(n * sizeof *m.elements);
    m.group = calloc(n, sizeof *m.group);
    m.reflectance = calloc(n, sizeof *m.reflectance);
    m.emission = calloc(n, sizeof *m.emission);
    m.group_names = malloc(sizeof *m.group_names + 8);
    memcpy(m.vertices, vertices, n_vertices * sizeof *vertices);
    memcpy(m.elements, elements, n * sizeof *elements);
    m.group_names[0] = strcpy((char *)(m.group_names + 1), "all");
    for (size_t i = 0; i < n; i++) m.reflectance[i] = .5f, m.emission[i] = (float)i;
    snprintf(m.name, sizeof m.name, "made");
    snprintf(m.source_hash, sizeof m.source_hash, "%032d", 7);
    ck_assert_int_eq(mesh_measure(&m, &error), LAM_OK);
    return m;
}

mesh make_cube(void) {
    return make_mesh(cube_vertices, 8, cube_elements, 6);
}

mesh make_octahedron(void) {
    return make_mesh(octahedron_vertices, 6, octahedron_elements, 8);
}
