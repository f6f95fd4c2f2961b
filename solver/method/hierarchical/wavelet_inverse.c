/* K = S (I - R S)^-1 is the limit of doublings, Z_2m = Z_m R Z_m and K_2m = K_m + Z_2m + Z_m R (K_m - Z_m),
 * on sparse rows over the weights, K_ij / (w_i w_j), so that one number is the threshold of all entries.
 * final_upper() then keeps the entries and the tiles of K that are above theirs. */
#include "solver/method/hierarchical/wavelet_inverse.h"

#include "solver/method/hierarchical/wavelet_terms.h"
#include "store/status.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* An inverse on its way. All matrices are over the weights of row and column, K^_ij = K_ij / (w_i w_j), and R
 * is times them, so that products stay products and a threshold is one number. */
typedef struct doubling {
    const wavelet_inverse_input *input;
    const float *weight; /* [n], of coefficients */
    row_work *works;     /* [n_threads] */
    csr R;
    bool coupled;   /* R is not diagonal */
    float *least;   /* [n], find_least */
    char stage[32]; /* for progress: "inverse, doubling 3" */
} doubling;

static rows_pass pass_of(const doubling *d, row_maker *make, const void *context) {
    return (rows_pass){.n = d->input->basis->n,
                       .n_threads = d->input->n_threads,
                       .n_outputs = 1,
                       .works = d->works,
                       .make = make,
                       .context = context,
                       .progress = d->input->progress};
}

/* Row i of S over its weights, of both triangles. */
typedef struct light_rows {
    const csr *S;
    const float *weight;
} light_rows;

static lam_status make_light(const void *context, size_t i, row_work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const light_rows *l = context;
    const uint64_t first = l->S->indptr[i], count = l->S->indptr[i + 1] - first;
    row_term *to = NULL;
    TRY(row_work_room(w, 0, (size_t)count, &to, error));
    for (uint64_t k = 0; k < count; k++) {
        const uint32_t j = l->S->indices[first + k];
        to[k] = (row_term){j, l->S->data[first + k] / (l->weight[i] * l->weight[j])};
    }
    w->done[0].used += count;
done:
    return status;
}

/* least_k = skip / max_i |z_ik|: a term z_ik b_kj is left out below skip, so that no row of Z B uses an entry
 * of row k of B with |b_kj| < least_k. Z is symmetric but for rounding. Returns the smallest. */
static float find_least(const term_rows *Z, float skip, size_t n_threads, float *least) {
    float smallest = INFINITY;
#pragma omp parallel for schedule(static) num_threads((int)n_threads) reduction(min : smallest)
    for (size_t k = 0; k < Z->n; k++) {
        float most = 0;
        for (size_t e = 0; e < Z->length[k]; e++) most = fmaxf(most, fabsf(Z->row[k][e].value));
        least[k] = .999f * skip / most; /* infinite where row k is empty */
        smallest = fminf(smallest, least[k]);
    }
    return smallest;
}

/* Sums up row i of A - B; B may be NULL. */
static void add_difference(row_work *w, const term_rows *A, const term_rows *B, size_t i) {
    w->count = 0;
    for (size_t e = 0; e < A->length[i]; e++) row_work_add(w, A->row[i][e].column, A->row[i][e].value);
    for (size_t e = 0; B != NULL && e < B->length[i]; e++)
        row_work_add(w, B->row[i][e].column, -B->row[i][e].value);
}

/* to = by times the row that is summed up, sorted by magnitude, without entries below `least`; the sums are 0
 * again. Returns how many are left. */
static size_t take_sorted(row_work *w, float by, float least, row_term *to) {
    size_t used = 0;
    for (size_t k = 0; k < w->count; k++) {
        const uint32_t j = w->columns[k];
        const float value = by * w->sums[j];
        w->spare[used] = (row_term){j, value};
        used += fabsf(value) >= least;
        w->sums[j] = 0;
    }
    row_terms_sort(used, w->spare, to);
    return used;
}

/* Row i of A, or of A - B, sorted by magnitude, without entries below `least`. */
typedef struct difference_rows {
    const term_rows *A, *B; /* B: NULL or another */
    float least;
} difference_rows;

static lam_status make_difference(const void *context, size_t i, row_work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const difference_rows *d = context;
    row_term *to = NULL;
    add_difference(w, d->A, d->B, i);
    TRY(row_work_room(w, 0, w->count, &to, error));
    w->done[0].used += take_sorted(w, 1, d->least, to);
done:
    for (size_t k = 0; status != LAM_OK && k < w->count; k++) w->sums[w->columns[k]] = 0;
    return status;
}

/* Row i of R (A - B), sorted by magnitude, without entries below least_i, which enter no product. Terms r_ik
 * a_kj below least_i are left out: each gives terms z_hi r_ik a_kj of Z R A that are below the bound of those
 * that may be. B is NULL, or R is diagonal. */
typedef struct scaled_rows {
    const csr *R;
    const term_rows *A, *B;
    const float *least;
} scaled_rows;

/* to = r times the terms of row k of A that are not below least_i; returns their number. */
static size_t scale_row(const scaled_rows *s, uint64_t e, size_t i, bool sorted, row_term *to) {
    const uint32_t k = s->R->indices[e];
    const float r = s->R->data[e], least = s->least[i] / fabsf(r);
    const row_term *const row = s->A->row[k];
    const size_t most = s->A->length[k];
    size_t used = 0;
    for (size_t t = 0; t < most && !(sorted && fabsf(row[t].value) < least); t++) {
        to[used] = (row_term){row[t].column, r * row[t].value};
        used += fabsf(row[t].value) >= least;
    }
    return used;
}

static lam_status make_scaled(const void *context, size_t i, row_work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const scaled_rows *s = context;
    const uint64_t e = s->R->indptr[i];
    row_term *to = NULL;
    w->count = 0;
    if (s->least[i] == INFINITY || e == s->R->indptr[i + 1]) goto done; /* black elements alone have no row */
    if (s->B == NULL) {
        TRY(row_work_room(w, 0, s->A->length[s->R->indices[e]], &to, error));
        const size_t used = scale_row(s, e, i, false, w->spare);
        row_terms_sort(used, w->spare, to);
        w->done[0].used += used;
    } else {
        add_difference(w, s->A, s->B, i);
        TRY(row_work_room(w, 0, w->count, &to, error));
        w->done[0].used += take_sorted(w, s->R->data[e], s->least[i], to);
    }
done:
    for (size_t k = 0; status != LAM_OK && k < w->count; k++) w->sums[w->columns[k]] = 0;
    return status;
}

/* Rows of A are sorted by magnitude. */
static lam_status make_coupled(const void *context, size_t i, row_work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const scaled_rows *s = context;
    const uint64_t begin = s->R->indptr[i], end = s->R->indptr[i + 1];
    row_term *to = NULL;
    w->count = 0;
    if (s->least[i] == INFINITY) goto done;
    if (end - begin == 1) {
        TRY(row_work_room(w, 0, s->A->length[s->R->indices[begin]], &to, error));
        w->done[0].used += scale_row(s, begin, i, true, to);
        goto done;
    }
    for (uint64_t e = begin; e < end; e++) {
        const uint32_t k = s->R->indices[e];
        const float r = s->R->data[e], least = s->least[i] / fabsf(r);
        const row_term *const row = s->A->row[k];
        const size_t most = s->A->length[k];
        for (size_t t = 0; t < most && fabsf(row[t].value) >= least; t++)
            row_work_add(w, row[t].column, r * row[t].value);
    }
    TRY(row_work_room(w, 0, w->count, &to, error));
    w->done[0].used += take_sorted(w, 1, s->least[i], to);
done:
    for (size_t k = 0; status != LAM_OK && k < w->count; k++) w->sums[w->columns[k]] = 0;
    return status;
}

/* out = R (A - B) without what Z R (A - B) does not use; B may be NULL. */
static lam_status scale_rows(const doubling *d, const term_rows *A, const term_rows *B, float smallest,
                             term_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    float most = 0;
    term_rows less = {.n = 0};
    if (d->coupled) {
        for (uint64_t e = 0; e < d->R.indptr[d->R.n]; e++) most = fmaxf(most, fabsf(d->R.data[e]));
        const difference_rows difference = {A, B, smallest / most};
        const rows_pass subtract = pass_of(d, make_difference, &difference);
        TRY(term_rows_make(&subtract, &less, error));
    }
    const scaled_rows scaled = {&d->R, d->coupled ? &less : A, d->coupled ? NULL : B, d->least};
    const rows_pass scale = pass_of(d, d->coupled ? make_coupled : make_scaled, &scaled);
    TRY(term_rows_make(&scale, out, error));
done:
    term_rows_free(&less);
    return status;
}

/* Row i of Z R Z, and of K + Z R Z + Z R (K - Z); RD without rows: K = Z. */
typedef struct product_rows {
    const term_rows *K, *Z, *RZ, *RD;
    float keep, skip;
} product_rows;

/* sums_j += sum_k z_k b_kj. Rows of B are sorted by magnitude, so that the loop over a row ends at the first
 * term that may be left out. The working area is in locals: a count in memory would make each term wait for
 * the one before. */
static void add_product(row_work *w, size_t length, const row_term *z, const term_rows *B, float skip) {
    float *const sums = w->sums;
    uint32_t *const columns = w->columns;
    size_t terms = 0, count = w->count;
    for (size_t e = 0; e < length; e++) {
        const float by = z[e].value, least = skip / fabsf(by);
        const row_term *const row = B->row[z[e].column];
        const size_t most = B->length[z[e].column];
        size_t t = 0;
        for (; t < most && fabsf(row[t].value) >= least; t++)
            count = row_sum_add(sums, columns, count, row[t].column, by * row[t].value);
        terms += t;
    }
    w->count = count;
    w->terms += (double)terms;
}

static lam_status make_products(const void *context, size_t i, row_work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const product_rows *p = context;
    const size_t length = p->Z->length[i];
    row_term *to = NULL;
    size_t used = 0;
    w->count = 0;
    if (length == 0) {
        TRY(row_work_room(w, 1, p->K->length[i], &to, error));
        if (p->K->length[i] > 0) memcpy(to, p->K->row[i], p->K->length[i] * sizeof *to);
        w->done[1].used += p->K->length[i];
        goto done;
    }
    add_product(w, length, p->Z->row[i], p->RZ, p->skip);
    TRY(row_work_room(w, 0, w->count, &to, error));
    for (size_t k = 0; k < w->count; k++) {
        const uint32_t j = w->columns[k];
        to[used] = (row_term){j, w->sums[j]};
        used += fabsf(w->sums[j]) > p->keep;
    }
    w->done[0].used += used;
    if (p->RD->n > 0) add_product(w, length, p->Z->row[i], p->RD, p->skip);
    for (size_t e = 0; e < p->K->length[i]; e++)
        row_work_add(w, p->K->row[i][e].column, p->K->row[i][e].value);
    TRY(row_work_room(w, 1, w->count, &to, error));
    used = 0;
    for (size_t k = 0; k < w->count; k++) {
        const uint32_t j = w->columns[k];
        to[used] = (row_term){j, w->sums[j]};
        used += fabsf(w->sums[j]) > p->keep;
        w->sums[j] = 0;
    }
    w->done[1].used += used;
done:
    for (size_t k = 0; status != LAM_OK && k < w->count; k++) w->sums[w->columns[k]] = 0;
    return status;
}

/* The tiles that are kept: number [n] of the node of a coefficient; node [n], that node, or NULL. */
typedef struct kept_tiles {
    const uint32_t *number, *node;
    float entry, tile;
    const float *times, *read, *emits; /* of nodes; the last two may be NULL */
} kept_tiles;

static float share_of(const float *x, size_t node) {
    return x != NULL ? x[node] : 1;
}

/* Times the thresholds: of entries of a node at coefficient j. */
static float times_of(const kept_tiles *t, size_t node, size_t j) {
    if (t->node == NULL) return 1;
    const uint32_t other = t->node[j];
    const float seen = fmaxf(share_of(t->read, node) * share_of(t->emits, other),
                             share_of(t->read, other) * share_of(t->emits, node));
    return t->times[node] * t->times[other] / seen;
}

/* Rows first to last - 1 of K, those of a node, lose their lower triangle, entries that are not above
 * `entry`, and tiles, all entries between two nodes, whose 2-norm is not above `tile`. They are sorted by
 * column. */
static void keep_tiles(const kept_tiles *t, size_t node, size_t first, size_t last, term_rows *K,
                       row_work *w) {
    const uint32_t *const node_of = t->number;
    w->count = 0;
    for (size_t i = first; i < last; i++)
        for (size_t e = 0; e < K->length[i]; e++) {
            const row_term *k = &K->row[i][e];
            row_work_add(w, node_of[k->column], k->value * k->value);
        }
    for (size_t i = first; i < last; i++) {
        row_term *const row = K->row[i];
        uint32_t kept = 0;
        for (size_t e = 0; e < K->length[i]; e++) {
            const size_t j = row[e].column;
            if (j < i) continue;
            const float times = times_of(t, node, j), tile = t->tile * times;
            if (fabsf(row[e].value) > t->entry * times && w->sums[node_of[j]] > tile * tile)
                row[kept++] = row[e];
        }
        row_terms_by_column(kept, row, w->spare);
        K->length[i] = kept;
    }
    for (size_t k = 0; k < w->count; k++) w->sums[w->columns[k]] = 0;
}

/* The coefficients of node t are first to last - 1; those of the root include its scaling functions. */
static size_t last_of(const wavelets *w, size_t t) {
    const wavelet_node *a = &w->nodes[t];
    return t + 1 < w->n_nodes ? a->first + a->inputs - a->scaling : w->n;
}

/* out: the entries of the upper triangle of K that are kept, times their weights. Rows of K lose the others.
 */
static lam_status final_upper(const doubling *d, term_rows *K, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_inverse_input *input = d->input;
    const wavelets *const basis = input->basis;
    const size_t n = K->n, n_threads = input->n_threads;
    const float *weight = d->weight;
    uint32_t *node_of = memory_allocate(n, sizeof *node_of, "wavelets", error), numbered = 0, *nodes = NULL;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    if (made.indptr == NULL || node_of == NULL) TRY(LAM_ERR_MEMORY);
    /* Planes of single elements have more nodes than coefficients: those without any have no number. */
    for (size_t t = 0; t < basis->n_nodes; t++) {
        for (size_t i = basis->nodes[t].first; i < last_of(basis, t); i++) node_of[i] = numbered;
        numbered += last_of(basis, t) > basis->nodes[t].first;
    }
    if (input->tile_times != NULL) {
        nodes = memory_allocate(n, sizeof *nodes, "wavelets", error);
        if (nodes == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t t = 0; t < basis->n_nodes; t++)
            for (size_t i = basis->nodes[t].first; i < last_of(basis, t); i++) nodes[i] = (uint32_t)t;
    }
    const kept_tiles kept = {.number = node_of,
                             .node = nodes,
                             .entry = input->entry * input->threshold,
                             .tile = input->tile * input->threshold,
                             .times = input->tile_times,
                             .read = input->tile_read,
                             .emits = input->tile_emits};
#pragma omp parallel for schedule(dynamic, 256) num_threads((int)n_threads)
    for (size_t t = 0; t < basis->n_nodes; t++)
        keep_tiles(&kept, t, basis->nodes[t].first, last_of(basis, t), K, &d->works[omp_get_thread_num()]);
    for (size_t i = 0; i < n; i++) made.indptr[i + 1] = made.indptr[i] + K->length[i];
    made.indices = memory_allocate((size_t)made.indptr[n], sizeof *made.indices, "wavelets", error);
    made.data = memory_allocate((size_t)made.indptr[n], sizeof *made.data, "wavelets", error);
    if (made.indices == NULL || made.data == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static) num_threads((int)n_threads)
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < K->length[i]; k++) {
            const row_term found = K->row[i][k];
            made.indices[made.indptr[i] + k] = found.column;
            made.data[made.indptr[i] + k] = found.value * weight[i] * weight[found.column];
        }
    *out = made;
    made = (csr){.n = 0};
done:
    free(node_of);
    free(nodes);
    csr_free(&made);
    return status;
}

/* K and Z of twice as many bounces. */
static lam_status double_bounces(doubling *d, term_rows *K, term_rows *Z, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_inverse_input *input = d->input;
    const float skip = input->skipped * input->threshold;
    const term_rows *const last = Z->n > 0 ? Z : K; /* Z_1 = K_1 */
    term_rows RZ = {.n = 0}, RD = {.n = 0}, next[ROW_OUTPUTS] = {{.n = 0}};
    const float smallest = find_least(last, skip, input->n_threads, d->least);
    TRY(scale_rows(d, last, NULL, smallest, &RZ, error));
    if (last != K) TRY(scale_rows(d, K, last, smallest, &RD, error));
    const product_rows product = {K, last, &RZ, &RD, input->inner * input->threshold, skip};
    rows_pass multiply = pass_of(d, make_products, &product);
    multiply.n_outputs = ROW_OUTPUTS;
    multiply.stage = d->stage;
    multiply.spent[0] = K;
    multiply.spent[1] = last != K ? Z : NULL;
    TRY(term_rows_make(&multiply, next, error));
    term_rows_free(Z);
    term_rows_free(K);
    *Z = next[0];
    *K = next[1];
done:
    term_rows_free(&RZ);
    term_rows_free(&RD);
    return status;
}

static lam_status run(doubling *d, csr *out, wavelet_inverse_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_inverse_input *input = d->input;
    const size_t n = input->basis->n;
    csr upper = {.n = 0}, S = {.n = 0};
    term_rows K = {.n = 0}, Z = {.n = 0};
    TRY(wavelet_diagonal(input->basis, input->rho, &upper, error));
    TRY(csr_mirror(&upper, "operator", &d->R, error));
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = d->R.indptr[i]; e < d->R.indptr[i + 1]; e++) {
            d->coupled = d->coupled || d->R.indices[e] != i;
            d->R.data[e] *= d->weight[i] * d->weight[d->R.indices[e]];
        }
    csr_free(&upper);
    TRY(csr_mirror(input->S, "operator", &S, error));
    if (input->last) csr_free(input->S);
    const light_rows light = {&S, d->weight};
    const rows_pass start = pass_of(d, make_light, &light);
    TRY(term_rows_make(&start, &K, error));
    csr_free(&S);
    while ((Z.n > 0 ? term_rows_count(&Z) : term_rows_count(&K)) > 0 && report->doublings < DOUBLINGS_MOST) {
        snprintf(d->stage, sizeof d->stage, "inverse, doubling %zu", report->doublings + 1);
        TRY(double_bounces(d, &K, &Z, error));
        report->doublings++;
    }
    for (size_t k = 0; k < input->n_threads; k++) report->terms += d->works[k].terms;
    TRY(final_upper(d, &K, out, error));
done:
    csr_free(&upper);
    csr_free(&S);
    term_rows_free(&K);
    term_rows_free(&Z);
    return status;
}

lam_status wavelet_inverse(const wavelet_inverse_input *input, csr *out, wavelet_inverse_report *report,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->basis->n;
    float *weight = NULL;
    doubling d = {.input = input};
    *report = (wavelet_inverse_report){.doublings = 0};
    TRY(spread_weights(input->basis, input->weight, &weight, error));
    d.weight = weight;
    d.least = memory_allocate(n, sizeof *d.least, "wavelets", error);
    if (d.least == NULL) TRY(LAM_ERR_MEMORY);
    TRY(row_works_make(n, input->n_threads, &d.works, error));
    TRY(run(&d, out, report, error));
done:
    row_works_free(d.works, input->n_threads);
    csr_free(&d.R);
    free(d.least);
    free(weight);
    return status;
}
