#include "support/random_blocks.h"

#include "solver/base/random.h"

void block_functions_at(const block_factors *f, uint32_t t, size_t i, double m[BLOCK_FUNCTIONS]) {
    m[0] = 1;
    for (int d = 0; d < 2; d++) m[1 + d] = (f->place[i][d] - f->nodes[t].centre[d]) * f->nodes[t].over[d];
}

void block_add_dense(const block_factors *f, const cluster_block *k, double *F, double *size) {
    for (size_t i = f->nodes[k->a].begin; i < f->nodes[k->a].end; i++)
        for (size_t j = f->nodes[k->b].begin; j < f->nodes[k->b].end; j++) {
            double x[BLOCK_FUNCTIONS], y[BLOCK_FUNCTIONS], value = 0, sum = 0;
            block_functions_at(f, k->a, i, x);
            block_functions_at(f, k->b, j, y);
            for (int r = 0; r < BLOCK_FUNCTIONS; r++)
                for (int c = 0; c < BLOCK_FUNCTIONS; c++) {
                    value += x[r] * (double)k->L[r][c] * y[c];
                    sum += fabs(x[r] * (double)k->L[r][c] * y[c]);
                }
            const double even = f->balance != NULL ? f->balance[i] * f->balance[j] : 1;
            F[i * f->n + j] += even * value * f->area[j];
            F[j * f->n + i] += even * value * f->area[i];
            size[i * f->n + j] += even * sum * f->area[j];
            size[j * f->n + i] += even * sum * f->area[i];
        }
}

void random_blocks(block_factors *f, size_t rounds, uint64_t *seed) {
    const size_t n = f->n, n_nodes = f->n_clusters + n;
    bool *taken = test_allocate(n * n, sizeof *taken);
    f->blocks = test_allocate(rounds, sizeof *f->blocks);
    for (size_t round = 0; round < rounds; round++) {
        cluster_block *k = &f->blocks[f->n_blocks];
        k->a = (uint32_t)(random_lcg_unit(seed) * (double)n_nodes);
        k->b = (uint32_t)(random_lcg_unit(seed) * (double)n_nodes);
        const block_node *a = &f->nodes[k->a], *b = &f->nodes[k->b];
        bool fits = a->end <= b->begin || b->end <= a->begin;
        for (size_t i = a->begin; fits && i < a->end; i++)
            for (size_t j = b->begin; j < b->end; j++) fits = fits && !taken[i * n + j];
        if (!fits) continue;
        for (size_t i = a->begin; i < a->end; i++)
            for (size_t j = b->begin; j < b->end; j++) taken[i * n + j] = taken[j * n + i] = true;
        for (int r = 0; r < BLOCK_FUNCTIONS; r++)
            for (int c = 0; c < BLOCK_FUNCTIONS; c++) k->L[r][c] = (float)(random_lcg_unit(seed) - .3);
        f->n_blocks++;
    }
    free(taken);
}

void blocks_of_pairs(const csr *F, block_factors *f) {
    const uint32_t first = (uint32_t)f->n_clusters;
    uint32_t *position = test_allocate(f->n, sizeof *position);
    f->blocks = test_allocate(F->indptr[f->n], sizeof *f->blocks);
    for (size_t p = 0; p < f->n; p++) position[f->order[p]] = (uint32_t)p;
    for (size_t i = 0; i < f->n; i++)
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const uint32_t j = F->indices[e];
            if (j <= i) continue;
            cluster_block *made = &f->blocks[f->n_blocks++];
            *made = (cluster_block){.a = first + position[i], .b = first + position[j]};
            made->L[0][0] = (float)((double)F->data[e] / f->area[position[j]]);
        }
    free(position);
}
