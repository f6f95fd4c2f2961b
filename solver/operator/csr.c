/* Sparse rows: their check and their product with a block of vectors in double. */
#include "solver/operator/csr.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>

/* Columns whose sums stay in registers. */
#define CSR_TILE 8

void csr_free(csr *a) {
    if (a == NULL) return;
    free(a->indptr);
    free(a->indices);
    free(a->data);
    *a = (csr){0};
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

/* width columns of Y_i = sum_e a_e X_j(e). */
static inline __attribute__((always_inline)) void multiply_tile(size_t width, const uint32_t *indices,
                                                                const float *data, uint64_t first,
                                                                uint64_t last, size_t m, const double *X,
                                                                double *Y) {
    double sum[CSR_TILE] = {0};
    for (uint64_t e = first; e < last; e++) {
        double a = (double)data[e];
        const double *X_j = X + indices[e] * m;
#pragma omp simd
        for (size_t v = 0; v < width; v++) sum[v] += a * X_j[v];
    }
    for (size_t v = 0; v < width; v++) Y[v] = sum[v];
}

static inline __attribute__((always_inline)) void multiply_rows(const csr *a, size_t first, size_t last,
                                                                size_t m, const double *X, double *Y) {
    for (size_t i = first; i < last; i++) {
        uint64_t begin = a->indptr[i], end = a->indptr[i + 1];
        size_t v = 0;
        for (; v + CSR_TILE <= m; v += CSR_TILE)
            multiply_tile(CSR_TILE, a->indices, a->data, begin, end, m, X + v, Y + i * m + v);
        for (; v + 4 <= m; v += 4) multiply_tile(4, a->indices, a->data, begin, end, m, X + v, Y + i * m + v);
        for (; v + 2 <= m; v += 2) multiply_tile(2, a->indices, a->data, begin, end, m, X + v, Y + i * m + v);
        if (v < m) multiply_tile(1, a->indices, a->data, begin, end, m, X + v, Y + i * m + v);
    }
}

/* The same loop compiled for several CPUs. */
#if defined(__x86_64__)
__attribute__((target("avx512f"))) static void multiply_rows_avx512(const csr *a, size_t first, size_t last,
                                                                    size_t m, const double *X, double *Y) {
    multiply_rows(a, first, last, m, X, Y);
}

__attribute__((target("avx2"))) static void multiply_rows_avx2(const csr *a, size_t first, size_t last,
                                                               size_t m, const double *X, double *Y) {
    multiply_rows(a, first, last, m, X, Y);
}
#endif

void csr_multiply_rows(const csr *a, size_t first, size_t last, size_t m, const double *X, double *Y) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) {
        multiply_rows_avx512(a, first, last, m, X, Y);
        return;
    }
    if (__builtin_cpu_supports("avx2")) {
        multiply_rows_avx2(a, first, last, m, X, Y);
        return;
    }
#endif
    multiply_rows(a, first, last, m, X, Y);
}
