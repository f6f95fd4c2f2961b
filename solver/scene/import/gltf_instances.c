/* EXT_mesh_gpu_instancing: copies of a node's mesh, which the library does not know. Each becomes a child of
 * the node, of its name, before the library reads the file. Runs in the child. */
#include "solver/scene/import/gltf_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char extension[] = GLTF_INSTANCES;

/* Instances of a file at most: the library takes about 3 KiB for each. */
enum { INSTANCES_MOST = 1 << 20 };

/* Translations, rotations and scales of instances. */
enum { ATTRIBUTES = 3 };
static const struct {
    const char *name, *member, *type;
    size_t width;
} attributes[ATTRIBUTES] = {{"TRANSLATION", "translation", "VEC3", 3},
                            {"ROTATION", "rotation", "VEC4", 4},
                            {"SCALE", "scale", "VEC3", 3}};

/* The numbers of one attribute of all instances: `size` bytes each, every `stride` bytes. */
typedef struct instance_values {
    const char *bytes; /* NULL: it is not given */
    size_t stride, size;
    double component; /* type, by its number in the format */
} instance_values;

/* Bytes of a number of a component type; 0 for one that rotations may not have. */
static size_t size_of(double component) {
    return component == 5126 ? 4 : component == 5122 ? 2 : component == 5120 ? 1 : 0;
}

static double value_at(const instance_values *v, size_t instance, size_t k) {
    const unsigned char *b = (const unsigned char *)v->bytes + instance * v->stride + k * v->size;
    if (v->size == 1) return fmax((double)(signed char)b[0] / 127, -1);
    const uint32_t low = b[0] | (uint32_t)b[1] << 8;
    if (v->size == 2) return fmax((double)(int16_t)low / 32767, -1);
    const uint32_t bits = low | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

/* A count, an offset or a stride of the file, `otherwise` where it is not given; false for another thing. */
static bool count_of(const json_t *owner, const char *name, size_t otherwise, size_t *out) {
    const json_t *value = json_object_get(owner, name);
    if (value != NULL &&
        (!json_is_integer(value) || json_integer_value(value) < 0 || json_integer_value(value) > UINT32_MAX))
        return false;
    *out = value == NULL ? otherwise : (size_t)json_integer_value(value);
    return true;
}

/* Finds the numbers of attribute a of n instances; false where the file does not have them, as the format
 * says: an accessor of this type, whose bytes lie in its view and its buffer. */
static bool find_values(gltf_file *g, const json_t *accessor, size_t a, size_t *n, instance_values *out) {
    lam_error ignored;
    const json_t *view = gltf_entry(g, "bufferViews", json_object_get(accessor, "bufferView"));
    const char *type = json_string_value(json_object_get(accessor, "type"));
    const double component = gltf_number(json_object_get(accessor, "componentType"), 0);
    size_t at, of_view, length, stride;
    const size_t size = size_of(component), row = size * attributes[a].width;
    const bool normalized = json_is_true(json_object_get(accessor, "normalized"));
    if (view == NULL || type == NULL || strcmp(type, attributes[a].type) != 0 || size == 0) return false;
    if (component != 5126 && (attributes[a].width != 4 || !normalized)) return false;
    if (json_object_get(accessor, "sparse") != NULL) return false;
    if (!count_of(accessor, "count", 0, n) || !count_of(accessor, "byteOffset", 0, &at) ||
        !count_of(view, "byteOffset", 0, &of_view) || !count_of(view, "byteLength", 0, &length) ||
        !count_of(view, "byteStride", row, &stride))
        return false;
    const gltf_buffer b = gltf_read_buffer(g, json_object_get(view, "buffer"), &ignored);
    if (b.bytes == NULL || stride < row || of_view > b.length || length > b.length - of_view) return false;
    if (at > length || (*n > 0 && (row > length - at || (*n - 1) > (length - at - row) / stride)))
        return false;
    *out = (instance_values){b.bytes + of_view + at, stride, size, component};
    return true;
}

/* Adds translation, rotation or scale of an instance to a node; false where a number is not usable. A
 * rotation is made one of length 1, as rounded ones are not. */
static bool set_member(json_t *node, size_t a, const instance_values *v, size_t instance) {
    double values[4], length = 0;
    json_t *array = json_array();
    for (size_t k = 0; k < attributes[a].width; k++) {
        values[k] = value_at(v, instance, k);
        length = hypot(length, values[k]);
    }
    const double by = attributes[a].width == 4 ? length : 1;
    bool good = isfinite(length) && by > 0;
    for (size_t k = 0; good && k < attributes[a].width; k++)
        good = json_array_append_new(array, json_real(values[k] / by)) == 0;
    return json_object_set_new(node, attributes[a].member, array) == 0 && good;
}

/* The attributes of a node's instances and their number; false, with why, where they cannot be read. */
static bool find_instances(gltf_file *g, const json_t *given, instance_values values[ATTRIBUTES], size_t *n,
                           char why[128]) {
    const json_t *of = json_object_get(given, "attributes");
    bool any = false;
    for (size_t a = 0; a < ATTRIBUTES; a++) {
        const json_t *index = json_object_get(of, attributes[a].name);
        size_t count = 0;
        values[a] = (instance_values){.bytes = NULL};
        if (index == NULL) continue;
        if (!find_values(g, gltf_entry(g, "accessors", index), a, &count, &values[a])) {
            snprintf(why, 128, "%s must be an accessor of %s of floats%s whose bytes the file has",
                     attributes[a].name, attributes[a].type,
                     attributes[a].width == 4 ? ", or normalized bytes or shorts," : "");
            return false;
        }
        if (any && count != *n) {
            snprintf(why, 128, "%s has %zu entries, another attribute %zu", attributes[a].name, count, *n);
            return false;
        }
        *n = count;
        any = true;
    }
    if (!any) snprintf(why, 128, "TRANSLATION, ROTATION and SCALE are missing");
    return any;
}

/* Moves the mesh of a node to children, one for each instance. */
static lam_status expand_node(gltf_file *g, json_t *nodes, size_t number, size_t *total, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *node = json_array_get(nodes, number), *name = json_object_get(node, "name");
    const json_t *given = gltf_extension(node, extension);
    json_t *of_node = json_object_get(node, "mesh"), *children;
    instance_values values[ATTRIBUTES];
    char why[128];
    size_t n = 0;
    if (given == NULL || of_node == NULL) return LAM_OK;
    if (!find_instances(g, given, values, &n, why))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: node %zu (%.60s): its instances (%s) cannot be read: %s; export it without", g->path,
             number, json_is_string(name) ? json_string_value(name) : "no name", extension, why);
    if (n > INSTANCES_MOST - *total)
        FAIL(error, LAM_ERR_FORMAT, "%s: more than %d instances (%s); export a part of the scene", g->path,
             INSTANCES_MOST, extension);
    *total += n;
    children = json_object_get(node, "children");
    if (!json_is_array(children)) {
        children = json_array();
        if (json_object_set_new(node, "children", children) != 0) TRY(LAM_ERR_MEMORY);
    }
    for (size_t i = 0; i < n; i++) {
        json_t *copy = json_object();
        if (json_array_append_new(nodes, copy) != 0 || json_object_set(copy, "mesh", of_node) != 0 ||
            (name != NULL && json_object_set(copy, "name", name) != 0) ||
            json_array_append_new(children, json_integer((json_int_t)json_array_size(nodes) - 1)) != 0)
            TRY(LAM_ERR_MEMORY);
        for (size_t a = 0; a < ATTRIBUTES; a++)
            if (values[a].bytes != NULL && !set_member(copy, a, &values[a], i))
                FAIL(error, LAM_ERR_FORMAT, "%s: node %zu: %s of instance %zu is no usable number", g->path,
                     number, attributes[a].name, i);
    }
    json_object_del(node, "mesh");
done:
    return status;
}

lam_status gltf_expand_instances(gltf_file *g, bool *any, lam_error *error) {
    lam_status status = LAM_OK;
    size_t total = 0;
    json_t *nodes = json_object_get(g->root, "nodes");
    const size_t n = json_array_size(nodes);
    for (size_t i = 0; i < n; i++) {
        if (gltf_extension(json_array_get(nodes, i), extension) == NULL) continue;
        TRY(expand_node(g, nodes, i, &total, error));
        *any = true;
    }
done:
    return status;
}
