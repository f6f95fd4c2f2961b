/* Views of a glTF whose bytes are compressed (EXT_meshopt_compression, by the library of that name): they
 * become plain bytes in a buffer of their own before others read them. A build without the library refuses
 * files that require it; others have the plain bytes besides. Runs in the child. */
#include "solver/base/array_grow.h"
#include "solver/scene/import/gltf_file.h"

#include <string.h>

#ifndef LAMBERT_MESHOPTIMIZER
bool gltf_reads_meshopt(void) {
    return false;
}

lam_status gltf_unpack_views(gltf_file *g, gltf_numbers *unpacked, lam_error *error) {
    (void)g;
    (void)unpacked;
    (void)error;
    return LAM_OK;
}
#else
#include <meshoptimizer.h>

/* The most bytes that one byte of such a view becomes: 16 equal bytes are written as 2 bits. */
#define BYTES_OF_BYTE 64
#define BYTES_MORE 4096

typedef enum packed_mode { PACKED_ATTRIBUTES, PACKED_TRIANGLES, PACKED_INDICES, PACKED_MODES } packed_mode;
typedef enum packed_filter {
    FILTER_NONE,
    FILTER_OCTAHEDRAL,
    FILTER_QUATERNION,
    FILTER_EXPONENTIAL,
    FILTERS
} packed_filter;

/* A view as the extension describes it: count rows of stride bytes. */
typedef struct packed_view {
    const unsigned char *bytes;
    size_t length, stride, count;
    unsigned mode, filter;
} packed_view;

/* The place of a text among names; that of `otherwise` where it is not given, n for another one. */
static unsigned word_of(const json_t *owner, const char *name, const char *otherwise,
                        const char *const *names, unsigned n) {
    const json_t *value = json_object_get(owner, name);
    const char *word = value == NULL ? otherwise : json_string_value(value);
    unsigned k = 0;
    while (k < n && (word == NULL || strcmp(names[k], word) != 0)) k++;
    return k;
}

/* True where the library takes a row of that many bytes. */
static bool has_row(const packed_view *p) {
    if (p->mode != PACKED_ATTRIBUTES)
        return (p->stride == 2 || p->stride == 4) && p->filter == FILTER_NONE &&
               (p->mode == PACKED_INDICES || p->count % 3 == 0);
    if (p->stride == 0 || p->stride > 256 || p->stride % 4 != 0) return false;
    return p->filter == FILTER_OCTAHEDRAL   ? p->stride == 4 || p->stride == 8
           : p->filter == FILTER_QUATERNION ? p->stride == 8
                                            : true;
}

/* False where the extension is none that the format allows, or its bytes are not in the file. */
static bool find_packed(gltf_file *g, const json_t *extension, packed_view *out) {
    static const char *const modes[PACKED_MODES] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
    static const char *const filters[FILTERS] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
    packed_view p;
    size_t at;
    lam_error ignored;
    if (!gltf_count(extension, "byteOffset", 0, &at) ||
        !gltf_count(extension, "byteLength", SIZE_MAX, &p.length) ||
        !gltf_count(extension, "byteStride", 0, &p.stride) ||
        !gltf_count(extension, "count", SIZE_MAX, &p.count))
        return false;
    p.mode = word_of(extension, "mode", NULL, modes, PACKED_MODES);
    p.filter = word_of(extension, "filter", "NONE", filters, FILTERS);
    if (p.mode == PACKED_MODES || p.filter == FILTERS || p.count == SIZE_MAX || !has_row(&p)) return false;
    const gltf_buffer b = gltf_read_buffer(g, json_object_get(extension, "buffer"), &ignored);
    if (b.bytes == NULL || at > b.length || p.length > b.length - at) return false;
    p.bytes = (const unsigned char *)b.bytes + at;
    *out = p;
    return p.count * p.stride <= BYTES_OF_BYTE * p.length + BYTES_MORE;
}

static bool unpack(const packed_view *p, char *to) {
    const int failed = p->mode == PACKED_ATTRIBUTES
                           ? meshopt_decodeVertexBuffer(to, p->count, p->stride, p->bytes, p->length)
                       : p->mode == PACKED_TRIANGLES
                           ? meshopt_decodeIndexBuffer(to, p->count, p->stride, p->bytes, p->length)
                           : meshopt_decodeIndexSequence(to, p->count, p->stride, p->bytes, p->length);
    if (failed != 0) return false;
    if (p->filter == FILTER_OCTAHEDRAL) meshopt_decodeFilterOct(to, p->count, p->stride);
    if (p->filter == FILTER_QUATERNION) meshopt_decodeFilterQuat(to, p->count, p->stride);
    if (p->filter == FILTER_EXPONENTIAL) meshopt_decodeFilterExp(to, p->count, p->stride);
    return true;
}

static lam_status unpack_view(gltf_file *g, size_t number, json_t *view, gltf_numbers *unpacked,
                              lam_error *error) {
    lam_status status = LAM_OK;
    packed_view p;
    const size_t at = unpacked->length;
    if (!find_packed(g, gltf_extension(view, GLTF_MESHOPT), &p))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: bufferViews[%zu] is compressed (" GLTF_MESHOPT
             ") in a way that the format does not have, or the "
             "file lacks its bytes; export it again, or without",
             g->path, number);
    const size_t size = (p.count * p.stride + 3) & ~(size_t)3; /* rows begin at multiples of 4 */
    if (size > UINT32_MAX - at)
        FAIL(error, LAM_ERR_FORMAT, "%s: its compressed views (" GLTF_MESHOPT ") have more than 4 GiB",
             g->path);
    TRY(array_grow(&unpacked->bytes, &unpacked->capacity, at + size + 1, 1, "vertices", error));
    memset(unpacked->bytes + at, 0, size);
    if (!unpack(&p, unpacked->bytes + at))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: bufferViews[%zu] is compressed (" GLTF_MESHOPT
             "), and its bytes are damaged; export it again",
             g->path, number);
    const size_t length = p.count * p.stride;
    unpacked->length = at + size;
    if (json_object_set_new(view, "buffer", json_integer((json_int_t)g->n_buffers)) != 0 ||
        json_object_set_new(view, "byteOffset", json_integer((json_int_t)at)) != 0 ||
        json_object_set_new(view, "byteLength", json_integer((json_int_t)length)) != 0)
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its vertices", g->path);
    json_object_del(json_object_get(view, "extensions"), GLTF_MESHOPT);
done:
    return status;
}

bool gltf_reads_meshopt(void) {
    return true;
}

lam_status gltf_unpack_views(gltf_file *g, gltf_numbers *unpacked, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *view;
    size_t k;
    bool any = false;
    json_array_foreach(json_object_get(g->root, "bufferViews"), k, view) {
        if (gltf_extension(view, GLTF_MESHOPT) == NULL) continue;
        any = true;
        TRY(unpack_view(g, k, view, unpacked, error));
    }
    if (any) TRY(gltf_add_buffer(g, GLTF_UNPACKED, unpacked, error));
done:
    return status;
}
#endif
