#include "solver/build/compress.h"

#include "solver/build/plane_tree.h"
#include "solver/build/wavelet_basis.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Elements of a leaf at most, as those of a hierarchical operator. */
enum { LEAF = 6 };

/* Subtrees that threads share. */
enum { PIECES = 24 };

/* F is symmetric but for rounding to single precision, and so are numbers that are kept. Also where one of
 * S_pq and S_qp is kept and the other is below the threshold it counts as lost. */
static const double asymmetry = 4e-7, beside_threshold = 1 + 1e-5;

/* Numbers from this share of epsilon on are kept, and, where F is a sample, from this share of its noise: a
 * quarter of what a hierarchical operator is cut at. */
static const double share_of_epsilon = 2e-4, share_of_noise = .055 / 4;

double compress_threshold(double epsilon, double noise) {
    return fmax(share_of_epsilon * epsilon, share_of_noise * noise);
}

/* Rows of a node in columns of coefficients, side by side. */
typedef double rows_of_node[WAVELET_INPUTS];

typedef struct kept_number {
    uint32_t i, j;
    float value;
} kept_number;

typedef struct compress_job {
    const compress_input *input;
    const wavelets *w;
    const uint32_t *order, *position; /* [n] and back */
    const uint8_t *class_of;          /* [n], of a coefficient */
    size_t n_classes;
    double (**up)[WAVELET_SCALING]; /* [n_nodes] -> [n], rows that wait for their sibling */
    double *lost;                   /* [n_nodes][n_classes], squares */
    size_t done;
} compress_job;

/* What a thread works with. */
typedef struct compress_desk {
    rows_of_node *rows;   /* [n], by position or coefficient */
    rows_of_node *turned; /* [n] */
    rows_of_node *slots;  /* [n_nodes][WAVELET_SCALING] */
    kept_number *kept;
    size_t n_kept, capacity;
} compress_desk;

static void desk_free(compress_desk *d) {
    free(d->rows);
    free(d->turned);
    free(d->slots);
    free(d->kept);
    *d = (compress_desk){.n_kept = 0};
}

static lam_status desk_make(const wavelets *w, compress_desk *d, lam_error *error) {
    d->rows = memory_allocate(w->n, sizeof *d->rows, "compressed form factors", error);
    d->turned = memory_allocate(w->n, sizeof *d->turned, "compressed form factors", error);
    d->slots =
        memory_allocate(w->n_nodes * WAVELET_SCALING, sizeof *d->slots, "compressed form factors", error);
    return d->rows != NULL && d->turned != NULL && d->slots != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

static const float *columns_of(const wavelets *w, size_t t) {
    return w->padded + (size_t)w->nodes[t].shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
}

/* out = Q in, each entry being some rows side by side. */
static void turn_columns(const float *columns, size_t inputs, const rows_of_node *const *in,
                         rows_of_node *out) {
    memset(out, 0, inputs * sizeof *out);
    for (size_t m = 0; m < inputs; m++)
        for (size_t k = 0; k < inputs; k++) {
            const double q = (double)columns[m * WAVELET_INPUTS + k];
            for (size_t lane = 0; lane < WAVELET_INPUTS; lane++) out[k][lane] += q * (*in[m])[lane];
        }
}

/* Rows by position become rows by coefficient: W on the right. */
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
        turn_columns(columns_of(w, t), a->inputs, in, out);
        memcpy(slots + t * WAVELET_SCALING, out, a->scaling * sizeof *out);
        memcpy(c + a->first, out + a->scaling, (a->inputs - a->scaling) * sizeof *out);
    }
    const size_t scaling = w->nodes[w->n_nodes - 1].scaling;
    memcpy(c + w->n - scaling, slots + (w->n_nodes - 1) * WAVELET_SCALING, scaling * sizeof *c);
}

/* Rows of a leaf's elements, A_i^1/2 F_ij A_j^-1/2, in columns of coefficients. */
static void begin_leaf(const compress_job *job, const wavelet_node *a, compress_desk *d) {
    const csr *F = job->input->F;
    const double *area = job->input->area;
    memset(d->turned, 0, job->w->n * sizeof *d->turned);
    for (size_t lane = 0; lane < a->n_elements; lane++) {
        const size_t i = job->order[a->begin + lane];
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const size_t j = F->indices[e];
            d->turned[job->position[j]][lane] = sqrt(area[i] / area[j]) * (double)F->data[e];
        }
    }
    transform_columns(job->w, d->turned, d->slots, d->rows);
}

/* Rows that its two children hand up. */
static void take_children(const compress_job *job, size_t t, compress_desk *d) {
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

static lam_status keep(compress_desk *d, size_t i, size_t j, double value, lam_error *error) {
    if (d->n_kept == d->capacity) {
        const size_t capacity = d->capacity + d->capacity / 2 + 4096;
        kept_number *const more = realloc(d->kept, capacity * sizeof *more);
        if (more == NULL)
            return status_fail(error, LAM_ERR_MEMORY,
                               "compressed form factors: cannot allocate %zu x %zu bytes", capacity,
                               sizeof *more);
        d->kept = more;
        d->capacity = capacity;
    }
    d->kept[d->n_kept++] = (kept_number){(uint32_t)i, (uint32_t)j, (float)value};
    return LAM_OK;
}

/* Number (p, q) of S: kept in the row that comes first, lost to that of p where it is small. */
static inline lam_status settle(const compress_job *job, double *lost, size_t p, size_t q, double value,
                                compress_desk *d, lam_error *error) {
    const double magnitude = fabs(value), threshold = job->input->threshold;
    if (magnitude < beside_threshold * threshold) lost[job->class_of[q]] += value * value;
    return q >= p && magnitude >= threshold ? keep(d, p, q, value, error) : LAM_OK;
}

static lam_status run_node(compress_job *job, size_t t, compress_desk *d, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = job->w;
    const wavelet_node *a = &w->nodes[t];
    const bool root = t + 1 == w->n_nodes;
    const float *columns = columns_of(w, t);
    double *lost = job->lost + t * job->n_classes;
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
        for (size_t k = 0; k < a->scaling; k++) {
            if (root)
                TRY(settle(job, lost, w->n - a->scaling + k, q, out[k], d, error));
            else
                up[q][k] = out[k];
        }
        for (size_t k = a->scaling; k < a->inputs; k++)
            TRY(settle(job, lost, a->first + k - a->scaling, q, out[k], d, error));
    }
done:
    return status;
}

static lam_status told(compress_job *job, size_t elements, lam_error *error) {
    lam_status status = LAM_OK;
    const progress *p = job->input->progress;
#pragma omp critical(compress_progress)
    {
        job->done += elements;
        progress_report(p, "compressing", (double)job->done / (double)job->w->n);
        if (progress_cancelled(p)) status = status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    }
    return status;
}

static lam_status run_piece(compress_job *job, const wavelet_piece *piece, compress_desk *d,
                            lam_error *error) {
    lam_status status = LAM_OK;
    if (d->rows == NULL) TRY(desk_make(job->w, d, error));
    for (size_t t = piece->first; t < piece->last; t++) {
        TRY(run_node(job, t, d, error));
        if (job->w->nodes[t].from_left == 0) TRY(told(job, job->w->nodes[t].n_elements, error));
    }
done:
    return status;
}

/* Whole subtrees, as many as PIECES or so, then what is above them. */
static lam_status run_all(compress_job *job, compress_desk *desks, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = job->w;
    const size_t N = w->n_nodes, most = w->n / PIECES + LEAF;
    wavelet_piece *pieces = memory_allocate(N, sizeof *pieces, "compressed form factors", error);
    size_t n_pieces = 0, n_taken = 0;
    int failed = 0;
    if (pieces == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < N; t++) {
        const uint32_t parent = w->nodes[t].parent;
        if (w->nodes[t].n_elements > most || (parent != WAVELET_NONE && w->nodes[parent].n_elements <= most))
            continue;
        size_t first = t;
        while (w->nodes[first].from_left > 0) first = w->nodes[first].left;
        pieces[n_pieces++] = (wavelet_piece){(uint32_t)first, (uint32_t)t + 1};
    }
#pragma omp parallel num_threads((int)job->input->n_threads)
    {
        compress_desk *mine = NULL;
#pragma omp critical(compress_desks)
        mine = &desks[n_taken++];
#pragma omp for schedule(dynamic, 1)
        for (size_t k = 0; k < n_pieces; k++) {
            lam_error one = {.message = ""};
            if (__atomic_load_n(&failed, __ATOMIC_RELAXED)) continue;
            const lam_status now = run_piece(job, &pieces[k], mine, &one);
            if (now == LAM_OK) continue;
#pragma omp critical(compress_failed)
            if (!failed) {
                status = status_fail(error, now, "%s", one.message);
                __atomic_store_n(&failed, 1, __ATOMIC_RELAXED);
            }
        }
    }
    if (status != LAM_OK) goto done;
    if (desks[0].rows == NULL) TRY(desk_make(w, &desks[0], error));
    for (size_t t = 0; t < N; t++)
        if (w->nodes[t].n_elements > most) TRY(run_node(job, t, &desks[0], error));
done:
    free(pieces);
    return status;
}

static int by_column(const void *left, const void *right) {
    const kept_number *a = left, *b = right;
    return a->j < b->j ? -1 : a->j > b->j;
}

/* All that was kept, by rows. */
static lam_status gather(size_t n, size_t n_desks, compress_desk *desks, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "form factors", error)};
    kept_number *row = memory_allocate(n, sizeof *row, "form factors", error);
    if (made.indptr == NULL || row == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_desks; k++)
        for (size_t e = 0; e < desks[k].n_kept; e++) made.indptr[desks[k].kept[e].i + 1]++;
    TRY(csr_begin_rows(&made, "form factors", error));
    for (size_t k = 0; k < n_desks; k++) {
        for (size_t e = 0; e < desks[k].n_kept; e++) {
            const kept_number *a = &desks[k].kept[e];
            made.indices[made.indptr[a->i]] = a->j;
            made.data[made.indptr[a->i]++] = a->value;
        }
        desk_free(&desks[k]);
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

/* --- bounds -------------------------------------------------------------------------------------------- */

/* What the bounds of a node are made of. */
typedef struct node_sizes {
    double wavelets, inputs; /* the largest norm at an element of its wavelets' values, of all it takes */
    double rows;             /* Frobenius norm of the rows of its elements */
} node_sizes;

/* values [n][WAVELET_SCALING] of what nodes hand up, over A^1/2, at each position: those of the children
 * become those of their parent. */
static void size_node(const wavelets *w, size_t t, const double *area, const uint32_t *order,
                      double (*values)[WAVELET_SCALING], node_sizes *out) {
    const wavelet_node *a = &w->nodes[t];
    const bool root = t + 1 == w->n_nodes;
    const float *columns = columns_of(w, t);
    const size_t right = a->from_left > 0 ? w->nodes[t - 1].begin : 0;
    for (size_t p = a->begin; p < a->begin + a->n_elements; p++) {
        double in[WAVELET_INPUTS] = {0}, all = 0, own = 0;
        size_t first = 0, count = 1;
        if (a->from_left == 0) {
            first = p - a->begin;
            in[0] = 1 / sqrt(area[order[p]]);
        } else {
            first = p < right ? 0 : a->from_left;
            count = p < right ? a->from_left : a->inputs - a->from_left;
            memcpy(in, values[p], count * sizeof *in);
        }
        for (size_t m = 0; m < count; m++) all += in[m] * in[m];
        for (size_t k = 0; k < a->inputs; k++) {
            double value = 0;
            for (size_t m = 0; m < count; m++)
                value += (double)columns[(first + m) * WAVELET_INPUTS + k] * in[m];
            if (k >= a->scaling || root) own += value * value;
            if (k < a->scaling) values[p][k] = value;
        }
        out->wavelets = fmax(out->wavelets, sqrt(own));
        out->inputs = fmax(out->inputs, sqrt(all));
    }
}

/* max over shapes of |Q Q^T - 1|_F: they are rounded to single precision. */
static double unorthogonal(const wavelets *w) {
    const float *Q = w->basis;
    double largest = 0;
    for (size_t s = 0; s < w->n_shapes; s++) {
        const size_t m = w->shapes[s].inputs;
        double squares = 0;
        for (size_t i = 0; i < m; i++)
            for (size_t j = 0; j < m; j++) {
                double sum = i == j ? -1 : 0;
                for (size_t k = 0; k < m; k++) sum += (double)Q[i * m + k] * (double)Q[j * m + k];
                squares += sum * sum;
            }
        largest = fmax(largest, sqrt(squares));
        Q += m * m;
    }
    return largest;
}

static float rounded_up(double value) {
    const float near = (float)value;
    return (double)near < value ? nextafterf(near, INFINITY) : near;
}

/* bound_tk = M_t d_tk, and what rounding of S and of the basis adds: W^T W is 1 but for eta a level. On the
 * way to the coefficients that is eta of each node's inputs, and on the way back all levels' eta of the
 * light, which the rows of the leaf see. */
static lam_status make_bounds(const compress_job *job, compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = job->w;
    const csr *F = job->input->F;
    const double *area = job->input->area, eta = unorthogonal(w);
    double(*values)[WAVELET_SCALING] = memory_allocate(w->n, sizeof *values, "form factors", error);
    node_sizes *sizes = memory_allocate(w->n_nodes, sizeof *sizes, "form factors", error);
    c->bound = memory_allocate(w->n_nodes, c->n_classes * sizeof *c->bound, "form factors", error);
    if (values == NULL || sizes == NULL || c->bound == NULL) TRY(LAM_ERR_MEMORY);
    const double levels = (double)(COMPRESSED_CLASS_HEIGHTS * c->n_classes + 1);
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        node_sizes *own = &sizes[t];
        *own = (node_sizes){.rows = 0};
        size_node(w, t, area, c->order, values, own);
        if (a->from_left > 0) {
            own->rows = hypot(sizes[a->left].rows, sizes[t - 1].rows);
        } else {
            double squares = 0;
            for (size_t p = a->begin; p < a->begin + a->n_elements; p++) {
                const size_t i = c->order[p];
                for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
                    squares += area[i] / area[F->indices[e]] * (double)F->data[e] * (double)F->data[e];
            }
            own->rows = sqrt(squares);
        }
        const double rounding = own->rows * (own->wavelets * asymmetry +
                                             own->inputs * (eta + (a->from_left == 0 ? levels * eta : 0)));
        for (size_t k = 0; k < c->n_classes; k++)
            c->bound[t * c->n_classes + k] = rounded_up(
                own->wavelets * sqrt(job->lost[t * c->n_classes + k]) * (1 + 1e-9) + rounding * (1 + 1e-9));
    }
done:
    free(values);
    free(sizes);
    return status;
}

/* --- first light of groups ----------------------------------------------------------------------------- */

/* The larger groups first, and those that shine before all others. */
static lam_status choose_lit(const compress_input *input, compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    double *size = memory_allocate(input->n_groups, sizeof *size, "form factors", error);
    double whole = 0;
    c->lit_group = memory_allocate(COMPRESS_LIT_MOST, sizeof *c->lit_group, "form factors", error);
    if (size == NULL || c->lit_group == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < c->n; i++) {
        size[input->group[i]] += input->area[i];
        whole += input->area[i];
    }
    for (size_t g = 0; g < input->n_groups; g++)
        if (size[g] > 0 && input->shines != NULL && input->shines[g]) size[g] += whole;
    while (c->n_lit < COMPRESS_LIT_MOST) {
        size_t largest = 0;
        for (size_t g = 1; g < input->n_groups; g++)
            if (size[g] > size[largest]) largest = g;
        if (input->n_groups == 0 || !(size[largest] > 0)) break;
        size[largest] = 0;
        c->lit_group[c->n_lit++] = (uint32_t)largest;
    }
done:
    free(size);
    return status;
}

static lam_status light_groups(const compress_input *input, compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *slot = memory_allocate(input->n_groups, sizeof *slot, "form factors", error);
    TRY(choose_lit(input, c, error));
    c->lit = memory_allocate(c->n_lit, c->n * sizeof *c->lit, "form factors", error);
    if (slot == NULL || c->lit == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < input->n_groups; g++) slot[g] = UINT32_MAX;
    for (size_t g = 0; g < c->n_lit; g++) slot[c->lit_group[g]] = (uint32_t)g;
    for (size_t i = 0; i < c->n; i++) {
        double sums[COMPRESS_LIT_MOST] = {0};
        for (uint64_t e = input->F->indptr[i]; e < input->F->indptr[i + 1]; e++) {
            const uint32_t g = slot[input->group[input->F->indices[e]]];
            if (g != UINT32_MAX) sums[g] += (double)input->F->data[e];
        }
        for (size_t g = 0; g < c->n_lit; g++) c->lit[g * c->n + i] = (float)sums[g];
    }
done:
    free(slot);
    return status;
}

/* --- all of it ----------------------------------------------------------------------------------------- */

/* Of every coefficient the class of its node. */
static lam_status spread_classes(const wavelets *w, uint8_t *of_coefficient, size_t *n_classes,
                                 lam_error *error) {
    uint8_t *of_node = memory_allocate(w->n_nodes, sizeof *of_node, "form factors", error);
    lam_status status = LAM_OK;
    if (of_node == NULL) TRY(LAM_ERR_MEMORY);
    TRY(compressed_classes(w, of_node, n_classes, error));
    memset(of_coefficient, (int)(*n_classes - 1), w->n);
    for (size_t t = 0; t < w->n_nodes; t++)
        memset(of_coefficient + w->nodes[t].first, of_node[t], w->nodes[t].inputs - w->nodes[t].scaling);
done:
    free(of_node);
    return status;
}

lam_status compress_form_factors(const compress_input *input, compressed_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->F->n;
    plane_tree tree = {.n = 0};
    compressed_factors c = {.n = n};
    compress_job job = {.input = input, .w = &c.basis};
    compress_desk *desks = memory_allocate(input->n_threads, sizeof *desks, "form factors", error);
    uint32_t *position = memory_allocate(n, sizeof *position, "form factors", error);
    uint8_t *class_of = memory_allocate(n, sizeof *class_of, "form factors", error);
    if (desks == NULL || position == NULL || class_of == NULL) TRY(LAM_ERR_MEMORY);
    TRY(plane_tree_make(n, input->centre, input->normal, LEAF, &tree, error));
    TRY(wavelet_basis_make(&tree, input->area, input->centre, &c.basis, error));
    c.order = tree.order;
    tree.order = NULL;
    for (size_t p = 0; p < n; p++) position[c.order[p]] = (uint32_t)p;
    TRY(spread_classes(&c.basis, class_of, &c.n_classes, error));
    job.order = c.order;
    job.position = position;
    job.class_of = class_of;
    job.n_classes = c.n_classes;
    job.up = memory_allocate(c.basis.n_nodes, sizeof *job.up, "form factors", error);
    job.lost = memory_allocate(c.basis.n_nodes, c.n_classes * sizeof *job.lost, "form factors", error);
    if (job.up == NULL || job.lost == NULL) TRY(LAM_ERR_MEMORY);
    TRY(run_all(&job, desks, error));
    TRY(gather(n, input->n_threads, desks, &c.S, error));
    TRY(make_bounds(&job, &c, error));
    TRY(light_groups(input, &c, error));
    *out = c;
    c = (compressed_factors){.n = 0};
done:
    for (size_t k = 0; desks != NULL && k < input->n_threads; k++) desk_free(&desks[k]);
    for (size_t t = 0; job.up != NULL && t < c.basis.n_nodes; t++) free(job.up[t]);
    free(job.up);
    free(job.lost);
    free(desks);
    free(position);
    free(class_of);
    plane_tree_free(&tree);
    compressed_free(&c);
    return status;
}
