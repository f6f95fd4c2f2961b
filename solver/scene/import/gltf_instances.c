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

/* Finds the numbers of attribute a of all instances; false where the file does not have them, as the
 * extension says: floats, or of a rotation normalized signed integers. */
static bool find_values(gltf_file *g, const json_t *accessor, size_t a, gltf_values *out) {
    if (!gltf_find_values(g, accessor, out) || out->width != attributes[a].width) return false;
    if (out->type == GLTF_FLOAT) return true;
    return out->width == 4 && out->normalized && (out->type == GLTF_BYTE || out->type == GLTF_SHORT);
}

/* Adds translation, rotation or scale of an instance to a node; false where a number is not usable. A
 * rotation is made one of length 1, as rounded ones are not. */
static bool set_member(json_t *node, size_t a, const gltf_values *v, size_t instance) {
    double values[4], length = 0;
    json_t *array = json_array();
    for (size_t k = 0; k < attributes[a].width; k++) {
        values[k] = gltf_value(v, instance, k);
        length = hypot(length, values[k]);
    }
    const double by = attributes[a].width == 4 ? length : 1;
    bool good = isfinite(length) && by > 0;
    for (size_t k = 0; good && k < attributes[a].width; k++)
        good = json_array_append_new(array, json_real(values[k] / by)) == 0;
    return json_object_set_new(node, attributes[a].member, array) == 0 && good;
}

/* The attributes of a node's instances and their number; false, with why, where they cannot be read. */
static bool find_instances(gltf_file *g, const json_t *given, gltf_values values[ATTRIBUTES], size_t *n,
                           char why[128]) {
    const json_t *of = json_object_get(given, "attributes");
    bool any = false;
    for (size_t a = 0; a < ATTRIBUTES; a++) {
        const json_t *index = json_object_get(of, attributes[a].name);
        values[a] = (gltf_values){.bytes = NULL};
        if (index == NULL) continue;
        if (!find_values(g, gltf_entry(g, "accessors", index), a, &values[a])) {
            snprintf(why, 128, "%s must be an accessor of %s of floats%s whose bytes the file has",
                     attributes[a].name, attributes[a].type,
                     attributes[a].width == 4 ? ", or normalized bytes or shorts," : "");
            return false;
        }
        if (any && values[a].n != *n) {
            snprintf(why, 128, "%s has %zu entries, another attribute %zu", attributes[a].name, values[a].n,
                     *n);
            return false;
        }
        *n = values[a].n;
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
    gltf_values values[ATTRIBUTES];
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
    g->own_nodes = n;
    for (size_t i = 0; i < n; i++) {
        if (gltf_extension(json_array_get(nodes, i), extension) == NULL) continue;
        TRY(expand_node(g, nodes, i, &total, error));
        *any = true;
    }
done:
    return status;
}
