#include "solver/formfactor/rows/row_code.h"

#include <math.h>
#include <stdlib.h>
#include <sys/mman.h>

/* row_get_number that reads no byte from end on; NULL for a number that does not end before. */
static const uint8_t *get_number_within(const uint8_t *from, const uint8_t *end, uint64_t *x) {
    const uint8_t *last = from;
    while (last < end && (*last & 0x80)) last++;
    if (last == end || last - from > 4) return NULL;
    return row_get_number(from, x);
}

/* Positions ascend below n, exchange areas are finite and not negative. */
static bool check_pairs(const packed_row *row, size_t n) {
    const size_t count = row->n_entries;
    if (row->n_bytes != count * ROW_PAIR_BYTES) return false;
    for (size_t e = 0; e < count; e++) {
        uint32_t other, before = 0;
        float exchange;
        memcpy(&other, row->bytes + 4 * e, sizeof other);
        if (e > 0) memcpy(&before, row->bytes + 4 * (e - 1), sizeof before);
        memcpy(&exchange, row->bytes + 4 * (count + e), sizeof exchange);
        if (other >= n || (e > 0 && other <= before) || !(exchange >= 0 && isfinite(exchange))) return false;
    }
    return true;
}

bool row_check(row_kind kind, const packed_row *row, size_t n) {
    if (kind == ROW_PAIRS) return check_pairs(row, n);
    const uint8_t *at = row->bytes, *const end = at + row->n_bytes;
    uint64_t column = 0; /* the smallest that may come */
    for (uint32_t e = 0; e < row->n_entries; e++) {
        uint64_t x, count;
        at = get_number_within(at, end, &x);
        if (at == NULL) return false;
        if (kind == ROW_WEIGHTS) {
            float weight;
            if (end - at < (ptrdiff_t)sizeof weight) return false;
            memcpy(&weight, at, sizeof weight);
            if (!(weight > 0 && weight <= 2)) return false;
            at += sizeof weight;
        } else {
            if (x & 1) {
                at = get_number_within(at, end, &count);
                if (at == NULL || count > (1 << 24)) return false;
            }
            x >>= 1;
        }
        column += x + 1;
        if (column > n) return false;
    }
    return at == end;
}

void packed_rows_free(packed_rows *rows) {
    for (size_t c = 0; c < rows->n_chunks; c++) free(rows->chunks[c]);
    free(rows->chunks);
    free(rows->rows);
    if (rows->map != NULL) munmap((void *)(uintptr_t)rows->map, rows->map_bytes);
    *rows = (packed_rows){0};
}
