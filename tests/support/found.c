#include "support/found.h"

csr found_unpack(const packed_rows *found) {
    csr rows = {.n = found->n, .indptr = calloc(found->n + 1, sizeof(uint64_t))};
    ck_assert_ptr_nonnull(rows.indptr);
    for (size_t i = 0; i < found->n; i++) rows.indptr[i + 1] = rows.indptr[i] + found->rows[i].n_entries;
    rows.indices = malloc((rows.indptr[found->n] + 1) * sizeof *rows.indices);
    rows.data = malloc((rows.indptr[found->n] + 1) * sizeof *rows.data);
    ck_assert(rows.indices != NULL && rows.data != NULL);
    for (size_t i = 0; i < found->n; i++) {
        const uint8_t *at = found->rows[i].bytes;
        uint32_t next = 0, gap;
        for (uint64_t p = rows.indptr[i]; p < rows.indptr[i + 1]; p++) {
            at = row_get(found->kind, at, &gap, &rows.data[p]);
            rows.indices[p] = next + gap;
            next = rows.indices[p] + 1;
        }
        ck_assert_uint_eq((size_t)(at - found->rows[i].bytes), found->rows[i].n_bytes);
    }
    return rows;
}
