/* The mesh of a scene as binary glTF (solver/codec/gltf), made from its store when it is first asked for, and
 * kept. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_MESH_H
#define LAMBERT_SERVER_SCENE_SCENE_MESH_H

#include "server/scene/kept_forms.h"
#include "solver/codec/buffer.h"
#include "store/store.h"

typedef struct scene scene;
typedef struct scene_mesh scene_mesh;

/* For a scene that is else complete, with its open store s, or NULL for a variant. The scene outlives it.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_FORMAT. */
lam_status scene_mesh_create(store *s, const scene *of, scene_mesh **out, lam_error *error);

/* NULL is allowed. */
void scene_mesh_destroy(scene_mesh *mesh);

/* Elements with vertices of their own; vertices that are the corners which elements share; or elements with
 * vertices of their own at all corners on their edges, and the weights of corners (gltf_corners). */
typedef enum mesh_form { MESH_ELEMENTS, MESH_CORNERS, MESH_ELEMENTS_CORNERS, MESH_FORMS } mesh_form;

/* A number for all that determines the file: equal files may have two, two files never have one (but for a
 * collision of 64 bits). It stays the same from one start of the daemon to the next. */
uint64_t scene_mesh_tag(const scene_mesh *mesh, mesh_form form);

/* The vertices of its store. */
size_t scene_mesh_vertices(const scene_mesh *mesh);

/* The file, in every coding that was asked for. */
kept_forms *scene_mesh_forms(scene_mesh *mesh, mesh_form form);

/* Bytes that kept files have of the ledger; and drops these. */
size_t scene_mesh_held(scene_mesh *mesh);
void scene_mesh_clear(scene_mesh *mesh);

/* Bytes of the file, and bytes that scene_mesh_build takes with those, at most. */
size_t scene_mesh_bytes_most(const scene_mesh *mesh, mesh_form form);
size_t scene_mesh_build_bytes(const scene_mesh *mesh, mesh_form form);

/* Makes the file. It opens the store again, and checks that it still is the one of the scene. O(n). Errors:
 * LAM_ERR_ARGUMENT (gltf_write, corner_plan_expand), LAM_ERR_IO (also if the file was replaced),
 * LAM_ERR_DAMAGED, LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status scene_mesh_build(const scene_mesh *mesh, mesh_form form, buffer *out, lam_error *error);

#endif
