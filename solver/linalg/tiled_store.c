/* A tiled matrix in a store, as products read it (tiled.h): nothing is unpacked, and a mapped store's pages
 * are those of every process that has mapped them. */
#include "solver/linalg/tiled.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(sizeof(tile_four) == 48 && offsetof(tile_four, beyond) == 4 &&
                   offsetof(tile_four, values) == 12,
               "store/FORMAT.md says where the parts of a four are");
_Static_assert(STORE_MAP_SLACK >= sizeof(tile_four), "a register reads behind the last four");

lam_status tiled_save(const tiled_rows *t, const char *group, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char name[64];
    const size_t n_begins = t->n_groups * t->n_planes + 1;
    snprintf(name, sizeof name, "%s/begin", group);
    TRY(store_write(s, name, STORE_U32, 1, &n_begins, t->begin, error));
    snprintf(name, sizeof name, "%s/four", group);
    TRY(store_write(s, name, STORE_I8, 2, (const size_t[]){t->n_fours, sizeof *t->fours}, t->fours, error));
    TRY(store_set_integer(s, group, "numbers", (int64_t)t->n_numbers, error));
done:
    return status;
}

/* Puts the bytes of fours where numbers and registers may be read: aligned, and with room behind the last. */
static lam_status make_readable(store_view *values, size_t bytes, lam_error *error) {
    if (values->map != NULL && (uintptr_t)values->data % _Alignof(tile_four) == 0) return LAM_OK;
    char *copy = memory_allocate(bytes + sizeof(tile_four), 1, "operator", error);
    if (copy == NULL) return LAM_ERR_MEMORY;
    if (bytes > 0) memcpy(copy, values->data, bytes);
    store_view_free(values);
    *values = (store_view){.data = copy, .memory = copy};
    return LAM_OK;
}

static lam_status check_begins(const tiled_rows *t, const char *group, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_parts = t->n_groups * t->n_planes;
    for (size_t k = 0; k < n_parts; k++)
        if (t->begin[k] > t->begin[k + 1])
            FAIL(error, LAM_ERR_NUMERIC, "%s/begin[%zu] = %u, must not be above the next, %u", group, k,
                 (unsigned)t->begin[k], (unsigned)t->begin[k + 1]);
    if (t->begin[0] != 0 || t->begin[n_parts] != t->n_fours)
        FAIL(error, LAM_ERR_NUMERIC, "%s/begin goes from %u to %u, must go from 0 to the %zu of %s/four",
             group, (unsigned)t->begin[0], (unsigned)t->begin[n_parts], t->n_fours, group);
done:
    return status;
}

/* Adding the largest step of each four lets the compiler compare many at once. */
static lam_status check_fours(const tiled_rows *t, const char *group, lam_error *error) {
    for (size_t f = 0; f < t->n_fours; f++) {
        const tile_four *four = &t->fours[f];
        uint16_t most = four->beyond[0];
        for (size_t k = 1; k < TILES_AT_ONCE; k++) most = four->beyond[k] > most ? four->beyond[k] : most;
        if ((size_t)four->base + most >= t->n)
            return status_fail(error, LAM_ERR_NUMERIC, "%s/four[%zu] has column %zu, must be below %zu",
                               group, f, (size_t)four->base + most, t->n);
    }
    return LAM_OK;
}

lam_status tiled_load(store *s, const char *group, size_t n, size_t n_groups, tiled_rows *out,
                      lam_error *error) {
    lam_status status = LAM_OK;
    char begin[64], four[64];
    int64_t numbers;
    size_t n_begins[STORE_MAX_RANK] = {SIZE_MAX}, shape[STORE_MAX_RANK] = {SIZE_MAX, sizeof(tile_four)};
    tiled_rows made = {.n = n, .n_groups = n_groups};
    lam_error cause = {.message = ""};
    snprintf(begin, sizeof begin, "%s/begin", group);
    snprintf(four, sizeof four, "%s/four", group);
    TRY(store_read_view(s, begin, STORE_U32, 1, n_begins, &made.begins, error));
    TRY(store_read_view(s, four, STORE_I8, 2, shape, &made.values, error));
    TRY(store_get_integer(s, group, "numbers", &numbers, error));
    if (numbers < 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %lld numbers", store_path(s), group, (long long)numbers);
    made.n_numbers = (size_t)numbers;
    made.n_planes = n_groups > 0 && n_begins[0] > 0 ? (n_begins[0] - 1) / n_groups : 0;
    if (made.n_planes < 1 || made.n_planes > TILE_PLANES || n_begins[0] != n_groups * made.n_planes + 1)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: %s has %zu numbers, must have one for each of %zu groups and 1 to %d planes, and one more",
             store_path(s), begin, n_begins[0], n_groups, TILE_PLANES);
    made.n_fours = shape[0];
    TRY(make_readable(&made.values, shape[0] * sizeof(tile_four), error));
    made.begin = made.begins.data;
    made.fours = made.values.data;
    status = check_begins(&made, group, &cause);
    if (status == LAM_OK) status = check_fours(&made, group, &cause);
    if (status != LAM_OK) {
        /* A block that is not as it was written is the cause, where there is one. */
        TRY(store_verify_group(s, group, error));
        FAIL(error, LAM_ERR_NUMERIC, "%s", cause.message);
    }
    *out = made;
    made = (tiled_rows){.n = 0};
done:
    tiled_free(&made);
    return status;
}
