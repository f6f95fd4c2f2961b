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

/* The last column of four tiles. */
static inline uint64_t last_column(const tile_four *four) {
    const uint16_t *b = four->beyond, low = b[0] > b[1] ? b[0] : b[1], high = b[2] > b[3] ? b[2] : b[3];
    return (uint64_t)four->base + (low > high ? low : high);
}

/* The fours that end between these bytes; n: columns. */
static bool are_within(const void *data, size_t from, size_t to, uint64_t n) {
    const tile_four *fours = data;
    uint64_t most = 0;
    for (size_t f = from / sizeof *fours; f < to / sizeof *fours; f++) {
        const uint64_t last = last_column(&fours[f]);
        most = last > most ? last : most;
    }
    return most < n;
}

static lam_status check_fours(const tiled_rows *t, const char *group, lam_error *error) {
    const bool good = are_within(t->fours, 0, t->n_fours * sizeof *t->fours, t->n);
    for (size_t f = 0; !good && f < t->n_fours; f++)
        if (last_column(&t->fours[f]) >= t->n)
            return status_fail(error, LAM_ERR_NUMERIC, "%s/four[%zu] has column %llu, must be below %zu",
                               group, f, (unsigned long long)last_column(&t->fours[f]), t->n);
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
    /* Mapped fours are looked at when they are compared with their checksums. */
    if (status == LAM_OK && made.values.map == NULL) status = check_fours(&made, group, &cause);
    store_view_check(&made.values, are_within, n, "has a tile beyond its columns");
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
