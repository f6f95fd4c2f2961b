#include "solver/formfactor/pairs/pair_rows.h"

#include "solver/base/array_grow.h"
#include "solver/base/bitset.h"

#include <stdlib.h>
#include <string.h>

static void block_free(pair_block *b) {
    free(b->other);
    free(b->exchange);
    free(b->state);
    *b = (pair_block){0};
}

lam_status pair_rows_create(size_t n, pair_rows *out, lam_error *error) {
    pair_rows rows = {.n = n, .n_blocks = (n + PAIR_BLOCK_ROWS - 1) / PAIR_BLOCK_ROWS};
    rows.blocks = memory_allocate(rows.n_blocks, sizeof *rows.blocks, "pairs", error);
    if (rows.blocks == NULL) return LAM_ERR_MEMORY;
    *out = rows;
    return LAM_OK;
}

void pair_rows_free(pair_rows *rows) {
    for (size_t b = 0; rows->blocks != NULL && b < rows->n_blocks; b++) block_free(&rows->blocks[b]);
    free(rows->blocks);
    *rows = (pair_rows){0};
}

/* Sets the capacity. */
static bool block_resize(pair_block *b, size_t capacity) {
    if (array_resize(&b->other, capacity, sizeof *b->other, "pairs", NULL) != LAM_OK ||
        array_resize(&b->exchange, capacity, sizeof *b->exchange, "pairs", NULL) != LAM_OK ||
        array_resize(&b->state, capacity, sizeof *b->state, "pairs", NULL) != LAM_OK)
        return false;
    b->capacity = capacity;
    return true;
}

bool pair_block_reserve(pair_block *b, size_t more) {
    if (b->capacity - b->used >= more) return true;
    return block_resize(b, array_capacity(b->capacity, b->used + more));
}

void pair_block_shrink(pair_block *b) {
    block_resize(b, b->used); /* nothing is lost where that fails */
}

bool pair_rows_find(const pair_rows *rows, uint32_t p, uint32_t q, const pair_block **block, size_t *at) {
    const uint32_t row = p < q ? p : q, wanted = p < q ? q : p;
    const pair_block *b = &rows->blocks[row / PAIR_BLOCK_ROWS];
    size_t low = b->begin[row % PAIR_BLOCK_ROWS];
    const size_t end = b->begin[row % PAIR_BLOCK_ROWS + 1];
    for (size_t high = end; low < high;) {
        const size_t middle = low + (high - low) / 2;
        if (b->other[middle] < wanted)
            low = middle + 1;
        else
            high = middle;
    }
    *block = b;
    *at = low;
    return low < end && b->other[low] == wanted;
}

pair_state pair_rows_state(const pair_rows *rows, uint32_t p, uint32_t q) {
    const pair_block *b;
    size_t at;
    if (!pair_rows_find(rows, p, q, &b, &at)) return PAIR_UNKNOWN;
    return (pair_state)(b->state[at] & ~(PAIR_SETTLED | PAIR_EXACT));
}

lam_status pair_rows_open(scratch *s, const char *name, const char geometry[33], const recipe *r, size_t n,
                          const uint32_t *order, row_file **out, lam_error *error) {
    row_file_contents contents = {
        .recipe = *r, .n = n, .block_rows = PAIR_BLOCK_ROWS, .kind = ROW_PAIRS, .sky = NULL};
    memcpy(contents.geometry, geometry, sizeof contents.geometry);
    return row_file_open(s, name, &contents, order, out, error);
}

/* A row's bytes: all positions, all exchange areas, all states. */
lam_status pair_rows_append(const pair_rows *rows, size_t block, const uint32_t *order, row_file *f,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const pair_block *b = &rows->blocks[block];
    const size_t first = pair_rows_first(block), length = pair_rows_length(rows, block);
    uint8_t *bytes = memory_allocate(b->used + 1, ROW_PAIR_BYTES, "pairs", error), *to = bytes;
    packed_row *found = memory_allocate(rows->n, sizeof *found, "pairs", error);
    if (bytes == NULL || found == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t r = 0; r < length; r++) {
        const size_t begin = b->begin[r], count = b->begin[r + 1] - begin;
        found[order[first + r]] = (packed_row){to, (uint32_t)(count * ROW_PAIR_BYTES), (uint32_t)count};
        if (count == 0) continue;
        memcpy(to, b->other + begin, count * sizeof *b->other);
        memcpy(to + 4 * count, b->exchange + begin, count * sizeof *b->exchange);
        memcpy(to + 8 * count, b->state + begin, count);
        to += count * ROW_PAIR_BYTES;
    }
    TRY(row_file_append(f, block, found, NULL, NULL, error));
done:
    free(bytes);
    free(found);
    return status;
}

static lam_status read_block(const pair_rows *rows, size_t block, const uint32_t *order, const row_file *f,
                             pair_block *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = pair_rows_first(block), length = pair_rows_length(rows, block);
    pair_block fresh = {0};
    void *data = NULL;
    size_t total = 0;
    packed_row *found = memory_allocate(rows->n, sizeof *found, "pairs", error);
    if (found == NULL) return LAM_ERR_MEMORY;
    TRY(row_file_read(f, block, found, &data, error));
    for (size_t r = 0; r < length; r++) total += found[order[first + r]].n_entries;
    if (!block_resize(&fresh, total)) FAIL(error, LAM_ERR_MEMORY, "pairs: out of memory");
    for (size_t r = 0; r < length; r++) {
        const packed_row *row = &found[order[first + r]];
        const size_t count = row->n_entries;
        fresh.begin[r] = fresh.used;
        if (count == 0) continue;
        memcpy(fresh.other + fresh.used, row->bytes, count * sizeof *fresh.other);
        memcpy(fresh.exchange + fresh.used, row->bytes + 4 * count, count * sizeof *fresh.exchange);
        memcpy(fresh.state + fresh.used, row->bytes + 8 * count, count);
        fresh.used += count;
    }
    for (size_t r = length; r <= PAIR_BLOCK_ROWS; r++) fresh.begin[r] = fresh.used;
    *out = fresh;
    fresh = (pair_block){0};
done:
    block_free(&fresh);
    free(data);
    free(found);
    return status;
}

lam_status pair_rows_fetch(pair_rows *rows, size_t block, const uint32_t *order, const row_file *f,
                           lam_error *error) {
    pair_block fresh;
    const lam_status status = read_block(rows, block, order, f, &fresh, error);
    if (status != LAM_OK) return status;
    block_free(&rows->blocks[block]);
    rows->blocks[block] = fresh;
    return LAM_OK;
}

lam_status pair_rows_fetch_exchange(pair_rows *rows, size_t block, const uint32_t *order, const row_file *f,
                                    lam_error *error) {
    pair_block fresh, *held = &rows->blocks[block];
    lam_status status = read_block(rows, block, order, f, &fresh, error);
    if (status != LAM_OK) return status;
    if (fresh.used != held->used)
        status = status_fail(error, LAM_ERR_FORMAT,
                             "the scratch folder holds %zu pairs of block %zu, must be %zu; remove its files",
                             fresh.used, block, held->used);
    else
        memcpy(held->exchange, fresh.exchange, held->used * sizeof *held->exchange);
    block_free(&fresh);
    return status;
}

/* Sorts the entries of a row by index, through a dense row and a bitset: O(entries + n/64). */
static void sort_row(csr *rows, size_t i, float *dense, bitset *there) {
    for (uint64_t p = rows->indptr[i]; p < rows->indptr[i + 1]; p++) {
        const uint32_t j = rows->indices[p];
        dense[j] = rows->data[p];
        bitset_add(there, j);
    }
    const size_t count = bitset_take(there);
    for (size_t k = 0; k < count; k++) {
        rows->indices[rows->indptr[i] + k] = there->taken[k];
        rows->data[rows->indptr[i] + k] = dense[there->taken[k]];
    }
}

static lam_status sort_rows(csr *rows, lam_error *error) {
    const size_t n = rows->n;
    bool out_of_memory = false;
#pragma omp parallel
    {
        lam_error ignored;
        bitset there;
        float *dense = memory_allocate(n, sizeof *dense, "form factor rows", &ignored);
        const bool enough =
            bitset_make(n, 0, "form factor rows", &there, &ignored) == LAM_OK && dense != NULL;
        if (!enough) {
#pragma omp atomic write
            out_of_memory = true;
        }
#pragma omp for schedule(dynamic, 16)
        for (size_t i = 0; i < n; i++)
            if (enough) sort_row(rows, i, dense, &there);
        free(dense);
        bitset_free(&there);
    }
    return out_of_memory ? status_fail(error, LAM_ERR_MEMORY, "rows of %zu elements: out of memory", n)
                         : LAM_OK;
}

lam_status pair_rows_gather(const pair_rows *found, const uint32_t *order, bool keep_hidden, csr *G,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = found->n;
    csr rows = {.n = n};
    uint64_t *next = memory_allocate(n + 1, sizeof *next, "form factor rows", error);
    rows.indptr = memory_allocate(n + 1, sizeof *rows.indptr, "form factor rows", error);
    if (rows.indptr == NULL || next == NULL) TRY(LAM_ERR_MEMORY);
    for (int fill = 0; fill < 2; fill++) {
#pragma omp parallel for schedule(dynamic, 64)
        for (size_t at = 0; at < n; at++) {
            const pair_block *block = &found->blocks[at / PAIR_BLOCK_ROWS];
            const size_t *begin = &block->begin[at % PAIR_BLOCK_ROWS];
            const uint32_t one = order[at];
            for (size_t p = begin[0]; p < begin[1]; p++) {
                const float g = block->exchange[p];
                const uint32_t two = order[block->other[p]];
                const uint32_t i = one < two ? one : two, j = one < two ? two : one;
                if (!(g > 0 || keep_hidden)) continue;
                if (fill == 0) {
                    __atomic_fetch_add(&rows.indptr[i + 1], 1, __ATOMIC_RELAXED);
                    continue;
                }
                const uint64_t there = __atomic_fetch_add(&next[i], 1, __ATOMIC_RELAXED);
                rows.indices[there] = j;
                rows.data[there] = g;
            }
        }
        if (fill == 1) break;
        for (size_t i = 0; i < n; i++) rows.indptr[i + 1] += rows.indptr[i];
        memcpy(next, rows.indptr, (n + 1) * sizeof *next);
        TRY(csr_reserve(&rows, rows.indptr[n], error));
    }
    TRY(sort_rows(&rows, error));
    *G = rows;
    rows = (csr){0};
done:
    free(next);
    csr_free(&rows);
    return status;
}
