#include "solver/linalg/sparse_product.h"

#include "solver/base/parallel.h"
#include "solver/base/work_area.h"
#include "solver/linalg/csr_rows.h"
#include "solver/linalg/panel.h"

#include <stdlib.h>
#include <string.h>

enum { BATCH = 16 };

/* Below this number of multiplications one thread does all; rows that a thread takes at a time. */
enum { THREADS_WORTH = 200000, ROWS_AT_ONCE = 256 };

/* By columns, each product is added in memory, which is slower than a sum in a register: columns are taken
 * when they hold less than 1/SPARSE_SHARE of all entries. */
enum { SPARSE_SHARE = 8 };

lam_status csr_transpose(const csr *a, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->n, entries = (size_t)a->indptr[n];
    csr made = {.n = n};
    made.indptr = memory_allocate(n + 1, sizeof *made.indptr, "columns", error);
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t e = 0; e < entries; e++) made.indptr[a->indices[e] + 1]++;
    TRY(csr_begin_rows(&made, "columns", error));
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
            const uint64_t to = made.indptr[a->indices[e]]++;
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

size_t sparse_product_work(size_t n, size_t m) {
    size_t side, whole, total = 0;
    if (!size_multiply(n, csr_floats_width(m) * sizeof(float), &side) ||
        !size_multiply(n, sizeof(float), &whole) || !work_area_add(&total, side) ||
        !work_area_add(&total, whole))
        return 0;
    return total;
}

bool sparse_product_by_columns(const csr *columns, const float *x) {
    const uint64_t most = columns->indptr[columns->n] / SPARSE_SHARE;
    uint64_t touched = 0;
    for (size_t j = 0; j < columns->n; j++)
        if (x[j] != 0) {
            touched += columns->indptr[j + 1] - columns->indptr[j];
            if (touched > most) return false;
        }
    return true;
}

static size_t row_of(const uint32_t *chosen, const uint32_t *map, size_t r) {
    if (chosen == NULL) return r;
    return map != NULL ? map[chosen[r]] : chosen[r];
}

/* y = A x by the columns j with x_j != 0. */
static void by_columns(const csr *columns, const float *x, float *y) {
    memset(y, 0, columns->n * sizeof *y);
    for (size_t j = 0; j < columns->n; j++) {
        const float x_j = x[j];
        if (x_j == 0) continue;
        for (uint64_t e = columns->indptr[j]; e < columns->indptr[j + 1]; e++)
            y[columns->indices[e]] += columns->data[e] * x_j;
    }
}

/* The rows of a product. */
typedef struct row_products {
    const csr *a;
    csr_float_row *multiply;
    size_t m, y_stride;
    const size_t *which;
    const uint32_t *chosen, *map;
    const float *x;
    float *Y;
} row_products;

static void multiply_rows(const void *job, size_t thread, size_t first, size_t last) {
    const row_products *p = job;
    const csr *a = p->a;
    (void)thread;
    for (size_t r = first; r < last; r++) {
        const size_t i = row_of(p->chosen, p->map, r);
        const uint64_t begin = a->indptr[i];
        float sums[CSR_FLOATS_WIDTH];
        p->multiply(a->indices + begin, a->data + begin, a->indptr[i + 1] - begin, p->x, sums);
        for (size_t v = 0; v < p->m; v++) p->Y[p->which[v] * p->y_stride + r] = sums[v];
    }
}

/* Vectors which[0] ... which[m - 1] by rows; several of them are first copied side by side. */
static void by_rows(const sparse_pair *A, size_t m, const size_t *which, const float *X, size_t x_stride,
                    size_t n_rows, const uint32_t *chosen, const uint32_t *map, float *Y, size_t y_stride,
                    float *side) {
    const csr *a = A->rows;
    const size_t n = a->n, width = csr_floats_width(m);
    const float *x = X + which[0] * x_stride;
    if (width > 1) {
        for (size_t p = 0; p < n; p++)
            for (size_t v = 0; v < width; v++) side[p * width + v] = v < m ? X[which[v] * x_stride + p] : 0;
        x = side;
    }
    const bool many = a->indptr[n] / n * n_rows * m > THREADS_WORTH;
    const row_products p = {.a = a,
                            .multiply = csr_floats_row(width),
                            .m = m,
                            .y_stride = y_stride,
                            .which = which,
                            .chosen = chosen,
                            .map = map,
                            .x = x,
                            .Y = Y};
    parallel_share(many ? A->n_threads : 1, n_rows, ROWS_AT_ONCE, multiply_rows, &p);
}

/* True when the rows hold fewer than n entries, so that copying vectors side by side would cost more than the
 * product. */
static bool rows_are_few(const csr *a, size_t n_rows) {
    return (double)n_rows * (double)a->indptr[a->n] < (double)a->n * (double)a->n;
}

void sparse_product(const sparse_pair *A, size_t m, const float *X, size_t x_stride, size_t n_chosen,
                    const uint32_t *chosen, const uint32_t *map, float *Y, size_t y_stride, void *work) {
    const size_t n = A->rows->n, n_rows = chosen != NULL ? n_chosen : n;
    float *side = work_area_take(&work, n * csr_floats_width(m) * sizeof *side);
    float *whole = work_area_take(&work, n * sizeof *whole);
    size_t dense[BATCH], n_dense = 0;
    for (size_t v = 0; v < m; v++) {
        const float *x = X + v * x_stride;
        float *y = Y + v * y_stride;
        if (!sparse_product_by_columns(A->columns, x)) {
            dense[n_dense++] = v;
            continue;
        }
        by_columns(A->columns, x, chosen != NULL ? whole : y);
        for (size_t r = 0; chosen != NULL && r < n_rows; r++) y[r] = whole[row_of(chosen, map, r)];
    }
    if (n_dense == 0) return;
    const size_t at_once = chosen != NULL && rows_are_few(A->rows, n_rows) ? 1 : n_dense;
    for (size_t v = 0; v < n_dense; v += at_once)
        by_rows(A, at_once, dense + v, X, x_stride, n_rows, chosen, map, Y, y_stride, side);
}
