/* The perspective cameras of a glTF or GLB, read from its JSON: the library keeps one node for each camera,
 * and its field of view depends on the library's version. Runs in the child. Source: glTF 2.0, 3.5.3
 * and 3.10.3. */
#include "solver/base/utf8.h"
#include "solver/scene/import/gltf_nodes.h"
#include "solver/scene/import/imported_faces.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The name of a node, cut where it is too long, at a whole character; camera-INDEX where it has none. */
static void name_of(const json_t *node, size_t camera, char *out, size_t size) {
    const char *name = json_string_value(json_object_get(node, "name"));
    if (name == NULL || name[0] == '\0') {
        snprintf(out, size, "camera-%zu", camera);
        return;
    }
    snprintf(out, size, "%s", name);
    for (size_t length = strlen(out); length > 0 && !utf8_is_valid(out, length);) out[--length] = '\0';
}

/* A camera looks along -z of its node, with y upwards. */
static lam_status add_camera(const json_t *root, size_t index, const gltf_transform *t, const char *path,
                             imported_faces *s, lam_error *error) {
    const json_t *node = json_array_get(json_object_get(root, "nodes"), index);
    const json_t *which = json_object_get(node, "camera"), *cameras = json_object_get(root, "cameras");
    const size_t camera = (size_t)json_integer_value(which);
    const json_t *found = json_is_integer(which) ? json_array_get(cameras, camera) : NULL;
    const json_t *perspective = json_object_get(found, "perspective");
    scene_camera made = {.name = ""};
    if (found == NULL) return LAM_OK;
    name_of(node, camera, made.name, sizeof made.name);
    if (perspective == NULL) {
        import_warn(&s->warnings, "%s: the camera '%s' is left out: it is orthographic", path, made.name);
        return LAM_OK;
    }
    made.fov = json_number_value(json_object_get(perspective, "yfov")) * 180 / M_PI;
    for (int d = 0; d < 3; d++) {
        made.eye[d] = t->a[d][3];
        made.direction[d] = -t->a[d][2];
        made.up[d] = t->a[d][1];
    }
    return imported_faces_add_camera(s, path, &made, error);
}

static lam_status read_tree(const json_t *root, const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    gltf_nodes nodes = {.n = 0};
    TRY(gltf_nodes_place(root, &nodes, error));
    for (size_t k = 0; k < nodes.n_read; k++)
        TRY(add_camera(root, nodes.order[k], &nodes.placed[nodes.order[k]], path, s, error));
done:
    gltf_nodes_free(&nodes);
    return status;
}

lam_status gltf_read_cameras(const char *path, const char *bytes, size_t length, imported_faces *s,
                             lam_error *error) {
    static const char member[] = "\"cameras\"";
    lam_status status = LAM_OK;
    gltf_find_json(&bytes, &length);
    if (memmem(bytes, length, member, sizeof member - 1) == NULL) return LAM_OK;
    json_t *root = json_loadb(bytes, length, 0, NULL);
    if (json_array_size(json_object_get(root, "cameras")) > 0) status = read_tree(root, path, s, error);
    json_decref(root);
    return status;
}
