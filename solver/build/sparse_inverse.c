#include "solver/build/sparse_inverse.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows that a thread takes at a time, and how many tell of all. */
enum { BLOCK = 64, SAMPLED = 256 };

/* Entries of R F that reach the threshold, rows and columns by position, and what each row lacks. */
typedef struct reflected {
    size_t n;
    uint64_t *indptr;
    uint32_t *indices;
    float *data;
    double *lost; /* [n] */
} reflected;

static void reflected_free(reflected *r) {
    free(r->indptr);
    free(r->indices);
    free(r->data);
    free(r->lost);
}

static lam_status reflected_make(const build_problem *p, const float *rho, const uint32_t *position,
                                 double threshold, reflected *r, lam_error *error) {
    const size_t n = p->n;
    *r = (reflected){.n = n};
    r->indptr = memory_allocate(n + 1, sizeof *r->indptr, "sparse inverse", error);
    r->lost = memory_allocate(n, sizeof *r->lost, "sparse inverse", error);
    if (r->indptr == NULL || r->lost == NULL) return LAM_ERR_MEMORY;
    for (size_t row = 0; row < n; row++) {
        const size_t i = p->order[row];
        uint64_t kept = 0;
        for (uint64_t e = p->F->indptr[i]; e < p->F->indptr[i + 1]; e++)
            kept += (double)rho[i] * (double)p->F->data[e] >= threshold;
        r->indptr[row + 1] = r->indptr[row] + kept;
    }
    r->indices = memory_allocate((size_t)r->indptr[n], sizeof *r->indices, "sparse inverse", error);
    r->data = memory_allocate((size_t)r->indptr[n], sizeof *r->data, "sparse inverse", error);
    if (r->indices == NULL || r->data == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 256)
    for (size_t row = 0; row < n; row++) {
        const size_t i = p->order[row];
        uint64_t to = r->indptr[row];
        for (uint64_t e = p->F->indptr[i]; e < p->F->indptr[i + 1]; e++) {
            const double t = (double)rho[i] * (double)p->F->data[e];
            if (t < threshold) {
                r->lost[row] += t;
                continue;
            }
            r->indices[to] = position[p->F->indices[e]];
            r->data[to++] = (float)t;
        }
    }
    return LAM_OK;
}

/* A row with most entries 0: where others are is marked, so that looking for them is no look at all. */
typedef struct sparse_row {
    double *value;    /* [n] */
    uint64_t *marked; /* [words] */
} sparse_row;

static inline void add_to(sparse_row *r, uint32_t j, double x) {
    r->value[j] += x;
    r->marked[j >> 6] |= (uint64_t)1 << (j & 63);
}

/* What a thread works with. */
typedef struct desk {
    size_t n, words;
    sparse_row sum, next; /* of T so far, and T R F */
    uint32_t *at;         /* [n], where T is not 0, ascending */
    double *T;            /* [n], there */
    size_t n_T;
    /* Rows that are done, one after the other. */
    uint32_t *indices;
    float *data;
    size_t used, capacity;
} desk;

static void desk_free(desk *d) {
    free(d->sum.value);
    free(d->sum.marked);
    free(d->next.value);
    free(d->next.marked);
    free(d->at);
    free(d->T);
    free(d->indices);
    free(d->data);
}

static lam_status desk_make(size_t n, desk *d, lam_error *error) {
    *d = (desk){.n = n, .words = (n + 63) / 64};
    d->sum.value = memory_allocate(n, sizeof *d->sum.value, "sparse inverse", error);
    d->next.value = memory_allocate(n, sizeof *d->next.value, "sparse inverse", error);
    d->sum.marked = memory_allocate(d->words, sizeof *d->sum.marked, "sparse inverse", error);
    d->next.marked = memory_allocate(d->words, sizeof *d->next.marked, "sparse inverse", error);
    d->at = memory_allocate(n, sizeof *d->at, "sparse inverse", error);
    d->T = memory_allocate(n, sizeof *d->T, "sparse inverse", error);
    const bool all = d->sum.value != NULL && d->next.value != NULL && d->sum.marked != NULL &&
                     d->next.marked != NULL && d->at != NULL && d->T != NULL;
    return all ? LAM_OK : LAM_ERR_MEMORY;
}

/* T = remove(next, threshold), added to the sum; next is 0 again. Returns what was removed. */
static double take_bounce(desk *d, double threshold) {
    double removed = 0;
    d->n_T = 0;
    for (size_t w = 0; w < d->words; w++) {
        for (uint64_t bits = d->next.marked[w]; bits != 0; bits &= bits - 1) {
            const uint32_t j = (uint32_t)(w * 64 + (size_t)__builtin_ctzll(bits));
            const double t = d->next.value[j];
            d->next.value[j] = 0;
            if (t < threshold) {
                removed += t;
                continue;
            }
            d->at[d->n_T] = j;
            d->T[d->n_T++] = t;
            add_to(&d->sum, j, t);
        }
        d->next.marked[w] = 0;
    }
    return removed;
}

/* next = T R F; returns what R F lacks of it. */
static double bounce(desk *d, const reflected *RF) {
    double lost = 0;
    for (size_t k = 0; k < d->n_T; k++) {
        const uint32_t row = d->at[k];
        const double t = d->T[k];
        lost += t * RF->lost[row];
        for (uint64_t e = RF->indptr[row]; e < RF->indptr[row + 1]; e++)
            add_to(&d->next, RF->indices[e], t * (double)RF->data[e]);
    }
    return lost;
}

static bool desk_reserve(desk *d, size_t more) {
    if (d->capacity - d->used >= more) return true;
    const size_t capacity = d->used + more + d->capacity / 2 + 4096;
    uint32_t *indices = realloc(d->indices, capacity * sizeof *indices);
    if (indices != NULL) d->indices = indices;
    float *data = realloc(d->data, capacity * sizeof *data);
    if (data != NULL) d->data = data;
    if (indices == NULL || data == NULL) return false;
    d->capacity = capacity;
    return true;
}

/* Puts the sum behind the rows that are done, and clears it; false where memory is out. */
static bool put_sum(desk *d, uint64_t *entries) {
    size_t count = 0;
    for (size_t w = 0; w < d->words; w++) count += (size_t)__builtin_popcountll(d->sum.marked[w]);
    if (!desk_reserve(d, count)) return false;
    for (size_t w = 0; w < d->words; w++) {
        for (uint64_t bits = d->sum.marked[w]; bits != 0; bits &= bits - 1) {
            const uint32_t j = (uint32_t)(w * 64 + (size_t)__builtin_ctzll(bits));
            d->indices[d->used] = j;
            d->data[d->used++] = (float)d->sum.value[j];
            d->sum.value[j] = 0;
        }
        d->sum.marked[w] = 0;
    }
    *entries = count;
    return true;
}

/* All that the threads share. */
typedef struct rows_job {
    const build_problem *problem;
    const float *rho;
    const uint32_t *position;
    double threshold;
    reflected RF;
} rows_job;

/* The row at a position into d->sum: the first bounce is the whole row of F, with 1 where nothing reflects.
 */
static void make_row(const rows_job *j, size_t row, desk *d, double *discarded, size_t *bounces) {
    const csr *F = j->problem->F;
    const size_t i = j->problem->order[row];
    const double rho = j->rho[i] > 0 ? (double)j->rho[i] : 1;
    for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
        add_to(&d->next, j->position[F->indices[e]], rho * (double)F->data[e]);
    *discarded = take_bounce(d, j->threshold);
    for (*bounces = 1; d->n_T > 0; ++*bounces) {
        *discarded += bounce(d, &j->RF);
        *discarded += take_bounce(d, j->threshold);
    }
}

static lam_status job_begin(const build_problem *problem, const float *rho, double threshold, rows_job *j,
                            uint32_t **position, lam_error *error) {
    *j = (rows_job){.problem = problem, .rho = rho, .threshold = threshold};
    *position = memory_allocate(problem->n, sizeof **position, "sparse inverse", error);
    if (*position == NULL) return LAM_ERR_MEMORY;
    for (size_t row = 0; row < problem->n; row++) (*position)[problem->order[row]] = (uint32_t)row;
    j->position = *position;
    return reflected_make(problem, rho, *position, threshold, &j->RF, error);
}

lam_status sparse_inverse_forecast(const build_problem *problem, const float *rho, double threshold,
                                   double *entries, lam_error *error) {
    lam_status status = LAM_OK;
    rows_job job;
    desk d = {.n = 0};
    uint32_t *position = NULL;
    const size_t n = problem->n, sampled = n < SAMPLED ? n : SAMPLED;
    TRY(job_begin(problem, rho, threshold, &job, &position, error));
    TRY(desk_make(n, &d, error));
    for (size_t k = 0; k < sampled; k++) {
        double discarded;
        size_t bounces;
        uint64_t count;
        make_row(&job, k * n / sampled, &d, &discarded, &bounces);
        if (!put_sum(&d, &count)) FAIL(error, LAM_ERR_MEMORY, "sparse inverse: out of memory");
    }
    *entries = (double)d.used * (double)n / (double)sampled;
done:
    reflected_free(&job.RF);
    desk_free(&d);
    free(position);
    return status;
}

/* Rows BLOCK b ... as they were found, until all are put together. */
typedef struct found_block {
    uint32_t *indices;
    float *data;
    size_t used;
} found_block;

typedef struct gathering {
    const rows_job *job;
    found_block *blocks;
    uint64_t *lengths; /* [n + 1], of row - 1 */
    double *discarded;
    size_t bounces, entries, most; /* entries so far and at most */
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

static lam_status gather_block(gathering *g, size_t b, desk *d, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = d->n, first = b * BLOCK, last = first + BLOCK < n ? first + BLOCK : n;
    size_t most = 0, entries;
    d->used = 0;
    for (size_t row = first; row < last; row++) {
        size_t bounces;
        make_row(g->job, row, d, &g->discarded[row], &bounces);
        if (bounces > most) most = bounces;
        if (!put_sum(d, &g->lengths[row + 1])) FAIL(error, LAM_ERR_MEMORY, "sparse inverse: out of memory");
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

static lam_status gather_all(gathering *g, size_t n, const progress *told, lam_error *error) {
    const size_t n_blocks = (n + BLOCK - 1) / BLOCK;
    size_t done_blocks = 0;
#pragma omp parallel
    {
        desk d;
        lam_error own = {.message = ""};
        if (desk_make(n, &d, &own) != LAM_OK) gather_fail(g, LAM_ERR_MEMORY, &own);
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
                progress_report(told, "sparse inverse", (double)++done_blocks / (double)n_blocks);
                if (progress_cancelled(told)) stop = true;
            }
            if (stop) {
                (void)status_fail(&own, LAM_ERR_CANCELLED, "cancelled");
                gather_fail(g, LAM_ERR_CANCELLED, &own);
            }
        }
        desk_free(&d);
    }
    if (g->status != LAM_OK) *error = g->error;
    return g->status;
}

/* Blocks go one after the other, each freed as it is copied. */
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

lam_status sparse_inverse_rows(const build_problem *problem, const float *rho, double threshold,
                               size_t memory, const progress *told, sparse_inverse *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, n_blocks = (n + BLOCK - 1) / BLOCK;
    rows_job job;
    uint32_t *position = NULL;
    gathering g = {.job = &job, .most = memory / (sizeof(uint32_t) + sizeof(float))};
    *out = (sparse_inverse){.bounces = 0};
    TRY(job_begin(problem, rho, threshold, &job, &position, error));
    g.blocks = memory_allocate(n_blocks, sizeof *g.blocks, "sparse inverse", error);
    g.lengths = memory_allocate(n + 1, sizeof *g.lengths, "sparse inverse", error);
    g.discarded = memory_allocate(n, sizeof *g.discarded, "sparse inverse", error);
    if (g.blocks == NULL || g.lengths == NULL || g.discarded == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gather_all(&g, n, told, error));
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
    reflected_free(&job.RF);
    free(position);
    if (status != LAM_OK) sparse_inverse_free(out);
    return status;
}

void sparse_inverse_free(sparse_inverse *s) {
    csr_free(&s->M);
    free(s->discarded);
    *s = (sparse_inverse){.bounces = 0};
}
