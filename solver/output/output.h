/* Solutions as files: NPY, JSON, CSV, PLY, VTU. */
#ifndef LAMBERT_OUTPUT_OUTPUT_H
#define LAMBERT_OUTPUT_OUTPUT_H

#include "solver/light/result_figures.h"
#include "solver/scene/mesh.h"

#include <stdio.h>

/* What a solve found, and what it was asked. */
typedef struct solution {
    const mesh *m;
    const char *scene;
    const char *quantity;
    size_t n_vectors;
    bool batch;
    const char *const *names; /* [n_vectors], of figures of a year in place of vectors; NULL: numbers */
    const float *values;      /* [n_vectors][C][n]; NULL where they are refined: */
    const double *refined;    /* [n_vectors][C][n], and, of each vector, [n_vectors]: */
    const double *certificates;
    const size_t *iterations;
    const reduction *reductions;
    size_t n_reductions;       /* 0: the values themselves are written */
    double relative, indirect; /* mean error that the store states; negative: not measured */
} solution;

/* Whether a file of this name can be written; LAM_ERR_ARGUMENT names the extensions that can.
 * Reductions go into JSON and CSV only. */
lam_status output_check(const char *path, bool reduced, lam_error *error);

/* Writes path in the format of its extension, whole or not at all. */
lam_status output_write(const solution *s, const char *path, lam_error *error);

/* "radiosity", "radiosity_g", "radiosity_3_g", "irradiance_sum": the column of a vector and channel. */
#define OUTPUT_COLUMN 64
void output_column(const solution *s, size_t vector, size_t channel, char name[OUTPUT_COLUMN]);

/* The figures of a reduction of one channel of a vector: column v C + c. */
void output_figures(const solution *s, const bool *inside, size_t column, double figures[REDUCE_COUNT]);

/* A value in double, and the digits that tell it from all others of its precision. */
static inline double output_value(const solution *s, size_t index) {
    return s->values != NULL ? (double)s->values[index] : s->refined[index];
}
static inline int output_digits(const solution *s) {
    return s->values != NULL ? 9 : 17;
}

/* On standard output: the reductions, or the mean of every group. */
lam_status output_print(const solution *s, lam_error *error);

/* The formats; a failed write is seen by ferror(stream). */
lam_status output_json(const solution *s, FILE *stream, lam_error *error);
void output_csv(const solution *s, FILE *stream);
void output_ply(const solution *s, FILE *stream);
void output_vtu(const solution *s, FILE *stream);

#endif
