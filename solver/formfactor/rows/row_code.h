/* One-sided rows of form factors, packed: for every entry the gap to the column before, and either its count
 * of rays (most often one byte for both) or its weight in single precision. */
#ifndef LAMBERT_FORMFACTOR_ROWS_ROW_CODE_H
#define LAMBERT_FORMFACTOR_ROWS_ROW_CODE_H

#include "store/status.h"

#include <stdint.h>
#include <string.h>

/* ROW_PAIRS: rows of pair_rows.h, not packed. */
typedef enum row_kind { ROW_COUNTS, ROW_WEIGHTS, ROW_PAIRS } row_kind;

/* Bytes of a pair: position, exchange area, state. */
enum { ROW_PAIR_BYTES = 9 };

/* Bytes of one entry at most: 33 bits of gap and 24 of count in groups of seven. */
enum { ROW_ENTRY_MOST = 10 };

static inline uint8_t *row_put_number(uint8_t *to, uint64_t x) {
    for (; x >= 0x80; x >>= 7) *to++ = (uint8_t)(x | 0x80);
    *to++ = (uint8_t)x;
    return to;
}

static inline const uint8_t *row_get_number(const uint8_t *from, uint64_t *x) {
    uint64_t byte = *from++;
    *x = byte & 0x7F;
    for (unsigned shift = 7; byte & 0x80; shift += 7) {
        byte = *from++;
        *x |= (byte & 0x7F) << shift;
    }
    return from;
}

/* Appends one entry, gap columns behind the one before. A count is a whole number from 1 to 2^24. */
static inline uint8_t *row_put(row_kind kind, uint8_t *to, uint32_t gap, float value) {
    if (kind == ROW_WEIGHTS) {
        to = row_put_number(to, gap);
        memcpy(to, &value, sizeof value);
        return to + sizeof value;
    }
    const bool many = value > 1;
    to = row_put_number(to, (uint64_t)gap << 1 | many);
    return many ? row_put_number(to, (uint64_t)value - 2) : to;
}

/* Reads what row_put wrote; returns where the next entry begins. */
static inline const uint8_t *row_get(row_kind kind, const uint8_t *from, uint32_t *gap, float *value) {
    uint64_t x;
    from = row_get_number(from, &x);
    if (kind == ROW_WEIGHTS) {
        *gap = (uint32_t)x;
        memcpy(value, from, sizeof *value);
        return from + sizeof *value;
    }
    *gap = (uint32_t)(x >> 1);
    *value = 1;
    if (x & 1) {
        from = row_get_number(from, &x);
        *value = (float)(x + 2);
    }
    return from;
}

/* A packed row. */
typedef struct packed_row {
    const uint8_t *bytes;
    uint32_t n_bytes, n_entries;
} packed_row;

/* True where a row from a file is valid: whole entries, as many as stated, columns below n, finite values
 * above 0. */
bool row_check(row_kind kind, const packed_row *row, size_t n);

/* The packed rows of all elements, in memory or in a mapped file. */
typedef struct packed_rows {
    size_t n;
    row_kind kind;
    packed_row *rows; /* [n], mesh order */
    size_t n_chunks;
    void **chunks; /* [n_chunks], the bytes in memory */
    const void *map;
    size_t map_bytes; /* the bytes in a file */
    size_t kept;      /* rows that came from an interrupted run */
} packed_rows;

void packed_rows_free(packed_rows *rows);

#endif
