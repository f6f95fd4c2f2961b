/* The patches of an operator of two meshes. */
#ifndef LAMBERT_OPERATOR_TWO_MESH_H
#define LAMBERT_OPERATOR_TWO_MESH_H

#include "solver/operator/operator.h"

/* The patches of an operator, views into it: patch p holds the elements at positions begin[p] ...
 * begin[p+1]-1. */
typedef struct operator_patches {
    size_t k;
    const uint64_t *begin;  /* [k+1] */
    const uint32_t *order;  /* [n], position -> element; NULL: mesh order */
    const float *weight;    /* [n], A_j / A_p by position; NULL: areas are equal in each patch */
    const float *coherence; /* [k], in [0, 1]; NULL: not stored */
} operator_patches;

/* False where the kind has no patches; *patches is then untouched. */
bool operator_patches_of(const lam_operator *op, operator_patches *patches);

#endif
