/* A glTF as the library gets it: with nodes in place of instances, plain bytes in place of compressed ones
 * and floats in place of integers, which it does not know, without bones and lights, and with numbers in
 * place of the names of materials, which it tells in the order that meshes use them first. Runs in the child.
 */
#include "solver/scene/import/gltf_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The names of materials tell their places in the file. */
static lam_status number_materials(gltf_file *g, lam_error *error) {
    const json_t *materials = json_object_get(g->root, "materials");
    const size_t n = json_array_size(materials);
    for (size_t i = 0; i < n; i++) {
        json_t *material = json_array_get(materials, i);
        char number[sizeof GLTF_NUMBER + 20];
        snprintf(number, sizeof number, GLTF_NUMBER "%zu", i);
        if (json_is_object(material) && json_object_set_new(material, "name", json_string(number)) != 0)
            return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory for its materials", g->path);
    }
    return LAM_OK;
}

/* Takes the bones off meshes, which gltf_tell_left_out has named: the library reads some of them wrong, and
 * none where the matrices are left out. True where there are any. */
static bool drop_skins(gltf_file *g) {
    json_t *node;
    size_t i;
    bool any = false;
    json_array_foreach(json_object_get(g->root, "nodes"), i, node) any =
        (json_is_object(node) && json_object_del(node, "skin") == 0) || any;
    return (json_is_object(g->root) && json_object_del(g->root, "skins") == 0) || any;
}

/* Takes the lights off, which gltf_read_lights has read: the library refuses the file for some of them, which
 * are read here, and needs none. True where there are any. */
static bool drop_lights(gltf_file *g) {
    static const char punctual[] = "KHR_lights_punctual";
    json_t *node;
    size_t i;
    bool any = json_object_del(json_object_get(g->root, "extensions"), punctual) == 0;
    json_array_foreach(json_object_get(g->root, "nodes"), i, node) any =
        json_object_del(json_object_get(node, "extensions"), punctual) == 0 || any;
    return any;
}

/* Fails where an accessor has a view, and that has not all of its bytes: the library reads what lies behind
 * them. Missing buffers, sparse accessors and numbers that are none are the library's to tell. */
static lam_status check_accessor(gltf_file *g, const json_t *index, const char *what, lam_error *error) {
    lam_error ignored;
    gltf_values v;
    const json_t *accessor = gltf_entry(g, "accessors", index);
    const json_t *view = gltf_entry(g, "bufferViews", json_object_get(accessor, "bufferView"));
    if (!json_is_integer(json_object_get(view, "byteLength")) ||
        json_object_get(accessor, "sparse") != NULL || gltf_find_values(g, accessor, &v) ||
        gltf_read_buffer(g, json_object_get(view, "buffer"), &ignored).bytes == NULL)
        return LAM_OK;
    return status_fail(error, LAM_ERR_FORMAT,
                       "%s: accessors[%lld], %s of a mesh, reaches beyond the bytes of its bufferView; the "
                       "file is damaged: export it again",
                       g->path, (long long)json_integer_value(index), what);
}

static lam_status check_meshes(gltf_file *g, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *of, *primitive;
    size_t i, k;
    json_array_foreach(json_object_get(g->root, "meshes"), i, of)
        json_array_foreach(json_object_get(of, "primitives"), k, primitive) {
        const json_t *attributes = json_object_get(primitive, "attributes");
        if (gltf_extension(primitive, "KHR_draco_mesh_compression") != NULL) continue;
        TRY(check_accessor(g, json_object_get(attributes, "POSITION"), "POSITION", error));
        TRY(check_accessor(g, json_object_get(primitive, "indices"), "indices", error));
    }
done:
    return status;
}

static void put_little_endian(char *bytes, size_t x) {
    for (int k = 0; k < 4; k++) bytes[k] = (char)(x >> 8 * k & 255);
}

/* The file with the JSON of g in place of its own: of a GLB the first chunk. */
static lam_status write_file(const gltf_file *g, const char *bytes, size_t length, char **out,
                             size_t *out_length, lam_error *error) {
    lam_status status = LAM_OK;
    const char *own = bytes;
    size_t own_length = length;
    gltf_find_json(&own, &own_length);
    char *text = json_dumps(g->root, JSON_COMPACT), *made = NULL;
    if (text == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its JSON", g->path);
    if (own == bytes) {
        *out_length = strlen(text);
        *out = text;
        return LAM_OK;
    }
    const size_t n = strlen(text), padded = (n + 3) / 4 * 4, rest = length - 20 - own_length;
    made = memory_allocate(20 + padded + rest, 1, "GLB", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    if (20 + padded + rest > UINT32_MAX) FAIL(error, LAM_ERR_FORMAT, "%s: more than 4 GiB", g->path);
    memcpy(made, bytes, 20);
    put_little_endian(made + 8, 20 + padded + rest);
    put_little_endian(made + 12, padded);
    for (size_t k = 0; k < padded; k++) made[20 + k] = (unsigned char)(k < n ? text[k] : ' ');
    memcpy(made + 20 + padded, own + own_length, rest);
    *out = made;
    *out_length = 20 + padded + rest;
    made = NULL;
done:
    free(text);
    free(made);
    return status;
}

lam_status gltf_rewrite(const char *path, const char *bytes, size_t length, imported_faces *s, char **out,
                        size_t *out_length, gltf_numbers *unpacked, gltf_numbers *numbers, lam_error *error) {
    lam_status status = LAM_OK;
    gltf_file g = {.path = path, .s = s};
    const bool names_instances = memmem(bytes, length, GLTF_INSTANCES, sizeof GLTF_INSTANCES - 1) != NULL;
    bool changed = false, bones, lights;
    *out = NULL;
    gltf_parse(&g, bytes, length);
    if (g.root == NULL && names_instances)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: its JSON is broken, and its instances (" GLTF_INSTANCES ") cannot be read", path);
    if (g.root == NULL) goto done; /* the library says why */
    TRY(gltf_hold_buffers(&g, error));
    TRY(gltf_unpack_views(&g, unpacked, error));
    TRY(gltf_convert_integers(&g, numbers, error));
    TRY(check_meshes(&g, error));
    TRY(gltf_expand_instances(&g, &changed, error));
    TRY(gltf_tell_left_out(&g, error));
    bones = drop_skins(&g);
    lights = drop_lights(&g);
    changed = changed || bones || lights || unpacked->length > 0 || numbers->length > 0;
    changed = changed || json_array_size(json_object_get(g.root, "materials")) > 0;
    TRY(number_materials(&g, error));
    if (changed) TRY(write_file(&g, bytes, length, out, out_length, error));
done:
    gltf_close(&g);
    return status;
}
