/* kind "emitters": the light of s emitters, each alone (Aguerre 2016, section 4.4.3). An answer adds up what
 * is stored: O(ns). Making, loading and saving; what it answers is in emitters_apply.c. */
#include "solver/operator/emitters.h"

#include "solver/base/work_area.h"
#include "solver/linalg/csr.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/sky_light.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

lam_status emitter_names_copy(size_t s, const char *const *names, char ***out, lam_error *error) {
    size_t bytes = s * sizeof(char *);
    for (size_t k = 0; k < s; k++) bytes += strlen(names[k]) + 1;
    *out = memory_allocate(bytes, 1, "names of emitters", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    char *text = (char *)(*out + s);
    for (size_t k = 0; k < s; k++) {
        (*out)[k] = text;
        text = stpcpy(text, names[k]) + 1;
    }
    return LAM_OK;
}

void emitter_arrays_free(emitter_arrays *a) {
    free(a->names);
    free(a->T);
    free(a->ends);
    free(a->elements);
    free(a->values);
    free(a->L);
    lam_sky_close(a->sky);
    free(a->direct);
    free(a->exitance);
    lam_luminaires_close(a->luminaires);
    *a = (emitter_arrays){.s = 0};
}

static void emitters_destroy(lam_operator *op) {
    emitters *self = (emitters *)op;
    for (size_t c = 0; self->T != NULL && c < op->n_channels; c++) panel_free(&self->T[c]);
    free(self->T);
    free(self->own);
    free(self->own_value);
    emitter_arrays_free(&self->a);
}

const emitters *operator_emitters_of(const lam_operator *op) {
    return op->kind == &operator_emitters ? (const emitters *)op : NULL;
}

static lam_status check_light(const emitter_arrays *a, size_t n, size_t n_channels, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t rows = n_channels * a->s;
    if (a->s == 0) FAIL(error, LAM_ERR_FORMAT, STORE_OPERATOR "/names is empty, there must be an emitter");
    if (a->ends[0] != 0) FAIL(error, LAM_ERR_FORMAT, STORE_OPERATOR "/E/indptr[0] must be 0");
    for (size_t row = 0; row < rows; row++) {
        if (a->ends[row + 1] < a->ends[row] || a->ends[row + 1] > a->ends[rows])
            FAIL(error, LAM_ERR_FORMAT, STORE_OPERATOR "/E: emission %zu ends before it begins", row);
        for (uint64_t e = a->ends[row]; e < a->ends[row + 1]; e++) {
            if (a->elements[e] >= n || (e > a->ends[row] && a->elements[e] <= a->elements[e - 1]))
                FAIL(error, LAM_ERR_FORMAT,
                     STORE_OPERATOR "/E: emission %zu has element %u, must ascend and be below %zu", row,
                     (unsigned)a->elements[e], n);
            if (!(a->values[e] > 0 && isfinite(a->values[e])))
                FAIL(error, LAM_ERR_NUMERIC,
                     STORE_OPERATOR "/E: emission %zu has the value %g, must be above 0", row,
                     (double)a->values[e]);
        }
    }
    for (size_t k = 0; a->L != NULL && k < rows * a->n_tiles; k++)
        if (!(a->L[k] >= 0 && isfinite(a->L[k])))
            FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/L[%zu] = %g, must be at least 0", k,
                 (double)a->L[k]);
    if (a->L != NULL &&
        (a->sky == NULL || lam_sky_tiles(a->sky) != a->n_tiles || lam_sky_elements(a->sky) != n))
        FAIL(error, LAM_ERR_FORMAT, STORE_OPERATOR "/L is of %zu tiles, the store's sky is not", a->n_tiles);
    if (a->luminaires != NULL &&
        (emitters_luminaires(a) > a->s || lam_luminaires_elements(a->luminaires) != n ||
         lam_luminaires_channels(a->luminaires) != n_channels))
        FAIL(error, LAM_ERR_FORMAT, STORE_OPERATOR "/names: %zu luminaires do not fit %zu emitters",
             emitters_luminaires(a), a->s);
    for (size_t k = 0; a->direct != NULL && k < a->s * n; k++)
        if (!(a->direct[k] >= 0 && isfinite(a->direct[k])))
            FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/direct[%zu] = %g, must be at least 0", k,
                 (double)a->direct[k]);
    for (size_t c = 0; a->direct != NULL && c < n_channels; c++)
        if (!(a->exitance[c] >= 0 && isfinite(a->exitance[c])))
            FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/exitance[%zu] = %g, must be at least 0", c,
                 (double)a->exitance[c]);
done:
    return status;
}

/* Panels of T: the file has 1 + T where an element emits 1 itself, and is rounded so here already, so that
 * saving and loading change nothing. */
static lam_status make_panels(emitters *self, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = self->base.n, s = self->a.s, C = self->base.n_channels;
    char name[48];
    float *rows = NULL;
    for (size_t row = 0; row < C * s; row++)
        for (uint64_t e = self->a.ends[row]; e < self->a.ends[row + 1]; e++) {
            float *T = &self->a.T[row * n + self->a.elements[e]];
            const float whole = *T + self->a.values[e];
            *T = whole - self->a.values[e];
        }
    rows = memory_allocate(n, s * sizeof *rows, "operator", error);
    self->T = memory_allocate(C, sizeof *self->T, "operator", error);
    if (rows == NULL || self->T == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++) {
        for (size_t first = 0; first < n; first += 64) /* a few rows of rows, read from every column */
            for (size_t k = 0; k < s; k++)
                for (size_t i = first; i < n && i < first + 64; i++)
                    rows[i * s + k] = self->a.T[(c * s + k) * n + i];
        snprintf(name, sizeof name, STORE_OPERATOR "/B[%zu]", c);
        TRY(panel_create(n, s, rows, name, &self->T[c], error));
    }
    free(self->a.T);
    self->a.T = NULL;
done:
    free(rows);
    return status;
}

/* Finds for each emitter a place where no other emitter sends anything: there an emission shows its weight.
 */
static lam_status find_own(emitters *self, lam_error *error) {
    const size_t n = self->base.n, s = self->a.s, m = self->a.n_tiles, C = self->base.n_channels;
    const emitter_arrays *a = &self->a;
    self->own = memory_allocate(C * s, sizeof *self->own, "operator", error);
    self->own_value = memory_allocate(C * s, sizeof *self->own_value, "operator", error);
    uint32_t *senders = memory_allocate(n + m, sizeof *senders, "operator", error);
    if (self->own == NULL || self->own_value == NULL || senders == NULL) {
        free(senders);
        return LAM_ERR_MEMORY;
    }
    for (size_t c = 0; c < C; c++) {
        memset(senders, 0, (n + m) * sizeof *senders);
        for (uint64_t e = a->ends[c * s]; e < a->ends[(c + 1) * s]; e++) senders[a->elements[e]]++;
        for (size_t k = 0; a->L != NULL && k < s; k++)
            for (size_t t = 0; t < m; t++) senders[n + t] += a->L[(c * s + k) * m + t] > 0;
        for (size_t row = c * s; row < (c + 1) * s; row++) {
            self->own[row] = EMITTERS_NONE;
            for (uint64_t e = a->ends[row]; e < a->ends[row + 1]; e++)
                if (senders[a->elements[e]] == 1 && a->values[e] > self->own_value[row]) {
                    self->own[row] = a->elements[e];
                    self->own_value[row] = a->values[e];
                }
            for (size_t t = 0; a->L != NULL && self->own[row] == EMITTERS_NONE && t < m; t++)
                if (senders[n + t] == 1 && a->L[row * m + t] > 0) {
                    self->own[row] = (uint32_t)(n + t);
                    self->own_value[row] = a->L[row * m + t];
                }
        }
    }
    free(senders);
    return LAM_OK;
}

lam_status operator_emitters_create(size_t n, size_t n_channels, const float *reflectance,
                                    emitter_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    emitters *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_emitters;
    TRY(operator_init(&self->base, &operator_emitters, n, n_channels, reflectance, error));
    TRY(check_light(arrays, n, n_channels, error));
    self->a = *arrays;
    *arrays = (emitter_arrays){.s = 0};
    TRY(make_panels(self, error));
    TRY(find_own(self, error));
    *op = &self->base;
    self = NULL;
done:
    emitter_arrays_free(arrays);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

static lam_status load_emission(store *s, size_t rows, emitter_arrays *a, lam_error *error) {
    csr E;
    const lam_status status = csr_load(s, STORE_OPERATOR "/E", rows, &E, error);
    if (status != LAM_OK) return status;
    a->ends = E.indptr;
    a->elements = E.indices;
    a->values = E.data;
    return LAM_OK;
}

/* The last emitters are the store's luminaires, as an attribute says. */
static lam_status load_luminaires(store *s, size_t n, size_t n_channels, emitter_arrays *a,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    int64_t count = 0;
    if (store_has_attribute(s, STORE_OPERATOR, "luminaires"))
        TRY(store_get_integer(s, STORE_OPERATOR, "luminaires", &count, error));
    TRY(luminaires_load(s, n, n_channels, &a->luminaires, error));
    const size_t k = emitters_luminaires(a);
    if (count < 0 || (size_t)count != k || k > a->s)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: " STORE_OPERATOR " counts %lld luminaires among %zu emitters, " STORE_LUMINAIRES " has %zu",
             store_path(s), (long long)count, a->s, k);
    for (size_t j = 0; j < k; j++)
        if (strcmp(lam_luminaires_name(a->luminaires, j), a->names[a->s - k + j]) != 0)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: emitter %zu is %.60s, and luminaire %zu is %.60s, must be the same", store_path(s),
                 a->s - k + j, a->names[a->s - k + j], j, lam_luminaires_name(a->luminaires, j));
done:
    return status;
}

static lam_status emitters_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    emitter_arrays a = {.s = 0};
    void *data = NULL;
    size_t dims[STORE_MAX_RANK] = {n_channels, SIZE_MAX, n};
    TRY(store_read_texts(s, STORE_OPERATOR "/names", &a.s, &a.names, error));
    dims[1] = a.s;
    TRY(store_read(s, STORE_OPERATOR "/B", STORE_F32, 3, dims, &data, error));
    a.T = data;
    data = NULL;
    TRY(load_emission(s, n_channels * a.s, &a, error));
    for (size_t row = 0; row < n_channels * a.s; row++)
        for (uint64_t e = a.ends[row]; e < a.ends[row + 1] && e < a.ends[n_channels * a.s]; e++)
            if (a.elements[e] < n) a.T[row * n + a.elements[e]] -= a.values[e];
    if (store_has(s, STORE_OPERATOR "/L")) {
        size_t tiles[STORE_MAX_RANK] = {n_channels, a.s, SIZE_MAX};
        TRY(store_read(s, STORE_OPERATOR "/L", STORE_F32, 3, tiles, &data, error));
        a.L = data;
        data = NULL;
        a.n_tiles = tiles[2];
        TRY(sky_load(s, n, &a.sky, error));
    }
    if (store_has(s, STORE_OPERATOR "/direct")) {
        size_t direct[STORE_MAX_RANK] = {a.s, n}, channels[STORE_MAX_RANK] = {n_channels};
        TRY(store_read(s, STORE_OPERATOR "/direct", STORE_F32, 2, direct, &data, error));
        a.direct = data;
        data = NULL;
        TRY(store_read(s, STORE_OPERATOR "/exitance", STORE_F32, 1, channels, &data, error));
        a.exitance = data;
        data = NULL;
    }
    TRY(load_luminaires(s, n, n_channels, &a, error));
    TRY(operator_emitters_create(n, n_channels, reflectance, &a, op, error));
done:
    free(data);
    emitter_arrays_free(&a);
    return status;
}

static lam_status emitters_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const emitters *self = (const emitters *)op;
    const emitter_arrays *a = &self->a;
    const size_t n = op->n, C = op->n_channels, rows = C * a->s;
    const csr E = {.n = rows, .indptr = a->ends, .indices = a->elements, .data = a->values};
    const size_t dims[3] = {C, a->s, n}, tiles[3] = {C, a->s, a->n_tiles};
    float *B = memory_allocate(rows, n * sizeof *B, STORE_OPERATOR "/B", error), *by_row = NULL;
    by_row = memory_allocate(n, a->s * sizeof *by_row, STORE_OPERATOR "/B", error);
    if (B == NULL || by_row == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++) {
        panel_copy_rows(&self->T[c], by_row);
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < a->s; k++) B[(c * a->s + k) * n + i] = by_row[i * a->s + k];
    }
    for (size_t row = 0; row < rows; row++)
        for (uint64_t e = a->ends[row]; e < a->ends[row + 1]; e++)
            B[row * n + a->elements[e]] += a->values[e];
    TRY(store_write_texts(s, STORE_OPERATOR "/names", a->s, (const char *const *)a->names, error));
    TRY(store_write(s, STORE_OPERATOR "/B", STORE_F32, 3, dims, B, error));
    TRY(csr_save(&E, STORE_OPERATOR "/E", s, error));
    if (a->L != NULL) TRY(store_write(s, STORE_OPERATOR "/L", STORE_F32, 3, tiles, a->L, error));
    if (a->direct != NULL) {
        TRY(store_write(s, STORE_OPERATOR "/direct", STORE_F32, 2, dims + 1, a->direct, error));
        TRY(store_write(s, STORE_OPERATOR "/exitance", STORE_F32, 1, dims, a->exitance, error));
    }
    if (a->luminaires != NULL)
        TRY(store_set_integer(s, STORE_OPERATOR, "luminaires", (int64_t)emitters_luminaires(a), error));
done:
    free(B);
    free(by_row);
    return status;
}

static size_t emitters_work_bytes(const lam_operator *op, size_t n_rhs) {
    const emitters *self = (const emitters *)op;
    const size_t panels = panel_work_bytes(&self->T[0], n_rhs);
    size_t vectors, tiles, total = panels;
    if (panels == 0 || !size_multiply(n_rhs * op->n_channels, op->n * sizeof(float), &vectors) ||
        !size_multiply(n_rhs * op->n_channels, self->a.n_tiles * sizeof(float), &tiles) ||
        !work_area_add(&total, vectors) || !work_area_add(&total, tiles) ||
        !work_area_add(&total, op->n * sizeof(float)))
        return 0;
    return total;
}

static void emitters_set_threads(lam_operator *op, size_t n_threads) {
    emitters *self = (emitters *)op;
    for (size_t c = 0; c < op->n_channels; c++) self->T[c].n_threads = n_threads;
}

static void emitters_describe(const lam_operator *op, operator_description *description) {
    const emitters *self = (const emitters *)op;
    for (size_t c = 0; c < op->n_channels; c++) description->bytes += panel_bytes(&self->T[c]);
}

const operator_kind operator_emitters = {
    .name = "emitters",
    .load = emitters_load,
    .save = emitters_save,
    .work_bytes = emitters_work_bytes,
    .set_threads = emitters_set_threads,
    .destroy = emitters_destroy,
    .describe = emitters_describe,
};
