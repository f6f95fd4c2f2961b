#include "solver/method/sparse/sparse_inverse.h"

#include "solver/method/sparse/sparse_rows.h"

#include <stdlib.h>
#include <string.h>

/* Rows that a thread computes at a time. */
enum { BLOCK = 64 };

/* Rows b BLOCK ... b BLOCK + BLOCK - 1, until all are concatenated. */
typedef struct found_block {
    uint32_t *indices;
    float *data;
    size_t used;
} found_block;

typedef struct gathering {
    const rows_job *job;
    found_block *blocks;
    uint64_t *lengths; /* [n + 1], lengths[row + 1] is the length of a row */
    double *discarded;
    size_t bounces, entries, most; /* most: limit of entries, 0: none */
    bool stop;
    lam_status status;
    lam_error error;
} gathering;

static void gather_fail(gathering *g, lam_status status, const lam_error *error) {
#pragma omp critical(sparse_inverse_failure)
    if (g->status == LAM_OK) {
        g->status = status;
        g->error = *error;
    }
#pragma omp atomic write
    g->stop = true;
}

static lam_status gather_block(gathering *g, size_t b, row_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = d->n, first = b * BLOCK, last = first + BLOCK < n ? first + BLOCK : n;
    size_t most = 0, entries;
    d->used = 0;
    for (size_t row = first; row < last; row++) {
        size_t bounces;
        row_work_compute(g->job, row, d, &g->discarded[row], &bounces);
        if (bounces > most) most = bounces;
        if (bounces > ROW_BOUNCES)
            FAIL(error, LAM_ERR_NUMERIC,
                 "sparse inverse at --threshold %g: light of element %u is above it after %d bounces, as "
                 "nearly "
                 "all is reflected; use --method hierarchical or a larger --threshold",
                 g->job->threshold, g->job->problem->order[row], ROW_BOUNCES);
        if (!row_work_store(d, &g->lengths[row + 1]))
            FAIL(error, LAM_ERR_MEMORY, "sparse inverse: out of memory");
    }
    found_block *block = &g->blocks[b];
    block->indices = memory_allocate(d->used, sizeof *block->indices, "sparse inverse", error);
    block->data = memory_allocate(d->used, sizeof *block->data, "sparse inverse", error);
    if (block->indices == NULL || block->data == NULL) TRY(LAM_ERR_MEMORY);
    if (d->used > 0) {
        memcpy(block->indices, d->indices, d->used * sizeof *block->indices);
        memcpy(block->data, d->data, d->used * sizeof *block->data);
    }
    block->used = d->used;
#pragma omp critical(sparse_inverse_count)
    {
        g->entries += block->used;
        entries = g->entries;
        if (most > g->bounces) g->bounces = most;
    }
    if (g->most > 0 && entries > g->most)
        FAIL(error, LAM_ERR_MEMORY,
             "sparse inverse at --threshold %g: more than the %zu entries that --memory holds; use a larger "
             "--threshold",
             g->job->threshold, g->most);
done:
    return status;
}

static lam_status gather_all(gathering *g, size_t n, const progress *p, lam_error *error) {
    const size_t n_blocks = (n + BLOCK - 1) / BLOCK;
    size_t done_blocks = 0;
#pragma omp parallel
    {
        row_work d;
        lam_error own = {.message = ""};
        if (row_work_make(n, &d, &own) != LAM_OK) gather_fail(g, LAM_ERR_MEMORY, &own);
#pragma omp for schedule(dynamic, 1)
        for (size_t b = 0; b < n_blocks; b++) {
            bool stop;
#pragma omp atomic read
            stop = g->stop;
            if (stop) continue;
            const lam_status found = gather_block(g, b, &d, &own);
            if (found != LAM_OK) gather_fail(g, found, &own);
#pragma omp critical(sparse_inverse_progress)
            {
                progress_report(p, "sparse inverse", (double)++done_blocks / (double)n_blocks);
                if (progress_cancelled(p)) stop = true;
            }
            if (stop) {
                (void)status_fail(&own, LAM_ERR_CANCELLED, "cancelled");
                gather_fail(g, LAM_ERR_CANCELLED, &own);
            }
        }
        row_work_free(&d);
    }
    if (g->status != LAM_OK) *error = g->error;
    return g->status;
}

/* Concatenates the blocks; each is freed once it is copied. */
static lam_status put_together(gathering *g, size_t n, csr *M, lam_error *error) {
    lam_status status = LAM_OK;
    *M = (csr){.n = n, .indptr = g->lengths};
    g->lengths = NULL;
    for (size_t row = 0; row < n; row++) M->indptr[row + 1] += M->indptr[row];
    TRY(csr_reserve(M, (size_t)M->indptr[n], error));
    for (size_t b = 0, to = 0; b < (n + BLOCK - 1) / BLOCK; b++) {
        found_block *block = &g->blocks[b];
        memcpy(M->indices + to, block->indices, block->used * sizeof *block->indices);
        memcpy(M->data + to, block->data, block->used * sizeof *block->data);
        to += block->used;
        free(block->indices);
        free(block->data);
        *block = (found_block){.used = 0};
    }
done:
    return status;
}

lam_status sparse_inverse_rows(const build_problem *problem, const float *rho, const sparse_limits *limits,
                               size_t memory, const progress *p, sparse_inverse *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, n_blocks = (n + BLOCK - 1) / BLOCK;
    rows_job job;
    gathering g = {.job = &job, .most = memory / (sizeof(uint32_t) + sizeof(float))};
    *out = (sparse_inverse){.bounces = 0};
    TRY(rows_job_begin(problem, rho, limits, &job, error));
    g.blocks = memory_allocate(n_blocks, sizeof *g.blocks, "sparse inverse", error);
    g.lengths = memory_allocate(n + 1, sizeof *g.lengths, "sparse inverse", error);
    g.discarded = memory_allocate(n, sizeof *g.discarded, "sparse inverse", error);
    if (g.blocks == NULL || g.lengths == NULL || g.discarded == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gather_all(&g, n, p, error));
    TRY(put_together(&g, n, &out->M, error));
    out->discarded = g.discarded;
    out->bounces = g.bounces;
    g.discarded = NULL;
done:
    for (size_t b = 0; g.blocks != NULL && b < n_blocks; b++) {
        free(g.blocks[b].indices);
        free(g.blocks[b].data);
    }
    free(g.blocks);
    free(g.lengths);
    free(g.discarded);
    rows_job_end(&job);
    if (status != LAM_OK) sparse_inverse_free(out);
    return status;
}

void sparse_inverse_free(sparse_inverse *s) {
    csr_free(&s->M);
    free(s->discarded);
    *s = (sparse_inverse){.bounces = 0};
}
