/* The nodes of a glTF where their parents put them. Private to solver/scene/import; used in the child.
 * Source: glTF 2.0, 3.5.3. */
#ifndef LAMBERT_SCENE_IMPORT_GLTF_NODES_H
#define LAMBERT_SCENE_IMPORT_GLTF_NODES_H

#include "store/status.h"

#include <jansson.h>

typedef struct gltf_transform {
    double a[3][4];
} gltf_transform;

/* Nodes of the scene that is read stand first in the order, each behind its parent; then nodes of other
 * scenes, and of none. */
typedef struct gltf_nodes {
    size_t n, n_read;
    size_t *order;          /* [n] */
    size_t *parent;         /* [n], of a node; SIZE_MAX: it has none */
    gltf_transform *placed; /* [n], of a node */
} gltf_nodes;

/* Places the nodes of a file; the caller frees them with gltf_nodes_free. A node has its first parent alone,
 * and a ring of nodes ends. O(n). Errors: LAM_ERR_MEMORY. */
lam_status gltf_nodes_place(const json_t *root, gltf_nodes *out, lam_error *error);
void gltf_nodes_free(gltf_nodes *nodes);

/* The scene that the file names, or the first. */
size_t gltf_scene_read(const json_t *root);

#endif
