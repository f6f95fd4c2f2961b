/* Small meshes for tests of glTF, and their files read back. */
#ifndef LAMBERT_TESTS_SMALL_GLTF_H
#define LAMBERT_TESTS_SMALL_GLTF_H

#include "support/gltf_file.h"

/* A mesh of at most so many elements, whose normals and areas are those of its corners. */
enum { SMALL_GLTF_MOST = 8, SMALL_GLTF_CORNERS = 4 * SMALL_GLTF_MOST };
typedef struct small_gltf {
    gltf_mesh m;
    double vertices[SMALL_GLTF_CORNERS][3], area[SMALL_GLTF_MOST];
    uint32_t elements[SMALL_GLTF_MOST][4], group[SMALL_GLTF_MOST];
    float normal[SMALL_GLTF_MOST][3], reflectance[4 * SMALL_GLTF_MOST], emission[4 * SMALL_GLTF_MOST];
    group_index groups;
} small_gltf;

/* The unit normal of three corners; returns their area. */
double small_gltf_facing(const double a[3], const double b[3], const double c[3], double out[3]);

uint32_t small_gltf_vertex(small_gltf *s, double x, double y, double z);

/* d: GLTF_NO_VERTEX makes a triangle. */
void small_gltf_element(small_gltf *s, uint32_t group, uint32_t a, uint32_t b, uint32_t c, uint32_t d);

/* A strip of n quads along x, whose k-th is steeper than the one before by step[k] degrees; they share
 * vertices, or have vertices of their own at the same places. */
void small_gltf_strip(small_gltf *s, size_t n, const double *steps, const double *lengths, bool shared);

/* The mesh, whose groups the caller frees: s->groups. */
const gltf_mesh *small_gltf_finish(small_gltf *s, size_t n_groups, const char *const *names);

/* Fails unless the floats at a place of a file are these. */
void gltf_is_vector(const char *at, double x, double y, double z);

#endif
