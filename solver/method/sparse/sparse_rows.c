#include "solver/method/sparse/sparse_rows.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>

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

static inline void add_to(sparse_row *r, uint32_t j, double x) {
    r->value[j] += x;
    bitset_add(&r->there, j);
}

void row_work_free(row_work *d) {
    free(d->sum.value);
    bitset_free(&d->sum.there);
    free(d->next.value);
    bitset_free(&d->next.there);
    free(d->at);
    free(d->T);
    free(d->indices);
    free(d->data);
}

lam_status row_work_make(size_t n, row_work *d, lam_error *error) {
    *d = (row_work){.n = n};
    d->sum.value = memory_allocate(n, sizeof *d->sum.value, "sparse inverse", error);
    d->next.value = memory_allocate(n, sizeof *d->next.value, "sparse inverse", error);
    const bool marked = bitset_make(n, 0, "sparse inverse", &d->sum.there, error) == LAM_OK &&
                        bitset_make(n, 0, "sparse inverse", &d->next.there, error) == LAM_OK;
    d->at = memory_allocate(n, sizeof *d->at, "sparse inverse", error);
    d->T = memory_allocate(n, sizeof *d->T, "sparse inverse", error);
    const bool all = marked && d->sum.value != NULL && d->next.value != NULL && d->at != NULL && d->T != NULL;
    return all ? LAM_OK : LAM_ERR_MEMORY;
}

/* T = drop(next, threshold); sum += T; next = 0. Returns the sum of what was dropped. */
static double drop_small(row_work *d, double threshold) {
    double removed = 0;
    d->n_T = 0;
    const size_t count = bitset_take(&d->next.there);
    for (size_t k = 0; k < count; k++) {
        const uint32_t j = d->next.there.taken[k];
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
    return removed;
}

/* next = T drop(R F). Returns the sum that was dropped with entries of R F. */
static double bounce(row_work *d, const reflected *RF) {
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

static bool row_work_reserve(row_work *d, size_t more) {
    if (d->capacity - d->used >= more) return true;
    const size_t capacity = array_capacity(d->capacity, d->used + more);
    if (array_resize(&d->indices, capacity, sizeof *d->indices, "sparse rows", NULL) != LAM_OK ||
        array_resize(&d->data, capacity, sizeof *d->data, "sparse rows", NULL) != LAM_OK)
        return false;
    d->capacity = capacity;
    return true;
}

bool row_work_store(row_work *d, uint64_t *entries) {
    const size_t count = bitset_take(&d->sum.there);
    if (!row_work_reserve(d, count)) return false;
    for (size_t k = 0; k < count; k++) {
        const uint32_t j = d->sum.there.taken[k];
        d->indices[d->used] = j;
        d->data[d->used++] = (float)d->sum.value[j];
        d->sum.value[j] = 0;
    }
    *entries = count;
    return true;
}

void row_work_compute(const rows_job *job, size_t row, row_work *d, double *discarded, size_t *bounces) {
    const csr *F = job->problem->F;
    const size_t i = job->problem->order[row];
    const double rho = job->rho[i] > 0 ? (double)job->rho[i] : 1;
    for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
        add_to(&d->next, job->position[F->indices[e]], rho * (double)F->data[e]);
    *discarded = drop_small(d, job->whole_black && !(job->rho[i] > 0) ? 0 : job->threshold);
    for (*bounces = 1; d->n_T > 0 && *bounces <= ROW_BOUNCES; ++*bounces) {
        *discarded += bounce(d, &job->RF);
        *discarded += drop_small(d, job->threshold);
    }
}

lam_status rows_job_begin(const build_problem *problem, const float *rho, const sparse_limits *limits,
                          rows_job *job, lam_error *error) {
    *job = (rows_job){
        .problem = problem, .rho = rho, .threshold = limits->threshold, .whole_black = limits->whole_black};
    job->position = memory_allocate(problem->n, sizeof *job->position, "sparse inverse", error);
    if (job->position == NULL) return LAM_ERR_MEMORY;
    for (size_t row = 0; row < problem->n; row++) job->position[problem->order[row]] = (uint32_t)row;
    return reflected_make(problem, rho, job->position, limits->threshold, &job->RF, error);
}

void rows_job_end(rows_job *job) {
    reflected_free(&job->RF);
    free(job->position);
}
