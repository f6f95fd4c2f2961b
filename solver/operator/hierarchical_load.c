/* Reads hierarchical operators. Of a mapped store an operator takes K, which is most of it, as it lies in the
 * file; all else is made once to check it, freed, and made again of mapped arrays when an answer first needs
 * it, so that a daemon has little memory of its own for scenes that nobody asks for. */
#include "solver/operator/hierarchical.h"
#include "solver/operator/hierarchical_wide.h"
#include "store/groups.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct hierarchical_rest {
    hierarchical *self;
    hierarchical_source source;
    pthread_mutex_t lock; /* of the making */
    atomic_bool made;
};

static void source_free(hierarchical_source *from) {
    store_view *views[] = {&from->order, &from->area, &from->missing, &from->light, &from->rows, &from->step};
    for (size_t k = 0; k < sizeof views / sizeof *views; k++) store_view_free(views[k]);
    wavelet_arrays_free(&from->basis);
}

void hierarchical_rest_free(hierarchical_rest *rest) {
    if (rest == NULL) return;
    source_free(&rest->source);
    pthread_mutex_destroy(&rest->lock);
    free(rest);
}

static lam_status read_source(store *s, size_t n, size_t n_channels, hierarchical_source *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical_source read = {.ordered = store_has(s, STORE_OPERATOR "/order")};
    size_t of_n[] = {n}, of_channels[] = {n_channels}, halves[] = {n_channels, n},
           rows[STORE_MAX_RANK] = {SIZE_MAX, 2};
    TRY(store_read_view(s, STORE_MESH "/area", STORE_F64, 1, of_n, &read.area, error));
    if (read.ordered)
        TRY(store_read_view(s, STORE_OPERATOR "/order", STORE_U32, 1, of_n, &read.order, error));
    TRY(wavelets_read(s, STORE_OPERATOR "/basis", &read.basis, error));
    if (store_has(s, STORE_OPERATOR "/missing")) {
        TRY(store_read_view(s, STORE_OPERATOR "/missing", STORE_F16, 2, halves, &read.missing, error));
        TRY(store_read_view(s, STORE_OPERATOR "/even_light", STORE_F64, 1, of_channels, &read.light, error));
    }
    TRY(store_read_view(s, STORE_OPERATOR "/groups/rows", STORE_U32, 2, rows, &read.rows, error));
    TRY(store_read_view(s, STORE_OPERATOR "/groups/step", STORE_F32, 1, rows, &read.step, error));
    read.n_groups = rows[0];
    *out = read;
    read = (hierarchical_source){.n_groups = 0};
done:
    source_free(&read);
    return status;
}

/* The largest step: a number of it and of four digits, and sums of them, are finite. */
static const float step_most = 0x1p40f;

/* Copies groups and steps, and marks in used [n] the coefficients that they hold. */
static lam_status make_groups(hierarchical *self, const hierarchical_source *from, bool *used, size_t *count,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = self->base.n, n_groups = from->n_groups;
    size_t end = 0;
    tile_group *groups = self->groups = memory_allocate(n_groups, sizeof *groups, "operator", error);
    float *step = self->step = memory_allocate(n_groups, sizeof *step, "operator", error);
    if (groups == NULL || step == NULL) TRY(LAM_ERR_MEMORY);
    if (n_groups > 0) memcpy(groups, from->rows.data, n_groups * sizeof *groups);
    if (n_groups > 0) memcpy(step, from->step.data, n_groups * sizeof *step);
    for (size_t g = 0; g < n_groups; g++) {
        if (groups[g].first < end || groups[g].size < 1 || groups[g].size > TILE ||
            (size_t)groups[g].first + groups[g].size > n)
            FAIL(error, LAM_ERR_NUMERIC,
                 "groups/rows[%zu] = %u, %u: must have 1 to %d rows of %zu behind those of the group before",
                 g, (unsigned)groups[g].first, (unsigned)groups[g].size, TILE, n);
        if (!(step[g] > 0 && step[g] <= step_most))
            FAIL(error, LAM_ERR_NUMERIC, "groups/step[%zu] = %g, must be above 0 and at most %g", g,
                 (double)step[g], (double)step_most);
        end = (size_t)groups[g].first + groups[g].size;
        for (size_t i = groups[g].first; i < end; i++) used[i] = true;
        *count += groups[g].size;
    }
done:
    return status;
}

/* Sets the pointers of a plan or a correction that was made before, whose numbers other threads may read. */
static lam_status take_plan(hierarchical *self, wavelet_plan *made, lam_error *error) {
    wavelet_plan *plan = &self->plan;
    if (plan->n_steps == 0) {
        *plan = *made;
        return LAM_OK;
    }
    if (plan->n_used != made->n_used || plan->n_steps != made->n_steps || plan->n_pieces != made->n_pieces ||
        plan->n_above != made->n_above || plan->n_numbers != made->n_numbers ||
        plan->most_steps != made->most_steps || plan->most_positions != made->most_positions ||
        plan->n_leaves != made->n_leaves) {
        wavelet_plan_free(made);
        return status_fail(error, LAM_ERR_NUMERIC, "groups/rows has other coefficients than before");
    }
    plan->steps = made->steps;
    plan->matrices = made->matrices;
    plan->coefficient = made->coefficient;
    plan->leaves = made->leaves;
    plan->pieces = made->pieces;
    plan->above = made->above;
    return LAM_OK;
}

static lam_status make_correction(hierarchical *self, const hierarchical_source *from, lam_error *error) {
    lam_status status = LAM_OK;
    mean_correction made = {.n = 0};
    if (from->missing.data == NULL) return LAM_OK;
    TRY(mean_correction_of_halves(self->base.n, self->base.n_channels, from->missing.data, from->light.data,
                                  &made, error));
    if (self->even.n == 0) {
        self->even = made;
    } else {
        self->even.missing = made.missing;
        self->even.light = made.light;
    }
    TRY(hierarchical_lift(self, error));
done:
    return status;
}

lam_status hierarchical_make(hierarchical *self, const hierarchical_source *from, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = self->base.n;
    size_t count = 0;
    wavelet_plan plan = {.n = 0};
    bool *used = memory_allocate(n, sizeof *used, "operator", error);
    if (used == NULL) TRY(LAM_ERR_MEMORY);
    TRY(hierarchical_set_area(self, from->order.data, from->area.data, false, error));
    TRY(wavelets_make(&from->basis, n, &self->basis, error));
    TRY(make_correction(self, from, error));
    TRY(make_groups(self, from, used, &count, error));
    TRY(wavelet_plan_create(&self->basis, used, &plan, error));
    if (count != plan.n_used) {
        const size_t wanted = plan.n_used;
        wavelet_plan_free(&plan);
        FAIL(error, LAM_ERR_NUMERIC,
             "groups/rows has %zu coefficients, must have all %zu of its nodes and of the root", count,
             wanted);
    }
    TRY(take_plan(self, &plan, error));
    TRY(hierarchical_wide_prepare(self, error));
    for (size_t c = 0; c < self->base.n_channels; c++)
        if (self->K[c].begin != NULL) TRY(tiled_set_rows(&self->K[c], self->groups, self->step, error));
done:
    free(used);
    return status;
}

void hierarchical_unmake(hierarchical *self) {
    void *made[] = {self->base.order, self->base.position,   self->groups, self->step,     self->root_area,
                    self->left,       self->left_of_element, self->runs,   self->first_run};
    for (size_t k = 0; k < sizeof made / sizeof *made; k++) free(made[k]);
    self->base.order = self->base.position = self->first_run = NULL;
    self->groups = NULL;
    self->step = self->root_area = self->left = self->left_of_element = NULL;
    self->runs = NULL;
    mean_correction_rest(&self->even);
    wavelet_plan_rest(&self->plan);
    wavelets_free(&self->basis);
    for (size_t c = 0; self->K != NULL && c < self->base.n_channels; c++) tiled_rest(&self->K[c]);
}

/* True where a K has arrays of older stores. */
static bool is_older(store *s, const char *group) {
    char count[64], tile[64];
    snprintf(count, sizeof count, "%s/count", group);
    snprintf(tile, sizeof tile, "%s/tile", group);
    return store_has(s, count) || store_has(s, tile);
}

/* The K of a channel; *in_place: as products read it. */
static lam_status load_K(hierarchical *self, size_t c, store *s, bool *in_place, lam_error *error) {
    lam_status status = LAM_OK;
    char group[48];
    tile_matrix tiles = {.count = {0}};
    snprintf(group, sizeof group, STORE_OPERATOR "/K/%zu", c);
    if (is_older(s, group)) {
        *in_place = false;
        TRY(hierarchical_load_tiles(s, group, self->n_groups, self->groups, &tiles, error));
        TRY(tiled_create(&tiles, self->n_groups, self->groups, self->step, &self->K[c], error));
    } else {
        TRY(tiled_load(s, group, self->plan.n_used, self->n_groups, &self->K[c], error));
        TRY(tiled_set_rows(&self->K[c], self->groups, self->step, error));
    }
done:
    tile_matrix_free(&tiles);
    return status;
}

/* Keeps the source in place of what was made of it. Takes from over on success. */
static lam_status let_rest(hierarchical *self, hierarchical_source *from, lam_error *error) {
    hierarchical_rest *rest = memory_allocate(1, sizeof *rest, "operator", error);
    if (rest == NULL) return LAM_ERR_MEMORY;
    rest->self = self;
    rest->source = *from;
    *from = (hierarchical_source){.n_groups = 0};
    pthread_mutex_init(&rest->lock, NULL);
    atomic_init(&rest->made, false);
    hierarchical_unmake(self);
    self->rest = rest;
    return LAM_OK;
}

lam_status hierarchical_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                             lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    hierarchical *self = NULL;
    hierarchical_source from = {.n_groups = 0};
    bool in_place = store_map_of(s) != NULL;
    TRY(hierarchical_begin(n, n_channels, reflectance, &self, error));
    TRY(read_source(s, n, n_channels, &from, error));
    self->n_groups = from.n_groups;
    status = hierarchical_make(self, &from, error);
    if (status == LAM_ERR_NUMERIC && in_place) {
        /* A block of what is mapped that is not as it was written is the cause, where there is one. */
        const lam_error cause = *error;
        TRY(store_verify_group(s, STORE_OPERATOR, error));
        *error = cause;
        status = LAM_ERR_NUMERIC;
    }
    TRY(status);
    for (size_t c = 0; c < n_channels; c++) {
        char group[48];
        snprintf(group, sizeof group, STORE_OPERATOR "/K/%zu", c);
        if (!store_has(s, group)) self->of_channel[c] = operator_like_channel(n, self->base.reflectance, c);
    }
    for (size_t c = 0; c < n_channels; c++)
        if (self->of_channel[c] == c) TRY(load_K(self, c, s, &in_place, error));
    if (in_place) TRY(let_rest(self, &from, error));
    *op = &self->base;
    self = NULL;
done:
    source_free(&from);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

lam_status hierarchical_prepare(const lam_operator *op, lam_error *error) {
    lam_status status = LAM_OK;
    lam_error cause = {.message = ""};
    hierarchical_rest *rest = ((const hierarchical *)op)->rest;
    if (rest == NULL || atomic_load(&rest->made)) return LAM_OK;
    pthread_mutex_lock(&rest->lock);
    if (!atomic_load(&rest->made)) {
        status = hierarchical_make(rest->self, &rest->source, &cause);
        if (status == LAM_OK)
            atomic_store(&rest->made, true);
        else
            hierarchical_unmake(rest->self);
    }
    pthread_mutex_unlock(&rest->lock);
    if (status == LAM_ERR_NUMERIC)
        return status_fail(error, LAM_ERR_DAMAGED, "the operator's file was changed while it is served: %s",
                           cause.message);
    return status == LAM_OK ? LAM_OK : status_fail(error, status, "%s", cause.message);
}

/* Bytes of memory for a byte of an older store: both triangles in tiles, of 12 bytes each; the store has of
 * one triangle two bytes for a tile and one for each number in it, of which there are three or four. */
enum { UNPACKED = 5 };

/* Bytes that are made of each element, of each of its channels, of a node of the basis and of its shape, all
 * beside K; the most. */
enum { OF_ELEMENT = 48, OF_CHANNEL = 20, OF_NODE = 128, OF_SHAPE = 528 };

uint64_t hierarchical_memory(store *s, uint64_t stored) {
    const uint64_t n = store_array_bytes(s, STORE_MESH "/area") / sizeof(double),
                   values = store_array_bytes(s, STORE_MESH "/reflectance") / sizeof(float),
                   nodes = store_array_bytes(s, STORE_OPERATOR "/basis/node") / sizeof(uint32_t),
                   shapes = store_array_bytes(s, STORE_OPERATOR "/basis/shape") / sizeof(wavelet_shape);
    if (is_older(s, STORE_OPERATOR "/K/0")) return UNPACKED * stored;
    return stored + OF_ELEMENT * n + OF_CHANNEL * values + OF_NODE * nodes + OF_SHAPE * shapes +
           store_array_bytes(s, STORE_OPERATOR "/basis/basis");
}
