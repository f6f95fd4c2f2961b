/* Positions of a mesh as glTF has them, and normals at the corners of its elements that keep creases. Private
 * to gltf.c. */
#ifndef LAMBERT_CODEC_GLTF_CORNER_NORMALS_H
#define LAMBERT_CODEC_GLTF_CORNER_NORMALS_H

#include "solver/codec/gltf/gltf.h"

typedef struct corner_normals {
    const gltf_mesh *m;
    float (*position)[3]; /* [n_vertices][3], y up */
    uint32_t *welded;     /* [n_vertices]: the first vertex at this position */
    uint32_t *first;  /* [n_vertices]: of the corners of a group at a vertex, the last one; of others none */
    uint32_t *next;   /* [4 elements of the largest group]: the corner before it there; of `first` of none */
    uint32_t *around; /* [room] corners at one position, */
    uint32_t *parent; /* [room] and their surfaces */
    double (*normal)[3]; /* [room] */
    size_t room;
} corner_normals;

/* O(n_vertices). Errors: LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (a position beyond float). */
lam_status corner_normals_create(const gltf_mesh *m, corner_normals *out, lam_error *error);
void corner_normals_free(corner_normals *s);

/* The normals of group g: normals[4 j + k] is that of corner k of its j-th element, y up. Errors:
 * LAM_ERR_MEMORY. */
lam_status corner_normals_of_group(corner_normals *s, size_t g, float (*normals)[3], lam_error *error);

/* Elements of the largest group. */
size_t gltf_largest_group(const group_index *groups);

#endif
