/* A tree of boxes over the faces of a scene, for rays that all go one way: to the sun. Knows neither skies
 * nor Embree, so that the daemon has it too. Immutable once created; any number of threads may ask it. */
#ifndef LAMBERT_SHADOW_SHADOW_TREE_H
#define LAMBERT_SHADOW_SHADOW_TREE_H

#include "solver/base/scene/scene_glass.h"
#include "store/status.h"

#include <stdint.h>

/* The faces of a mesh, as a store has them; borrowed while a tree is made. */
typedef struct shadow_faces {
    size_t n;        /* elements */
    size_t n_fronts; /* of them; those behind are their backs, and shade nothing more */
    size_t n_vertices;
    const double (*vertices)[3];   /* m */
    const uint32_t (*elements)[4]; /* the 4th is SHADOW_NO_VERTEX: a triangle */
    const float (*normal)[3];      /* unit, of the front */
    const scene_glass *glass;      /* panes, by groups; NULL, or without `of`: there are none */
    const uint32_t *group;         /* [n], with glass */
} shadow_faces;

#define SHADOW_NO_VERTEX 0xFFFFFFFFu

/* Rays that are asked for together. */
enum { SHADOW_PACKET = 16 };

typedef struct shadow_tree shadow_tree;

/* Splits boxes where few rays meet both halves (the surface area heuristic: Goldsmith and Salmon 1987), eight
 * to a node. Cost: O(n log n). Memory: shadow_tree_bytes once it is made, at most shadow_tree_bytes_most
 * until then. Errors: LAM_ERR_MEMORY; LAM_ERR_ARGUMENT (2^31 elements). */
lam_status shadow_tree_create(const shadow_faces *faces, shadow_tree **out, lam_error *error);

/* NULL is allowed. */
void shadow_tree_free(shadow_tree *t);

size_t shadow_tree_bytes(const shadow_tree *t);

/* Bytes of any tree of n elements, and of making it. SIZE_MAX: more than there can be. */
size_t shadow_tree_bytes_most(size_t n);

size_t shadow_tree_elements(const shadow_tree *t);

/* A parallelogram is one up to rounding in double precision. */
typedef enum shadow_shape { SHADOW_TRIANGLE, SHADOW_PARALLELOGRAM, SHADOW_QUAD } shadow_shape;

/* The corners of an element relative to the middle of the scene; a triangle has its third one twice. Its
 * normal. */
const float (*shadow_tree_corners(const shadow_tree *t, size_t element, shadow_shape *shape))[3];
const float *shadow_tree_normal(const shadow_tree *t, size_t element);

/* Where rays of one element and one direction begin, relative to the middle of the scene: one array for each
 * component. */
typedef struct shadow_rays {
    size_t n; /* 1 to SHADOW_PACKET */
    float at[3][SHADOW_PACKET];
} shadow_rays;

/* In place of an element: rays begin where they are, and all faces block them. */
#define SHADOW_NO_ELEMENT SIZE_MAX

/* Bit k of the result: ray k in this direction, a unit vector in front of the element, meets nothing but
 * panes. Rays are lifted above the element by 2 roundings of single precision, which changes `at`; faces in
 * its own plane (solver/scene/plane.h) block none of them, as a file's decimals may put these before it.
 * *last, 0 at first and the caller's own from one call to the next, is a guess at what blocks rays, for speed
 * alone. */
unsigned shadow_tree_open(const shadow_tree *t, size_t element, const float direction[3], shadow_rays *rays,
                          uint32_t *last);

/* passed[k], of the rays of `open` after shadow_tree_open: the part that the panes pass which ray k crosses,
 * 1 where it crosses none. Edges that panes share, and sheets, count once. Does nothing in a scene without
 * panes. */
void shadow_tree_pass(const shadow_tree *t, const float direction[3], const shadow_rays *rays, unsigned open,
                      double passed[SHADOW_PACKET]);

bool shadow_tree_has_panes(const shadow_tree *t);

#endif
