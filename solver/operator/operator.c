/* The list of operator kinds, and what all of them share: loading, saving, mesh order.
 * Knows no kind from inside. */
#include "solver/operator/operator.h"
#include "store/groups.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#define OPERATOR_KIND_ADDRESS(name) &operator_##name,
static const operator_kind *const operator_kinds[] = {OPERATOR_KINDS(OPERATOR_KIND_ADDRESS)};

const operator_kind *operator_kind_find(const char *name) {
    for (size_t i = 0; i < sizeof operator_kinds / sizeof *operator_kinds; i++)
        if (strcmp(operator_kinds[i]->name, name) == 0) return operator_kinds[i];
    return NULL;
}

uint64_t operator_memory(store *s, const char *kind, uint64_t stored) {
    const operator_kind *found = operator_kind_find(kind);
    return found != NULL && found->memory != NULL ? found->memory(s, stored) : stored;
}

lam_status operator_prepare(const lam_operator *op, lam_error *error) {
    return op->kind->prepare != NULL ? op->kind->prepare(op, error) : LAM_OK;
}

static lam_status check_reflectance(size_t n, size_t n_channels, const float *reflectance, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < n * n_channels; i++)
        if (!(reflectance[i] >= 0.0f && reflectance[i] < 1.0f))
            FAIL(error, LAM_ERR_NUMERIC, "reflectance[%zu][%zu] = %g, must be at least 0 and below 1", i / n,
                 i % n, (double)reflectance[i]);
done:
    return status;
}

lam_status operator_init(lam_operator *op, const operator_kind *kind, size_t n, size_t n_channels,
                         const float *reflectance, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count;
    if (n == 0 || n_channels == 0 || n > UINT32_MAX || !size_multiply(n, n_channels, &count))
        FAIL(error, LAM_ERR_ARGUMENT, "an operator of %zu elements and %zu channels cannot be", n,
             n_channels);
    TRY(check_reflectance(n, n_channels, reflectance, error));
    float *copy = memory_allocate(count, sizeof *copy, "reflectance", error);
    if (copy == NULL) TRY(LAM_ERR_MEMORY);
    /* Division by a subnormal reflectance passes the range of single precision. */
    for (size_t i = 0; i < count; i++) copy[i] = reflectance[i] < FLT_MIN ? 0.0f : reflectance[i];
    op->reflectances = (store_view){.data = copy, .memory = copy};
    op->reflectance = copy;
    op->kind = kind;
    op->n = n;
    op->n_channels = n_channels;
    op->n_threads = 1;
done:
    return status;
}

size_t operator_like_channel(size_t n, const float *reflectance, size_t c) {
    size_t like = 0;
    while (like < c && memcmp(reflectance + like * n, reflectance + c * n, n * sizeof *reflectance) != 0)
        like++;
    return like;
}

lam_status operator_set_order(lam_operator *op, const uint32_t *order, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *copy = NULL, *position = NULL;
    if (order != NULL) {
        copy = memory_allocate(op->n, sizeof *copy, "order", error);
        position = memory_allocate(op->n, sizeof *position, "order", error);
        if (copy == NULL || position == NULL) TRY(LAM_ERR_MEMORY);
        memset(position, 0xff, op->n * sizeof *position);
        memcpy(copy, order, op->n * sizeof *copy); /* order may be mapped, and change */
        for (size_t p = 0; p < op->n; p++) {
            if (copy[p] >= op->n)
                FAIL(error, LAM_ERR_NUMERIC, "order[%zu] = %u, must be below %zu", p, (unsigned)copy[p],
                     op->n);
            if (position[copy[p]] != UINT32_MAX)
                FAIL(error, LAM_ERR_NUMERIC, "order[%zu] = %u, which stands there twice", p,
                     (unsigned)copy[p]);
            position[copy[p]] = (uint32_t)p;
        }
    }
    free(op->order);
    free(op->position);
    op->order = copy;
    op->position = position;
    copy = position = NULL;
done:
    free(copy);
    free(position);
    return status;
}

/* The kind of an open store; its layout must be the one we know. */
static lam_status load_kind(store *s, const operator_kind **kind, lam_error *error) {
    lam_status status = LAM_OK;
    char *name = NULL, *layout = NULL;
    TRY(store_get_text(s, STORE_OPERATOR, "kind", &name, error));
    *kind = operator_kind_find(name);
    if (*kind == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown kind '%s'; precompute it again",
             store_path(s), name);
    if (store_has_attribute(s, STORE_OPERATOR, "layout")) {
        TRY(store_get_text(s, STORE_OPERATOR, "layout", &layout, error));
        if (strcmp(layout, "rows") != 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown layout '%s'", store_path(s), layout);
    }
done:
    free(name);
    free(layout);
    return status;
}

/* Mapped reflectances that an operator takes as they are need no copy. */
static void share_reflectances(lam_operator *op, store_view *reflectances) {
    const size_t bytes = op->n_channels * op->n * sizeof *op->reflectance;
    if (reflectances->map == NULL || memcmp(reflectances->data, op->reflectance, bytes) != 0) return;
    store_view_free(&op->reflectances);
    op->reflectances = *reflectances;
    op->reflectance = reflectances->data;
    *reflectances = (store_view){.data = NULL};
}

lam_status operator_load(store *s, lam_operator **out, lam_error *error) {
    lam_status status = LAM_OK;
    const operator_kind *kind = NULL;
    lam_operator *op = NULL;
    store_view reflectances = {.data = NULL};
    void *order = NULL;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, SIZE_MAX};
    lam_error cause = {.message = ""};
    if (!store_has(s, STORE_OPERATOR))
        FAIL(error, LAM_ERR_FORMAT, "%s: holds no operator; precompute it again", store_path(s));
    TRY(load_kind(s, &kind, error));
    TRY(store_read_view(s, STORE_MESH "/reflectance", STORE_F32, 2, dims, &reflectances, error));
    size_t n_channels = dims[0], n = dims[1];
    if (n == 0 || n_channels == 0 || n > UINT32_MAX)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /mesh/reflectance is %zu x %zu, must be channels x elements, not empty", store_path(s),
             n_channels, n);
    status = kind->load(s, n, n_channels, reflectances.data, &op, &cause);
    if (status == LAM_OK) share_reflectances(op, &reflectances);
    if (status == LAM_OK && kind->prepare == NULL && store_has(s, STORE_OPERATOR "/order")) {
        dims[0] = n;
        status = store_read(s, STORE_OPERATOR "/order", STORE_U32, 1, dims, &order, &cause);
        if (status == LAM_OK) status = operator_set_order(op, order, &cause);
    }
    /* Values that cannot be, met in a file, make it a file that is not ours. */
    if (status == LAM_ERR_NUMERIC) FAIL(error, LAM_ERR_FORMAT, "%s: %s", store_path(s), cause.message);
    if (status != LAM_OK) FAIL(error, status, "%s", cause.message);
    *out = op;
    op = NULL;
done:
    store_view_free(&reflectances);
    free(order);
    lam_operator_close(op);
    return status;
}

lam_status operator_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    operator_description description = {0};
    TRY(operator_prepare(op, error));
    op->kind->describe(op, &description);
    TRY(store_set_text(s, STORE_OPERATOR, "kind", op->kind->name, error));
    if (description.form != NULL) TRY(store_set_text(s, STORE_OPERATOR, "form", description.form, error));
    TRY(store_set_text(s, STORE_OPERATOR, "layout", "rows", error));
    if (description.precision != NULL)
        TRY(store_set_text(s, STORE_OPERATOR, "precision", description.precision, error));
    if (op->order != NULL)
        TRY(store_write(s, STORE_OPERATOR "/order", STORE_U32, 1, &op->n, op->order, error));
    TRY(op->kind->save(op, s, error));
done:
    return status;
}

void operator_describe(const lam_operator *op, operator_description *description) {
    *description = (operator_description){.density = -1};
    op->kind->describe(op, description);
}

lam_status lam_operator_open(const char *path, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    if (path == NULL || op == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the operator are needed");
    TRY(store_open(path, &s, error));
    TRY(operator_load(s, op, error));
done:
    store_close(s);
    return status;
}

void lam_operator_close(lam_operator *op) {
    if (op == NULL) return;
    op->kind->destroy(op);
    store_view_free(&op->reflectances);
    free(op->order);
    free(op->position);
    free(op);
}

size_t lam_operator_elements(const lam_operator *op) {
    return op->n;
}

size_t lam_operator_channels(const lam_operator *op) {
    return op->n_channels;
}

size_t lam_operator_bytes(const lam_operator *op) {
    operator_description description;
    operator_describe(op, &description);
    return description.bytes;
}

const char *lam_operator_kind(const lam_operator *op) {
    return op->kind->name;
}

void lam_operator_set_threads(lam_operator *op, size_t n_threads) {
    op->n_threads = n_threads > 0 ? n_threads : 1;
    if (op->kind->set_threads != NULL) op->kind->set_threads(op, op->n_threads);
}

bool operator_keeps_factors(const lam_operator *op) {
    operator_description description;
    operator_describe(op, &description);
    return op->kind->relight != NULL && description.form != NULL && strcmp(description.form, "factored") == 0;
}

lam_status operator_relight(const lam_operator *op, const float *reflectance, atomic_bool *cancelled,
                            lam_operator **out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *made = NULL;
    if (!operator_keeps_factors(op))
        FAIL(error, LAM_ERR_UNSUPPORTED, "an operator of kind '%s' without factors cannot be relit",
             op->kind->name);
    TRY(check_reflectance(op->n, op->n_channels, reflectance, error));
    TRY(op->kind->relight(op, reflectance, cancelled, &made, error));
    TRY(operator_set_order(made, op->order, error));
    lam_operator_set_threads(made, op->n_threads);
    *out = made;
    made = NULL;
done:
    lam_operator_close(made);
    return status;
}

lam_status operator_narrow(const lam_operator *op, panel_precision precision, lam_operator **out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *made = NULL;
    if (op->kind->narrow == NULL)
        FAIL(error, LAM_ERR_UNSUPPORTED, "an operator of kind '%s' is kept in f32", op->kind->name);
    TRY(op->kind->narrow(op, precision, &made, error));
    TRY(operator_set_order(made, op->order, error));
    lam_operator_set_threads(made, op->n_threads);
    *out = made;
    made = NULL;
done:
    lam_operator_close(made);
    return status;
}
