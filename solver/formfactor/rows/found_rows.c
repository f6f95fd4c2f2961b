#include "solver/formfactor/rows/found_rows.h"

#include <stdlib.h>
#include <sys/mman.h>

void found_rows_free(found_rows *rows) {
    for (size_t c = 0; c < rows->n_chunks; c++) free(rows->chunks[c]);
    free(rows->chunks);
    free(rows->rows);
    if (rows->map != NULL) munmap((void *)(uintptr_t)rows->map, rows->map_bytes);
    *rows = (found_rows){0};
}
