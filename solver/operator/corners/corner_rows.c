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
    free(rows->run);
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

static bool is_four(const corner_rows *rows, size_t j) {
    return rows->even[j] && rows->first[j + 1] - rows->first[j] == 4;
}

/* True if row j + 1 goes on in the grid of row j. */
static bool is_next(const corner_rows *rows, size_t j) {
    const uint32_t *at = rows->columns + rows->first[j];
    for (int k = 0; k < 4; k++)
        if (at[4 + k] != at[k] + 1) return false;
    return true;
}

lam_status corner_rows_end(corner_rows *rows, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(resize(rows, rows->first[rows->n_rows], error));
    rows->run = memory_allocate(rows->n_rows, sizeof *rows->run, "corners", error);
    if (rows->run == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t j = rows->n_rows; j-- > 0;) {
        if (!is_four(rows, j)) continue;
        const bool next = j + 1 < rows->n_rows && is_four(rows, j + 1) && is_next(rows, j);
        rows->run[j] = (uint16_t)(next && rows->run[j + 1] < UINT16_MAX ? rows->run[j + 1] + 1 : 1);
    }
done:
    return status;
}

size_t corner_rows_bytes(const corner_rows *rows) {
    return (rows->n_rows + 1) * (sizeof *rows->first + sizeof *rows->even + sizeof *rows->run) +
           (size_t)rows->first[rows->n_rows] * (sizeof *rows->columns + sizeof *rows->weights);
}

/* Of so many vectors a row's columns are read once. */
enum { TOGETHER = 4 };

/* Shorter runs are done row by row. */
enum { RUN_LEAST = 8 };

static inline __attribute__((always_inline)) void put(float *at, float sum, const bool reflects) {
    *at = reflects ? 2 * *at - sum : sum;
}

/* Rows of a grid: columns need not be read, and numbers stand beside each other. */
static inline __attribute__((always_inline)) void apply_run(const uint32_t *columns, size_t count,
                                                            const bool reflects, const float *restrict x,
                                                            float *restrict out) {
    const float *restrict a = x + columns[0], *restrict b = x + columns[1], *restrict c = x + columns[2],
                          *restrict d = x + columns[3];
    for (size_t i = 0; i < count; i++) put(&out[i], .25f * ((a[i] + b[i]) + (c[i] + d[i])), reflects);
}

/* Inlined for each number of vectors. Even rows, which are most, read no weights. */
static inline __attribute__((always_inline)) void apply_some(const corner_rows *rows, const bool reflects,
                                                             const size_t n_vectors, size_t width,
                                                             const float *restrict x, float *restrict out) {
    const size_t n_rows = rows->n_rows;
    const uint32_t *restrict first = rows->first, *restrict columns = rows->columns;
    const float *restrict weights = rows->weights;
    for (size_t j = 0; j < n_rows;) {
        const uint32_t at = first[j], end = first[j + 1];
        const size_t run = rows->run[j];
        if (run >= RUN_LEAST) {
            for (size_t v = 0; v < n_vectors; v++)
                apply_run(columns + at, run, reflects, x + v * width, &out[v * n_rows + j]);
            j += run;
            continue;
        }
        for (size_t v = 0; v < n_vectors && end > at; v++) {
            const float *of = x + v * width;
            float sum = 0;
            if (run > 0)
                sum = .25f *
                      ((of[columns[at]] + of[columns[at + 1]]) + (of[columns[at + 2]] + of[columns[at + 3]]));
            else
                for (uint32_t k = at; k < end; k++) sum += weights[k] * of[columns[k]];
            put(&out[v * n_rows + j], sum, reflects);
        }
        j++;
    }
}

static inline __attribute__((always_inline)) void apply_all(const corner_rows *rows, const bool reflects,
                                                            size_t n_vectors, size_t width, const float *x,
                                                            float *out) {
    for (size_t v = 0; v < n_vectors; v += TOGETHER) {
        const float *from = x + v * width;
        float *to = out + v * rows->n_rows;
        switch (n_vectors - v) {
        case 1:
            apply_some(rows, reflects, 1, width, from, to);
            break;
        case 2:
            apply_some(rows, reflects, 2, width, from, to);
            break;
        case 3:
            apply_some(rows, reflects, 3, width, from, to);
            break;
        default:
            apply_some(rows, reflects, TOGETHER, width, from, to);
        }
    }
}

void corner_rows_apply(const corner_rows *rows, size_t n_vectors, size_t width, const float *x, float *out) {
    apply_all(rows, false, n_vectors, width, x, out);
}

void corner_rows_reflect(const corner_rows *rows, size_t n_vectors, size_t width, const float *x,
                         float *out) {
    apply_all(rows, true, n_vectors, width, x, out);
}

void corner_rows_transpose(const corner_rows *rows, float factor, const float *g, float *x) {
    for (size_t j = 0; j < rows->n_rows; j++) {
        const float of_row = factor * g[j];
        for (uint32_t k = rows->first[j]; k < rows->first[j + 1]; k++)
            x[rows->columns[k]] += rows->weights[k] * of_row;
    }
}
