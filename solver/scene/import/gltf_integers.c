/* Positions and places in images that are integers (KHR_mesh_quantization, and glTF 2.0 itself for the
 * latter), which the library takes for floating point numbers. They become such numbers in a buffer of their
 * own before it reads the file; nodes have the scale. Runs in the child. */
#include "solver/base/array_grow.h"
#include "solver/scene/import/gltf_file.h"

#include <stdlib.h>
#include <string.h>

static const char position[] = "POSITION", texcoord[] = "TEXCOORD_";

/* Appends the numbers of an accessor to the buffer as floats, in the order of this machine, which is that of
 * the format; *at is where they begin. */
static lam_status append_floats(const gltf_values *v, gltf_numbers *numbers, size_t *at, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count;
    if (!size_multiply(v->n, v->width * sizeof(float), &count)) TRY(LAM_ERR_MEMORY);
    TRY(array_grow(&numbers->bytes, &numbers->capacity, numbers->length + count, 1, "vertices", error));
    *at = numbers->length;
    for (size_t i = 0; i < v->n; i++)
        for (size_t k = 0; k < v->width; k++) {
            const float value = (float)gltf_value(v, i, k);
            memcpy(numbers->bytes + numbers->length, &value, sizeof value);
            numbers->length += sizeof value;
        }
done:
    return status;
}

/* Moves an accessor of integers to a view of the buffer of numbers. */
static lam_status convert(gltf_file *g, json_t *accessor, const char *attribute, gltf_numbers *numbers,
                          lam_error *error) {
    lam_status status = LAM_OK;
    gltf_values v;
    size_t at = 0;
    json_t *views = json_object_get(g->root, "bufferViews");
    if (!gltf_find_values(g, accessor, &v))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: its %s are integers that cannot be read: an accessor of them must not be sparse, and the "
             "file "
             "must have its bytes; export it without KHR_mesh_quantization",
             g->path, attribute);
    TRY(append_floats(&v, numbers, &at, error));
    json_t *view = json_pack("{sIsIsI}", "buffer", (json_int_t)g->n_buffers, "byteOffset", (json_int_t)at,
                             "byteLength", (json_int_t)(numbers->length - at));
    if (json_array_append_new(views, view) != 0 ||
        json_object_set_new(accessor, "bufferView", json_integer((json_int_t)json_array_size(views) - 1)) !=
            0 ||
        json_object_set_new(accessor, "componentType", json_integer(GLTF_FLOAT)) != 0)
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its vertices", g->path);
    static const char *const gone[] = {"byteOffset", "normalized", "min", "max"};
    for (size_t k = 0; k < sizeof gone / sizeof *gone; k++) json_object_del(accessor, gone[k]);
done:
    return status;
}

/* True where an accessor has bytes of its own that are no floats; a compressed mesh has none. */
static bool has_integers(const json_t *accessor) {
    return json_object_get(accessor, "bufferView") != NULL &&
           gltf_number(json_object_get(accessor, "componentType"), GLTF_FLOAT) != GLTF_FLOAT;
}

static json_t *accessor_of(const gltf_file *g, const json_t *index) {
    if (gltf_entry(g, "accessors", index) == NULL) return NULL;
    return json_array_get(json_object_get(g->root, "accessors"), (size_t)json_integer_value(index));
}

static lam_status convert_primitive(gltf_file *g, json_t *attributes, gltf_numbers *numbers,
                                    lam_error *error) {
    /* Nothing takes these, and the library does not expect them as integers. */
    static const char *const unused[] = {"NORMAL", "TANGENT"};
    lam_status status = LAM_OK;
    const char *name;
    json_t *index;
    json_object_foreach(attributes, name, index) {
        json_t *accessor = accessor_of(g, index);
        if (strcmp(name, position) != 0 && strncmp(name, texcoord, sizeof texcoord - 1) != 0) continue;
        if (has_integers(accessor)) TRY(convert(g, accessor, name, numbers, error));
    }
    for (size_t k = 0; k < sizeof unused / sizeof *unused; k++)
        if (has_integers(accessor_of(g, json_object_get(attributes, unused[k]))))
            json_object_del(attributes, unused[k]);
done:
    return status;
}

lam_status gltf_convert_integers(gltf_file *g, gltf_numbers *numbers, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *owner, *primitive;
    size_t i, k;
    json_array_foreach(json_object_get(g->root, "meshes"), i, owner)
        json_array_foreach(json_object_get(owner, "primitives"), k, primitive)
            TRY(convert_primitive(g, json_object_get(primitive, "attributes"), numbers, error));
    if (numbers->length == 0) goto done;
    TRY(gltf_add_buffer(g, GLTF_NUMBERS, numbers, error));
done:
    return status;
}
