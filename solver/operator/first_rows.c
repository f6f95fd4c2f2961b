#include "solver/operator/first_rows.h"

#include "solver/base/cpu.h"
#include "store/status.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Elements whose rows stay in the second cache from some results to the next; results and elements whose sums
 * are kept in registers over many sources; and sources that are taken at a time. */
enum { BLOCK = 512, TOGETHER = 8, LANES = 16, SOURCES = 256 };

/* Some sources of some results: the weights of those that matter to one of them, and where their rows are. */
typedef struct source_list {
    size_t count;
    const float *rows[SOURCES];
    double weight[SOURCES][TOGETHER];
} source_list;

#define CPU_KERNELS "solver/operator/first_rows_kernels.inc"
#include "solver/base/cpu_kernels.inc"

lam_status first_rows_load(store *s, const char *name, const char *source, size_t n, const bool *is_signed,
                           first_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, n};
    store_view view = {.data = NULL};
    TRY(store_read_view(s, name, STORE_F32, 2, dims, &view, error));
    const float *values = view.data;
    if (dims[0] == 0) FAIL(error, LAM_ERR_FORMAT, "%s: %s has no %ss", store_path(s), name, source);
    /* A mapped array is compared with its checksums later; its writer has checked the values. */
    for (size_t k = 0; k < dims[0] * n && view.map == NULL; k++) {
        const bool any_sign = is_signed != NULL && is_signed[k % n];
        if (!isfinite(values[k]) || (values[k] < 0 && !any_sign))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu][%zu] = %g, must be %s", store_path(s), name, k / n,
                 k % n, (double)values[k], any_sign ? "a number" : "at least 0");
    }
    *out = (first_rows){.m = dims[0], .n = n, .values = values, .where = view};
    view = (store_view){.data = NULL};
done:
    store_view_free(&view);
    return status;
}

lam_status first_rows_copy(size_t m, size_t n, const float *values, first_rows *out, lam_error *error) {
    float *copy = memory_allocate(m, n * sizeof *copy, "direct light", error);
    if (copy == NULL) return LAM_ERR_MEMORY;
    memcpy(copy, values, m * n * sizeof *copy);
    *out = (first_rows){.m = m, .n = n, .values = copy, .where = {.memory = copy}};
    return LAM_OK;
}

void first_rows_free(first_rows *r) {
    store_view_free(&r->where);
    *r = (first_rows){.m = 0};
}

static double factor_of(const row_factors *f, size_t row, size_t m, size_t t) {
    return f == NULL || f->values == NULL ? 1 : f->values[row % f->n_channels * m + t];
}

/* Sources first ... last of results q ... q + count. */
static void list_sources(const first_rows *r, size_t first, size_t last, size_t q, size_t count,
                         const float *w, const row_factors *f, source_list *list) {
    const size_t m = r->m;
    list->count = 0;
    for (size_t t = first; t < last; t++) {
        double *weight = list->weight[list->count];
        bool matters = false;
        for (size_t k = 0; k < TOGETHER; k++) {
            weight[k] = k < count ? (double)w[(q + k) * m + t] * factor_of(f, q + k, m, t) : 0;
            matters = matters || weight[k] != 0;
        }
        list->rows[list->count] = r->values + t * r->n;
        list->count += matters;
    }
}

typedef void add_sources(const source_list *list, size_t first, size_t count, bool one, double (*sum)[BLOCK]);

/* H0_q = sum_t w_qt row_t, each sum in the order of the sources. */
void first_rows_apply(const first_rows *r, size_t n_rows, const float *w, const row_factors *f, bool add,
                      float *H0) {
    static add_sources *const adds[] = CPU_TABLE(add_sources_portable, add_sources_avx2, add_sources_avx512);
    add_sources *const add_some = adds[cpu_best()];
    const size_t m = r->m, n = r->n;
    for (size_t first = 0; first < n; first += BLOCK) {
        const size_t count = n - first < BLOCK ? n - first : BLOCK;
        for (size_t q = 0; q < n_rows; q += TOGETHER) {
            const size_t some = n_rows - q < TOGETHER ? n_rows - q : TOGETHER;
            double sum[TOGETHER][BLOCK] = {{0}};
            for (size_t t = 0; t < m; t += SOURCES) {
                source_list list;
                list_sources(r, t, m - t < SOURCES ? m : t + SOURCES, q, some, w, f, &list);
                add_some(&list, first, count, some == 1, sum);
            }
            for (size_t k = 0; k < some; k++) {
                float *to = H0 + (q + k) * n + first;
                for (size_t i = 0; i < count; i++) to[i] = (float)(sum[k][i] + (add ? (double)to[i] : 0));
            }
        }
    }
}

void first_rows_apply_double(const first_rows *r, size_t n_rows, const double *w, const row_factors *f,
                             double *H0) {
    const size_t m = r->m, n = r->n;
    for (size_t q = 0; q < n_rows; q++)
        for (size_t t = 0; t < m; t++) {
            const double weight = w[q * m + t] * factor_of(f, q, m, t);
            const float *row = r->values + t * n;
            double *sum = H0 + q * n;
            if (weight == 0) continue;
            for (size_t i = 0; i < n; i++) sum[i] += weight * (double)row[i];
        }
}

void first_rows_adjoint(const first_rows *r, size_t n_rows, const float *g, const row_factors *f, float *w) {
    const size_t m = r->m, n = r->n;
    for (size_t q = 0; q < n_rows; q++)
        for (size_t t = 0; t < m; t++) {
            const float *row = r->values + t * n, *g_q = g + q * n;
            double sum = 0;
            for (size_t i = 0; i < n; i++) sum += (double)row[i] * (double)g_q[i];
            w[q * m + t] = (float)(sum * factor_of(f, q, m, t));
        }
}
