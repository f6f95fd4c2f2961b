#include "solver/formfactor/rows/transpose.h"

#include <stdlib.h>
#include <string.h>

void column_push_grown(column_slice *slice, column_entry entry) {
    const size_t capacity = slice->capacity + slice->capacity / 2 + 1024;
    column_entry *entries = slice->failed ? NULL : realloc(slice->entries, capacity * sizeof *slice->entries);
    if (entries == NULL) {
        slice->failed = true;
        return;
    }
    slice->entries = entries;
    slice->capacity = capacity;
    slice->entries[slice->count++] = entry;
}

void columns_free(columns *c) {
    for (size_t s = 0; s < COLUMN_SLICES; s++) free(c->slices[s].entries);
    free(c->start);
    free(c->rows);
    free(c->values);
    free(c->next);
    *c = (columns){0};
}

static lam_status reserve_columns(columns *c, size_t width, lam_error *error) {
    if (width + 1 <= c->start_capacity) return LAM_OK;
    free(c->start);
    free(c->next);
    c->start_capacity = 0;
    c->start = memory_allocate(width + 1, sizeof *c->start, "form factors", error);
    c->next = memory_allocate(width, COLUMN_SLICES * sizeof *c->next, "form factors", error);
    if (c->start == NULL || c->next == NULL) return LAM_ERR_MEMORY;
    c->start_capacity = width + 1;
    return LAM_OK;
}

static lam_status reserve_entries(columns *c, size_t count, lam_error *error) {
    if (count <= c->entry_capacity) return LAM_OK;
    free(c->rows);
    free(c->values);
    c->entry_capacity = 0;
    count += count / 4;
    c->rows = memory_allocate(count, sizeof *c->rows, "form factors", error);
    c->values = memory_allocate(count, sizeof *c->values, "form factors", error);
    if (c->rows == NULL || c->values == NULL) return LAM_ERR_MEMORY;
    c->entry_capacity = count;
    return LAM_OK;
}

lam_status columns_collect(columns *c, size_t row_first, size_t row_last, size_t first, size_t last,
                           column_source *source, void *context, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t width = last - first, n_rows = row_last > row_first ? row_last - row_first : 0;
    TRY(reserve_columns(c, width, error));
    c->first = first;
    c->last = last;
    memset(c->next, 0, width * COLUMN_SLICES * sizeof *c->next);
    /* next[slice][column]: how many; later where the next one goes. */
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t s = 0; s < COLUMN_SLICES; s++) {
        column_slice *slice = &c->slices[s];
        size_t *count = c->next + s * width;
        slice->count = 0;
        slice->failed = false;
        const size_t end = row_first + (s + 1) * n_rows / COLUMN_SLICES;
        for (size_t row = row_first + s * n_rows / COLUMN_SLICES; row < end; row++)
            source(context, row, first, last, slice);
        for (size_t e = 0; e < slice->count; e++) count[slice->entries[e].column - first]++;
    }
    size_t total = 0;
    for (size_t j = 0; j < width; j++) {
        c->start[j] = total;
        for (size_t s = 0; s < COLUMN_SLICES; s++) {
            const size_t count = c->next[s * width + j];
            c->next[s * width + j] = total;
            total += count;
        }
    }
    c->start[width] = total;
    for (size_t s = 0; s < COLUMN_SLICES; s++)
        if (c->slices[s].failed)
            FAIL(error, LAM_ERR_MEMORY, "form factors: out of memory; use fewer --rays or a smaller scene");
    TRY(reserve_entries(c, total, error));
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t s = 0; s < COLUMN_SLICES; s++) {
        const column_slice *slice = &c->slices[s];
        size_t *next = c->next + s * width;
        for (size_t e = 0; e < slice->count; e++) {
            const column_entry *entry = &slice->entries[e];
            const size_t at = next[entry->column - first]++;
            c->rows[at] = entry->row;
            c->values[at] = entry->value;
        }
    }
done:
    return status;
}
