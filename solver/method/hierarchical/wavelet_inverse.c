#include "solver/method/hierarchical/wavelet_inverse.h"

#include "solver/base/array_grow.h"

#include "store/status.h"

#include "solver/operator/hierarchical.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Products of a doubling. */
enum { PRODUCTS = 4 };

/* 2^24 bounces suffice up to rho = 1 - 1e-6. */
enum { DOUBLINGS_MOST = 24 };

/* weight [n_nodes] by coefficient. */
static lam_status spread_weights(const wavelets *w, const float *weight, float **out, lam_error *error) {
    float *made = memory_allocate(w->n, sizeof *made, "wavelets", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        for (size_t k = 0; k < a->inputs - a->scaling; k++) made[a->first + k] = weight[t];
    }
    const wavelet_node *root = &w->nodes[w->n_nodes - 1];
    for (size_t k = w->n - root->scaling; k < w->n; k++) made[k] = weight[w->n_nodes - 1];
    *out = made;
    return LAM_OK;
}

/* A row that grows. */
typedef struct row_store {
    uint32_t *indices;
    float *data;
    size_t used, capacity;
} row_store;

/* The working area of one thread: the row that it sums up, and rows that are done. */
typedef struct inverse_work {
    float *sum;      /* [n], all 0 between rows */
    uint32_t *where; /* [n], columns where sum is not 0 */
    row_store done;
} inverse_work;

typedef struct product_job {
    const wavelet_inverse_input *input;
    const float *weight; /* [n], of coefficients */
    float *inverse_weight;
    inverse_work *works; /* [n_threads] */
    char stage[32];      /* for progress: "inverse, doubling 3" */
    size_t n_products;   /* of this doubling, that are done */
} product_job;

typedef struct numbered {
    float value;
    uint32_t index;
} numbered;

static int by_size(const void *left, const void *right) {
    const numbered *a = left, *b = right;
    const float x = fabsf(a->value), y = fabsf(b->value);
    if (x != y) return x < y ? 1 : -1;
    return a->index < b->index ? -1 : a->index > b->index;
}

static int by_index(const void *left, const void *right) {
    const numbered *a = left, *b = right;
    return a->index < b->index ? -1 : a->index > b->index;
}

/* Threads take blocks of rows; the rows of a thread stand one behind the other in its area. */
enum { ROWS_AT_ONCE = 256 };

typedef struct made_rows {
    uint32_t *owner; /* [blocks], the thread that made it */
    size_t *begin;   /* [blocks], where it begins among the rows of that thread */
    size_t *length;  /* [n] */
} made_rows;

/* Sums row i up in d->sum, lists its columns in d->where[0 ... count) and returns count. */
typedef size_t make_row(const void *context, size_t i, inverse_work *d);
/* True if entry j of row i is stored. */
typedef bool keep_entry(const void *context, size_t i, uint32_t j, float value);

typedef struct row_rule {
    make_row *make;
    keep_entry *keep;
    const void *context;
    bool by_size; /* entries by descending magnitude, else by column */
    bool divided; /* entries are stored over the weight of their column */
    bool silent;  /* these rows are no product, of which progress tells */
} row_rule;

static lam_status store_row(const product_job *job, const row_rule *rule, size_t i, size_t count,
                            inverse_work *d, numbered *row, size_t *length, lam_error *error) {
    lam_status status = LAM_OK;
    size_t used = 0;
    for (size_t k = 0; k < count; k++) {
        const uint32_t j = d->where[k];
        const float value = d->sum[j];
        d->sum[j] = 0;
        if (!rule->keep(rule->context, i, j, value)) continue;
        row[used++] = (numbered){rule->divided ? value * job->inverse_weight[j] : value, j};
    }
    qsort(row, used, sizeof *row, rule->by_size ? by_size : by_index);
    if (d->done.used + used > d->done.capacity) {
        const size_t capacity = array_capacity(d->done.capacity, d->done.used + used);
        TRY(array_resize(&d->done.indices, capacity, sizeof *d->done.indices, "wavelets", error));
        TRY(array_resize(&d->done.data, capacity, sizeof *d->done.data, "wavelets", error));
        d->done.capacity = capacity;
    }
    for (size_t k = 0; k < used; k++) {
        d->done.indices[d->done.used] = row[k].index;
        d->done.data[d->done.used++] = row[k].value;
    }
    *length = used;
done:
    return status;
}

static lam_status collect(const product_job *job, const made_rows *made, size_t n, csr *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    csr all = {.n = n, .indptr = memory_allocate(n + 1, sizeof *all.indptr, "wavelets", error)};
    if (all.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) all.indptr[i + 1] = all.indptr[i] + made->length[i];
    all.indices = memory_allocate((size_t)all.indptr[n], sizeof *all.indices, "wavelets", error);
    all.data = memory_allocate((size_t)all.indptr[n], sizeof *all.data, "wavelets", error);
    if (all.indices == NULL || all.data == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t first = 0; first < n; first += ROWS_AT_ONCE) {
        const size_t block = first / ROWS_AT_ONCE, last = first + ROWS_AT_ONCE < n ? first + ROWS_AT_ONCE : n;
        const row_store *from = &job->works[made->owner[block]].done;
        const size_t count = (size_t)(all.indptr[last] - all.indptr[first]);
        if (count == 0) continue;
        memcpy(all.indices + all.indptr[first], from->indices + made->begin[block],
               count * sizeof *all.indices);
        memcpy(all.data + all.indptr[first], from->data + made->begin[block], count * sizeof *all.data);
    }
    *out = all;
    all = (csr){.n = 0};
done:
    csr_free(&all);
    return status;
}

/* out: all rows by a rule; the bits do not depend on the number of threads. */
static lam_status make_rows(const product_job *job, const row_rule *rule, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = job->input->basis->n, blocks = (n + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    int failed = 0;
    size_t n_done = 0, n_taken = 0;
    made_rows made = {.owner = memory_allocate(blocks, sizeof *made.owner, "wavelets", error),
                      .begin = memory_allocate(blocks, sizeof *made.begin, "wavelets", error),
                      .length = memory_allocate(n, sizeof *made.length, "wavelets", error)};
    numbered *rows = memory_allocate(job->input->n_threads * n, sizeof *rows, "wavelets", error);
    if (made.owner == NULL || made.begin == NULL || made.length == NULL || rows == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < job->input->n_threads; k++) job->works[k].done.used = 0;
#pragma omp parallel num_threads((int)job->input->n_threads)
    {
        size_t mine = 0;
#pragma omp critical(wavelet_inverse_works)
        mine = n_taken++;
        inverse_work *d = &job->works[mine];
#pragma omp for schedule(dynamic, 1)
        for (size_t block = 0; block < blocks; block++) {
            lam_error one = {.message = ""};
            if (__atomic_load_n(&failed, __ATOMIC_RELAXED)) continue;
            lam_status now = LAM_OK;
            made.owner[block] = (uint32_t)mine;
            made.begin[block] = d->done.used;
            for (size_t i = block * ROWS_AT_ONCE; now == LAM_OK && i < n && i < (block + 1) * ROWS_AT_ONCE;
                 i++)
                now = store_row(job, rule, i, rule->make(rule->context, i, d), d, rows + mine * n,
                                &made.length[i], &one);
#pragma omp critical(wavelet_inverse_progress)
            {
                const double share = ((double)job->n_products + (double)++n_done / (double)blocks) / PRODUCTS;
                if (!rule->silent) progress_report(job->input->progress, job->stage, share);
                if (now == LAM_OK && progress_cancelled(job->input->progress))
                    now = status_fail(&one, LAM_ERR_CANCELLED, "cancelled");
                if (now != LAM_OK && !failed) {
                    status = status_fail(error, now, "%s", one.message);
                    __atomic_store_n(&failed, 1, __ATOMIC_RELAXED);
                }
            }
        }
    }
    if (status == LAM_OK) TRY(collect(job, &made, n, out, error));
done:
    free(made.owner);
    free(made.begin);
    free(made.length);
    free(rows);
    return status;
}

static inline void add(inverse_work *d, uint32_t j, float value, size_t *count) {
    /* A sum that cancels to 0 is set to 1e-30, so that its column is not listed twice. */
    if (d->sum[j] == 0) d->where[(*count)++] = j;
    d->sum[j] += value;
    if (d->sum[j] == 0) d->sum[j] = 1e-30f;
}

/* Row i of R B. Entries below least_i weight_j enter no term of the product A (R B) and are dropped. */
typedef struct scaled_rows {
    const csr *R, *B;
    const float *weight, *least;
} scaled_rows;

static size_t make_scaled(const void *context, size_t i, inverse_work *d) {
    const scaled_rows *s = context;
    size_t count = 0;
    for (uint64_t e = s->R->indptr[i]; e < s->R->indptr[i + 1]; e++) {
        const uint32_t k = s->R->indices[e];
        for (uint64_t f = s->B->indptr[k]; f < s->B->indptr[k + 1]; f++)
            add(d, s->B->indices[f], s->R->data[e] * s->B->data[f], &count);
    }
    return count;
}

static bool keep_used(const void *context, size_t i, uint32_t j, float value) {
    const scaled_rows *s = context;
    return fabsf(value) >= s->least[i] * s->weight[j];
}

/* The same where rows of B are over the weights of their columns and sorted by magnitude, and those of R B
 * become so. Terms r_ik b_kj below least_i are left out: each gives terms a_hi r_ik b_kj of A R B that are
 * below the bound of those that may be. */
static size_t make_scaled_of_sorted(const void *context, size_t i, inverse_work *d) {
    const scaled_rows *s = context;
    size_t count = 0;
    for (uint64_t e = s->R->indptr[i]; e < s->R->indptr[i + 1]; e++) {
        const uint32_t k = s->R->indices[e];
        const float r = s->R->data[e], least = s->least[i] / fabsf(r);
        for (uint64_t f = s->B->indptr[k]; f < s->B->indptr[k + 1] && fabsf(s->B->data[f]) >= least; f++)
            add(d, s->B->indices[f], r * s->B->data[f], &count);
    }
    return count;
}

static bool keep_used_of_sorted(const void *context, size_t i, uint32_t j, float value) {
    const scaled_rows *s = context;
    (void)j;
    return fabsf(value) >= s->least[i];
}

/* Row i of B. */
static size_t make_copy(const void *context, size_t i, inverse_work *d) {
    const csr *B = context;
    size_t count = 0;
    for (uint64_t e = B->indptr[i]; e < B->indptr[i + 1]; e++) add(d, B->indices[e], B->data[e], &count);
    return count;
}

static bool keep_all(const void *context, size_t i, uint32_t j, float value) {
    (void)context;
    (void)i;
    (void)j;
    return value != 0;
}

/* Row i of base + A B. Rows of B are sorted by magnitude over the weight of the column, so that the loop over
 * a row ends at the first term that may be left out. */
typedef struct product_rows {
    const csr *A, *B, *base; /* base: NULL or symmetric, both triangles */
    const float *weight, *inverse_weight;
    float keep, skip;
    double *terms;
} product_rows;

static size_t make_product(const void *context, size_t i, inverse_work *d) {
    const product_rows *p = context;
    size_t count = 0, terms = 0;
    const float skip = p->skip * p->weight[i];
    for (uint64_t e = p->base != NULL ? p->base->indptr[i] : 0; p->base != NULL && e < p->base->indptr[i + 1];
         e++) {
        const uint32_t j = p->base->indices[e];
        if (j >= i) add(d, j, p->base->data[e] * p->inverse_weight[j], &count);
    }
    for (uint64_t e = p->A->indptr[i]; e < p->A->indptr[i + 1]; e++) {
        const uint32_t k = p->A->indices[e];
        const float a = p->A->data[e], least = skip / fabsf(a);
        uint64_t f = p->B->indptr[k];
        for (; f < p->B->indptr[k + 1] && fabsf(p->B->data[f]) >= least; f++)
            if (p->B->indices[f] >= i) add(d, p->B->indices[f], a * p->B->data[f], &count);
        terms += (size_t)(f - p->B->indptr[k]);
    }
    /* Until here sums are over the weight of their column. */
    for (size_t k = 0; k < count; k++) d->sum[d->where[k]] *= p->weight[d->where[k]];
#pragma omp atomic
    *p->terms += (double)terms;
    return count;
}

static bool keep_upper(const void *context, size_t i, uint32_t j, float value) {
    const product_rows *p = context;
    return j >= i && fabsf(value) > p->keep * p->weight[i] * p->weight[j];
}

/* least_k = skip / max_i |a_ik| / weight_i: a term a_ik b_kj is left out below skip weight_i weight_j, so
 * that no row of A B uses an entry of row k of B with |b_kj| < least_k weight_j. A is symmetric. */
static void find_least(const product_job *job, const csr *A, float *least) {
    const float skip = job->input->skipped * job->input->threshold;
    for (size_t k = 0; k < A->n; k++) {
        float most = 0;
        for (uint64_t e = A->indptr[k]; e < A->indptr[k + 1]; e++)
            most = fmaxf(most, fabsf(A->data[e]) * job->inverse_weight[A->indices[e]]);
        least[k] = .999f * skip / most; /* infinite where row k of A is empty */
    }
}

/* Entries of R per row from which on sorting B first takes less time: R is diagonal where planes have one
 * reflectance each, and couples each function with its ancestors where clusters of planes have several. */
enum { COUPLED = 2 };

/* out = R B without entries that A (R B) does not use, over the weight of the column, rows sorted by
 * magnitude. */
static lam_status scale_rows(const product_job *job, const csr *R, const csr *B, const csr *A, csr *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    csr sorted = {.n = 0};
    float *least = memory_allocate(A->n, sizeof *least, "wavelets", error);
    if (least == NULL) TRY(LAM_ERR_MEMORY);
    find_least(job, A, least);
    const bool coupled = R->indptr[R->n] > COUPLED * (uint64_t)R->n;
    const row_rule sort = {make_copy, keep_all, B, .by_size = true, .divided = true, .silent = true};
    if (coupled) TRY(make_rows(job, &sort, &sorted, error));
    const scaled_rows s = {R, coupled ? &sorted : B, job->weight, least};
    const row_rule plain = {make_scaled, keep_used, &s, .by_size = true, .divided = true},
                   of_sorted = {make_scaled_of_sorted, keep_used_of_sorted, &s, .by_size = true};
    TRY(make_rows(job, coupled ? &of_sorted : &plain, out, error));
done:
    csr_free(&sorted);
    free(least);
    return status;
}

/* out = base + A B, both triangles. */
static lam_status multiply(const product_job *job, const csr *A, const csr *B, const csr *base, double *terms,
                           csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_inverse_input *input = job->input;
    csr upper = {.n = 0};
    const product_rows p = {.A = A,
                            .B = B,
                            .base = base,
                            .weight = job->weight,
                            .inverse_weight = job->inverse_weight,
                            .keep = input->inner * input->threshold,
                            .skip = input->skipped * input->threshold,
                            .terms = terms};
    const row_rule rule = {make_product, keep_upper, &p, .by_size = false};
    TRY(make_rows(job, &rule, &upper, error));
    TRY(csr_mirror(&upper, "operator", out, error));
done:
    csr_free(&upper);
    return status;
}

static void works_free(inverse_work *works, size_t count) {
    for (size_t k = 0; works != NULL && k < count; k++) {
        free(works[k].sum);
        free(works[k].where);
        free(works[k].done.indices);
        free(works[k].done.data);
    }
    free(works);
}

/* out: entries of the upper triangle of a above the threshold. */
static lam_status final_upper(const product_job *job, const csr *a, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->n;
    const float threshold = job->input->threshold, *weight = job->weight;
    uint64_t used = 0;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    made.indices = memory_allocate((size_t)a->indptr[n], sizeof *made.indices, "wavelets", error);
    made.data = memory_allocate((size_t)a->indptr[n], sizeof *made.data, "wavelets", error);
    if (made.indptr == NULL || made.indices == NULL || made.data == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
            const uint32_t j = a->indices[e];
            if (j < i || !(fabsf(a->data[e]) > threshold * weight[i] * weight[j])) continue;
            made.indices[used] = j;
            made.data[used++] = a->data[e];
        }
        made.indptr[i + 1] = used;
    }
    *out = made;
    made = (csr){.n = 0};
done:
    csr_free(&made);
    return status;
}

static void replace(csr *a, csr *b) {
    csr_free(a);
    *a = *b;
    *b = (csr){.n = 0};
}

static lam_status run(product_job *job, csr *out, wavelet_inverse_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_inverse_input *input = job->input;
    csr R = {.n = 0}, K = {.n = 0}, Z = {.n = 0}, RK = {.n = 0}, RZ = {.n = 0}, next_K = {.n = 0},
        next_Z = {.n = 0}, upper = {.n = 0};
    TRY(wavelet_diagonal(input->basis, input->rho, &upper, error));
    TRY(csr_mirror(&upper, "operator", &R, error));
    TRY(csr_mirror(input->S, "operator", &K, error));
    TRY(csr_mirror(input->S, "operator", &Z, error));
    while (Z.indptr[Z.n] > 0 && report->doublings < DOUBLINGS_MOST) {
        snprintf(job->stage, sizeof job->stage, "inverse, doubling %zu", report->doublings + 1);
        job->n_products = 0;
        TRY(scale_rows(job, &R, &K, &Z, &RK, error));
        job->n_products = 1;
        TRY(multiply(job, &Z, &RK, &K, &report->terms, &next_K, error));
        csr_free(&RK);
        job->n_products = 2;
        TRY(scale_rows(job, &R, &Z, &Z, &RZ, error));
        job->n_products = 3;
        TRY(multiply(job, &Z, &RZ, NULL, &report->terms, &next_Z, error));
        csr_free(&RZ);
        replace(&K, &next_K);
        replace(&Z, &next_Z);
        report->doublings++;
    }
    TRY(final_upper(job, &K, out, error));
done:
    csr_free(&R);
    csr_free(&K);
    csr_free(&Z);
    csr_free(&RK);
    csr_free(&RZ);
    csr_free(&next_K);
    csr_free(&next_Z);
    csr_free(&upper);
    return status;
}

lam_status wavelet_inverse(const wavelet_inverse_input *input, csr *out, wavelet_inverse_report *report,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->basis->n;
    float *weight = NULL;
    product_job job = {.input = input};
    *report = (wavelet_inverse_report){.doublings = 0};
    TRY(spread_weights(input->basis, input->weight, &weight, error));
    job.weight = weight;
    job.inverse_weight = memory_allocate(n, sizeof *job.inverse_weight, "wavelets", error);
    job.works = memory_allocate(input->n_threads, sizeof *job.works, "wavelets", error);
    if (job.inverse_weight == NULL || job.works == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) job.inverse_weight[i] = 1 / weight[i];
    for (size_t k = 0; k < input->n_threads; k++) {
        job.works[k].sum = memory_allocate(n, sizeof *job.works[k].sum, "wavelets", error);
        job.works[k].where = memory_allocate(n, sizeof *job.works[k].where, "wavelets", error);
        if (job.works[k].sum == NULL || job.works[k].where == NULL) TRY(LAM_ERR_MEMORY);
    }
    TRY(run(&job, out, report, error));
done:
    works_free(job.works, input->n_threads);
    free(job.inverse_weight);
    free(weight);
    return status;
}
