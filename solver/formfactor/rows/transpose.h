/* Entries of sparse rows collected by column, some columns at a time: what a transpose needs at once. */
#ifndef LAMBERT_FORMFACTOR_ROWS_TRANSPOSE_H
#define LAMBERT_FORMFACTOR_ROWS_TRANSPOSE_H

#include "store/status.h"

#include <stdint.h>

typedef struct column_entry {
    uint32_t column, row;
    float value;
} column_entry;

/* Entries of some consecutive rows, as they come. */
typedef struct column_slice {
    column_entry *entries;
    size_t count, capacity;
    bool failed; /* out of memory: what was pushed since is lost */
} column_slice;

void column_push_grown(column_slice *slice, column_entry entry);

static inline void column_push(column_slice *slice, uint32_t column, uint32_t row, float value) {
    const column_entry entry = {column, row, value};
    if (slice->count < slice->capacity)
        slice->entries[slice->count++] = entry;
    else
        column_push_grown(slice, entry);
}

enum { COLUMN_SLICES = 32 };

/* Columns first ... last-1: column j has the entries start[j-first] ... start[j-first+1]-1, rows ascending.
 */
typedef struct columns {
    size_t first, last;
    size_t *start;
    uint32_t *rows;
    float *values;
    size_t start_capacity, entry_capacity;
    column_slice slices[COLUMN_SLICES];
    size_t *next; /* [COLUMN_SLICES][last - first] */
} columns;

/* Pushes the entries of one row that lie in columns first ... last-1. Rows come from many threads, each row
 * once. */
typedef void column_source(void *context, size_t row, size_t first, size_t last, column_slice *to);

/* Collects columns first ... last-1 of rows row_first ... row_last-1; what c held before is replaced, its
 * memory used again. The same for any number of threads. Memory: 20 bytes an entry. LAM_ERR_MEMORY. */
lam_status columns_collect(columns *c, size_t row_first, size_t row_last, size_t first, size_t last,
                           column_source *source, void *context, lam_error *error);
void columns_free(columns *c);

#endif
