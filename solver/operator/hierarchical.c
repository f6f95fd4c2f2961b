/* kind "hierarchical": H = A^-1/2 W^T K W A^1/2 E, with W a basis of multiwavelets on a tree of clusters
 * (Gortler et al. 1993; Beylkin et al. 1991) and K sparse, as most of its coefficients lie below the
 * threshold. An answer is two transforms of O(n) and a product with K. */
#include "solver/operator/hierarchical.h"

#include "solver/base/work_area.h"
#include "solver/linalg/tiled.h"
#include "solver/operator/mean_correction.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Numbers that a thread scales at once. */
enum { BLOCK = 8192 };

typedef struct hierarchical {
    lam_operator base;
    wavelets basis;
    wavelet_plan plan; /* of the coefficients that any K has */
    size_t n_groups;
    tile_group *groups; /* [n_groups], by number in the basis, all that the plan has */
    float *step;        /* [n_groups] */
    tiled_rows *K;      /* [C] */
    double n_numbers;   /* of all K, both triangles */
    float *root_area;   /* [n] A^1/2, by position */
    float *left;        /* [C][n] rho' A^-1/2, by position */
    mean_correction even;
} hierarchical;

void hierarchical_arrays_free(hierarchical_arrays *arrays, size_t n_channels) {
    for (size_t c = 0; arrays->K != NULL && c < n_channels; c++) csr_free(&arrays->K[c]);
    free(arrays->K);
    free(arrays->step);
    wavelets_free(&arrays->basis);
    arrays->K = NULL;
    arrays->step = NULL;
}

static void hierarchical_destroy(lam_operator *op) {
    hierarchical *self = (hierarchical *)op;
    for (size_t c = 0; self->K != NULL && c < op->n_channels; c++) tiled_free(&self->K[c]);
    free(self->K);
    free(self->groups);
    free(self->step);
    free(self->root_area);
    free(self->left);
    mean_correction_free(&self->even);
    wavelet_plan_free(&self->plan);
    wavelets_free(&self->basis);
}

/* The shared part, areas, room for K. */
static lam_status start(size_t n, size_t n_channels, const float *reflectance, const double *area,
                        const uint32_t *order, hierarchical **out, lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_hierarchical;
    TRY(operator_init(&self->base, &operator_hierarchical, n, n_channels, reflectance, error));
    self->root_area = memory_allocate(n, sizeof *self->root_area, "operator", error);
    self->K = memory_allocate(n_channels, sizeof *self->K, "operator", error);
    self->left = memory_allocate(n_channels, n * sizeof *self->left, "operator", error);
    if (self->root_area == NULL || self->left == NULL || self->K == NULL) TRY(LAM_ERR_MEMORY);
    TRY(operator_set_order(&self->base, order, error));
    for (size_t p = 0; p < n; p++) {
        self->root_area[p] = (float)sqrt(area[p]);
        if (!(self->root_area[p] > 0 && self->root_area[p] < INFINITY))
            FAIL(error, LAM_ERR_NUMERIC, "area of position %zu = %g, must be above 0", p, area[p]);
        for (size_t c = 0; c < n_channels; c++)
            self->left[c * n + p] = operator_reflectance_or_one(&self->base, c, p) / self->root_area[p];
    }
    *out = self;
    self = NULL;
done:
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* With the correction of its mean error. */
static lam_status lift_even_light(hierarchical *self, lam_error *error) {
    const size_t n = self->base.n, C = self->base.n_channels;
    float *by = NULL;
    if (self->even.missing == NULL) return LAM_OK;
    by = memory_allocate(C, n * sizeof *by, "operator", error);
    if (by == NULL) return LAM_ERR_MEMORY;
    for (size_t c = 0; c < C; c++)
        for (size_t p = 0; p < n; p++) by[c * n + p] = operator_reflectance_or_one(&self->base, c, p);
    const lam_status status = mean_correction_lift(&self->even, by, error);
    free(by);
    return status;
}

lam_status operator_hierarchical_correct(lam_operator *op, const double *missing, const double *light,
                                         lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = (hierarchical *)op;
    TRY(mean_correction_create(op->n, op->n_channels, missing, light, &self->even, error));
    TRY(lift_even_light(self, error));
done:
    return status;
}

/* Takes the tiles of a channel over, and frees them. */
static lam_status take_tiles(hierarchical *self, size_t c, tile_matrix *tiles, lam_error *error) {
    self->n_numbers += (double)tile_matrix_numbers(tiles);
    const lam_status status =
        tiled_create(tiles, self->n_groups, self->groups, self->step, &self->K[c], error);
    tile_matrix_free(tiles);
    return status;
}

/* The largest number over its step, as tile_matrix_round says. */
static const double most_steps = 0x1p29;

/* Makes the arrays that answers read of the upper triangles K [C]. */
static lam_status round_K(hierarchical *self, const csr *K, const float *step, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = self->base.n, C = self->base.n_channels;
    tile_matrix tiles = {.count = {0}};
    float largest = 0;
    bool *used = memory_allocate(n, sizeof *used, "operator", error);
    if (used == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++)
        for (size_t i = 0; i < n; i++)
            for (uint64_t e = K[c].indptr[i]; e < K[c].indptr[i + 1]; e++) {
                const float value = K[c].data[e];
                if (!isfinite(value))
                    FAIL(error, LAM_ERR_NUMERIC, "K[%zu] = %g, must be finite", (size_t)e, (double)value);
                if (value == 0) continue;
                used[i] = used[K[c].indices[e]] = true;
                largest = fmaxf(largest, fabsf(value));
            }
    TRY(wavelet_plan_create(&self->basis, used, &self->plan, error));
    TRY(hierarchical_groups(&self->plan, step, (float)sqrt((double)largest / most_steps), &self->n_groups,
                            &self->groups, &self->step, error));
    for (size_t c = 0; c < C; c++) {
        TRY(tile_matrix_round(&K[c], self->n_groups, self->groups, self->step, &tiles, error));
        TRY(take_tiles(self, c, &tiles, error));
    }
done:
    free(used);
    return status;
}

lam_status operator_hierarchical_create(size_t n, size_t n_channels, const float *reflectance,
                                        const double *area, const uint32_t *order,
                                        hierarchical_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = NULL;
    TRY(start(n, n_channels, reflectance, area, order, &self, error));
    self->basis = arrays->basis;
    arrays->basis = (wavelets){.n = 0};
    TRY(round_K(self, arrays->K, arrays->step, error));
    *op = &self->base;
    self = NULL;
done:
    hierarchical_arrays_free(arrays, n_channels);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* Reads groups and tiles. */
static lam_status load_tiles(hierarchical *self, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char group[48];
    const size_t n = self->base.n;
    tile_matrix tiles = {.count = {0}};
    bool *used = memory_allocate(n, sizeof *used, "operator", error);
    if (used == NULL) TRY(LAM_ERR_MEMORY);
    TRY(hierarchical_load_groups(s, n, &self->n_groups, &self->groups, &self->step, error));
    size_t count = 0;
    for (size_t g = 0; g < self->n_groups; g++)
        for (size_t r = 0; r < self->groups[g].size; r++, count++) used[self->groups[g].first + r] = true;
    TRY(wavelet_plan_create(&self->basis, used, &self->plan, error));
    if (count != self->plan.n_used)
        FAIL(error, LAM_ERR_NUMERIC,
             "groups/rows has %zu coefficients, must have all %zu of its nodes and of the root", count,
             self->plan.n_used);
    for (size_t c = 0; c < self->base.n_channels; c++) {
        snprintf(group, sizeof group, "/operator/K/%zu", c);
        TRY(hierarchical_load_tiles(s, group, self->n_groups, self->groups, &tiles, error));
        TRY(take_tiles(self, c, &tiles, error));
    }
done:
    free(used);
    return status;
}

/* Reads numbers in half precision and rounds them as if they had just been found. */
static lam_status load_halves(hierarchical *self, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char group[48];
    const size_t C = self->base.n_channels;
    double threshold;
    float *step = NULL;
    csr *K = memory_allocate(C, sizeof *K, "operator", error);
    if (K == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++) {
        snprintf(group, sizeof group, "/operator/K/%zu", c);
        TRY(hierarchical_load_halves(s, group, self->base.n, &K[c], error));
    }
    TRY(store_get_number(s, "/operator", "threshold", &threshold, error));
    if (!(threshold > 0 && threshold <= 1))
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the threshold %g, must be above 0 and at most 1",
             store_path(s), threshold);
    TRY(hierarchical_steps(&self->basis, threshold, &step, error));
    TRY(round_K(self, K, step, error));
done:
    for (size_t c = 0; K != NULL && c < C; c++) csr_free(&K[c]);
    free(K);
    free(step);
    return status;
}

/* Areas in the order of positions, and that order; NULL: mesh order. */
static lam_status read_area(store *s, size_t n, double **out, uint32_t **out_order, lam_error *error) {
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
    *out_order = order;
    placed = NULL;
    order = NULL;
done:
    free(area);
    free(order);
    free(placed);
    return status;
}

static lam_status hierarchical_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                    lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    double *area = NULL;
    uint32_t *order = NULL;
    hierarchical *self = NULL;
    TRY(read_area(s, n, &area, &order, error));
    TRY(start(n, n_channels, reflectance, area, order, &self, error));
    TRY(wavelets_load(s, "/operator/basis", n, &self->basis, error));
    TRY(mean_correction_load(s, n, n_channels, &self->even, error));
    TRY(lift_even_light(self, error));
    TRY(store_has(s, "/operator/groups") ? load_tiles(self, s, error) : load_halves(self, s, error));
    *op = &self->base;
    self = NULL;
done:
    free(area);
    free(order);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

static lam_status hierarchical_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const hierarchical *self = (const hierarchical *)op;
    char group[48];
    tile_matrix tiles = {.count = {0}};
    TRY(wavelets_save(&self->basis, "/operator/basis", s, error));
    TRY(hierarchical_save_groups(self->n_groups, self->groups, self->step, s, error));
    for (size_t c = 0; c < op->n_channels; c++) {
        snprintf(group, sizeof group, "/operator/K/%zu", c);
        TRY(tiled_upper(&self->K[c], &tiles, error));
        TRY(hierarchical_save_tiles(&tiles, self->n_groups, group, s, error));
        tile_matrix_free(&tiles);
    }
    TRY(mean_correction_save(&self->even, s, error));
done:
    tile_matrix_free(&tiles);
    return status;
}

/* Steps, coefficients and flags of some positions. */
static size_t some_bytes(const wavelet_plan *plan) {
    return 4 * WORK_AREA_ALIGN + plan->n_steps * (sizeof(uint32_t) + 1) +
           (plan->n_used + plan->n) * sizeof(uint32_t);
}

static size_t hierarchical_work_bytes(const lam_operator *op, size_t n_rhs) {
    const hierarchical *self = (const hierarchical *)op;
    const size_t used = self->plan.n_used;
    size_t product, vectors, coefficients, slots, total = WORK_AREA_ALIGN;
    if (!size_multiply(tiled_work(used, n_rhs), sizeof(float), &product) ||
        !size_multiply(op->n, n_rhs * sizeof(float), &vectors) ||
        !size_multiply(used, n_rhs * sizeof(float), &coefficients) ||
        !size_multiply(wavelet_plan_work(&self->plan), n_rhs * sizeof(float), &slots) ||
        !work_area_add(&total, vectors) || !work_area_add(&total, coefficients) ||
        !work_area_add(&total, coefficients) || !work_area_add(&total, slots) ||
        !work_area_add(&total, some_bytes(&self->plan)) || !work_area_add(&total, product))
        return 0;
    return total;
}

/* out_v = K_c in_v: light of few elements by its columns, other vectors together. */
static void multiply_core(const hierarchical *self, size_t c, size_t m, const float *in, float *out,
                          float *work) {
    const tiled_rows *K = &self->K[c];
    for (size_t v = 0, last; v < m; v = last) {
        last = v;
        while (last < m && !tiled_few_columns(K, in + last * K->n)) last++;
        if (last > v)
            tiled_multiply(K, last - v, in + v * K->n, out + v * K->n, work, self->base.n_threads);
        else
            tiled_multiply_columns(K, in + v * K->n, out + last++ * K->n, work);
    }
}

/* to_v = by from_v, element by element. */
static void scale(size_t m, size_t n, const float *by, const float *from, size_t from_stride, float *to,
                  size_t to_stride, size_t n_threads) {
    const size_t blocks = (n + BLOCK - 1) / BLOCK;
#pragma omp parallel for schedule(static) num_threads((int)n_threads) if (n_threads > 1 && m * blocks > 8)
    for (size_t k = 0; k < m * blocks; k++) {
        const size_t v = k / blocks, first = k % blocks * BLOCK, last = first + BLOCK < n ? first + BLOCK : n;
        const float *x = from + v * from_stride;
        float *y = to + v * to_stride;
        for (size_t p = first; p < last; p++) y[p] = by[p] * x[p];
    }
}

/* Vectors of which one channel is 0 have an answer of 0 there, whatever stands beside them in a pass. */
static bool is_dark(const float *in, size_t n) {
    for (size_t p = 0; p < n; p++)
        if (in[p] != 0) return false;
    return true;
}

static bool are_dark(const float *in, size_t n, size_t stride, size_t n_rhs) {
    for (size_t v = 0; v < n_rhs; v++)
        if (!is_dark(in + v * stride, n)) return false;
    return true;
}

/* out = left W^T K W right in, left = R' A^-1/2 and right = A^1/2, or transposed. */
static void apply(const lam_operator *op, bool adjoint, size_t n_rhs, const float *in, float *out,
                  void *work) {
    const hierarchical *self = (const hierarchical *)op;
    const wavelet_plan *plan = &self->plan;
    const size_t n = op->n, C = op->n_channels, n_threads = op->n_threads;
    float *X = work_area_take(&work, n_rhs * n * sizeof *X);
    float *from = work_area_take(&work, n_rhs * plan->n_used * sizeof *from);
    float *to = work_area_take(&work, n_rhs * plan->n_used * sizeof *to);
    float *slots = work_area_take(&work, n_rhs * wavelet_plan_work(plan) * sizeof *slots);
    for (size_t c = 0; c < C; c++) {
        const float *left = self->left + c * n, *root = self->root_area;
        if (are_dark(in + c * n, n, C * n, n_rhs)) {
            for (size_t v = 0; v < n_rhs; v++) memset(out + (v * C + c) * n, 0, n * sizeof *out);
            continue;
        }
        scale(n_rhs, n, adjoint ? left : root, in + c * n, C * n, X, n, n_threads);
        wavelet_plan_forward(plan, n_rhs, X, from, slots, n_threads);
        multiply_core(self, c, n_rhs, from, to, work);
        wavelet_plan_inverse(plan, n_rhs, to, X, slots, n_threads);
        scale(n_rhs, n, adjoint ? root : left, X, n, out + c * n, C * n, n_threads);
        for (size_t v = 0; v < n_rhs; v++) {
            const size_t row = (v * C + c) * n;
            if (n_rhs > 1 && is_dark(in + row, n)) memset(out + row, 0, n * sizeof *out);
            const double sum = mean_correction_sum(&self->even, c, adjoint, root, in + row);
            mean_correction_add(&self->even, c, adjoint, root, sum, out + row);
        }
    }
}

static void hierarchical_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    apply(op, false, n_rhs, E, P, work);
}

/* Where more than one in so many steps is needed, the whole answer is as quick. */
enum { SOME_STEPS = 4 };

/* For some elements: only their ancestors in the tree and the rows of K of these. */
static void hierarchical_apply_selected(const lam_operator *op, size_t n_rhs, const float *E,
                                        size_t n_selected, const uint32_t *selected, float *P, void *work) {
    const hierarchical *self = (const hierarchical *)op;
    const wavelet_plan *plan = &self->plan;
    const size_t n = op->n, C = op->n_channels, used = plan->n_used, n_threads = op->n_threads;
    float *X = work_area_take(&work, n_rhs * n * sizeof *X);
    float *from = work_area_take(&work, n_rhs * used * sizeof *from);
    float *to = work_area_take(&work, n_rhs * used * sizeof *to);
    float *slots = work_area_take(&work, n_rhs * wavelet_plan_work(plan) * sizeof *slots);
    uint32_t *steps = work_area_take(&work, plan->n_steps * sizeof *steps);
    uint32_t *rows = work_area_take(&work, used * sizeof *rows);
    uint32_t *positions = work_area_take(&work, n * sizeof *positions);
    uint8_t *flags = work_area_take(&work, plan->n_steps);
    size_t n_steps = plan->n_steps, n_rows = used;
    memset(flags, 0, plan->n_steps);
    const bool few = n_selected <= n;
    for (size_t r = 0; few && r < n_selected; r++)
        positions[r] = (uint32_t)operator_position(op, selected[r]);
    if (few) n_steps = wavelet_plan_paths(plan, n_selected, positions, flags, steps);
    const bool some = few && n_steps * SOME_STEPS < plan->n_steps;
    if (some) n_rows = wavelet_plan_coefficients(plan, n_steps, steps, rows);
    for (size_t c = 0; c < C; c++) {
        const float *left = self->left + c * n;
        if (are_dark(E + c * n, n, C * n, n_rhs)) {
            for (size_t v = 0; v < n_rhs; v++)
                memset(P + (v * C + c) * n_selected, 0, n_selected * sizeof *P);
            continue;
        }
        scale(n_rhs, n, self->root_area, E + c * n, C * n, X, n, n_threads);
        wavelet_plan_forward(plan, n_rhs, X, from, slots, n_threads);
        if (!some) {
            multiply_core(self, c, n_rhs, from, to, work);
            wavelet_plan_inverse(plan, n_rhs, to, X, slots, n_threads);
        }
        for (size_t v = 0; v < n_rhs; v++) {
            if (is_dark(E + (v * C + c) * n, n)) {
                memset(P + (v * C + c) * n_selected, 0, n_selected * sizeof *P);
                continue;
            }
            if (some && tiled_few_columns(&self->K[c], from + v * used))
                tiled_multiply_columns(&self->K[c], from + v * used, to, work);
            else if (some)
                tiled_multiply_rows(&self->K[c], n_rows, rows, from + v * used, to, work);
            if (some) wavelet_plan_inverse_some(plan, n_steps, steps, to, X + v * n, slots);
            const mean_correction *even = &self->even;
            const float *lift = even->missing != NULL ? even->lift + c * n : NULL;
            const float sum =
                (float)mean_correction_sum(even, c, false, self->root_area, E + (v * C + c) * n);
            for (size_t r = 0; r < n_selected; r++) {
                const size_t p = operator_position(op, selected[r]);
                const float found = left[p] * X[v * n + p];
                P[(v * C + c) * n_selected + r] = lift != NULL ? found + sum * lift[p] : found;
            }
        }
    }
}

static void hierarchical_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    apply(op, true, n_rhs, g, w, work);
}

static void hierarchical_describe(const lam_operator *op, operator_description *description) {
    const hierarchical *self = (const hierarchical *)op;
    const double whole = (double)op->n * (double)op->n * (double)op->n_channels;
    for (size_t c = 0; c < op->n_channels; c++) description->bytes += tiled_bytes(&self->K[c]);
    description->bytes += mean_correction_bytes(&self->even);
    description->bytes += wavelet_plan_bytes(&self->plan) + (1 + op->n_channels) * op->n * sizeof(float);
    description->precision = "i8"; /* of K */
    description->density = self->n_numbers / whole;
}

const operator_kind operator_hierarchical = {
    .name = "hierarchical",
    .load = hierarchical_load,
    .save = hierarchical_save,
    .work_bytes = hierarchical_work_bytes,
    .apply = hierarchical_apply,
    .apply_selected = hierarchical_apply_selected,
    .apply_adjoint = hierarchical_apply_adjoint,
    .destroy = hierarchical_destroy,
    .describe = hierarchical_describe,
    /* Both triangles in tiles, of 12 bytes each; the store has of one triangle two bytes for a tile and one
     * for each number in it, of which there are three or four. */
    .unpacked = 5,
};
