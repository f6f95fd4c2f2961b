/* Binary glTF read back by the rules of the specification, each of which is checked. */
#ifndef LAMBERT_TESTS_GLTF_FILE_H
#define LAMBERT_TESTS_GLTF_FILE_H

#include "solver/codec/gltf/gltf.h"

#include <jansson.h>

/* A file of glTF in parts. */
typedef struct gltf_file {
    buffer file;
    json_t *root;
    const char *binary;
    size_t n_binary;
} gltf_file;

/* Writes a mesh and reads it; its length is within the bound of meshes without light. */
gltf_file gltf_load(const gltf_mesh *m);
void gltf_unload(gltf_file *l);

/* Numbers as files have them. */
uint32_t gltf_u32(const char *at);
float gltf_float(const char *at);

/* Item k of a member that is a list, and a member that is an integer. */
json_t *gltf_item(const json_t *object, const char *list, size_t k);
size_t gltf_number(const json_t *object, const char *name);

/* The bytes of an accessor, of this type and size of an item, which lie in their view and are aligned. */
const char *gltf_accessor(const gltf_file *l, size_t k, const char *type, size_t component, size_t bytes,
                          size_t *count);

/* The primitive of a node. */
typedef struct gltf_primitive {
    const char *name;
    const char *position, *normal, *element, *face, *index;
    size_t n_vertices, n_indices;
    const json_t *material, *extras, *attributes;
} gltf_primitive;

/* Reads a primitive and checks its bounds. */
gltf_primitive gltf_primitive_of(const gltf_file *l, size_t node);

#endif
