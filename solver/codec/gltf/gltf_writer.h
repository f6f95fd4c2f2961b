/* The parts of a glTF file while it is written. Private to solver/codec/gltf. */
#ifndef LAMBERT_CODEC_GLTF_WRITER_H
#define LAMBERT_CODEC_GLTF_WRITER_H

#include "solver/codec/gltf/corner_normals.h"
#include "solver/codec/gltf/gltf.h"

/* The views of the binary chunk, in this order; each group has one accessor in each. With light there is a
 * colour, and a view for each column. With pictures there are places in the image and reflectances, which
 * only the vertices of groups with an image have. With a lightmap there are places in it. A view for each
 * image stands behind these, the lightmap last. */
enum {
    GLTF_VIEW_POSITION,
    GLTF_VIEW_NORMAL,
    GLTF_VIEW_ELEMENT,
    GLTF_VIEW_FACE,
    GLTF_VIEW_INDEX,
    GLTF_VIEW_COLOUR,
    GLTF_VIEW_COLUMN
};
enum { GLTF_VIEW_TEXCOORD = GLTF_VIEW_COLOUR, GLTF_VIEW_REFLECTANCE, GLTF_VIEW_IMAGE };

/* A group's part of the file. */
typedef struct gltf_part {
    size_t group, n_elements;
    size_t textured;           /* place among the groups with an image */
    size_t vertex, n_vertices; /* first of the file, and how many */
    size_t index, n_indices;
    uint32_t surface;       /* of pictures, that of all its elements; or PICTURE_NONE */
    size_t textured_vertex; /* first among those of groups with an image */
    float low[3], high[3];
    double reflectance[3], emission[3];
} gltf_part;

_Static_assert(sizeof(gltf_part) <= GLTF_PART_BYTES, "gltf_work_bytes counts less");

typedef struct gltf_writer {
    const gltf_mesh *m;
    corner_normals s;
    float (*normals)[3]; /* [4 elements of the largest group] */
    gltf_part *parts;    /* [n_parts]: the groups that have elements */
    size_t n_parts, n_vertices, n_indices, n_textured_vertices;
    size_t n_views;  /* with accessors */
    size_t n_common; /* of them, in which each group has one */
    size_t map_view; /* places in the lightmap, or numbers of corners; SIZE_MAX without these */
    size_t n_blobs;  /* views of the rows of corners, behind images */
    const scene_pictures *pictures; /* NULL where no group has an image */
    size_t n_textured, n_images;
    size_t *view; /* [n_views + n_images + 1]: offsets in the binary chunk, and its length */
    buffer json;
} gltf_writer;

static inline size_t gltf_corners_of(const gltf_mesh *m, size_t element) {
    return m->elements[element][3] == GLTF_NO_VERTEX ? 3 : 4;
}

/* Places of an element's polygon, and their vertices: its corners, and those inside its edges. */
static inline size_t gltf_ring_count(const gltf_mesh *m, size_t i) {
    return m->corners == NULL ? gltf_corners_of(m, i)
                              : m->corners->nodes->ring_start[i + 1] - m->corners->nodes->ring_start[i];
}

static inline uint32_t gltf_ring_vertex(const gltf_mesh *m, size_t i, size_t k) {
    return m->corners == NULL
               ? m->elements[i][k]
               : m->corners->nodes->vertex[m->corners->nodes->ring[m->corners->nodes->ring_start[i] + k]];
}

static inline const uint32_t *gltf_elements_of(const gltf_mesh *m, size_t g) {
    return m->groups->elements + m->groups->start[g];
}

/* The bytes of image k of the file. */
const unsigned char *gltf_image_of(const gltf_writer *w, size_t k, size_t *bytes);

/* Writes a number of 32 bits, little-endian, and gives the place behind it. */
char *gltf_put(char *at, uint32_t value);

/* Writes the part's vertices and triangles; to is the binary chunk. Errors: LAM_ERR_MEMORY. */
lam_status gltf_put_part(gltf_writer *w, const gltf_part *p, char *to, lam_error *error);

/* The same of a part with corners, and the vertices of a part with shared ones. */
lam_status gltf_put_corners(gltf_writer *w, const gltf_part *p, char *to, lam_error *error);
size_t gltf_count_shared(const gltf_mesh *m, const gltf_part *p);

/* The bytes of blob k, and writing all of them. */
size_t gltf_blob_bytes(const gltf_writer *w, size_t k);
void gltf_put_blobs(const gltf_writer *w, char *to);

/* Writes vectors and numbers, and gives the place behind them. */
char *gltf_put_float(char *at, float value);
char *gltf_put_vector(char *at, const float v[3]);

/* The number of an element's face as glTF has it: -1 of none, of several, or where it is no float. */
float gltf_face_number(const gltf_mesh *m, size_t element);

/* Writes the images. */
void gltf_put_images(const gltf_writer *w, char *to);

#endif
