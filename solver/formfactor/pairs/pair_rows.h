/* Exchange areas and states of pairs of elements, in rows by position in a cluster tree's order: a row holds
 * the pairs with greater positions. One thread computes a whole block of rows, which a scratch file may keep.
 */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_ROWS_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_ROWS_H

#include "solver/formfactor/rows/row_file.h"
#include "solver/linalg/csr.h"

/* The occlusion of a pair: CERTAIN by an empty shaft, OPEN, HIDDEN or MIXED by an occlusion test. The flag
 * SETTLED beside it: the test was accurate enough; EXACT: by projection, not by segments. */
typedef enum pair_state { PAIR_UNKNOWN, PAIR_CERTAIN, PAIR_OPEN, PAIR_HIDDEN, PAIR_MIXED } pair_state;
enum { PAIR_SETTLED = 8, PAIR_EXACT = 16, PAIR_BLOCK_ROWS = 64 };

/* The pairs of PAIR_BLOCK_ROWS rows, one array a member: positions ascending in a row, exchange areas,
 * states. */
typedef struct pair_block {
    uint32_t *other;
    float *exchange;
    uint8_t *state;
    size_t used, capacity;
    size_t begin[PAIR_BLOCK_ROWS + 1]; /* of each row */
} pair_block;

typedef struct pair_rows {
    size_t n, n_blocks;
    pair_block *blocks;
} pair_rows;

lam_status pair_rows_create(size_t n, pair_rows *out, lam_error *error);
void pair_rows_free(pair_rows *rows);

/* First position of a block, and how many rows it has. */
static inline size_t pair_rows_first(size_t block) {
    return block * PAIR_BLOCK_ROWS;
}
static inline size_t pair_rows_length(const pair_rows *rows, size_t block) {
    const size_t rest = rows->n - pair_rows_first(block);
    return rest < PAIR_BLOCK_ROWS ? rest : PAIR_BLOCK_ROWS;
}

/* Makes room for that many more pair_block_add; false where there is no memory. */
bool pair_block_reserve(pair_block *b, size_t more);
static inline void pair_block_add(pair_block *b, uint32_t other, float exchange, uint8_t state) {
    b->other[b->used] = other;
    b->exchange[b->used] = exchange;
    b->state[b->used++] = state;
}

/* Returns reserved and unused memory. */
void pair_block_shrink(pair_block *b);

/* The state of the pair of two positions; PAIR_UNKNOWN where it is in no row. */
pair_state pair_rows_state(const pair_rows *rows, uint32_t p, uint32_t q);

/* The place of the pair of two positions; false where it is in no row. */
bool pair_rows_find(const pair_rows *rows, uint32_t p, uint32_t q, const pair_block **block, size_t *at);

/* A scratch file of such rows, and its blocks written and read. order is the tree's, position to element. */
lam_status pair_rows_open(scratch *s, const char *name, const char geometry[33], const recipe *r, size_t n,
                          const uint32_t *order, row_file **out, lam_error *error);
lam_status pair_rows_append(const pair_rows *rows, size_t block, const uint32_t *order, row_file *f,
                            lam_error *error);
lam_status pair_rows_fetch(pair_rows *rows, size_t block, const uint32_t *order, const row_file *f,
                           lam_error *error);

/* Reads only the exchange areas of a block, while other threads may read its states. */
lam_status pair_rows_fetch_exchange(pair_rows *rows, size_t block, const uint32_t *order, const row_file *f,
                                    lam_error *error);

/* The upper triangle of exchange areas in mesh order; keep_hidden keeps zeros as entries. Freed by csr_free.
 */
lam_status pair_rows_gather(const pair_rows *found, const uint32_t *order, bool keep_hidden, csr *G,
                            lam_error *error);

#endif
