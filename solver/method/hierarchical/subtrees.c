#include "solver/method/hierarchical/subtrees.h"

#include "store/status.h"

#include <stdlib.h>

/* The first node of the subtree of t in postorder. */
static size_t subtree_begin(const wavelets *w, size_t t) {
    while (w->nodes[t].from_left > 0) t = w->nodes[t].left;
    return t;
}

static size_t cut(const wavelets *w, size_t most, wavelet_piece *pieces) {
    size_t count = 0;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const uint32_t parent = w->nodes[t].parent;
        const bool within = parent != WAVELET_NONE && w->nodes[parent].n_elements <= most;
        if (w->nodes[t].n_elements <= most && !within)
            pieces[count++] = (wavelet_piece){(uint32_t)subtree_begin(w, t), (uint32_t)t + 1};
    }
    return count;
}

lam_status subtrees_run(const wavelets *w, size_t most, size_t n_threads, run_subtree *run, void *context,
                        lam_error *error) {
    lam_status status = LAM_OK;
    wavelet_piece *pieces = memory_allocate(w->n_nodes, sizeof *pieces, "wavelets", error);
    size_t n_taken = 0;
    int failed = 0;
    if (pieces == NULL) TRY(LAM_ERR_MEMORY);
    const size_t n_pieces = cut(w, most, pieces);
#pragma omp parallel num_threads((int)n_threads)
    {
        size_t mine;
#pragma omp critical(subtrees_threads)
        mine = n_taken++;
#pragma omp for schedule(dynamic, 1)
        for (size_t k = 0; k < n_pieces; k++) {
            lam_error one = {.message = ""};
            if (__atomic_load_n(&failed, __ATOMIC_RELAXED)) continue;
            const lam_status now = run(context, pieces[k], mine, &one);
            if (now == LAM_OK) continue;
#pragma omp critical(subtrees_failed)
            if (!failed) {
                status = status_fail(error, now, "%s", one.message);
                __atomic_store_n(&failed, 1, __ATOMIC_RELAXED);
            }
        }
    }
    if (status != LAM_OK) goto done;
    for (size_t t = 0; t < w->n_nodes; t++)
        if (w->nodes[t].n_elements > most)
            TRY(run(context, (wavelet_piece){(uint32_t)t, (uint32_t)t + 1}, 0, error));
done:
    free(pieces);
    return status;
}
