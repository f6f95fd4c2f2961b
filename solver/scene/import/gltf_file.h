/* The JSON of a glTF or GLB and its buffers, for the files that read parts of it. Private to
 * solver/scene/import; used in the child. */
#ifndef LAMBERT_SCENE_IMPORT_GLTF_FILE_H
#define LAMBERT_SCENE_IMPORT_GLTF_FILE_H

#include "solver/base/asset_files.h"
#include "solver/scene/import/imported_faces.h"

#include <jansson.h>

typedef struct gltf_buffer {
    const char *bytes;
    char *owned;
    size_t length;
} gltf_buffer;

typedef struct gltf_file {
    const char *path;
    imported_faces *s;
    json_t *root;
    const char *chunk; /* the binary one of a GLB, or NULL */
    size_t chunk_length, n_buffers;
    gltf_buffer *buffers; /* those read so far */
    size_t own_nodes; /* nodes of the file; those behind are instances, children of the node that has them */
} gltf_file;

/* Parses the JSON and finds the binary chunk, into a file that has its path and s; root is NULL where the
 * file is broken. The bytes are the caller's until gltf_close. */
void gltf_parse(gltf_file *g, const char *bytes, size_t length);

/* Room for the buffers, of which none is read yet, and for two more. Errors: LAM_ERR_MEMORY. */
lam_status gltf_hold_buffers(gltf_file *g, lam_error *error);

void gltf_close(gltf_file *g);

/* The entry of an array of the file, NULL where index is none of it; an extension of a part of the file, or
 * NULL; a number, or otherwise. */
const json_t *gltf_entry(const gltf_file *g, const char *array, const json_t *index);
const json_t *gltf_extension(const json_t *owner, const char *name);
double gltf_number(const json_t *value, double otherwise);

/* The bytes of a data URI, freed by the caller; NULL where it has none in base64. */
char *gltf_data_of_uri(const char *uri, size_t *length, lam_error *error);

/* Undoes %20 and the like; longer names are cut, and not found then. */
void gltf_decode_uri(const char *uri, char out[ASSET_PATH]);

/* Gives the nodes with EXT_mesh_gpu_instancing a child for each instance, in the JSON; *any becomes true
 * where there are such nodes. Errors: LAM_ERR_FORMAT (instances that cannot be read, or too many),
 * LAM_ERR_MEMORY. */
#define GLTF_INSTANCES "EXT_mesh_gpu_instancing"
lam_status gltf_expand_instances(gltf_file *g, bool *any, lam_error *error);

/* A count, an offset or a stride of the file, `otherwise` where it is not given; false for another thing. */
bool gltf_count(const json_t *owner, const char *name, size_t otherwise, size_t *out);

/* The component types of the format. */
enum {
    GLTF_BYTE = 5120,
    GLTF_UBYTE = 5121,
    GLTF_SHORT = 5122,
    GLTF_USHORT = 5123,
    GLTF_UINT = 5125,
    GLTF_FLOAT = 5126
};

/* The numbers of an accessor: n rows of width numbers, `size` bytes each, a row every `stride` bytes. */
typedef struct gltf_values {
    const char *bytes; /* in a buffer of the file; NULL: there are none */
    size_t n, width, stride, size;
    unsigned type; /* of components */
    bool normalized;
} gltf_values;

/* Finds them; false where they are sparse, of another type than a number or a vector, or not in the bytes
 * that the file has. */
bool gltf_find_values(gltf_file *g, const json_t *accessor, gltf_values *out);

/* Number k of a row; a normalized integer is from 0 or -1 to 1. */
double gltf_value(const gltf_values *v, size_t row, size_t k);

/* Adds a buffer of this URI behind the others, for as long as bytes stay where they are. Errors:
 * LAM_ERR_MEMORY. */
lam_status gltf_add_buffer(gltf_file *g, const char *uri, const gltf_numbers *bytes, lam_error *error);

/* The first is true of a build that reads compressed views. The second puts their bytes into a buffer of the
 * URI GLTF_UNPACKED; unpacked is empty where there are none. O(bytes). Errors: LAM_ERR_FORMAT (views that
 * cannot be read, more than 4 GiB of them), LAM_ERR_MEMORY. */
#define GLTF_MESHOPT "EXT_meshopt_compression"
bool gltf_reads_meshopt(void);
lam_status gltf_unpack_views(gltf_file *g, gltf_numbers *unpacked, lam_error *error);

/* Turns positions and places in images that are integers into floats of a buffer, the last one, whose URI is
 * GLTF_NUMBERS, and leaves out normals that are integers. numbers is empty where there are no integers.
 * O(numbers). Errors: LAM_ERR_FORMAT (integers that cannot be read), LAM_ERR_MEMORY. */
lam_status gltf_convert_integers(gltf_file *g, gltf_numbers *numbers, lam_error *error);

/* Warns of maps, scenes and extensions that are not read, a line for each kind, with the faces that
 * each is about and their area: of plain bytes, instances that are nodes, and bones. O(faces) where there are
 * some. Errors: LAM_ERR_MEMORY. */
lam_status gltf_tell_left_out(gltf_file *g, lam_error *error);

/* The bytes of a buffer, read once; bytes is NULL where there are none. */
gltf_buffer gltf_read_buffer(gltf_file *g, const json_t *index, lam_error *error);

#endif
