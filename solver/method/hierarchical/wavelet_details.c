#include "solver/method/hierarchical/wavelet_details.h"

#include "store/status.h"

#include <stdlib.h>
#include <string.h>

void details_free(details *d) {
    free(d->list);
    *d = (details){.count = 0};
}

lam_status details_reserve(details *d, size_t more, lam_error *error) {
    if (d->capacity - d->count >= more) return LAM_OK;
    const size_t capacity = d->count + more + d->capacity / 2 + 64;
    detail *const list = realloc(d->list, capacity * sizeof *list);
    if (list == NULL)
        return status_fail(error, LAM_ERR_MEMORY, "wavelets: cannot allocate %zu x %zu bytes", capacity,
                           sizeof *list);
    d->list = list;
    d->capacity = capacity;
    return LAM_OK;
}

lam_status details_join(const details *a, const detail *b, size_t b_count, details *into, lam_error *error) {
    into->count = 0;
    const lam_status status = details_reserve(into, a->count + b_count, error);
    if (status != LAM_OK) return status;
    size_t p = 0, q = 0;
    while (p < a->count || q < b_count) {
        const bool from_a = q == b_count || (p < a->count && a->list[p].j < b[q].j);
        into->list[into->count++] = from_a ? a->list[p++] : b[q++];
    }
    return LAM_OK;
}

lam_status details_copy(const details *from, details *out, lam_error *error) {
    *out = (details){.count = from->count, .capacity = from->count};
    if (from->count == 0) return LAM_OK;
    out->list = memory_allocate(from->count, sizeof *out->list, "wavelets", error);
    if (out->list == NULL) {
        *out = (details){.count = 0};
        return LAM_ERR_MEMORY;
    }
    memcpy(out->list, from->list, from->count * sizeof *out->list);
    return LAM_OK;
}
