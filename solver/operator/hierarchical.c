/* kind "hierarchical": H = A^-1/2 W^T K W A^1/2 E, with W a basis of multiwavelets on a tree of clusters
 * (Gortler et al. 1993; Beylkin et al. 1991) and K sparse, as most of its coefficients lie below the
 * threshold. An answer is two transforms of O(n) and a product with K. */
#include "solver/operator/hierarchical.h"

#include "solver/operator/hierarchical_wide.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
    free(self->of_channel);
    free(self->groups);
    free(self->step);
    free(self->root_area);
    free(self->left);
    free(self->left_of_element);
    mean_correction_free(&self->even);
    wavelet_plan_free(&self->plan);
    free(self->runs);
    free(self->first_run);
    wavelets_free(&self->basis);
}

/* The shared part, areas, room for K, of which each channel has its own so far. */
static lam_status start(size_t n, size_t n_channels, const float *reflectance, const double *area,
                        const uint32_t *order, hierarchical **out, lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_hierarchical;
    TRY(operator_init(&self->base, &operator_hierarchical, n, n_channels, reflectance, error));
    self->root_area = memory_allocate(n, sizeof *self->root_area, "operator", error);
    self->K = memory_allocate(n_channels, sizeof *self->K, "operator", error);
    self->of_channel = memory_allocate(n_channels, sizeof *self->of_channel, "operator", error);
    self->left = memory_allocate(n_channels, n * sizeof *self->left, "operator", error);
    self->left_of_element = memory_allocate(n_channels, n * sizeof *self->left_of_element, "operator", error);
    if (self->root_area == NULL || self->left == NULL || self->left_of_element == NULL || self->K == NULL ||
        self->of_channel == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < n_channels; c++) self->of_channel[c] = c;
    TRY(operator_set_order(&self->base, order, error));
    for (size_t p = 0; p < n; p++) {
        self->root_area[p] = (float)sqrt(area[p]);
        if (!(self->root_area[p] > 0 && self->root_area[p] < INFINITY))
            FAIL(error, LAM_ERR_NUMERIC, "area of position %zu = %g, must be above 0", p, area[p]);
        const size_t i = self->base.order != NULL ? self->base.order[p] : p;
        for (size_t c = 0; c < n_channels; c++)
            self->left_of_element[c * n + i] = self->left[c * n + p] =
                operator_reflectance_or_one(&self->base, c, p) / self->root_area[p];
    }
    *out = self;
    self = NULL;
done:
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* Makes the lift of the correction of the mean error. */
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

/* Takes the tiles of a channel, and of those that share them, over, and frees them. */
static lam_status take_tiles(hierarchical *self, size_t c, tile_matrix *tiles, lam_error *error) {
    for (size_t k = 0; k < self->base.n_channels; k++)
        if (self->of_channel[k] == c) self->n_numbers += (double)tile_matrix_numbers(tiles);
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
        for (size_t i = 0; i < K[c].n; i++)
            for (uint64_t e = K[c].indptr[i]; e < K[c].indptr[i + 1]; e++) {
                const float value = K[c].data[e];
                if (!isfinite(value))
                    FAIL(error, LAM_ERR_NUMERIC, "K[%zu] = %g, must be finite", (size_t)e, (double)value);
                if (value == 0) continue;
                used[i] = used[K[c].indices[e]] = true;
                largest = fmaxf(largest, fabsf(value));
            }
    TRY(wavelet_plan_create(&self->basis, used, &self->plan, error));
    TRY(hierarchical_wide_prepare(self, error));
    TRY(hierarchical_groups(&self->plan, step, (float)sqrt((double)largest / most_steps), &self->n_groups,
                            &self->groups, &self->step, error));
    for (size_t c = 0; c < C; c++) {
        if (self->of_channel[c] != c) continue;
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
    for (size_t c = 0; c < n_channels; c++)
        if (arrays->K[c].n == 0) self->of_channel[c] = operator_like_channel(n, reflectance, c);
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
    TRY(hierarchical_wide_prepare(self, error));
    if (count != self->plan.n_used)
        FAIL(error, LAM_ERR_NUMERIC,
             "groups/rows has %zu coefficients, must have all %zu of its nodes and of the root", count,
             self->plan.n_used);
    for (size_t c = 0; c < self->base.n_channels; c++) {
        snprintf(group, sizeof group, STORE_OPERATOR "/K/%zu", c);
        if (!store_has(s, group)) self->of_channel[c] = operator_like_channel(n, self->base.reflectance, c);
    }
    for (size_t c = 0; c < self->base.n_channels; c++) {
        if (self->of_channel[c] != c) continue;
        snprintf(group, sizeof group, STORE_OPERATOR "/K/%zu", c);
        TRY(hierarchical_load_tiles(s, group, self->n_groups, self->groups, &tiles, error));
        TRY(take_tiles(self, c, &tiles, error));
    }
done:
    free(used);
    return status;
}

/* Areas in the order of positions, and that order; NULL: mesh order. */
static lam_status read_area(store *s, size_t n, double **out, uint32_t **out_order, lam_error *error) {
    lam_status status = LAM_OK;
    void *area = NULL, *order = NULL;
    double *placed = memory_allocate(n, sizeof *placed, "operator", error);
    size_t dims[STORE_MAX_RANK] = {n};
    if (placed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_read(s, STORE_MESH "/area", STORE_F64, 1, dims, &area, error));
    if (store_has(s, STORE_OPERATOR "/order"))
        TRY(store_read(s, STORE_OPERATOR "/order", STORE_U32, 1, dims, &order, error));
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
    TRY(wavelets_load(s, STORE_OPERATOR "/basis", n, &self->basis, error));
    TRY(mean_correction_load(s, n, n_channels, &self->even, error));
    TRY(lift_even_light(self, error));
    TRY(load_tiles(self, s, error));
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
    TRY(wavelets_save(&self->basis, STORE_OPERATOR "/basis", s, error));
    TRY(hierarchical_save_groups(self->n_groups, self->groups, self->step, s, error));
    for (size_t c = 0; c < op->n_channels; c++) {
        if (self->of_channel[c] != c) continue;
        snprintf(group, sizeof group, STORE_OPERATOR "/K/%zu", c);
        TRY(tiled_upper(&self->K[c], &tiles, error));
        TRY(hierarchical_save_tiles(&tiles, self->n_groups, group, s, error));
        tile_matrix_free(&tiles);
    }
    TRY(mean_correction_save(&self->even, s, error));
done:
    tile_matrix_free(&tiles);
    return status;
}

static void hierarchical_describe(const lam_operator *op, operator_description *description) {
    const hierarchical *self = (const hierarchical *)op;
    const double whole = (double)op->n * (double)op->n * (double)op->n_channels;
    for (size_t c = 0; c < op->n_channels; c++)
        if (self->of_channel[c] == c) description->bytes += tiled_bytes(&self->K[c]);
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
    .apply_adjoint = hierarchical_apply_adjoint,
    .answer = hierarchical_answer,
    .answer_selected = hierarchical_answer_selected,
    .destroy = hierarchical_destroy,
    .describe = hierarchical_describe,
    /* Both triangles in tiles, of 12 bytes each; the store has of one triangle two bytes for a tile and one
     * for each number in it, of which there are three or four. */
    .unpacked = 5,
};
