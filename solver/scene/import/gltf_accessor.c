/* The numbers of a glTF's accessors. Runs in the child. Source: glTF 2.0, 3.6.2. */
#include "solver/scene/import/gltf_file.h"

#include <math.h>
#include <string.h>

static size_t size_of(unsigned type) {
    switch (type) {
    case GLTF_BYTE:
    case GLTF_UBYTE:
        return 1;
    case GLTF_SHORT:
    case GLTF_USHORT:
        return 2;
    case GLTF_UINT:
    case GLTF_FLOAT:
        return 4;
    default:
        return 0;
    }
}

bool gltf_count(const json_t *owner, const char *name, size_t otherwise, size_t *out) {
    const json_t *value = json_object_get(owner, name);
    if (value != NULL &&
        (!json_is_integer(value) || json_integer_value(value) < 0 || json_integer_value(value) > UINT32_MAX))
        return false;
    *out = value == NULL ? otherwise : (size_t)json_integer_value(value);
    return true;
}

static size_t width_of(const json_t *accessor) {
    static const char *const types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    const char *type = json_string_value(json_object_get(accessor, "type"));
    for (size_t k = 0; type != NULL && k < sizeof types / sizeof *types; k++)
        if (strcmp(type, types[k]) == 0) return k + 1;
    return 0;
}

bool gltf_find_values(gltf_file *g, const json_t *accessor, gltf_values *out) {
    lam_error ignored;
    const json_t *view = gltf_entry(g, "bufferViews", json_object_get(accessor, "bufferView"));
    size_t n, at, of_view, length, stride, type;
    if (view == NULL || json_object_get(accessor, "sparse") != NULL) return false;
    if (!gltf_count(accessor, "componentType", 0, &type)) return false;
    const size_t width = width_of(accessor), size = size_of((unsigned)type), row = size * width;
    if (row == 0 || !gltf_count(accessor, "count", 0, &n) || !gltf_count(accessor, "byteOffset", 0, &at) ||
        !gltf_count(view, "byteOffset", 0, &of_view) || !gltf_count(view, "byteLength", 0, &length) ||
        !gltf_count(view, "byteStride", row, &stride))
        return false;
    if (stride == 0) stride = row; /* as some programs write it */
    const gltf_buffer b = gltf_read_buffer(g, json_object_get(view, "buffer"), &ignored);
    if (b.bytes == NULL || stride < row || of_view > b.length || length > b.length - of_view) return false;
    if (at > length || (n > 0 && (row > length - at || n - 1 > (length - at - row) / stride))) return false;
    *out = (gltf_values){.bytes = b.bytes + of_view + at,
                         .n = n,
                         .width = width,
                         .stride = stride,
                         .size = size,
                         .type = (unsigned)type,
                         .normalized = json_is_true(json_object_get(accessor, "normalized"))};
    return true;
}

double gltf_value(const gltf_values *v, size_t row, size_t k) {
    const unsigned char *b = (const unsigned char *)v->bytes + row * v->stride + k * v->size;
    uint32_t bits = 0;
    float value;
    for (size_t i = 0; i < v->size; i++) bits |= (uint32_t)b[i] << 8 * i;
    switch (v->type) {
    case GLTF_BYTE:
        return v->normalized ? fmax((double)(int8_t)bits / 127, -1) : (double)(int8_t)bits;
    case GLTF_UBYTE:
        return v->normalized ? (double)bits / 255 : (double)bits;
    case GLTF_SHORT:
        return v->normalized ? fmax((double)(int16_t)bits / 32767, -1) : (double)(int16_t)bits;
    case GLTF_USHORT:
        return v->normalized ? (double)bits / 65535 : (double)bits;
    case GLTF_UINT:
        return (double)bits;
    default:
        memcpy(&value, &bits, sizeof value);
        return (double)value;
    }
}
