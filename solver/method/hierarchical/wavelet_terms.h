/* Sparse matrices on their way through products: rows of columns and values side by side, made in parallel
 * block by block of rows. It knows nothing of wavelets or light. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_TERMS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_TERMS_H

#include "solver/base/progress.h"

#include <math.h>
#include <stdint.h>

typedef struct row_term {
    uint32_t column;
    float value;
} row_term;

/* Row i is row[i][0 .. length[i] - 1], in no order of columns; the rows of a block lie behind each other. */
typedef struct term_rows {
    size_t n, n_blocks;
    row_term **row;    /* [n] */
    uint32_t *length;  /* [n] */
    row_term **blocks; /* [n_blocks] */
} term_rows;

void term_rows_free(term_rows *a);

/* Sum of all lengths. */
size_t term_rows_count(const term_rows *a);

/* Matrices that one pass makes at most. */
enum { ROW_OUTPUTS = 2 };

/* Terms that a row_work_room is larger than its row may be, so that one may be written and not counted. */
enum { ROW_SPARE = 1 };

typedef struct row_store {
    row_term *terms;
    size_t used, capacity;
} row_store;

/* The working area of a thread: the row that it sums up and the rows of its block that are done. */
typedef struct row_work {
    float *sums;       /* [n], all 0 between rows */
    uint32_t *columns; /* [n + ROW_SPARE], those where sums are not 0 */
    size_t count;      /* of columns */
    row_term *spare;   /* [n + ROW_SPARE] */
    double terms;      /* that were added */
    row_store done[ROW_OUTPUTS];
} row_work;

/* One for each thread, [n_threads]. Errors: LAM_ERR_MEMORY. */
lam_status row_works_make(size_t n, size_t n_threads, row_work **out, lam_error *error);
void row_works_free(row_work *works, size_t n_threads);

/* sums_j += value, where columns [count] are those that are not 0; returns their new number. */
static inline size_t row_sum_add(float *sums, uint32_t *columns, size_t count, uint32_t j, float value) {
    const float before = sums[j], after = before + value;
    columns[count] = j;
    /* A sum that cancels to 0 is set to 1e-30, so that its column is not listed twice. */
    sums[j] = after == 0 ? 1e-30f : after;
    return count + (before == 0);
}

static inline void row_work_add(row_work *w, uint32_t j, float value) {
    w->count = row_sum_add(w->sums, w->columns, w->count, j, value);
}

/* Room for a row of `count` terms of an output, which is kept by adding its length to done[output].used.
 * Errors: LAM_ERR_MEMORY. */
lam_status row_work_room(row_work *w, size_t output, size_t count, row_term **out, lam_error *error);

/* Makes row i of each output in w, and leaves w->sums at 0. */
typedef lam_status row_maker(const void *context, size_t i, row_work *w, lam_error *error);

typedef struct rows_pass {
    size_t n, n_threads, n_outputs;
    row_work *works; /* [n_threads] */
    row_maker *make;
    const void *context;
    const progress *progress; /* asked for cancellation */
    const char *stage;        /* under which the share of rows is reported; NULL: it is not */
    /* Matrices of which row i of the outputs takes row i alone, apart, or NULL: their terms are freed block
       by block as they are used up, and the caller frees the rest. */
    term_rows *spent[ROW_OUTPUTS];
} rows_pass;

/* out [n_outputs]: all rows; the bits do not depend on the number of threads. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED, those of the maker. */
lam_status term_rows_make(const rows_pass *pass, term_rows *out, lam_error *error);

/* Copies terms by descending magnitude to within an eighth of an octave (a factor of 1.125 at most), down to
 * 2^-31 of the largest: equal eighths, and all that is smaller, stay in their order. from and to are apart.
 */
void row_terms_sort(size_t count, const row_term *from, row_term *to);

/* Sorts terms by column in place; equal columns stay in their order. spare: room for as many. O(n log n). */
void row_terms_by_column(size_t count, row_term *terms, row_term *spare);

#endif
