/* Sparse rows: their check and their product with a block of vectors in double. */
#include "solver/linalg/csr.h"

#include "solver/base/cpu.h"
#include "store/status.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* Columns whose sums stay in registers. A multiplication waits several cycles for its result, so WIDE has
 * enough independent sums to fill them; compilers do not find that by themselves. */
enum { WIDE = 32, NARROW = 8 };

void csr_free(csr *a) {
    if (a == NULL) return;
    free(a->indptr);
    if (a->place == NULL) {
        free(a->indices);
        free(a->data);
    }
    for (int k = 0; k < 2; k++) large_file_free(a->files[k]);
    *a = (csr){0};
}

/* Resizes one of the two arrays, in a file or in memory. */
static lam_status reserve(const large_place *place, large_file **file, size_t entries, size_t size,
                          void **array, lam_error *error) {
    lam_status status = LAM_OK;
    size_t bytes;
    void *moved;
    if (!size_multiply(entries == 0 ? 1 : entries, size, &bytes))
        FAIL(error, LAM_ERR_MEMORY, "sparse rows: %zu entries are too many", entries);
    if (place != NULL) {
        if (*file == NULL) TRY(large_file_create(place, file, error));
        TRY(large_file_resize(*file, bytes, array, error));
        goto done;
    }
    moved = *array == NULL ? memory_allocate(bytes, 1, "sparse rows", error) : realloc(*array, bytes);
    if (moved == NULL)
        FAIL(error, LAM_ERR_MEMORY,
             "sparse rows: cannot allocate %zu bytes; use fewer --rays, or --scratch and less --memory",
             bytes);
    *array = moved;
done:
    return status;
}

lam_status csr_reserve(csr *a, size_t entries, lam_error *error) {
    lam_status status = LAM_OK;
    void *indices = a->indices, *data = a->data;
    TRY(reserve(a->place, &a->files[0], entries, sizeof *a->indices, &indices, error));
    a->indices = indices;
    TRY(reserve(a->place, &a->files[1], entries, sizeof *a->data, &data, error));
    a->data = data;
done:
    return status;
}

lam_status csr_begin_rows(csr *a, const char *what, lam_error *error) {
    for (size_t i = 0; i < a->n; i++) a->indptr[i + 1] += a->indptr[i];
    const size_t entries = (size_t)a->indptr[a->n];
    a->indices = memory_allocate(entries, sizeof *a->indices, what, error);
    a->data = memory_allocate(entries, sizeof *a->data, what, error);
    return a->indices != NULL && a->data != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

size_t csr_part(const csr *a, size_t k, size_t n_parts) {
    const uint64_t before = a->indptr[a->n] / n_parts * k;
    size_t low = 0, high = a->n;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (a->indptr[middle] < before)
            low = middle + 1;
        else
            high = middle;
    }
    return k == n_parts ? a->n : low;
}

void csr_end_rows(csr *a) {
    memmove(a->indptr + 1, a->indptr, a->n * sizeof *a->indptr);
    a->indptr[0] = 0;
}

lam_status csr_check(const csr *a, size_t nnz, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    if (a->indptr[0] != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: row 0 begins at %zu, must be 0", name, (size_t)a->indptr[0]);
    for (size_t i = 0; i < a->n; i++) {
        uint64_t first = a->indptr[i], last = a->indptr[i + 1];
        if (last < first || last > nnz)
            FAIL(error, LAM_ERR_FORMAT, "%s: row %zu ends at %zu, must be between %zu and %zu", name, i,
                 (size_t)last, (size_t)first, nnz);
        for (uint64_t e = first; e < last; e++) {
            if (a->indices[e] >= a->n)
                FAIL(error, LAM_ERR_FORMAT, "%s: row %zu has the column %u, must be below %zu", name, i,
                     (unsigned)a->indices[e], a->n);
            if (e > first && a->indices[e] <= a->indices[e - 1])
                FAIL(error, LAM_ERR_FORMAT, "%s: row %zu has the column %u after %u, must ascend", name, i,
                     (unsigned)a->indices[e], (unsigned)a->indices[e - 1]);
            if (!isfinite(a->data[e]))
                FAIL(error, LAM_ERR_FORMAT, "%s: row %zu has the value %g, must be finite", name, i,
                     (double)a->data[e]);
        }
    }
    if (a->indptr[a->n] != nnz)
        FAIL(error, LAM_ERR_FORMAT, "%s: rows end at %zu, must be %zu", name, (size_t)a->indptr[a->n], nnz);
done:
    return status;
}

enum { NAME_MOST = 64 };

static const char *array_name(const char *name, const char *part, char text[NAME_MOST]) {
    snprintf(text, NAME_MOST, "%s/%s", name, part);
    return text;
}

lam_status csr_save(const csr *a, const char *name, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t ends = a->n + 1, entries = (size_t)a->indptr[a->n];
    char text[NAME_MOST];
    TRY(store_write(s, array_name(name, "indptr", text), STORE_U64, 1, &ends, a->indptr, error));
    TRY(store_write(s, array_name(name, "indices", text), STORE_U32, 1, &entries, a->indices, error));
    TRY(store_write(s, array_name(name, "data", text), STORE_F32, 1, &entries, a->data, error));
done:
    return status;
}

lam_status csr_load(store *s, const char *name, size_t n, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    void *indptr = NULL, *indices = NULL, *data = NULL;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX}, ends[STORE_MAX_RANK] = {n + 1};
    char text[NAME_MOST];
    TRY(store_read(s, array_name(name, "indptr", text), STORE_U64, 1, ends, &indptr, error));
    TRY(store_read(s, array_name(name, "indices", text), STORE_U32, 1, dims, &indices, error));
    TRY(store_read(s, array_name(name, "data", text), STORE_F32, 1, dims, &data, error));
    const uint64_t *last = indptr;
    if (last[n] != dims[0])
        FAIL(error, LAM_ERR_FORMAT, "%s: %s/indptr ends at %zu, must be %zu", store_path(s), name,
             (size_t)last[n], dims[0]);
    *out = (csr){.n = n, .indptr = indptr, .indices = indices, .data = data};
    indptr = indices = data = NULL;
done:
    free(indptr);
    free(indices);
    free(data);
    return status;
}

/* One row of the product, WIDE columns from X and Y on: Y_i = sum_e a_e X_j(e). */
typedef void multiply_wide(const uint32_t *indices, const float *data, uint64_t n_entries, size_t m,
                           const double *X, double *Y);

static inline __attribute__((always_inline)) void multiply_tile(size_t width, const uint32_t *indices,
                                                                const float *data, uint64_t n_entries,
                                                                size_t m, const double *X, double *Y) {
    double sum[NARROW] = {0};
    for (uint64_t e = 0; e < n_entries; e++) {
        const double a = (double)data[e];
        const double *X_j = X + indices[e] * m;
#pragma omp simd
        for (size_t v = 0; v < width; v++) sum[v] += a * X_j[v];
    }
    for (size_t v = 0; v < width; v++) Y[v] = sum[v];
}

static void multiply_wide_portable(const uint32_t *indices, const float *data, uint64_t n_entries, size_t m,
                                   const double *X, double *Y) {
    for (size_t v = 0; v < WIDE; v += NARROW)
        multiply_tile(NARROW, indices, data, n_entries, m, X + v, Y + v);
}

#ifdef CPU_AVX2_TARGET
CPU_AVX512_TARGET static void multiply_wide_avx512(const uint32_t *indices, const float *data,
                                                   uint64_t n_entries, size_t m, const double *X, double *Y) {
    __m512d sum[WIDE / 8];
    for (int t = 0; t < WIDE / 8; t++) sum[t] = _mm512_setzero_pd();
    for (uint64_t e = 0; e < n_entries; e++) {
        const __m512d a = _mm512_set1_pd((double)data[e]);
        const double *X_j = X + indices[e] * m;
        for (int t = 0; t < WIDE / 8; t++) sum[t] = _mm512_fmadd_pd(a, _mm512_loadu_pd(X_j + 8 * t), sum[t]);
    }
    for (int t = 0; t < WIDE / 8; t++) _mm512_storeu_pd(Y + 8 * t, sum[t]);
}

CPU_AVX2_TARGET static void multiply_wide_avx2(const uint32_t *indices, const float *data, uint64_t n_entries,
                                               size_t m, const double *X, double *Y) {
    __m256d sum[WIDE / 4];
    for (int t = 0; t < WIDE / 4; t++) sum[t] = _mm256_setzero_pd();
    for (uint64_t e = 0; e < n_entries; e++) {
        const __m256d a = _mm256_set1_pd((double)data[e]);
        const double *X_j = X + indices[e] * m;
        for (int t = 0; t < WIDE / 4; t++) sum[t] = _mm256_fmadd_pd(a, _mm256_loadu_pd(X_j + 4 * t), sum[t]);
    }
    for (int t = 0; t < WIDE / 4; t++) _mm256_storeu_pd(Y + 4 * t, sum[t]);
}
#endif

void csr_multiply_rows(const csr *a, size_t first, size_t last, size_t m, const double *X, double *Y) {
    static multiply_wide *const table[] =
        CPU_TABLE(multiply_wide_portable, multiply_wide_avx2, multiply_wide_avx512);
    multiply_wide *const wide = table[cpu_best()];
    for (size_t i = first; i < last; i++) {
        const uint64_t begin = a->indptr[i], n_entries = a->indptr[i + 1] - begin;
        const uint32_t *indices = a->indices + begin;
        const float *data = a->data + begin;
        double *Y_i = Y + i * m;
        size_t v = 0;
        for (; v + WIDE <= m; v += WIDE) wide(indices, data, n_entries, m, X + v, Y_i + v);
        for (; v + NARROW <= m; v += NARROW)
            multiply_tile(NARROW, indices, data, n_entries, m, X + v, Y_i + v);
        for (; v + 4 <= m; v += 4) multiply_tile(4, indices, data, n_entries, m, X + v, Y_i + v);
        for (; v + 2 <= m; v += 2) multiply_tile(2, indices, data, n_entries, m, X + v, Y_i + v);
        if (v < m) multiply_tile(1, indices, data, n_entries, m, X + v, Y_i + v);
    }
}

/* Row i of csr_replace; returns how many entries it has. With indices NULL it only counts. */
static size_t replace_row(const csr *A, const csr *B, size_t i, uint32_t *indices, float *data) {
    uint64_t p = A->indptr[i], q = B->indptr[i];
    size_t length = 0;
    while (p < A->indptr[i + 1] || q < B->indptr[i + 1]) {
        const uint32_t a = p < A->indptr[i + 1] ? A->indices[p] : UINT32_MAX;
        const uint32_t b = q < B->indptr[i + 1] ? B->indices[q] : UINT32_MAX;
        const uint32_t j = a < b ? a : b;
        float value = 0;
        if (a == j) value = A->data[p++];
        if (b == j) value = B->data[q++];
        if (value == 0) continue;
        if (indices != NULL) {
            indices[length] = j;
            data[length] = value;
        }
        length++;
    }
    return length;
}

lam_status csr_replace(const csr *A, const csr *B, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = A->n;
    csr made = {.n = n, .place = A->place};
    if (B->n != n) FAIL(error, LAM_ERR_ARGUMENT, "rows of %zu and %zu elements cannot be combined", n, B->n);
    made.indptr = memory_allocate(n + 1, sizeof *made.indptr, "form factors", error);
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) made.indptr[i + 1] = replace_row(A, B, i, NULL, NULL);
    for (size_t i = 0; i < n; i++) made.indptr[i + 1] += made.indptr[i];
    TRY(csr_reserve(&made, made.indptr[n], error));
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++)
        replace_row(A, B, i, made.indices + made.indptr[i], made.data + made.indptr[i]);
    *out = made;
    made = (csr){0};
done:
    csr_free(&made);
    return status;
}

/* Rows [first, last) of the mirrored matrix, whose indptr are begins: row j gets its lower part from rows i <
 * j, in their order, before its own. */
static void mirror_rows(const csr *a, size_t first, size_t last, csr *out) {
    for (size_t i = 0; i < last; i++)
        for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
            const uint32_t j = a->indices[e];
            if (a->data[e] == 0) continue;
            if (i >= first) {
                const uint64_t to = out->indptr[i]++;
                out->indices[to] = j;
                out->data[to] = a->data[e];
            }
            if (j == i || j < first || j >= last) continue;
            const uint64_t to = out->indptr[j]++;
            out->indices[to] = (uint32_t)i;
            out->data[to] = a->data[e];
        }
}

lam_status csr_mirror(const csr *a, const char *what, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->n;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, what, error)};
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
            if (a->data[e] == 0) continue;
            made.indptr[i + 1]++;
            if (a->indices[e] != i) made.indptr[a->indices[e] + 1]++;
        }
    TRY(csr_begin_rows(&made, what, error));
#pragma omp parallel
    {
        /* Each thread fills the rows of a part. */
        const size_t n_parts = (size_t)omp_get_num_threads(), part = (size_t)omp_get_thread_num();
        const size_t first = csr_part(&made, part, n_parts), last = csr_part(&made, part + 1, n_parts);
#pragma omp barrier
        mirror_rows(a, first, last, &made);
    }
    csr_end_rows(&made);
    *out = made;
    made = (csr){.n = 0};
done:
    csr_free(&made);
    return status;
}
