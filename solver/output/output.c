#include "solver/output/output.h"

#include "solver/base/atomic_file.h"
#include "solver/base/options.h"
#include "solver/light/npy_file.h"

#include <string.h>

lam_status output_check(const char *path, bool reduced, lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16];
    output_file_extension(path, extension);
    if (!option_among(extension, "npy|json|csv|ply|vtu"))
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: must end in .npy, .json, .csv, .ply or .vtu", path);
    if (reduced && !option_among(extension, "json|csv"))
        FAIL(error, LAM_ERR_ARGUMENT, "-o %s: --reduce goes into .json or .csv only", path);
done:
    return status;
}

void output_column(const solution *s, size_t vector, size_t channel, char name[OUTPUT_COLUMN]) {
    static const char letters[] = "rgb";
    int length = snprintf(name, OUTPUT_COLUMN, "%s", s->quantity);
    if (s->names != NULL)
        length += snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_%s", s->names[vector]);
    else if (s->batch)
        length += snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_%zu", vector);
    if (s->m->n_channels == 3)
        snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_%c", letters[channel]);
    else if (s->m->n_channels > 1)
        snprintf(name + length, OUTPUT_COLUMN - (size_t)length, "_c%zu", channel);
}

void output_figures(const solution *s, const bool *inside, size_t column, double figures[REDUCE_COUNT]) {
    if (s->values != NULL)
        reduce_compute(s->m, inside, s->values + column * s->m->n, figures);
    else
        reduce_compute_double(s->m, inside, s->refined + column * s->m->n, figures);
}

static void output_npy(const solution *s, FILE *stream) {
    size_t dims[3];
    int rank = 0;
    if (s->batch) dims[rank++] = s->n_vectors;
    if (s->m->n_channels > 1) dims[rank++] = s->m->n_channels;
    dims[rank++] = s->m->n;
    if (s->values != NULL)
        npy_write(stream, rank, dims, s->values);
    else
        npy_write_double(stream, rank, dims, s->refined);
}

lam_status output_write(const solution *s, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    output_file file = {0};
    char extension[16];
    output_file_extension(path, extension);
    TRY(output_file_open(path, &file, error));
    if (strcmp(extension, "npy") == 0)
        output_npy(s, file.stream);
    else if (strcmp(extension, "json") == 0)
        TRY(output_json(s, file.stream, error));
    else if (strcmp(extension, "csv") == 0)
        output_csv(s, file.stream);
    else if (strcmp(extension, "ply") == 0)
        output_ply(s, file.stream);
    else
        output_vtu(s, file.stream);
    TRY(output_file_commit(&file, error));
done:
    output_file_abort(&file);
    return status;
}
