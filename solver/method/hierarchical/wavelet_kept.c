#include "solver/method/hierarchical/wavelet_kept.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>

void kept_free(kept_list *k) {
    free(k->list);
    *k = (kept_list){.count = 0};
}

lam_status kept_put(kept_list *k, uint32_t i, uint32_t j, float value, lam_error *error) {
    if (k->count == k->capacity) {
        const size_t capacity = k->capacity + k->capacity / 2 + 4096;
        kept *const more = realloc(k->list, capacity * sizeof *more);
        if (more == NULL)
            return status_fail(error, LAM_ERR_MEMORY, "wavelets: cannot allocate %zu x %zu bytes", capacity,
                               sizeof *more);
        k->list = more;
        k->capacity = capacity;
    }
    k->list[k->count++] = i < j ? (kept){i, j, value} : (kept){j, i, value};
    return LAM_OK;
}

static int by_column(const void *left, const void *right) {
    const kept *a = left, *b = right;
    return a->j < b->j ? -1 : a->j > b->j;
}

lam_status kept_gather(size_t n, kept_list *lists, size_t n_lists, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    kept *all = NULL;
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_lists; k++)
        for (size_t e = 0; e < lists[k].count; e++) made.indptr[lists[k].list[e].i + 1]++;
    TRY(csr_begin_rows(&made, "wavelets", error));
    all = memory_allocate((size_t)made.indptr[n], sizeof *all, "wavelets", error);
    if (all == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_lists; k++) {
        for (size_t e = 0; e < lists[k].count; e++) all[made.indptr[lists[k].list[e].i]++] = lists[k].list[e];
        kept_free(&lists[k]);
    }
    csr_end_rows(&made);
#pragma omp parallel for schedule(dynamic, 256) num_threads((int)n_lists)
    for (size_t i = 0; i < n; i++) {
        qsort(all + made.indptr[i], (size_t)(made.indptr[i + 1] - made.indptr[i]), sizeof *all, by_column);
        for (uint64_t e = made.indptr[i]; e < made.indptr[i + 1]; e++) {
            made.indices[e] = all[e].j;
            made.data[e] = all[e].value;
        }
    }
    *out = made;
    made = (csr){.n = 0};
done:
    free(all);
    csr_free(&made);
    return status;
}

lam_status kept_add_sides(const wavelets *w, const float *weight, float threshold, csr *S, lam_error *error) {
    uint64_t used = 0, p = 0;
    float *of = memory_allocate(w->n, sizeof *of, "wavelets", error); /* by coefficient */
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
