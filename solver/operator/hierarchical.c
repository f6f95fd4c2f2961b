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
    hierarchical_unmake(self);
    hierarchical_rest_free(self->rest);
    free(self->K);
    free(self->of_channel);
}

lam_status hierarchical_begin(size_t n, size_t n_channels, const float *reflectance, hierarchical **out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_hierarchical;
    TRY(operator_init(&self->base, &operator_hierarchical, n, n_channels, reflectance, error));
    self->K = memory_allocate(n_channels, sizeof *self->K, "operator", error);
    self->of_channel = memory_allocate(n_channels, sizeof *self->of_channel, "operator", error);
    if (self->K == NULL || self->of_channel == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < n_channels; c++) self->of_channel[c] = c;
    *out = self;
    self = NULL;
done:
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

lam_status hierarchical_set_area(hierarchical *self, const uint32_t *order, const double *area,
                                 bool by_position, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = self->base.n, C = self->base.n_channels;
    TRY(operator_set_order(&self->base, order, error));
    self->root_area = memory_allocate(n, sizeof *self->root_area, "operator", error);
    self->left = memory_allocate(C, n * sizeof *self->left, "operator", error);
    self->left_of_element = memory_allocate(C, n * sizeof *self->left_of_element, "operator", error);
    if (self->root_area == NULL || self->left == NULL || self->left_of_element == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) {
        const size_t i = self->base.order != NULL ? self->base.order[p] : p;
        const double A = area[by_position ? p : i];
        self->root_area[p] = (float)sqrt(A);
        if (!(self->root_area[p] > 0 && self->root_area[p] < INFINITY))
            FAIL(error, LAM_ERR_NUMERIC, "area of position %zu = %g, must be above 0", p, A);
        for (size_t c = 0; c < C; c++)
            self->left_of_element[c * n + i] = self->left[c * n + p] =
                operator_reflectance_or_one(&self->base, c, p) / self->root_area[p];
    }
done:
    return status;
}

lam_status hierarchical_lift(hierarchical *self, lam_error *error) {
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
    TRY(hierarchical_lift(self, error));
done:
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
        TRY(tiled_create(&tiles, self->n_groups, self->groups, self->step, &self->K[c], error));
        tile_matrix_free(&tiles);
    }
done:
    tile_matrix_free(&tiles);
    free(used);
    return status;
}

lam_status operator_hierarchical_create(size_t n, size_t n_channels, const float *reflectance,
                                        const double *area, const uint32_t *order,
                                        hierarchical_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = NULL;
    TRY(hierarchical_begin(n, n_channels, reflectance, &self, error));
    TRY(hierarchical_set_area(self, order, area, true, error));
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

static lam_status hierarchical_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const hierarchical *self = (const hierarchical *)op;
    TRY(wavelets_save(&self->basis, STORE_OPERATOR "/basis", s, error));
    TRY(store_write(s, STORE_OPERATOR "/groups/rows", STORE_U32, 2, (const size_t[]){self->n_groups, 2},
                    self->groups, error));
    TRY(store_write(s, STORE_OPERATOR "/groups/step", STORE_F32, 1, &self->n_groups, self->step, error));
    for (size_t c = 0; c < op->n_channels; c++) {
        char group[48];
        if (self->of_channel[c] != c) continue;
        snprintf(group, sizeof group, STORE_OPERATOR "/K/%zu", c);
        TRY(tiled_save(&self->K[c], group, s, error));
    }
    TRY(mean_correction_save(&self->even, s, error));
done:
    return status;
}

static void hierarchical_describe(const lam_operator *op, operator_description *description) {
    const hierarchical *self = (const hierarchical *)op;
    const double whole = (double)op->n * (double)op->n * (double)op->n_channels;
    double numbers = 0;
    for (size_t c = 0; c < op->n_channels; c++) {
        numbers += (double)self->K[self->of_channel[c]].n_numbers;
        if (self->of_channel[c] == c) description->bytes += tiled_bytes(&self->K[c]);
    }
    description->bytes += mean_correction_bytes(&self->even);
    description->bytes += wavelet_plan_bytes(&self->plan) + (1 + op->n_channels) * op->n * sizeof(float);
    description->precision = "i8"; /* of K */
    description->density = numbers / whole;
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
    .prepare = hierarchical_prepare,
    .memory = hierarchical_memory,
};
