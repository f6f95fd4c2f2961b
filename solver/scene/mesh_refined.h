/* A mesh made of parts of another one's faces. Private to solver/scene. */
#ifndef LAMBERT_SCENE_MESH_REFINED_H
#define LAMBERT_SCENE_MESH_REFINED_H

#include "solver/scene/mesh.h"
#include "solver/scene/tables.h"

typedef struct refined_mesh {
    size_t n;
    uint32_t (*elements)[4]; /* [n] */
    uint32_t *face;          /* [n], the face that each is a part of */
    point_table points;
} refined_mesh;

/* Room for n elements. Errors: LAM_ERR_ARGUMENT for a two-sided mesh or too many elements, LAM_ERR_MEMORY. */
lam_status refined_mesh_begin(const mesh *m, size_t n, refined_mesh *out, lam_error *error);
void refined_mesh_free(refined_mesh *r);

/* Element i by its corners, 3 or 4. */
lam_status refined_mesh_add(refined_mesh *r, size_t i, size_t corners, const double (*p)[3],
                            lam_error *error);

/* The mesh, without the names of groups; groups, faces of the file and materials come from the
 * faces. */
lam_status refined_mesh_end(refined_mesh *r, const mesh *m, mesh *out, lam_error *error);

#endif
