#include "solver/formfactor/row_code.h"

#include <math.h>

/* row_get_number within end; NULL where the number does not end. */
static const uint8_t *get_number_within(const uint8_t *from, const uint8_t *end, uint64_t *x) {
    const uint8_t *last = from;
    while (last < end && (*last & 0x80)) last++;
    if (last == end || last - from > 4) return NULL;
    return row_get_number(from, x);
}

bool row_check(row_kind kind, const found_row *row, size_t n) {
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
