/* One-sided rows of form factors as they were found, packed, wherever their bytes lie. */
#ifndef LAMBERT_FORMFACTOR_ROWS_FOUND_ROWS_H
#define LAMBERT_FORMFACTOR_ROWS_FOUND_ROWS_H

#include "solver/formfactor/rows/row_code.h"
#include "store/status.h"

typedef struct found_rows {
    size_t n;
    row_kind kind;
    found_row *rows; /* [n], mesh order */
    size_t n_chunks;
    void **chunks; /* [n_chunks], where the bytes are in memory */
    const void *map;
    size_t map_bytes; /* where they are in a file */
    size_t kept;      /* rows that were there from an earlier run */
} found_rows;

void found_rows_free(found_rows *rows);

#endif
