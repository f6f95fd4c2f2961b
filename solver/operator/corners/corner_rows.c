#include "solver/operator/corners/corner_rows.h"

#include "solver/base/array_grow.h"

#include <math.h>
#include <stdlib.h>

lam_status corner_rows_begin(corner_rows *rows, size_t n_rows, lam_error *error) {
    rows->first = memory_allocate(n_rows + 1, sizeof *rows->first, "corners", error);
    rows->even = memory_allocate(n_rows, sizeof *rows->even, "corners", error);
    return rows->first == NULL || rows->even == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

void corner_rows_free(corner_rows *rows) {
    free(rows->first);
    free(rows->columns);
    free(rows->weights);
    free(rows->even);
    *rows = (corner_rows){.n_rows = 0};
}

static lam_status resize(corner_rows *rows, size_t count, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(array_resize(&rows->columns, count, sizeof *rows->columns, "corners", error));
    TRY(array_resize(&rows->weights, count, sizeof *rows->weights, "corners", error));
    rows->capacity = count;
done:
    return status;
}

lam_status corner_rows_add(corner_rows *rows, size_t count, const uint32_t *columns, const double *weights,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = rows->first[rows->n_rows], end = first + count;
    const double mean = 1 / (double)count;
    bool even = count > 0;
    if (end > UINT32_MAX) FAIL(error, LAM_ERR_ARGUMENT, "corners have more than 2^32 weights");
    if (end > rows->capacity) TRY(resize(rows, array_capacity(rows->capacity, end), error));
    for (size_t k = 0; k < count; k++) even = even && fabs(weights[k] - mean) <= 1e-6 * mean;
    for (size_t k = 0; k < count; k++) {
        rows->columns[first + k] = columns[k];
        rows->weights[first + k] = (float)(even ? mean : weights[k]);
    }
    rows->even[rows->n_rows] = even;
    rows->first[++rows->n_rows] = (uint32_t)end;
done:
    return status;
}

lam_status corner_rows_end(corner_rows *rows, lam_error *error) {
    return resize(rows, rows->first[rows->n_rows], error);
}

size_t corner_rows_bytes(const corner_rows *rows) {
    return (rows->n_rows + 1) * (sizeof *rows->first + sizeof *rows->even) +
           (size_t)rows->first[rows->n_rows] * (sizeof *rows->columns + sizeof *rows->weights);
}

/* Of so many vectors a row's columns are read once. */
enum { TOGETHER = 4 };

/* Inlined for each number of vectors. Even rows, which are most, read no weights. */
static inline __attribute__((always_inline)) void apply_some(const corner_rows *rows, const size_t n_vectors,
                                                             size_t width, const float *x, float *out) {
    const size_t n_rows = rows->n_rows;
    uint32_t at = 0;
    for (size_t j = 0; j < n_rows; j++) {
        const uint32_t end = rows->first[j + 1], *columns = rows->columns + at;
        const float *weights = rows->weights + at;
        const uint32_t count = end - at;
        at = end;
        if (count == 4 && rows->even[j]) {
            const uint32_t a = columns[0], b = columns[1], c = columns[2], d = columns[3];
            for (size_t v = 0; v < n_vectors; v++) {
                const float *of = x + v * width;
                out[v * n_rows + j] = .25f * ((of[a] + of[b]) + (of[c] + of[d]));
            }
            continue;
        }
        for (size_t v = 0; v < n_vectors && count > 0; v++) {
            const float *of = x + v * width;
            float sum = 0;
            for (uint32_t k = 0; k < count; k++) sum += weights[k] * of[columns[k]];
            out[v * n_rows + j] = sum;
        }
    }
}

void corner_rows_apply(const corner_rows *rows, size_t n_vectors, size_t width, const float *x, float *out) {
    for (size_t v = 0; v < n_vectors; v += TOGETHER) {
        const float *from = x + v * width;
        float *to = out + v * rows->n_rows;
        switch (n_vectors - v) {
        case 1:
            apply_some(rows, 1, width, from, to);
            break;
        case 2:
            apply_some(rows, 2, width, from, to);
            break;
        case 3:
            apply_some(rows, 3, width, from, to);
            break;
        default:
            apply_some(rows, TOGETHER, width, from, to);
            break;
        }
    }
}

void corner_rows_transpose(const corner_rows *rows, float factor, const float *g, float *x) {
    for (size_t j = 0; j < rows->n_rows; j++) {
        const float of_row = factor * g[j];
        for (uint32_t k = rows->first[j]; k < rows->first[j + 1]; k++)
            x[rows->columns[k]] += rows->weights[k] * of_row;
    }
}
