#include "solver/method/hierarchical/wavelet_terms.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>
#include <string.h>

/* Threads take blocks of rows. */
enum { ROWS_AT_ONCE = 256 };

void term_rows_free(term_rows *a) {
    for (size_t k = 0; a->blocks != NULL && k < a->n_blocks; k++) free(a->blocks[k]);
    free(a->blocks);
    free(a->row);
    free(a->length);
    *a = (term_rows){.n = 0};
}

size_t term_rows_count(const term_rows *a) {
    size_t count = 0;
    for (size_t i = 0; i < a->n; i++) count += a->length[i];
    return count;
}

void row_works_free(row_work *works, size_t n_threads) {
    for (size_t k = 0; works != NULL && k < n_threads; k++) {
        free(works[k].sums);
        free(works[k].columns);
        free(works[k].spare);
        for (size_t o = 0; o < ROW_OUTPUTS; o++) free(works[k].done[o].terms);
    }
    free(works);
}

lam_status row_works_make(size_t n, size_t n_threads, row_work **out, lam_error *error) {
    lam_status status = LAM_OK;
    row_work *works = memory_allocate(n_threads, sizeof *works, "wavelets", error);
    if (works == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_threads; k++) {
        row_work *w = &works[k];
        w->sums = memory_allocate(n, sizeof *w->sums, "wavelets", error);
        w->columns = memory_allocate(n + ROW_SPARE, sizeof *w->columns, "wavelets", error);
        w->spare = memory_allocate(n + ROW_SPARE, sizeof *w->spare, "wavelets", error);
        if (w->sums == NULL || w->columns == NULL || w->spare == NULL) TRY(LAM_ERR_MEMORY);
    }
    *out = works;
    works = NULL;
done:
    row_works_free(works, n_threads);
    return status;
}

lam_status row_work_room(row_work *w, size_t output, size_t count, row_term **out, lam_error *error) {
    row_store *s = &w->done[output];
    const lam_status status =
        array_grow(&s->terms, &s->capacity, s->used + count + ROW_SPARE, sizeof *s->terms, "wavelets", error);
    if (status == LAM_OK) *out = s->terms + s->used;
    return status;
}

/* Moves the rows of a block that are done into memory of their size. */
static lam_status keep_block(const row_store *done, size_t block, size_t first, size_t last, term_rows *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    size_t used = 0;
    if (done->used == 0) return LAM_OK;
    TRY(array_resize(&out->blocks[block], done->used, sizeof *done->terms, "wavelets", error));
    memcpy(out->blocks[block], done->terms, done->used * sizeof *done->terms);
    for (size_t i = first; i < last; used += out->length[i++])
        if (out->length[i] > 0) out->row[i] = out->blocks[block] + used;
done:
    return status;
}

/* Frees the terms of a block, whose rows are then empty. */
static void spend_block(term_rows *a, size_t block, size_t first, size_t last) {
    free(a->blocks[block]);
    a->blocks[block] = NULL;
    for (size_t i = first; i < last; i++) {
        a->row[i] = NULL;
        a->length[i] = 0;
    }
}

static lam_status make_block(const rows_pass *pass, size_t block, row_work *w, term_rows *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = block * ROWS_AT_ONCE,
                 last = first + ROWS_AT_ONCE < pass->n ? first + ROWS_AT_ONCE : pass->n;
    for (size_t o = 0; o < pass->n_outputs; o++) w->done[o].used = 0;
    for (size_t i = first; i < last; i++) {
        size_t before[ROW_OUTPUTS];
        for (size_t o = 0; o < pass->n_outputs; o++) before[o] = w->done[o].used;
        TRY(pass->make(pass->context, i, w, error));
        for (size_t o = 0; o < pass->n_outputs; o++)
            out[o].length[i] = (uint32_t)(w->done[o].used - before[o]);
    }
    for (size_t o = 0; o < ROW_OUTPUTS; o++)
        if (pass->spent[o] != NULL) spend_block(pass->spent[o], block, first, last);
    for (size_t o = 0; o < pass->n_outputs; o++)
        TRY(keep_block(&w->done[o], block, first, last, &out[o], error));
done:
    return status;
}

static lam_status make_all(const rows_pass *pass, term_rows *made, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t blocks = (pass->n + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    int failed = 0;
    size_t n_done = 0, n_taken = 0;
#pragma omp parallel num_threads((int)pass->n_threads)
    {
        size_t mine = 0;
#pragma omp critical(wavelet_terms_works)
        mine = n_taken++;
#pragma omp for schedule(dynamic, 1)
        for (size_t block = 0; block < blocks; block++) {
            lam_error one = {.message = ""};
            if (__atomic_load_n(&failed, __ATOMIC_RELAXED)) continue;
            lam_status now = make_block(pass, block, &pass->works[mine], made, &one);
#pragma omp critical(wavelet_terms_progress)
            {
                n_done++;
                if (pass->stage != NULL)
                    progress_report(pass->progress, pass->stage, (double)n_done / (double)blocks);
                if (now == LAM_OK && progress_cancelled(pass->progress))
                    now = status_fail(&one, LAM_ERR_CANCELLED, "cancelled");
                if (now != LAM_OK && !failed) {
                    status = status_fail(error, now, "%s", one.message);
                    __atomic_store_n(&failed, 1, __ATOMIC_RELAXED);
                }
            }
        }
    }
    return status;
}

lam_status term_rows_make(const rows_pass *pass, term_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = pass->n, blocks = (n + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    term_rows made[ROW_OUTPUTS] = {{.n = 0}};
    for (size_t o = 0; o < pass->n_outputs; o++) {
        made[o] = (term_rows){.n = n,
                              .n_blocks = blocks,
                              .row = memory_allocate(n, sizeof *made[o].row, "wavelets", error),
                              .length = memory_allocate(n, sizeof *made[o].length, "wavelets", error),
                              .blocks = memory_allocate(blocks, sizeof *made[o].blocks, "wavelets", error)};
        if (made[o].row == NULL || made[o].length == NULL || made[o].blocks == NULL) TRY(LAM_ERR_MEMORY);
    }
    TRY(make_all(pass, made, error));
    for (size_t o = 0; o < pass->n_outputs; o++) {
        out[o] = made[o];
        made[o] = (term_rows){.n = 0};
    }
done:
    for (size_t o = 0; o < ROW_OUTPUTS; o++) term_rows_free(&made[o]);
    return status;
}

/* Rows up to which insertion is quicker; bits of a float below an eighth of an octave; places of the sort. */
enum { SHORT_ROW = 12, EIGHTH_SHIFT = 20, EIGHTHS = 256 };

/* The logarithm of |value| in eighths of an octave, rounded down. */
static inline uint32_t eighth_of(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits & INT32_MAX) >> EIGHTH_SHIFT;
}

void row_terms_sort(size_t count, const row_term *from, row_term *to) {
    uint32_t at[EIGHTHS] = {0}, most = 0, sum = 0;
    if (count <= SHORT_ROW) {
        for (size_t k = 0; k < count; k++) {
            size_t place = k;
            for (; place > 0 && eighth_of(to[place - 1].value) < eighth_of(from[k].value); place--)
                to[place] = to[place - 1];
            to[place] = from[k];
        }
        return;
    }
    for (size_t k = 0; k < count; k++) {
        const uint32_t eighth = eighth_of(from[k].value);
        most = eighth > most ? eighth : most;
    }
#define PLACE(term) (most - eighth_of((term).value) < EIGHTHS ? most - eighth_of((term).value) : EIGHTHS - 1)
    for (size_t k = 0; k < count; k++) at[PLACE(from[k])]++;
    for (size_t b = 0; b < EIGHTHS; b++) {
        const uint32_t here = at[b];
        at[b] = sum;
        sum += here;
    }
    for (size_t k = 0; k < count; k++) to[at[PLACE(from[k])]++] = from[k];
#undef PLACE
}

/* to [last - first] = the sorted terms [first, middle) and [middle, last). */
static void merge_terms(const row_term *from, size_t first, size_t middle, size_t last, row_term *to) {
    size_t left = first, right = middle;
    while (left < middle && right < last)
        *to++ = from[from[right].column < from[left].column ? right++ : left++];
    if (left < middle) memcpy(to, from + left, (middle - left) * sizeof *to);
    if (right < last) memcpy(to, from + right, (last - right) * sizeof *to);
}

void row_terms_by_column(size_t count, row_term *terms, row_term *spare) {
    row_term *from = terms, *to = spare;
    for (size_t first = 0; first < count; first += SHORT_ROW)
        for (size_t k = first + 1; k < count && k < first + SHORT_ROW; k++) {
            const row_term one = terms[k];
            size_t place = k;
            for (; place > first && terms[place - 1].column > one.column; place--)
                terms[place] = terms[place - 1];
            terms[place] = one;
        }
    for (size_t run = SHORT_ROW; run < count; run *= 2) {
        for (size_t first = 0; first < count; first += 2 * run) {
            const size_t middle = first + run < count ? first + run : count,
                         last = middle + run < count ? middle + run : count;
            merge_terms(from, first, middle, last, to + first);
        }
        row_term *const swapped = from;
        from = to;
        to = swapped;
    }
    if (from != terms) memcpy(terms, from, count * sizeof *terms);
}
