#include "solver/operator/refine/compressed_factors.h"

#include "solver/base/parallel.h"
#include "solver/linalg/csr_rows.h"
#include "solver/operator/hierarchical.h"

#include "store/status.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_AT_ONCE = 64 };

/* Factor for the rounding of sums of bounds. */
static const double margin = 1 + 1e-9;

/* Half a unit in the last place of single precision, in which lit is kept. */
static const double single_rounding = 0x1p-24;

void compressed_free(compressed_factors *c) {
    wavelets_free(&c->basis);
    csr_free(&c->S);
    free(c->order);
    free(c->bound);
    free(c->lit_group);
    free(c->lit);
    free(c->class_of);
    free(c->root);
    free(c->lit_of);
    free(c->lit_area);
    *c = (compressed_factors){.n = 0};
}

/* The class of every coefficient. */
static lam_status find_classes(compressed_factors *c, lam_error *error) {
    const wavelets *w = &c->basis;
    uint32_t *height = memory_allocate(w->n_nodes, sizeof *height, "form factors", error);
    c->class_of = memory_allocate(c->n, sizeof *c->class_of, "form factors", error);
    if (height == NULL || c->class_of == NULL) {
        free(height);
        return LAM_ERR_MEMORY;
    }
    wavelets_heights(w, height);
    const uint32_t most = COMPRESSED_CLASSES_MOST - 1, root = height[w->n_nodes - 1];
    const uint32_t top = root < most ? root : most;
    c->n_classes = top + 1;
    memset(c->class_of, (int)top, c->n);
    for (size_t t = 0; t < w->n_nodes; t++)
        memset(c->class_of + w->nodes[t].first, (int)(height[t] < top ? height[t] : top),
               w->nodes[t].inputs - w->nodes[t].scaling);
    free(height);
    return LAM_OK;
}

/* Maps elements to the groups whose F 1_g is stored. */
static lam_status find_lit(compressed_factors *c, const double *area, const uint32_t *group,
                           lam_error *error) {
    c->lit_of = memory_allocate(c->n, sizeof *c->lit_of, "form factors", error);
    c->lit_area = memory_allocate(c->n_lit, sizeof *c->lit_area, "form factors", error);
    if (c->lit_of == NULL || c->lit_area == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < c->n; i++) {
        size_t g = 0;
        while (g < c->n_lit && c->lit_group[g] != group[i]) g++;
        c->lit_of[i] = (uint32_t)g;
        if (g < c->n_lit) c->lit_area[g] += area[i];
    }
    return LAM_OK;
}

/* The rounding of a product, bounded step by step in norms: two transforms with sums of at most eight terms a
 * level, whose matrices of absolute values have norms of at most eight, and the sums of S, whose absolute
 * values have at most its Frobenius norm. */
static double rounding_of(const compressed_factors *c) {
    double squares = 0, least = INFINITY;
    uint64_t longest = 0;
    for (uint64_t e = 0; e < c->S.indptr[c->n]; e++) squares += (double)c->S.data[e] * (double)c->S.data[e];
    for (size_t i = 0; i < c->n; i++) {
        const uint64_t count = c->S.indptr[i + 1] - c->S.indptr[i];
        longest = count > longest ? count : longest;
        least = fmin(least, c->root[i]);
    }
    const double norm = fmax(sqrt(squares), 1), transform = 64 * (double)(c->n_classes + 3);
    /* |W A^1/2 y| <= A^1/2 2 |x|_max */
    return 2 * sqrt(c->area) / least * (2 * transform + csr_doubles_roundings(longest)) * norm *
           (.5 * DBL_EPSILON);
}

lam_status compressed_place(compressed_factors *c, const double *area, const uint32_t *group,
                            lam_error *error) {
    lam_status status = LAM_OK;
    c->root = memory_allocate(c->n, sizeof *c->root, "form factors", error);
    if (c->root == NULL) TRY(LAM_ERR_MEMORY);
    TRY(find_classes(c, error));
    TRY(find_lit(c, area, group, error));
    c->area = 0;
    for (size_t p = 0; p < c->n; p++) {
        c->root[p] = sqrt(area[c->order[p]]);
        c->area += area[p];
    }
done:
    return status;
}

lam_status compressed_finish(compressed_factors *c, lam_error *error) {
    csr mirrored = {.n = 0};
    const lam_status status = csr_mirror(&c->S, "form factors", &mirrored, error);
    if (status != LAM_OK) return status;
    csr_free(&c->S);
    c->S = mirrored;
    c->rounding = rounding_of(c);
    return LAM_OK;
}

/* Work: coefficients of x and of F~ x, means of groups, work of a transform. */
size_t compressed_work(const compressed_factors *c) {
    return 2 * c->n + c->n_lit + wavelets_work(&c->basis);
}

/* Splits x into mean [n_lit] and c = W A^1/2 y; scratch [n]. */
static void take_apart(const compressed_factors *c, const double *x, double *mean, double *coefficients,
                       double *scratch, double *work) {
    for (size_t g = 0; g < c->n_lit; g++) mean[g] = 0;
    for (size_t p = 0; p < c->n; p++) {
        const size_t i = c->order[p], g = c->lit_of[i];
        if (g < c->n_lit) mean[g] += c->root[p] * c->root[p] * x[i];
    }
    for (size_t g = 0; g < c->n_lit; g++) mean[g] = c->lit_area[g] > 0 ? mean[g] / c->lit_area[g] : 0;
    for (size_t p = 0; p < c->n; p++) {
        const size_t i = c->order[p], g = c->lit_of[i];
        scratch[p] = c->root[p] * (g < c->n_lit ? x[i] - mean[g] : x[i]);
    }
    wavelets_forward(&c->basis, scratch, coefficients, work);
}

/* Rows of S times coefficients. */
typedef struct row_products {
    const csr *S;
    csr_double_row *multiply;
    const double *from;
    double *to;
} row_products;

static void multiply_rows(const void *job, size_t thread, size_t first, size_t last) {
    const row_products *p = job;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        const uint64_t begin = p->S->indptr[k];
        p->multiply(p->S->indices + begin, p->S->data + begin, p->S->indptr[k + 1] - begin, p->from,
                    p->to + k);
    }
}

void compressed_multiply(const compressed_factors *c, const double *x, double *y, double *work,
                         size_t n_threads) {
    const size_t n = c->n;
    double *from = work, *to = from + n, *mean = to + n, *slots = mean + c->n_lit;
    const row_products rows = {&c->S, csr_doubles_row(1), from, to};
    take_apart(c, x, mean, from, to, slots);
    parallel_share(n_threads, n, ROWS_AT_ONCE, multiply_rows, &rows);
    wavelets_inverse(&c->basis, to, from, slots);
    for (size_t p = 0; p < n; p++) y[c->order[p]] = from[p] / c->root[p];
    for (size_t g = 0; g < c->n_lit; g++)
        for (size_t i = 0; i < n; i++) y[i] += mean[g] * (double)c->lit[g * n + i];
}

void compressed_norms(const compressed_factors *c, const double *x, double *norms, double *work) {
    const size_t n = c->n;
    double *from = work, *scratch = from + n, *mean = scratch + n, *slots = mean + c->n_lit, all = 0;
    take_apart(c, x, mean, from, scratch, slots);
    for (size_t k = 0; k < c->n_classes; k++) norms[k] = 0;
    for (size_t q = 0; q < n; q++) norms[c->class_of[q]] += from[q] * from[q];
    for (size_t k = 0; k < c->n_classes; k++) all += norms[k];
    /* The transform rounds each part relative to the whole. */
    for (size_t k = 0; k < c->n_classes; k++) norms[k] = margin * (sqrt(norms[k]) + 1e-12 * sqrt(all));
}

double compressed_error(const compressed_factors *c, const double *x, double *out, double *work) {
    const wavelets *w = &c->basis;
    const size_t n = c->n;
    /* compressed_norms leaves the means here. */
    const double *mean = work + 2 * n;
    double *sum = work + 2 * n + c->n_lit; /* [n_nodes], over a node and its ancestors */
    double norms[COMPRESSED_CLASSES_MOST] = {0}, largest = 0;
    compressed_norms(c, x, norms, work);
    for (size_t t = w->n_nodes; t-- > 0;) {
        const wavelet_node *a = &w->nodes[t];
        double own = 0;
        for (size_t k = 0; k < c->n_classes; k++) own += (double)c->bound[t * c->n_classes + k] * norms[k];
        sum[t] = own + (a->parent == WAVELET_NONE ? 0 : sum[a->parent]);
        if (a->from_left > 0) continue;
        for (size_t p = a->begin; p < a->begin + a->n_elements; p++) out[c->order[p]] = sum[t];
    }
    for (size_t i = 0; i < n; i++) {
        double lit = 0;
        for (size_t g = 0; g < c->n_lit; g++) lit += fabs(mean[g]) * (double)c->lit[g * n + i];
        out[i] = margin * (out[i] + single_rounding * lit);
        largest = fmax(largest, out[i]);
    }
    return largest;
}

size_t compressed_bytes(const compressed_factors *c) {
    return (size_t)c->S.indptr[c->n] * (sizeof *c->S.indices + sizeof *c->S.data) +
           (c->n + 1) * sizeof *c->S.indptr + c->basis.n_nodes * c->n_classes * sizeof *c->bound +
           c->n_lit * c->n * sizeof *c->lit;
}

#define GROUP "/form_factors"

lam_status compressed_save(const compressed_factors *c, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(csr_save(&c->S, GROUP, s, error));
    TRY(wavelets_save(&c->basis, GROUP "/basis", s, error));
    TRY(store_write(s, GROUP "/order", STORE_U32, 1, &c->n, c->order, error));
    TRY(store_write(s, GROUP "/bound", STORE_F32, 2, (size_t[]){c->basis.n_nodes, c->n_classes}, c->bound,
                    error));
    TRY(store_write(s, GROUP "/lit_group", STORE_U32, 1, &c->n_lit, c->lit_group, error));
    TRY(store_write(s, GROUP "/lit", STORE_F32, 2, (size_t[]){c->n_lit, c->n}, c->lit, error));
done:
    return status;
}

static lam_status check_numbers(store *s, const char *name, const float *values, size_t count,
                                lam_error *error) {
    for (size_t k = 0; k < count; k++)
        if (!(values[k] >= 0 && values[k] < INFINITY))
            return status_fail(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be at least 0", store_path(s),
                               name, k, (double)values[k]);
    return LAM_OK;
}

static lam_status check_order(store *s, const compressed_factors *c, lam_error *error) {
    bool *seen = memory_allocate(c->n, sizeof *seen, "form factors", error);
    lam_status status = LAM_OK;
    if (seen == NULL) return LAM_ERR_MEMORY;
    for (size_t p = 0; p < c->n; p++) {
        const size_t i = c->order[p];
        if (i >= c->n || seen[i])
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: " GROUP "/order[%zu] = %zu, must hold every number below %zu once", store_path(s), p, i,
                 c->n);
        seen[i] = true;
    }
done:
    free(seen);
    return status;
}

static lam_status read_parts(store *s, size_t n, compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    size_t bound[STORE_MAX_RANK] = {SIZE_MAX, SIZE_MAX}, lit[STORE_MAX_RANK] = {SIZE_MAX, n};
    void *data;
    *c = (compressed_factors){.n = n};
    TRY(csr_load(s, GROUP, n, &c->S, error));
    TRY(csr_check(&c->S, (size_t)c->S.indptr[n], GROUP, error));
    for (size_t i = 0; i < n; i++)
        if (c->S.indptr[i] < c->S.indptr[i + 1] && c->S.indices[c->S.indptr[i]] < i)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: /form_factors: row %zu has the column %u, must not be below the diagonal",
                 store_path(s), i, c->S.indices[c->S.indptr[i]]);
    TRY(wavelets_load(s, GROUP "/basis", n, &c->basis, error));
    TRY(store_read(s, GROUP "/order", STORE_U32, 1, (size_t[]){n}, &data, error));
    c->order = data;
    TRY(check_order(s, c, error));
    TRY(store_read(s, GROUP "/bound", STORE_F32, 2, bound, &data, error));
    c->bound = data;
    c->n_classes = bound[1];
    if (bound[0] != c->basis.n_nodes)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/bound has %zu rows, the basis has %zu nodes",
             store_path(s), bound[0], c->basis.n_nodes);
    TRY(check_numbers(s, GROUP "/bound", c->bound, bound[0] * bound[1], error));
    TRY(store_read(s, GROUP "/lit_group", STORE_U32, 1, lit, &data, error));
    c->lit_group = data;
    c->n_lit = lit[0];
    TRY(store_read(s, GROUP "/lit", STORE_F32, 2, lit, &data, error));
    c->lit = data;
    TRY(check_numbers(s, GROUP "/lit", c->lit, c->n_lit * n, error));
done:
    return status;
}

lam_status compressed_load(store *s, size_t n, const double *area, compressed_factors *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    void *group = NULL;
    compressed_factors c = {.n = 0};
    TRY(read_parts(s, n, &c, error));
    TRY(store_read(s, "/mesh/group", STORE_U32, 1, (size_t[]){n}, &group, error));
    const size_t n_classes = c.n_classes;
    TRY(compressed_place(&c, area, group, error));
    if (n_classes != c.n_classes)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/bound has %zu columns, must be %zu", store_path(s),
             n_classes, c.n_classes);
    TRY(compressed_finish(&c, error));
    *out = c;
    c = (compressed_factors){.n = 0};
done:
    free(group);
    compressed_free(&c);
    return status;
}

lam_status compressed_size(store *s, size_t *bytes, lam_error *error) {
    lam_status status = LAM_OK;
    static const struct {
        const char *name;
        size_t bytes; /* in memory, for each number of the array */
    } parts[] = {{GROUP "/data", 2 * (sizeof(uint32_t) + sizeof(float))},
                 {GROUP "/indptr", 2 * sizeof(uint64_t) + 6 * sizeof(double)},
                 {GROUP "/basis/node", sizeof(wavelet_node) + WAVELET_SCALING * sizeof(double)},
                 {GROUP "/basis/basis", 3 * sizeof(float)},
                 {GROUP "/bound", sizeof(float)},
                 {GROUP "/lit", sizeof(float)}};
    store_type type;
    int rank;
    *bytes = 0;
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        size_t dims[STORE_MAX_RANK] = {0}, count = 1, part;
        TRY(store_array_info(s, parts[k].name, &type, &rank, dims, error));
        for (int d = 0; d < rank; d++)
            if (!size_multiply(count, dims[d], &count)) count = SIZE_MAX / 64;
        if (!size_multiply(count, parts[k].bytes, &part) || *bytes > SIZE_MAX - part)
            FAIL(error, LAM_ERR_MEMORY, "%s: %s is larger than memory can be", store_path(s), parts[k].name);
        *bytes += part;
    }
done:
    return status;
}
