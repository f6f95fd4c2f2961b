/* The order of faces that cover the same part of a plane: the first keeps it. Private to solver/scene. */
#ifndef LAMBERT_SCENE_COINCIDENT_ORDER_H
#define LAMBERT_SCENE_COINCIDENT_ORDER_H

#include "solver/scene/mesh.h"

typedef struct coincident_order {
    uint32_t *surface; /* [n], of each face: the first face of all that hang together */
    double *area;      /* [n], m^2 of the surface, by its first face, to six digits */
    bool *emits;       /* [n], by the first face of a surface */
} coincident_order;

/* Surfaces are the faces that touch in one plane, of one group and material. Freed by coincident_order_free.
 * Cost: O(n log n + neighbours). Errors: LAM_ERR_MEMORY. */
lam_status coincident_order_find(const mesh *m, coincident_order *out, lam_error *error);
void coincident_order_free(coincident_order *o);

/* True if face a keeps its place where it and face b, another one, overlap. */
bool coincident_comes_first(const coincident_order *o, uint32_t a, uint32_t b);

/* True if two faces differ in group or material; if a face emits. */
bool coincident_faces_differ(const mesh *m, size_t a, size_t b);
bool coincident_face_emits(const mesh *m, size_t face);

#endif
