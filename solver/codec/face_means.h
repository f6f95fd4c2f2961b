/* Answers by face of the scene file: the elements of each face, and means over them by area,
 *     x_f = sum a_if x_i / sum a_if,
 * a_if being the area that element i and face f have in common. Backs are in none of them. No I/O. */
#ifndef LAMBERT_CODEC_FACE_MEANS_H
#define LAMBERT_CODEC_FACE_MEANS_H

#include "solver/base/scene/scene_faces.h"

#include <stdbool.h>

typedef struct face_index {
    size_t n_faces;    /* of the file; 0: they are not known */
    size_t n;          /* elements */
    size_t n_fronts;   /* the first of these */
    size_t n_entries;  /* of all faces */
    uint32_t *start;   /* [n_faces + 1], into the entries of a face: */
    uint32_t *element; /* [n_entries], ascending */
    double *area;      /* [n_entries], a_if, m^2; NULL where no element is a part of several faces: */
    const double *own; /* [n], area of elements, borrowed */
    scene_faces of;
} face_index;

/* a_if of an entry. */
static inline double face_index_area(const face_index *f, size_t entry) {
    return f->area != NULL ? f->area[entry] : f->own[f->element[entry]];
}

/* Makes the index of n elements, of which the first n_fronts are fronts; area is [n] and outlives the index.
 * Takes faces over, also on an error; those that are not known make an empty index. O(n + faces). Errors:
 * LAM_ERR_MEMORY. */
lam_status face_index_make(size_t n, size_t n_fronts, const double *area, scene_faces *faces, face_index *out,
                           lam_error *error);
void face_index_free(face_index *f);

/* Bytes of an index, at most, and of what it takes over. */
uint64_t face_index_bytes(uint64_t n, uint64_t n_faces, uint64_t n_parts);

/* The faces that some elements are parts of, each once, ascending; *faces is freed by the caller. False when
 * memory is short. */
bool face_index_of(const face_index *f, size_t count, const uint32_t *elements, uint32_t **faces,
                   size_t *n_faces);

/* The faces that are asked for. */
typedef struct face_choice {
    size_t n;
    const uint32_t *faces; /* [n], each once; NULL: all */
} face_choice;

/* The elements of the faces, face by face, *elements freed by the caller. False when memory is short. */
bool face_choice_elements(const face_index *f, const face_choice *c, uint32_t **elements, size_t *count);

/* Means [rows][c->n] of x [rows][width], values of all elements in mesh order where all faces are asked for,
 * else of those of face_choice_elements. NaN: a face without an element; a mean is infinite where values are
 * not finite. A face of one element has its value, bit for bit. O(rows width). */
void face_means_floats(const face_index *f, const face_choice *c, size_t rows, const float *x, float *out);

/* The same in double; *rounding rises to a bound of the largest rounding error of a mean. */
void face_means_doubles(const face_index *f, const face_choice *c, size_t rows, const double *x, double *out,
                        double *rounding);

#endif
