/* kind "hierarchical": the symmetric core of the transport in a basis of multiwavelets on a tree of clusters,
 * where nearly all of it is below what matters. An answer is two transforms of O(n) and a product with what
 * is left. */
#include "solver/operator/hierarchical.h"

#include "solver/operator/sparse_product.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct hierarchical {
    lam_operator base;
    wavelets basis;
    half_matrix *K;   /* [C] */
    float *root_area; /* [n] A^1/2, by position */
} hierarchical;

void hierarchical_arrays_free(hierarchical_arrays *arrays, size_t n_channels) {
    for (size_t c = 0; arrays->K != NULL && c < n_channels; c++) csr_free(&arrays->K[c]);
    free(arrays->K);
    wavelets_free(&arrays->basis);
    arrays->K = NULL;
}

static void hierarchical_destroy(lam_operator *op) {
    hierarchical *self = (hierarchical *)op;
    for (size_t c = 0; self->K != NULL && c < op->n_channels; c++) csr_free(&self->K[c].rows);
    free(self->K);
    free(self->root_area);
    wavelets_free(&self->basis);
}

/* The shared part, areas, room for K. */
static lam_status start(size_t n, size_t n_channels, const float *reflectance, const double *area,
                        hierarchical **out, lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_hierarchical;
    TRY(operator_init(&self->base, &operator_hierarchical, n, n_channels, reflectance, error));
    self->root_area = memory_allocate(n, sizeof *self->root_area, "operator", error);
    self->K = memory_allocate(n_channels, sizeof *self->K, "operator", error);
    if (self->root_area == NULL || self->K == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) {
        self->root_area[p] = (float)sqrt(area[p]);
        if (!(self->root_area[p] > 0 && self->root_area[p] < INFINITY))
            FAIL(error, LAM_ERR_NUMERIC, "area of position %zu = %g, must be above 0", p, area[p]);
    }
    *out = self;
    self = NULL;
done:
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

lam_status operator_hierarchical_create(size_t n, size_t n_channels, const float *reflectance,
                                        const double *area, hierarchical_arrays *arrays, lam_operator **op,
                                        lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = NULL;
    TRY(start(n, n_channels, reflectance, area, &self, error));
    for (size_t c = 0; c < n_channels; c++) TRY(half_matrix_create(&arrays->K[c], &self->K[c], error));
    self->basis = arrays->basis;
    arrays->basis = (wavelets){.n = 0};
    *op = &self->base;
    self = NULL;
done:
    hierarchical_arrays_free(arrays, n_channels);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* --- the store ----------------------------------------------------------------------------------------- */

/* Areas in the order of positions. */
static lam_status read_area(store *s, size_t n, double **out, lam_error *error) {
    lam_status status = LAM_OK;
    void *area = NULL, *order = NULL;
    double *placed = memory_allocate(n, sizeof *placed, "operator", error);
    size_t dims[STORE_MAX_RANK] = {n};
    if (placed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_read(s, "/mesh/area", STORE_F64, 1, dims, &area, error));
    if (store_has(s, "/operator/order"))
        TRY(store_read(s, "/operator/order", STORE_U32, 1, dims, &order, error));
    for (size_t p = 0; p < n; p++) {
        const size_t i = order != NULL ? ((uint32_t *)order)[p] : p;
        if (i >= n) FAIL(error, LAM_ERR_NUMERIC, "order[%zu] = %zu, must be below %zu", p, i, n);
        placed[p] = ((double *)area)[i];
    }
    *out = placed;
    placed = NULL;
done:
    free(area);
    free(order);
    free(placed);
    return status;
}

static lam_status hierarchical_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                    lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char group[48];
    double *area = NULL;
    hierarchical *self = NULL;
    TRY(read_area(s, n, &area, error));
    TRY(start(n, n_channels, reflectance, area, &self, error));
    TRY(wavelets_load(s, "/operator/basis", n, &self->basis, error));
    for (size_t c = 0; c < n_channels; c++) {
        snprintf(group, sizeof group, "/operator/K/%zu", c);
        TRY(half_matrix_load(s, group, n, &self->K[c], error));
    }
    *op = &self->base;
    self = NULL;
done:
    free(area);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

static lam_status hierarchical_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const hierarchical *self = (const hierarchical *)op;
    char group[48];
    TRY(wavelets_save(&self->basis, "/operator/basis", s, error));
    for (size_t c = 0; c < op->n_channels; c++) {
        snprintf(group, sizeof group, "/operator/K/%zu", c);
        TRY(half_matrix_save(&self->K[c], group, s, error));
    }
done:
    return status;
}

/* --- the products -------------------------------------------------------------------------------------- */

static size_t hierarchical_work_bytes(const lam_operator *op, size_t n_rhs) {
    const hierarchical *self = (const hierarchical *)op;
    const size_t product = sparse_product_work(op->n, n_rhs);
    size_t vectors, slots, total = PANEL_ALIGN;
    if (product == 0 || !size_multiply(op->n, n_rhs * sizeof(float), &vectors) ||
        !size_multiply(wavelets_work(&self->basis), n_rhs * sizeof(float), &slots) ||
        !work_add(&total, vectors) || !work_add(&total, vectors) || !work_add(&total, slots) ||
        !work_add(&total, product))
        return 0;
    return total;
}

/* Y = W^T K_c W X of m vectors, [m][n]; X is lost. */
static void multiply(const hierarchical *self, size_t c, size_t m, float *X, float *Y, float *slots,
                     void *product) {
    const size_t n = self->base.n, n_threads = self->base.n_threads;
    const sparse_pair K = {&self->K[c].rows, &self->K[c].rows, n_threads}; /* symmetric */
    wavelets_forward(&self->basis, m, X, Y, slots, n_threads);
    sparse_product(&K, m, Y, n, 0, NULL, NULL, X, n, product);
    wavelets_inverse(&self->basis, m, X, Y, slots, n_threads);
}

/* out = left W^T K W right in, left = R' A^-1/2 and right = A^1/2, or transposed. */
static void apply(const lam_operator *op, bool adjoint, size_t n_rhs, const float *in, float *out,
                  void *work) {
    const hierarchical *self = (const hierarchical *)op;
    const size_t n = op->n, C = op->n_channels;
    float *X = work_take(&work, n_rhs * n * sizeof *X);
    float *Y = work_take(&work, n_rhs * n * sizeof *Y);
    float *slots = work_take(&work, n_rhs * wavelets_work(&self->basis) * sizeof *slots);
    for (size_t c = 0; c < C; c++) {
        for (size_t v = 0; v < n_rhs; v++)
            for (size_t p = 0; p < n; p++) {
                const float x = in[(v * C + c) * n + p], root = self->root_area[p];
                X[v * n + p] = adjoint ? operator_reflectance_or_one(op, c, p) / root * x : root * x;
            }
        multiply(self, c, n_rhs, X, Y, slots, work);
        for (size_t v = 0; v < n_rhs; v++)
            for (size_t p = 0; p < n; p++) {
                const float y = Y[v * n + p], root = self->root_area[p];
                out[(v * C + c) * n + p] =
                    adjoint ? root * y : operator_reflectance_or_one(op, c, p) / root * y;
            }
    }
}

static void hierarchical_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    apply(op, false, n_rhs, E, P, work);
}

static void hierarchical_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    apply(op, true, n_rhs, g, w, work);
}

static void hierarchical_describe(const lam_operator *op, operator_description *description) {
    const hierarchical *self = (const hierarchical *)op;
    const double whole = (double)op->n * (double)op->n * (double)op->n_channels;
    double entries = 0;
    for (size_t c = 0; c < op->n_channels; c++) {
        const size_t stored = (size_t)self->K[c].rows.indptr[op->n];
        entries += (double)stored;
        description->bytes += (op->n + 1) * sizeof(uint64_t) + stored * (sizeof(uint32_t) + sizeof(float));
    }
    description->bytes += wavelets_bytes(&self->basis) + op->n * sizeof *self->root_area;
    description->density = entries / whole;
}

const operator_kind operator_hierarchical = {
    .name = "hierarchical",
    .load = hierarchical_load,
    .save = hierarchical_save,
    .work_bytes = hierarchical_work_bytes,
    .apply = hierarchical_apply,
    .apply_adjoint = hierarchical_apply_adjoint,
    .destroy = hierarchical_destroy,
    .describe = hierarchical_describe,
};
