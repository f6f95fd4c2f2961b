#include "solver/linalg/panel_store.h"
#include "store/groups.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The type of a panel of each precision in a file. */
static const store_type panel_types[PANEL_PRECISIONS] = {STORE_F32, STORE_F16, STORE_I8};

static lam_status read_precision(store *s, const char *name, panel_precision *precision, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK], p = 0;
    TRY(store_array_info(s, name, &type, &rank, dims, error));
    while (p < PANEL_PRECISIONS && panel_types[p] != type) p++;
    if (p == PANEL_PRECISIONS)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s must be of f32, f16 or i8", store_path(s), name);
    *precision = (panel_precision)p;
done:
    return status;
}

lam_status panel_load(store *s, const char *name, size_t n, size_t *k, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    char scale_name[48];
    void *scale = NULL;
    store_view values = {.data = NULL};
    panel_precision precision = PANEL_F32;
    size_t dims[STORE_MAX_RANK] = {n, *k};
    TRY(read_precision(s, name, &precision, error));
    snprintf(scale_name, sizeof scale_name, "%s_scale", name);
    const bool scaled = store_has(s, scale_name);
    if (precision == PANEL_I8 && !scaled)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is of i8 and has no %s", store_path(s), name, scale_name);
    if (scaled && precision != PANEL_I8 && precision != PANEL_F16)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is of %s and must not have a %s", store_path(s), name,
             panel_precision_name(precision), scale_name);
    TRY(store_read_view(s, name, panel_types[precision], 2, dims, &values, error));
    if (scaled) TRY(store_read(s, scale_name, STORE_F32, 1, &dims[1], &scale, error));
    TRY(panel_from_view(n, dims[1], precision, &values, 0, scale, name, a, error));
    *k = dims[1];
done:
    store_view_free(&values);
    free(scale);
    return status;
}

lam_status panel_from_view(size_t n, size_t k, panel_precision precision, const store_view *values,
                           size_t offset, const float *scale, const char *name, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    const void *first = (const char *)values->data + offset;
    if (values->map == NULL) {
        TRY(panel_create_kept(n, k, precision, first, scale, name, a, error));
        goto done;
    }
    _Static_assert(PANEL_SLACK <= STORE_MAP_SLACK, "the end of a mapping can be read past so far");
    TRY(panel_view(n, k, precision, first, scale, name, a, error));
    a->mapping = store_map_hold(values->map);
done:
    return status;
}

lam_status panel_save(const panel *a, store *s, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    char scale_name[48];
    size_t dims[2] = {a->n, a->k};
    /* The padded panel was allocated, so the product below cannot overflow. */
    void *values = memory_allocate(a->n * a->k, panel_value_size(a->precision), name, error);
    if (values == NULL) TRY(LAM_ERR_MEMORY);
    panel_copy_values(a, values);
    TRY(store_write(s, name, panel_types[a->precision], 2, dims, values, error));
    snprintf(scale_name, sizeof scale_name, "%s_scale", name);
    if (a->scale != NULL) TRY(store_write(s, scale_name, STORE_F32, 1, &a->k, a->scale, error));
done:
    free(values);
    return status;
}

lam_status panel_check_precision(store *s, panel_precision precision, lam_error *error) {
    lam_status status = LAM_OK;
    char *said = NULL;
    if (!store_has_attribute(s, STORE_OPERATOR, "precision")) goto done;
    TRY(store_get_text(s, STORE_OPERATOR, "precision", &said, error));
    if (strcmp(said, panel_precision_name(precision)) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator says precision '%s', its arrays are of %s", store_path(s),
             said, panel_precision_name(precision));
done:
    free(said);
    return status;
}
