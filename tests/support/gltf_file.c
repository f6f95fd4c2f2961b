#include "support/gltf_file.h"

#include "support/suite.h"

#include <endian.h>
#include <math.h>
#include <string.h>

uint32_t gltf_u32(const char *at) {
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return le32toh(value);
}

float gltf_float(const char *at) {
    const uint32_t bits = gltf_u32(at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

gltf_file gltf_load(const gltf_mesh *m) {
    gltf_file l = {.root = NULL};
    lam_error error;
    json_error_t why;
    gltf_sizes sizes = {.n = m->n, .n_vertices = m->n_vertices, .n_groups = m->groups->n_groups};
    if (m->pictures != NULL) {
        sizes.n_textured = m->n;
        sizes.n_textures = m->pictures->n_surfaces + m->pictures->n_files;
        sizes.image_bytes = m->pictures->start[m->pictures->n_files] + 3 * m->pictures->n_files;
    }
    for (size_t i = 0; i < m->n; i++) sizes.n_buried += !group_index_counts(m->groups, i);
    for (size_t g = 0; g < m->groups->n_groups; g++) sizes.n_texts += strlen(m->groups->names[g]);
    ck_ok(gltf_write(m, &l.file, &error));
    if (m->light == NULL) ck_assert_uint_le(l.file.length, gltf_bytes_most(&sizes));
    const char *bytes = l.file.bytes;
    const size_t text = gltf_u32(bytes + 12);
    ck_assert_uint_eq(gltf_u32(bytes), 0x46546C67);
    ck_assert_uint_eq(gltf_u32(bytes + 4), 2);
    ck_assert_uint_eq(gltf_u32(bytes + 8), l.file.length);
    ck_assert_uint_eq(gltf_u32(bytes + 16), 0x4E4F534A);
    ck_assert_uint_eq(text % 4, 0);
    l.root = json_loadb(bytes + 20, text, 0, &why);
    ck_assert_msg(l.root != NULL, "%s", why.text);
    l.n_binary = gltf_u32(bytes + 20 + text);
    ck_assert_uint_eq(gltf_u32(bytes + 24 + text), 0x004E4942);
    l.binary = bytes + 28 + text;
    ck_assert_uint_eq(28 + text + l.n_binary, l.file.length);
    const json_t *first = json_array_get(json_object_get(l.root, "buffers"), 0);
    ck_assert_int_eq(json_integer_value(json_object_get(first, "byteLength")), (json_int_t)l.n_binary);
    return l;
}

void gltf_unload(gltf_file *l) {
    json_decref(l->root);
    buffer_free(&l->file);
}

json_t *gltf_item(const json_t *object, const char *list, size_t k) {
    json_t *found = json_array_get(json_object_get(object, list), k);
    ck_assert_msg(found != NULL, "%s[%zu]", list, k);
    return found;
}

size_t gltf_number(const json_t *object, const char *name) {
    const json_t *found = json_object_get(object, name);
    ck_assert_msg(json_is_integer(found), "%s", name);
    return (size_t)json_integer_value(found);
}

const char *gltf_accessor(const gltf_file *l, size_t k, const char *type, size_t component, size_t bytes,
                          size_t *count) {
    const json_t *a = gltf_item(l->root, "accessors", k),
                 *view = gltf_item(l->root, "bufferViews", gltf_number(a, "bufferView"));
    *count = gltf_number(a, "count");
    ck_assert_str_eq(json_string_value(json_object_get(a, "type")), type);
    ck_assert_uint_eq(gltf_number(a, "componentType"), component);
    const size_t offset = gltf_number(a, "byteOffset"), start = gltf_number(view, "byteOffset") + offset;
    ck_assert_uint_eq(start % 4, 0);
    ck_assert_uint_le(offset + *count * bytes, gltf_number(view, "byteLength"));
    ck_assert_uint_le(start + *count * bytes, l->n_binary);
    if (component == 5126) ck_assert_uint_eq(gltf_number(view, "byteStride"), bytes);
    return l->binary + start;
}

gltf_primitive gltf_primitive_of(const gltf_file *l, size_t node) {
    const json_t *n = gltf_item(l->root, "nodes", node),
                 *mesh = gltf_item(l->root, "meshes", gltf_number(n, "mesh"));
    const json_t *p = gltf_item(mesh, "primitives", 0), *of = json_object_get(p, "attributes");
    gltf_primitive out = {.name = json_string_value(json_object_get(n, "name")),
                          .extras = json_object_get(n, "extras"),
                          .attributes = of};
    size_t count;
    ck_assert_uint_eq(json_array_size(json_object_get(mesh, "primitives")), 1);
    ck_assert_uint_eq(gltf_number(p, "mode"), 4);
    out.position = gltf_accessor(l, gltf_number(of, "POSITION"), "VEC3", 5126, 12, &out.n_vertices);
    out.normal = gltf_accessor(l, gltf_number(of, "NORMAL"), "VEC3", 5126, 12, &count);
    ck_assert_uint_eq(count, out.n_vertices);
    out.element = gltf_accessor(l, gltf_number(of, "_ELEMENT"), "SCALAR", 5126, 4, &count);
    ck_assert_uint_eq(count, out.n_vertices);
    out.face = gltf_accessor(l, gltf_number(of, "_FACE"), "SCALAR", 5126, 4, &count);
    ck_assert_uint_eq(count, out.n_vertices);
    out.index = gltf_accessor(l, gltf_number(p, "indices"), "SCALAR", 5125, 4, &out.n_indices);
    out.material = gltf_item(l->root, "materials", gltf_number(p, "material"));
    const json_t *a = gltf_item(l->root, "accessors", gltf_number(of, "POSITION"));
    for (size_t d = 0; d < 3; d++) {
        float low = INFINITY, high = -INFINITY;
        for (size_t v = 0; v < out.n_vertices; v++) {
            low = fminf(low, gltf_float(out.position + 12 * v + 4 * d));
            high = fmaxf(high, gltf_float(out.position + 12 * v + 4 * d));
        }
        ck_assert((float)json_number_value(json_array_get(json_object_get(a, "min"), d)) == low);
        ck_assert((float)json_number_value(json_array_get(json_object_get(a, "max"), d)) == high);
    }
    return out;
}
