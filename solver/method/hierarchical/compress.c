#include "solver/method/hierarchical/compress.h"

#include "solver/base/array_grow.h"
#include "solver/method/hierarchical/compress_bound.h"
#include "solver/method/hierarchical/subtrees.h"
#include "solver/method/hierarchical/wavelet_basis.h"
#include "solver/operator/blocks/plane_tree.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Elements of a leaf at most, as in the hierarchical operator. */
enum { LEAF = 6 };

/* Threads take subtrees of n / PIECES elements. */
enum { PIECES = 24 };

/* The threshold over epsilon. */
static const double share_of_epsilon = 4e-4;

double compress_threshold(double epsilon) {
    return share_of_epsilon * epsilon;
}

/* One column of the rows of a node: a lane is the row of one of its functions. */
typedef double rows_of_node[WAVELET_INPUTS];

typedef struct kept_number {
    uint32_t i, j;
    float value;
} kept_number;

typedef struct compress_job {
    const compress_input *input;
    const wavelets *w;
    const compressed_factors *c;
    const uint32_t *position; /* [n], element -> position */
    const double *size_of;    /* [n], by coefficient: node_sizes.wavelets times (area of the scene)^1/2 */
    const double *share;      /* [n_classes] */
    const node_sizes *sizes;  /* [n_nodes] */
    double (**up)[WAVELET_SCALING]; /* [n_nodes] -> [n], scaling rows that wait for those of the sibling */
    double *lost;                   /* [n_nodes][n_classes], sum of squares of dropped coefficients */
    size_t done, n_kept;
    bool given_up; /* more than `most` are kept */
} compress_job;

/* The working area of one thread. */
typedef struct compress_work {
    rows_of_node *rows;   /* [n], by position or coefficient */
    rows_of_node *turned; /* [n] */
    rows_of_node *slots;  /* [n_nodes][WAVELET_SCALING] */
    kept_number *kept;
    size_t n_kept, capacity;
} compress_work;

static void work_free(compress_work *d) {
    free(d->rows);
    free(d->turned);
    free(d->slots);
    free(d->kept);
    *d = (compress_work){.n_kept = 0};
}

static lam_status work_make(const wavelets *w, compress_work *d, lam_error *error) {
    d->rows = memory_allocate(w->n, sizeof *d->rows, "compressed form factors", error);
    d->turned = memory_allocate(w->n, sizeof *d->turned, "compressed form factors", error);
    d->slots =
        memory_allocate(w->n_nodes * WAVELET_SCALING, sizeof *d->slots, "compressed form factors", error);
    return d->rows != NULL && d->turned != NULL && d->slots != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

/* out = Q in; an entry holds one column of all rows. */
static void turn_columns(const float *columns, size_t inputs, const rows_of_node *const *in,
                         rows_of_node *out) {
    memset(out, 0, inputs * sizeof *out);
    for (size_t m = 0; m < inputs; m++)
        for (size_t k = 0; k < inputs; k++) {
            const double q = (double)columns[m * WAVELET_INPUTS + k];
            for (size_t lane = 0; lane < WAVELET_INPUTS; lane++) out[k][lane] += q * (*in[m])[lane];
        }
}

/* Columns by position become columns by coefficient: c = x W^T. */
static void transform_columns(const wavelets *w, const rows_of_node *x, rows_of_node *slots,
                              rows_of_node *c) {
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const rows_of_node *in[WAVELET_INPUTS];
        rows_of_node out[WAVELET_INPUTS];
        for (size_t m = 0; m < a->inputs; m++)
            in[m] = a->from_left == 0  ? x + a->begin + m
                    : m < a->from_left ? slots + (size_t)a->left * WAVELET_SCALING + m
                                       : slots + (t - 1) * WAVELET_SCALING + m - a->from_left;
        turn_columns(wavelet_columns(w, &w->nodes[t]), a->inputs, in, out);
        memcpy(slots + t * WAVELET_SCALING, out, a->scaling * sizeof *out);
        memcpy(c + a->first, out + a->scaling, (a->inputs - a->scaling) * sizeof *out);
    }
    const size_t scaling = w->nodes[w->n_nodes - 1].scaling;
    memcpy(c + w->n - scaling, slots + (w->n_nodes - 1) * WAVELET_SCALING, scaling * sizeof *c);
}

/* Rows A_i^1/2 F_ij A_j^-1/2 of a leaf's elements, times W^T. */
static void begin_leaf(const compress_job *job, const wavelet_node *a, compress_work *d) {
    const csr *F = job->input->F;
    const double *area = job->input->area;
    memset(d->turned, 0, job->w->n * sizeof *d->turned);
    for (size_t lane = 0; lane < a->n_elements; lane++) {
        const size_t i = job->c->order[a->begin + lane];
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const size_t j = F->indices[e];
            d->turned[job->position[j]][lane] = sqrt(area[i] / area[j]) * (double)F->data[e];
        }
    }
    transform_columns(job->w, d->turned, d->slots, d->rows);
}

/* The scaling rows of both children. */
static void take_children(const compress_job *job, size_t t, compress_work *d) {
    const wavelet_node *a = &job->w->nodes[t];
    double(*const left)[WAVELET_SCALING] = job->up[a->left];
    double(*const right)[WAVELET_SCALING] = job->up[t - 1];
    for (size_t q = 0; q < job->w->n; q++) {
        memset(d->rows[q], 0, sizeof d->rows[q]);
        for (size_t m = 0; m < a->from_left; m++) d->rows[q][m] = left[q][m];
        for (size_t m = a->from_left; m < a->inputs; m++) d->rows[q][m] = right[q][m - a->from_left];
    }
    free(left);
    free(right);
    job->up[a->left] = job->up[t - 1] = NULL;
}

static lam_status keep(compress_work *d, size_t i, size_t j, double value, lam_error *error) {
    if (array_grow(&d->kept, &d->capacity, d->n_kept + 1, sizeof *d->kept, "compressed form factors",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    d->kept[d->n_kept++] = (kept_number){(uint32_t)i, (uint32_t)j, (float)value};
    return LAM_OK;
}

/* The rows of a node at column q. */
typedef struct entry_rule {
    double *lost;  /* of the row's node and the column's class */
    double least;  /* a coefficient of this magnitude is kept */
    double beside; /* a coefficient below this counts as dropped: S_qp, which decides if q < p, may differ by
                      the asymmetry */
    size_t q;
} entry_rule;

/* Coefficient S_pq: kept in the upper triangle, added to the dropped ones of row p if it is small. */
static inline lam_status keep_or_drop(const entry_rule *at, size_t p, double value, compress_work *d,
                                      lam_error *error) {
    const double magnitude = fabs(value);
    if (magnitude < at->beside) *at->lost += value * value;
    return at->q >= p && magnitude >= at->least ? keep(d, p, at->q, value, error) : LAM_OK;
}

static lam_status run_node(compress_job *job, size_t t, compress_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = job->w;
    const wavelet_node *a = &w->nodes[t];
    const bool root = t + 1 == w->n_nodes;
    const float *columns = wavelet_columns(w, &w->nodes[t]);
    const uint8_t *class_of = job->c->class_of;
    double *lost = job->lost + t * job->c->n_classes;
    /* Dropping S_pq changes F B by at most the size of p's wavelets times the share of B in q's class, and
     * with p and q exchanged. */
    const double own_size = job->size_of[root ? w->n - 1 : a->first];
    const double own_share = job->share[class_of[root ? w->n - 1 : a->first]];
    const double asymmetry = COMPRESS_ASYMMETRY * job->sizes[t].rows;
    double(*up)[WAVELET_SCALING] = NULL;
    if (a->from_left == 0)
        begin_leaf(job, a, d);
    else
        take_children(job, t, d);
    if (!root) up = job->up[t] = memory_allocate(w->n, sizeof *up, "compressed form factors", error);
    if (!root && up == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t q = 0; q < w->n; q++) {
        double out[WAVELET_INPUTS] = {0};
        for (size_t m = 0; m < a->inputs; m++)
            for (size_t k = 0; k < WAVELET_INPUTS; k++)
                out[k] += (double)columns[m * WAVELET_INPUTS + k] * d->rows[q][m];
        const double worth = fmax(own_size * job->share[class_of[q]], own_share * job->size_of[q]);
        const double least = job->input->threshold / worth;
        const entry_rule at = {
            .lost = &lost[class_of[q]], .least = least, .beside = least + asymmetry, .q = q};
        for (size_t k = 0; k < a->scaling; k++) {
            if (root)
                TRY(keep_or_drop(&at, w->n - a->scaling + k, out[k], d, error));
            else
                up[q][k] = out[k];
        }
        for (size_t k = a->scaling; k < a->inputs; k++)
            TRY(keep_or_drop(&at, a->first + k - a->scaling, out[k], d, error));
    }
done:
    return status;
}

/* Reports progress after a node, and gives up when too many coefficients are kept. */
static lam_status report_node(compress_job *job, const wavelet_node *a, size_t kept, lam_error *error) {
    lam_status status = LAM_OK;
    const progress *p = job->input->progress;
#pragma omp critical(compress_progress)
    {
        job->done += a->from_left == 0 ? a->n_elements : 0;
        job->n_kept += kept;
        if (job->input->most > 0 && job->n_kept > job->input->most)
            __atomic_store_n(&job->given_up, true, __ATOMIC_RELAXED);
        progress_report(p, "compressing", (double)job->done / (double)job->w->n);
        if (progress_cancelled(p)) status = status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    }
    return status;
}

typedef struct compress_team {
    compress_job *job;
    compress_work *works;
} compress_team;

static lam_status run_piece(void *context, wavelet_piece piece, size_t k, lam_error *error) {
    lam_status status = LAM_OK;
    compress_team *team = context;
    compress_job *job = team->job;
    compress_work *d = &team->works[k];
    if (d->rows == NULL) TRY(work_make(job->w, d, error));
    for (size_t t = piece.first; t < piece.last; t++) {
        const size_t before = d->n_kept;
        if (__atomic_load_n(&job->given_up, __ATOMIC_RELAXED)) break;
        TRY(run_node(job, t, d, error));
        TRY(report_node(job, &job->w->nodes[t], d->n_kept - before, error));
    }
done:
    return status;
}

static int by_column(const void *left, const void *right) {
    const kept_number *a = left, *b = right;
    return a->j < b->j ? -1 : a->j > b->j;
}

/* out: all coefficients that were kept, as a CSR matrix. */
static lam_status collect(size_t n, size_t n_works, compress_work *works, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "form factors", error)};
    kept_number *row = memory_allocate(n, sizeof *row, "form factors", error);
    if (made.indptr == NULL || row == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_works; k++)
        for (size_t e = 0; e < works[k].n_kept; e++) made.indptr[works[k].kept[e].i + 1]++;
    TRY(csr_begin_rows(&made, "form factors", error));
    for (size_t k = 0; k < n_works; k++) {
        for (size_t e = 0; e < works[k].n_kept; e++) {
            const kept_number *a = &works[k].kept[e];
            made.indices[made.indptr[a->i]] = a->j;
            made.data[made.indptr[a->i]++] = a->value;
        }
        work_free(&works[k]);
    }
    csr_end_rows(&made);
    for (size_t i = 0; i < n; i++) {
        const uint64_t begin = made.indptr[i], count = made.indptr[i + 1] - begin;
        for (uint64_t e = 0; e < count; e++)
            row[e] = (kept_number){(uint32_t)i, made.indices[begin + e], made.data[begin + e]};
        qsort(row, (size_t)count, sizeof *row, by_column);
        for (uint64_t e = 0; e < count; e++) {
            made.indices[begin + e] = row[e].j;
            made.data[begin + e] = row[e].value;
        }
    }
    *out = made;
    made = (csr){.n = 0};
done:
    free(row);
    csr_free(&made);
    return status;
}

/* out [n]: node_sizes.wavelets of each coefficient's node, relative to the constant function of norm 1. */
static void spread_sizes(const compressed_factors *c, const node_sizes *sizes, double *out) {
    const wavelets *w = &c->basis;
    const double root = sqrt(c->area);
    for (size_t q = 0; q < w->n; q++) out[q] = root * sizes[w->n_nodes - 1].wavelets;
    for (size_t t = 0; t < w->n_nodes; t++)
        for (size_t k = 0; k < w->nodes[t].inputs - w->nodes[t].scaling; k++)
            out[w->nodes[t].first + k] = root * sizes[t].wavelets;
}

/* Basis, order, groups and direct illumination of c. */
static lam_status prepare(const compress_input *input, compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    plane_tree tree = {.n = 0};
    TRY(plane_tree_make(c->n, input->centre, input->normal, NULL, NULL, LEAF, &tree, error));
    TRY(wavelet_basis_make(&tree, input->area, input->centre, &c->basis, error));
    c->order = tree.order;
    tree.order = NULL;
    TRY(compress_light_groups(input->F, input->area, input->group, input->n_groups, input->shines, c, error));
    TRY(compressed_place(c, input->area, input->group, error));
done:
    plane_tree_free(&tree);
    return status;
}

lam_status compress_form_factors(const compress_input *input, compressed_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->F->n;
    compressed_factors c = {.n = n};
    compress_job job = {.input = input, .w = &c.basis, .c = &c};
    double share[COMPRESSED_CLASSES_MOST], *size_of = NULL;
    node_sizes *sizes = NULL;
    compress_work *works = memory_allocate(input->n_threads, sizeof *works, "form factors", error);
    uint32_t *position = memory_allocate(n, sizeof *position, "form factors", error);
    if (works == NULL || position == NULL) TRY(LAM_ERR_MEMORY);
    TRY(prepare(input, &c, error));
    for (size_t p = 0; p < n; p++) position[c.order[p]] = (uint32_t)p;
    sizes = memory_allocate(c.basis.n_nodes, sizeof *sizes, "form factors", error);
    size_of = memory_allocate(n, sizeof *size_of, "form factors", error);
    job.up = memory_allocate(c.basis.n_nodes, sizeof *job.up, "form factors", error);
    job.lost = memory_allocate(c.basis.n_nodes, c.n_classes * sizeof *job.lost, "form factors", error);
    if (sizes == NULL || size_of == NULL || job.up == NULL || job.lost == NULL) TRY(LAM_ERR_MEMORY);
    TRY(compress_sizes(input->F, input->area, &c, sizes, error));
    TRY(compress_shares(input->area, &c, share, error));
    spread_sizes(&c, sizes, size_of);
    job.position = position;
    job.size_of = size_of;
    job.share = share;
    job.sizes = sizes;
    compress_team team = {&job, works};
    TRY(subtrees_run(&c.basis, n / PIECES + LEAF, input->n_threads, run_piece, &team, error));
    if (job.given_up) {
        *out = (compressed_factors){.n = 0};
        goto done;
    }
    TRY(collect(n, input->n_threads, works, &c.S, error));
    TRY(compress_bounds(sizes, job.lost, &c, error));
    *out = c;
    c = (compressed_factors){.n = 0};
done:
    for (size_t k = 0; works != NULL && k < input->n_threads; k++) work_free(&works[k]);
    for (size_t t = 0; job.up != NULL && t < c.basis.n_nodes; t++) free(job.up[t]);
    free(job.up);
    free(job.lost);
    free(works);
    free(position);
    free(sizes);
    free(size_of);
    compressed_free(&c);
    return status;
}
