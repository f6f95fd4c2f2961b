#include "solver/method/hierarchical/wavelet_entries.h"

#include "solver/base/array_grow.h"
#include "solver/method/hierarchical/wavelet_terms.h"
#include "solver/operator/wavelet/wavelet_plan.h"

#include "store/status.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

void coefficient_list_free(coefficient_list *k) {
    free(k->list);
    *k = (coefficient_list){.count = 0};
}

lam_status coefficient_list_add(coefficient_list *k, uint32_t i, uint32_t j, float value, lam_error *error) {
    if (array_grow(&k->list, &k->capacity, k->count + 1, sizeof *k->list, "wavelets", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    k->list[k->count++] = i < j ? (coefficient){i, j, value} : (coefficient){j, i, value};
    return LAM_OK;
}

/* Puts the coefficients of all lists into their rows, in no order; each thread takes those of some rows. */
static void fill_rows(const coefficient_list *lists, size_t n_lists, csr *out) {
#pragma omp parallel num_threads((int)n_lists)
    {
        const size_t n_parts = (size_t)omp_get_num_threads(), part = (size_t)omp_get_thread_num();
        const size_t first = csr_part(out, part, n_parts), last = csr_part(out, part + 1, n_parts);
#pragma omp barrier
        for (size_t k = 0; k < n_lists; k++)
            for (size_t e = 0; e < lists[k].count; e++) {
                const coefficient *const c = &lists[k].list[e];
                if (c->i < first || c->i >= last) continue;
                const uint64_t to = out->indptr[c->i]++;
                out->indices[to] = c->j;
                out->data[to] = c->value;
            }
    }
    csr_end_rows(out);
}

/* room [n_threads][2 longest] */
static void sort_rows(csr *a, size_t n_threads, size_t longest, row_term *room) {
#pragma omp parallel for schedule(dynamic, 256) num_threads((int)n_threads)
    for (size_t i = 0; i < a->n; i++) {
        row_term *const terms = room + (size_t)omp_get_thread_num() * 2 * longest;
        const uint64_t first = a->indptr[i];
        const size_t count = (size_t)(a->indptr[i + 1] - first);
        for (size_t e = 0; e < count; e++) terms[e] = (row_term){a->indices[first + e], a->data[first + e]};
        row_terms_by_column(count, terms, terms + longest);
        for (size_t e = 0; e < count; e++) {
            a->indices[first + e] = terms[e].column;
            a->data[first + e] = terms[e].value;
        }
    }
}

lam_status coefficient_lists_join(size_t n, coefficient_list *lists, size_t n_lists, csr *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    row_term *room = NULL;
    size_t longest = 0;
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_lists; k++)
        for (size_t e = 0; e < lists[k].count; e++) made.indptr[lists[k].list[e].i + 1]++;
    for (size_t i = 0; i < n; i++)
        if (made.indptr[i + 1] > longest) longest = (size_t)made.indptr[i + 1];
    room = memory_allocate(n_lists, 2 * longest * sizeof *room, "wavelets", error);
    if (room == NULL) TRY(LAM_ERR_MEMORY);
    TRY(csr_begin_rows(&made, "wavelets", error));
    fill_rows(lists, n_lists, &made);
    for (size_t k = 0; k < n_lists; k++) coefficient_list_free(&lists[k]);
    sort_rows(&made, n_lists, longest, room);
    *out = made;
    made = (csr){.n = 0};
done:
    free(room);
    csr_free(&made);
    return status;
}

lam_status wavelet_add_transpose(const wavelets *w, const float *weight, float threshold, csr *S,
                                 lam_error *error) {
    uint64_t used = 0, p = 0;
    float *of =
        memory_allocate(w->n, sizeof *of, "wavelets", error); /* by coefficient, the weight of its node */
    if (of == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const size_t count = a->inputs - (t + 1 < w->n_nodes ? a->scaling : 0);
        for (size_t k = 0; k < count; k++) of[a->first + k] = weight[t];
    }
    for (size_t i = 0; i < w->n; i++) {
        const uint64_t end = S->indptr[i + 1];
        while (p < end) {
            const uint32_t j = S->indices[p];
            float sum = S->data[p++] * (j == i ? 2 : 1);
            if (p < end && S->indices[p] == j) sum += S->data[p++];
            if (!(fabsf(sum) > threshold * of[i] * of[j])) continue;
            S->indices[used] = j;
            S->data[used++] = sum;
        }
        S->indptr[i + 1] = used;
    }
    free(of);
    return csr_reserve(S, used, error);
}

void fine_columns_free(fine_columns *d) {
    free(d->list);
    *d = (fine_columns){.count = 0};
}

lam_status fine_columns_reserve(fine_columns *d, size_t more, lam_error *error) {
    return array_grow(&d->list, &d->capacity, d->count + more, sizeof *d->list, "wavelets", error);
}

lam_status fine_columns_union(const fine_columns *a, const fine_column *b, size_t b_count, fine_columns *into,
                              lam_error *error) {
    into->count = 0;
    const lam_status status = fine_columns_reserve(into, a->count + b_count, error);
    if (status != LAM_OK) return status;
    size_t p = 0, q = 0;
    while (p < a->count || q < b_count) {
        const bool from_a = q == b_count || (p < a->count && a->list[p].j < b[q].j);
        into->list[into->count++] = from_a ? a->list[p++] : b[q++];
    }
    return LAM_OK;
}

lam_status fine_columns_copy(const fine_columns *from, fine_columns *out, lam_error *error) {
    *out = (fine_columns){.count = from->count, .capacity = from->count};
    if (from->count == 0) return LAM_OK;
    out->list = memory_allocate(from->count, sizeof *out->list, "wavelets", error);
    if (out->list == NULL) {
        *out = (fine_columns){.count = 0};
        return LAM_ERR_MEMORY;
    }
    memcpy(out->list, from->list, from->count * sizeof *out->list);
    return LAM_OK;
}
