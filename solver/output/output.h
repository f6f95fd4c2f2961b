/* Solutions as files: NPY, JSON, CSV, PLY, VTU, glTF; and the figures of groups that --reduce asks for. The
 * room codec writes numbers, NPY, JSON and glTF. */
#ifndef LAMBERT_OUTPUT_OUTPUT_H
#define LAMBERT_OUTPUT_OUTPUT_H

#include "lambert/lambert.h"
#include "solver/codec/face_means.h"
#include "solver/codec/group_figures.h"
#include "solver/codec/headline.h"
#include "solver/operator/stated/answer_error.h"
#include "solver/scene/mesh.h"

#include <stdio.h>

/* --reduce GROUP=FIGURE,...: each request has one name; items of the same group share one. */
typedef struct reduction {
    char *group;
    reduce_request request;
    double *figures; /* [n_with][n_vectors][C], or NULL before reductions_fill */
} reduction;

/* Adds an item to the n reductions, which have room for one more. LAM_ERR_ARGUMENT names the item. */
lam_status reductions_add(reduction *reductions, size_t *n, const char *item, lam_error *error);

/* Finds the groups of each. LAM_ERR_ARGUMENT for a name that the scene does not have. */
lam_status reductions_bind(reduction *reductions, size_t n, const group_index *groups, lam_error *error);

/* The elements of the groups that are reduced, *selected freed with free(); NULL where there is no reduction.
 * LAM_ERR_MEMORY. */
lam_status reductions_elements(const mesh *m, const reduction *reductions, size_t n, size_t *n_selected,
                               uint32_t **selected, lam_error *error);

void reductions_free(reduction *reductions, size_t n);

/* Hours of weather behind an answer. */
typedef struct weather_hours {
    double counted, left_out, filled; /* h; counted: with those that were filled */
} weather_hours;

/* An answer of the solver and its question. */
typedef struct solution {
    const mesh *m;
    const mesh *materials; /* m with all its channels, where values have one, their luminance; else NULL */
    const group_index *groups;
    const char *scene;
    lam_quantity quantity;
    const char *unit;         /* of values, or of the hours of a year */
    const char *sum_unit;     /* of the sum of a year; NULL: there is none */
    const char *converted_by; /* the text of a light_conversion */
    size_t n_vectors;
    bool batch;
    const char *const *names; /* [n_vectors], of figures of a year in place of vectors; NULL: numbers */
    const char *const *units; /* [n_vectors], beside names: "" of shares */
    const char *named_as;     /* the member of JSON that holds them; NULL: "annual" */
    const float *values;      /* [n_vectors][C][n]; NULL where they are refined: */
    const float *corners;     /* [n_vectors][C][n][4] beside values, the 4th of a triangle NaN; or NULL */
    const double *refined;    /* [n_vectors][C][n], and, of each vector, [n_vectors]: */
    const double *certificates;
    const size_t *iterations;
    const face_index *faces; /* where values are of faces: [n_vectors][C][n_faces], NaN of a face without an
                                element; NULL: of elements */
    const size_t *limited;   /* of answer_notes; or NULL */
    reduction *reductions;
    size_t n_reductions;               /* 0: the values themselves are written */
    double relative, indirect;         /* mean error that is stated; negative: none is */
    headline head;                     /* of answer_notes */
    bool tells_parts;                  /* of head, in the table for people */
    const char *error_of, *error_from; /* of answer_notes */
    const char *error_light;           /* likewise */
    double emitters;                   /* likewise */
    bool by_luminance;                 /* likewise */
    const weather_hours *hours;        /* NULL: no weather */
    const name_error *name_errors;     /* [n_reductions], of error_light "own"; or NULL */
} solution;

/* Computes the figures of every reduction. LAM_ERR_MEMORY. */
lam_status reductions_fill(solution *s, lam_error *error);

/* A file holds values of elements, figures of groups in place of them, values of corners, or of faces. */
typedef enum output_content {
    OUTPUT_ELEMENTS,
    OUTPUT_GROUPS,
    OUTPUT_CORNERS,
    OUTPUT_FACES,
    OUTPUT_CONTENTS
} output_content;

/* Puts ".npy, .json or .csv", the formats of a content, into text. */
#define OUTPUT_FORMATS 128
void output_formats(output_content content, char text[OUTPUT_FORMATS]);

/* Checks that a file of this name can be written: LAM_ERR_ARGUMENT names the extensions that can. */
lam_status output_check(const char *path, output_content content, lam_error *error);

/* Writes path in the format of its extension, whole or not at all. */
lam_status output_write(const solution *s, const char *path, lam_error *error);

/* Writes an array, floats or doubles, as NPY of its own type; a failed write is seen by ferror(stream).
 * Errors: LAM_ERR_MEMORY. */
lam_status output_array(FILE *stream, size_t rank, const size_t *shape, const float *floats,
                        const double *doubles, lam_error *error);

/* "radiosity", "radiosity_g", "radiosity_3_g", "irradiance_sum": the column of a vector and channel. */
#define OUTPUT_COLUMN 64
void output_column(const solution *s, size_t vector, size_t channel, char name[OUTPUT_COLUMN]);

/* The first line of a table: these columns, then one for each vector and channel, with the unit of its values
 * in brackets. */
void output_csv_header(const solution *s, const char *first, FILE *stream);

/* The unit of the values of a vector, or "". */
static inline const char *output_unit(const solution *s, size_t vector) {
    return s->units != NULL ? s->units[vector] : s->unit;
}

/* Numbers of a vector in a channel. */
static inline size_t output_width(const solution *s) {
    return s->faces != NULL ? s->faces->n_faces : s->m->n;
}

/* A value in double, and the digits that distinguish it from all others of its precision. */
static inline double output_value(const solution *s, size_t index) {
    return s->values != NULL ? (double)s->values[index] : s->refined[index];
}
static inline int output_digits(const solution *s) {
    return s->values != NULL ? 9 : 17;
}

/* The figure of a reduction: number k of its request's statistics, of column v C + c. */
static inline double output_figure(const solution *s, const reduction *r, size_t k, size_t column) {
    const size_t C = s->m->n_channels;
    return *reduce_figure(&r->request, 0, k, s->n_vectors, column / C, C, column % C, r->figures);
}

/* The group of a face of the scene file, or NULL where it has no element; and the area of its elements, m^2.
 */
const char *output_face_group(const solution *s, size_t face, double *area);

/* Writes on standard output: the reductions, the values of faces, or the mean of every group. */
void output_print(const solution *s);

/* The last of its lines, "stated error of this answer, of the light of receivers, emitted by sources, 4
 * emitters: 0.012, most of it by the mesh", with the parts where these are wanted; or why none is stated. */
void output_print_error(const solution *s);

/* Writes the same as JSON on standard output, those of faces as output_json. Errors: LAM_ERR_MEMORY;
 * LAM_ERR_ARGUMENT for a value that is too large for a float. */
lam_status output_print_json(const solution *s, lam_error *error);

/* The formats; a failed write is seen by ferror(stream). */
lam_status output_json(const solution *s, FILE *stream, lam_error *error);
lam_status output_csv(const solution *s, FILE *stream, lam_error *error);
lam_status output_ply(const solution *s, FILE *stream, lam_error *error);
lam_status output_vtu(const solution *s, FILE *stream, lam_error *error);
lam_status output_glb(const solution *s, FILE *stream, lam_error *error);

#endif
