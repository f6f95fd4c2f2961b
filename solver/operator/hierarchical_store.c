/* A symmetric sparse matrix as its upper triangle: of each row how many, and for each number the step from
 * the one before it (from the diagonal for the first) and itself in half precision. A step beyond 65,535 is
 * made of several, of numbers that are 0. */
#include "solver/base/half.h"
#include "solver/operator/hierarchical.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEP_MOST = UINT16_MAX };

/* Half precision reaches from 2^-14 to 2^16 with all its digits: the largest number is put near the end. */
enum { LARGEST_EXPONENT = 15 };

/* Rows come out ascending as those of a are. */
lam_status csr_mirror(const csr *a, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->n;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "operator", error)};
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
            if (a->data[e] == 0) continue;
            made.indptr[i + 1]++;
            if (a->indices[e] != i) made.indptr[a->indices[e] + 1]++;
        }
    TRY(csr_begin_rows(&made, "operator", error));
    /* Row j gets its lower part from rows i < j, in their order, before its own. */
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
            const uint32_t j = a->indices[e];
            if (a->data[e] == 0) continue;
            uint64_t to = made.indptr[i]++;
            made.indices[to] = j;
            made.data[to] = a->data[e];
            if (j == i) continue;
            to = made.indptr[j]++;
            made.indices[to] = (uint32_t)i;
            made.data[to] = a->data[e];
        }
    csr_end_rows(&made);
    *out = made;
    made = (csr){.n = 0};
done:
    csr_free(&made);
    return status;
}

lam_status half_matrix_create(const csr *a, half_matrix *out, lam_error *error) {
    lam_status status = LAM_OK;
    half_matrix made = {.n = a->n, .scale = 1};
    csr rounded = *a; /* but for its numbers */
    float largest = 0;
    int exponent;
    const size_t count = (size_t)a->indptr[a->n];
    for (size_t e = 0; e < count; e++) {
        if (!isfinite(a->data[e]))
            FAIL(error, LAM_ERR_NUMERIC, "K[%zu] = %g, must be finite", e, (double)a->data[e]);
        largest = fmaxf(largest, fabsf(a->data[e]));
    }
    (void)frexpf(largest, &exponent);
    if (largest > 0) made.scale = ldexpf(1, exponent - LARGEST_EXPONENT);
    rounded.data = memory_allocate(count, sizeof *rounded.data, "operator", error);
    if (rounded.data == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t e = 0; e < count; e++)
        rounded.data[e] = made.scale * float_of_half(half_of_float(a->data[e] / made.scale));
    TRY(csr_mirror(&rounded, &made.rows, error));
    *out = made;
    made = (half_matrix){.scale = 1};
done:
    if (rounded.data != a->data) free(rounded.data);
    csr_free(&made.rows);
    return status;
}

lam_status half_matrix_compact(half_matrix *m, const uint32_t *number, size_t count, lam_error *error) {
    lam_status status = LAM_OK;
    const csr *a = &m->rows;
    const size_t entries = (size_t)a->indptr[a->n];
    csr made = {.n = count, .indptr = memory_allocate(count + 1, sizeof *made.indptr, "operator", error)};
    uint32_t *place = memory_allocate(a->n, sizeof *place, "operator", error);
    made.indices = memory_allocate(entries, sizeof *made.indices, "operator", error);
    made.data = memory_allocate(entries, sizeof *made.data, "operator", error);
    if (made.indptr == NULL || place == NULL || made.indices == NULL || made.data == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) place[number[k]] = (uint32_t)k;
    for (size_t k = 0; k < count; k++) {
        uint64_t used = made.indptr[k];
        for (uint64_t e = a->indptr[number[k]]; e < a->indptr[number[k] + 1]; e++) {
            made.indices[used] = place[a->indices[e]];
            made.data[used++] = a->data[e];
        }
        made.indptr[k + 1] = used;
    }
    csr_free(&m->rows);
    m->rows = made;
    m->number = number;
    made = (csr){.n = 0};
done:
    free(place);
    csr_free(&made);
    return status;
}

/* Calls visit for every number that is stored of a row; returns how many. */
typedef void visit_number(void *context, uint16_t step, float value);

static size_t each_stored(const half_matrix *m, size_t row, visit_number *visit, void *context) {
    const csr *rows = &m->rows;
    const size_t i = m->number != NULL ? m->number[row] : row;
    size_t count = 0, at = i;
    for (uint64_t e = rows->indptr[row]; e < rows->indptr[row + 1]; e++) {
        const size_t column = rows->indices[e], j = m->number != NULL ? m->number[column] : column;
        if (j < i || rows->data[e] == 0) continue;
        for (; j - at > STEP_MOST; at += STEP_MOST, count++)
            if (visit != NULL) visit(context, STEP_MOST, 0);
        if (visit != NULL) visit(context, (uint16_t)(j - at), rows->data[e]);
        count++;
        at = j;
    }
    return count;
}

typedef struct encoder {
    uint16_t *steps, *halves;
    size_t used;
    float scale;
} encoder;

static void encode(void *context, uint16_t step, float value) {
    encoder *to = context;
    to->steps[to->used] = step;
    to->halves[to->used++] = half_of_float(value / to->scale);
}

lam_status half_matrix_save(const half_matrix *m, const char *group, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    char name[64];
    size_t most = 0, stored = 0;
    encoder to = {.scale = m->scale};
    uint32_t *counts = memory_allocate(n, sizeof *counts, "operator", error);
    uint16_t *narrow = memory_allocate(n, sizeof *narrow, "operator", error);
    if (counts == NULL || narrow == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t row = 0; row < m->rows.n; row++) {
        const size_t count = each_stored(m, row, NULL, NULL), i = m->number != NULL ? m->number[row] : row;
        counts[i] = (uint32_t)count;
        narrow[i] = (uint16_t)count;
        stored += count;
        most = count > most ? count : most;
    }
    to.steps = memory_allocate(stored, sizeof *to.steps, "operator", error);
    to.halves = memory_allocate(stored, sizeof *to.halves, "operator", error);
    if (to.steps == NULL || to.halves == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t row = 0; row < m->rows.n; row++) (void)each_stored(m, row, encode, &to);
    const bool wide = most > UINT16_MAX;
    const void *as_stored = wide ? (const void *)counts : (const void *)narrow;
    snprintf(name, sizeof name, "%s/count", group);
    TRY(store_write(s, name, wide ? STORE_U32 : STORE_U16, 1, &n, as_stored, error));
    snprintf(name, sizeof name, "%s/gap", group);
    TRY(store_write(s, name, STORE_U16, 1, &stored, to.steps, error));
    snprintf(name, sizeof name, "%s/data", group);
    TRY(store_write(s, name, STORE_F16, 1, &stored, to.halves, error));
    TRY(store_set_number(s, group, "scale", (double)m->scale, error));
done:
    free(counts);
    free(narrow);
    free(to.steps);
    free(to.halves);
    return status;
}

/* Widens the counts of rows where they are stored narrow. */
static lam_status read_counts(store *s, const char *name, size_t n, uint32_t **out, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK] = {n};
    void *read = NULL;
    uint32_t *counts = NULL;
    TRY(store_array_info(s, name, &type, &rank, dims, error));
    dims[0] = n;
    TRY(store_read(s, name, type == STORE_U16 ? STORE_U16 : STORE_U32, 1, dims, &read, error));
    counts = memory_allocate(n, sizeof *counts, "operator", error);
    if (counts == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++)
        counts[i] = type == STORE_U16 ? ((uint16_t *)read)[i] : ((uint32_t *)read)[i];
    *out = counts;
    counts = NULL;
done:
    free(read);
    free(counts);
    return status;
}

/* The upper triangle in single precision, zeros of long steps left out. */
static lam_status decode(const char *group, size_t n, const uint32_t *counts, const uint16_t *steps,
                         const uint16_t *halves, float scale, csr *upper, lam_error *error) {
    lam_status status = LAM_OK;
    size_t from = 0;
    uint64_t used = 0;
    for (size_t i = 0; i < n; i++) {
        size_t j = i;
        for (size_t k = 0; k < counts[i]; k++, from++) {
            const float value = scale * float_of_half(halves[from]);
            j += steps[from];
            if (j >= n || (k > 0 && steps[from] == 0))
                FAIL(error, LAM_ERR_NUMERIC,
                     "%s: row %zu steps to column %zu, must be ascending and below %zu", group, i, j, n);
            if (!isfinite(value))
                FAIL(error, LAM_ERR_NUMERIC, "%s/data[%zu] = %g, must be finite", group, from, (double)value);
            if (value == 0) continue;
            upper->indices[used] = (uint32_t)j;
            upper->data[used++] = value;
        }
        upper->indptr[i + 1] = used;
    }
done:
    return status;
}

lam_status half_matrix_load(store *s, const char *group, size_t n, half_matrix *out, lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    uint32_t *counts = NULL;
    void *steps = NULL, *halves = NULL;
    double scale;
    size_t stored[STORE_MAX_RANK] = {SIZE_MAX}, total = 0;
    csr upper = {.n = n};
    half_matrix made = {.n = n, .scale = 1};
    snprintf(name, sizeof name, "%s/count", group);
    TRY(read_counts(s, name, n, &counts, error));
    snprintf(name, sizeof name, "%s/gap", group);
    TRY(store_read(s, name, STORE_U16, 1, stored, &steps, error));
    snprintf(name, sizeof name, "%s/data", group);
    TRY(store_read(s, name, STORE_F16, 1, stored, &halves, error));
    TRY(store_get_number(s, group, "scale", &scale, error));
    for (size_t i = 0; i < n; i++) total += counts[i];
    if (total != stored[0])
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %zu numbers, its rows want %zu", store_path(s), group,
             stored[0], total);
    if (!(scale > 0 && scale <= (double)0x1p112f))
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has the scale %g, must be above 0", store_path(s), group, scale);
    upper.indptr = memory_allocate(n + 1, sizeof *upper.indptr, "operator", error);
    upper.indices = memory_allocate(total, sizeof *upper.indices, "operator", error);
    upper.data = memory_allocate(total, sizeof *upper.data, "operator", error);
    if (upper.indptr == NULL || upper.indices == NULL || upper.data == NULL) TRY(LAM_ERR_MEMORY);
    made.scale = (float)scale;
    TRY(decode(group, n, counts, steps, halves, made.scale, &upper, error));
    TRY(csr_mirror(&upper, &made.rows, error));
    *out = made;
    made = (half_matrix){.scale = 1};
done:
    free(counts);
    free(steps);
    free(halves);
    csr_free(&upper);
    csr_free(&made.rows);
    return status;
}
