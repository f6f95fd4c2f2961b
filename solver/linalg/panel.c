/* The memory and the precision of a panel; its products are in panel_product.c. */
#include "solver/linalg/panel.h"

#include "solver/base/cpu.h"
#include "solver/base/half.h"
#include "solver/base/work_area.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define HUGE_PAGE ((size_t)2 << 20)

/* f16: a column whose largest magnitude lies between these needs no scale. Below HALF_LEAST, the error of its
 * small values by f16's smallest step of 2^-24 would exceed the rounding of its large ones. */
#define HALF_LEAST 0x1p-7f
#define HALF_MOST 6e4f
/* i8: steps from 0 to the largest magnitude of a column. */
#define I8_STEPS 127.0f

static const struct {
    const char *name;
    size_t size;
} precisions[PANEL_PRECISIONS] = {{"f32", 4}, {"f16", 2}, {"i8", 1}};

const char *panel_precision_name(panel_precision precision) {
    return precisions[precision].name;
}

bool panel_precision_find(const char *name, panel_precision *precision) {
    for (size_t i = 0; i < PANEL_PRECISIONS; i++) {
        if (strcmp(name, precisions[i].name) != 0) continue;
        *precision = (panel_precision)i;
        return true;
    }
    return false;
}

size_t panel_value_size(panel_precision precision) {
    return precisions[precision].size;
}

/* Zeroed memory, *data at its first cache line or, when it is large, huge page: with 4 KiB pages an answer
 * takes twice as long. NULL on failure. */
static void *allocate_data(size_t bytes, const char *name, void **data, lam_error *error) {
    const size_t align = bytes < 2 * HUGE_PAGE ? WORK_AREA_ALIGN : HUGE_PAGE;
    char *memory = memory_allocate(bytes + align, 1, name, error);
    if (memory == NULL) return NULL;
    char *aligned = memory + (align - (uintptr_t)memory % align) % align;
    /* A refused advice costs time alone. */
    if (align == HUGE_PAGE) (void)madvise(aligned, bytes, MADV_HUGEPAGE);
    *data = aligned;
    return memory;
}

static float value_as_float(panel_precision precision, const void *values, size_t j) {
    switch (precision) {
    case PANEL_F32:
        return ((const float *)values)[j];
    case PANEL_F16:
        return float_of_half(((const uint16_t *)values)[j]);
    case PANEL_I8:
        return (float)((const int8_t *)values)[j];
    }
    return NAN;
}

/* True when no exponent has all its bits. */
static bool all_finite(panel_precision precision, size_t count, const void *values) {
    bool good = true;
    switch (precision) {
    case PANEL_F32:
        for (size_t j = 0; j < count; j++)
            good &= (((const uint32_t *)values)[j] & 0x7f800000u) != 0x7f800000u;
        break;
    case PANEL_F16:
        for (size_t j = 0; j < count; j++) good &= (((const uint16_t *)values)[j] & 0x7c00u) != 0x7c00u;
        break;
    case PANEL_I8:
        break;
    }
    return good;
}

/* The chunk of columns from PANEL_CHUNK q on of row i of a tile. */
static void *tile_chunk(const panel *a, size_t i, size_t q) {
    const size_t tile = i / PANEL_TILE * PANEL_TILE * a->stride;
    return (char *)a->data +
           (tile + (q * PANEL_TILE + i % PANEL_TILE) * PANEL_CHUNK) * panel_value_size(a->precision);
}

/* tile_chunk in either layout. */
static const void *chunk_of(const panel *a, size_t i, size_t q) {
    if (a->layout == PANEL_TILES) return tile_chunk(a, i, q);
    return (const char *)a->rows + (i * a->k + q * PANEL_CHUNK) * panel_value_size(a->precision);
}

/* Columns of chunk q that are not padding. */
static size_t chunk_columns(const panel *a, size_t q) {
    return a->k - q * PANEL_CHUNK < PANEL_CHUNK ? a->k - q * PANEL_CHUNK : PANEL_CHUNK;
}

static void put_row(panel *a, size_t i, const void *values) {
    const size_t size = panel_value_size(a->precision);
    for (size_t q = 0; q < a->stride / PANEL_CHUNK; q++)
        memcpy(tile_chunk(a, i, q), (const char *)values + q * PANEL_CHUNK * size,
               chunk_columns(a, q) * size);
}

static void get_row(const panel *a, size_t i, void *values) {
    const size_t size = panel_value_size(a->precision);
    for (size_t q = 0; q < a->stride / PANEL_CHUNK; q++)
        memcpy((char *)values + q * PANEL_CHUNK * size, chunk_of(a, i, q), chunk_columns(a, q) * size);
}

/* A panel without values: its shape, and a copy of scale or, with scaled and no scale, room for one. */
static lam_status panel_shape(size_t n, size_t k, panel_precision precision, const float *scale, bool scaled,
                              const char *name, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    panel made = {.n = n, .k = k, .precision = precision, .n_threads = 1};
    const size_t size = panel_value_size(precision);
    size_t count;
    made.stride = k / PANEL_CHUNK * PANEL_CHUNK + (k % PANEL_CHUNK > 0 ? PANEL_CHUNK : 0);
    const size_t rows = n + (PANEL_TILE - n % PANEL_TILE) % PANEL_TILE;
    if (made.stride < k || rows < n || !size_multiply(rows, made.stride, &count) ||
        count > (PTRDIFF_MAX - HUGE_PAGE) / size)
        FAIL(error, LAM_ERR_MEMORY, "%s: %zu x %zu numbers are more than memory can have", name, n, k);
    if (scaled) {
        made.scale = memory_allocate(k, sizeof *made.scale, name, error);
        if (made.scale == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t j = 0; j < k && scale != NULL; j++) {
        if (!(scale[j] > 0.0f && isfinite(scale[j])))
            FAIL(error, LAM_ERR_NUMERIC, "%s_scale[%zu] = %g, must be above 0 and finite", name, j,
                 (double)scale[j]);
        made.scale[j] = scale[j];
    }
    made.kernels = panel_kernels_of(cpu_best());
    *a = made;
    made = (panel){0};
done:
    panel_free(&made);
    return status;
}

/* panel_shape with room for tiles, zeroed. */
static lam_status panel_init(size_t n, size_t k, panel_precision precision, const float *scale, bool scaled,
                             const char *name, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    panel made = {0};
    TRY(panel_shape(n, k, precision, scale, scaled, name, &made, error));
    const size_t rows = n + (PANEL_TILE - n % PANEL_TILE) % PANEL_TILE;
    made.memory = allocate_data(rows * made.stride * panel_value_size(precision), name, &made.data, error);
    if (made.memory == NULL) TRY(LAM_ERR_MEMORY);
    *a = made;
    made = (panel){0};
done:
    panel_free(&made);
    return status;
}

lam_status panel_create_kept(size_t n, size_t k, panel_precision precision, const void *values,
                             const float *scale, const char *name, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    panel made = {0};
    const size_t row_bytes = k * panel_value_size(precision);
    TRY(panel_init(n, k, precision, scale, scale != NULL, name, &made, error));
    for (size_t i = 0; i < n && k > 0; i++) {
        const char *row = (const char *)values + i * row_bytes;
        if (!all_finite(precision, k, row)) {
            size_t j = 0;
            while (isfinite(value_as_float(precision, row, j))) j++;
            FAIL(error, LAM_ERR_NUMERIC, "%s[%zu][%zu] = %g, must be finite", name, i, j,
                 (double)value_as_float(precision, row, j));
        }
        put_row(&made, i, row);
    }
    *a = made;
    made = (panel){0};
done:
    panel_free(&made);
    return status;
}

lam_status panel_create(size_t n, size_t k, const float *rows, const char *name, panel *a, lam_error *error) {
    return panel_create_kept(n, k, PANEL_F32, rows, NULL, name, a, error);
}

lam_status panel_view(size_t n, size_t k, panel_precision precision, const void *values, const float *scale,
                      const char *name, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(panel_shape(n, k, precision, scale, scale != NULL, name, a, error));
    a->layout = PANEL_ROWS;
    a->rows = values;
done:
    return status;
}

void panel_free(panel *a) {
    store_map_release(a->mapping);
    free(a->memory);
    free(a->scale);
    *a = (panel){0};
}

/* A power of two that brings the largest magnitude of a column to at least 2^14 and below 2^15. */
static float half_scale(float largest) {
    int exponent;
    if (largest == 0.0f || (largest >= HALF_LEAST && largest <= HALF_MOST)) return 1.0f;
    (void)frexpf(largest, &exponent); /* below 2^exponent */
    exponent -= 15;
    return ldexpf(1.0f, exponent > -126 ? exponent : -126);
}

/* Scales of the columns for a precision; true when one is not 1. row has room for a row. */
static bool find_scale(const panel *a, panel_precision precision, float *row, float *scale) {
    bool any = false;
    memset(scale, 0, a->k * sizeof *scale);
    for (size_t i = 0; i < a->n; i++) {
        get_row(a, i, row);
        for (size_t j = 0; j < a->k; j++) {
            const float magnitude = fabsf(row[j]);
            scale[j] = magnitude > scale[j] ? magnitude : scale[j];
        }
    }
    for (size_t j = 0; j < a->k; j++) {
        const float largest = scale[j];
        if (precision == PANEL_F16)
            scale[j] = half_scale(largest);
        else /* the quotient of a subnormal number may be 0 */
            scale[j] = largest > 0x1p-119f ? largest / I8_STEPS : 0x1p-126f;
        any = any || scale[j] != 1.0f;
    }
    return any;
}

/* values = row / scale, rounded. */
static void round_row(const float *row, const float *scale, panel_precision precision, size_t k,
                      void *values) {
    for (size_t j = 0; j < k; j++) {
        const float x = scale != NULL ? row[j] / scale[j] : row[j];
        if (precision == PANEL_F32)
            ((float *)values)[j] = x;
        else if (precision == PANEL_F16)
            ((uint16_t *)values)[j] = half_of_float(x);
        else
            ((int8_t *)values)[j] = (int8_t)fmaxf(-I8_STEPS, fminf(I8_STEPS, rintf(x)));
    }
}

lam_status panel_convert(const panel *a, panel_precision precision, const char *name, panel *out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    panel made = {0};
    float *row = memory_allocate(a->k, 2 * sizeof *row, name, error);
    float *scale = memory_allocate(a->k, sizeof *scale, name, error);
    bool scaled = false;
    if (row == NULL || scale == NULL) TRY(LAM_ERR_MEMORY);
    if (a->precision != PANEL_F32)
        FAIL(error, LAM_ERR_INTERNAL, "%s: is of %s, only f32 is converted", name,
             panel_precision_name(a->precision));
    if (precision == PANEL_F16 || precision == PANEL_I8)
        scaled = find_scale(a, precision, row, scale) || precision == PANEL_I8;
    TRY(panel_init(a->n, a->k, precision, scaled ? scale : NULL, scaled, name, &made, error));
    made.n_threads = a->n_threads;
    for (size_t i = 0; i < a->n; i++) {
        float *values = row + a->k;
        get_row(a, i, row);
        round_row(row, made.scale, precision, a->k, values);
        put_row(&made, i, values);
    }
    *out = made;
    made = (panel){0};
done:
    free(row);
    free(scale);
    panel_free(&made);
    return status;
}

void panel_copy_some(const panel *a, size_t first, size_t count, float *rows) {
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < a->k; j++)
            rows[i * a->k + j] =
                value_as_float(a->precision, chunk_of(a, first + i, j / PANEL_CHUNK), j % PANEL_CHUNK) *
                (a->scale != NULL ? a->scale[j] : 1.0f);
}

void panel_copy_rows(const panel *a, float *rows) {
    panel_copy_some(a, 0, a->n, rows);
}

void panel_copy_values(const panel *a, void *values) {
    for (size_t i = 0; i < a->n; i++)
        get_row(a, i, (char *)values + i * a->k * panel_value_size(a->precision));
}

size_t panel_bytes(const panel *a) {
    return a->n * (a->layout == PANEL_TILES ? a->stride : a->k) * panel_value_size(a->precision) +
           (a->scale != NULL ? a->k * sizeof *a->scale : 0);
}
