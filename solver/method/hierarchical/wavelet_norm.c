#include "solver/method/hierarchical/wavelet_norm.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>

double wavelet_norm_of_rows(const csr *F, const double *area) {
    double sum = 0;
    for (size_t i = 0; i < F->n; i++)
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const double share = (double)F->data[e];
            sum += share * share * area[i] / area[F->indices[e]];
        }
    return sqrt(sum);
}

/* sum over blocks of 2 A_a A_b L_00^2 with areas A = sum of A_i balance_i^2 */
lam_status wavelet_norm_of_blocks(const block_factors *f, double *out, lam_error *error) {
    double *before = memory_allocate(f->n + 1, sizeof *before, "operator", error), sum = 0;
    if (before == NULL) return LAM_ERR_MEMORY;
    for (size_t p = 0; p < f->n; p++) {
        const double balance = f->balance != NULL ? f->balance[p] : 1;
        before[p + 1] = before[p] + f->area[p] * balance * balance;
    }
    for (size_t k = 0; k < f->n_blocks; k++) {
        const cluster_block *block = &f->blocks[k];
        const block_node *a = &f->nodes[block->a], *b = &f->nodes[block->b];
        const double mean = (double)block->L[0][0];
        sum += 2 * mean * mean * (before[a->end] - before[a->begin]) * (before[b->end] - before[b->begin]);
    }
    free(before);
    *out = sqrt(sum);
    return LAM_OK;
}
