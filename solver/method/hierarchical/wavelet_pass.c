/* W S W^T is made from rows of F in one pass up the tree (Beylkin, Coifman and Rokhlin 1991): node a forms
 * (Phi_a S; Psi_a S) = Q_a (Phi_left S; Phi_right S), coarsens the columns by Q_b, and keeps Psi_a S Psi_b^T
 * above threshold weight_a weight_b. wavelet_pass_kernels.inc has the inner loops. */
#include "solver/method/hierarchical/wavelet_pass.h"

#include "solver/base/bitset.h"
#include "solver/base/cpu.h"
#include "solver/method/hierarchical/subtrees.h"
#include "solver/method/hierarchical/wavelet_entries.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* Up to WAVELET_INPUTS rows of one node side by side: lane k is the row of its function k. */
typedef float lanes __attribute__((vector_size(32)));
typedef float lanes_unaligned __attribute__((vector_size(32), aligned(4), may_alias));

/* Of one-sided rows each coefficient is a sum S1_ij + S1_ji of two that are found apart, each noisy: either
 * is kept above this share of the threshold, and their sum is compared with the whole. */
static const float one_sided_share = .2f;

/* Prefetch distance, in entries. */
enum { AHEAD = 12 };

/* Rows on the scaling functions of a column cluster (constant and linear, three at most): all rows of a node
 * (block), or its scaling rows alone (kept_block). */
enum { SCALING = ENTRY_LANES };
typedef struct block {
    lanes of[SCALING];
} block;
typedef struct kept_block {
    float of[SCALING][SCALING];
} kept_block;

/* The rows of a node on column clusters (nodes, ascending); they are 0 on all others. */
typedef struct live_rows {
    size_t count;
    uint32_t *cluster;
    block *value;
} live_rows;
typedef struct kept_rows {
    size_t count;
    uint32_t *cluster;
    kept_block *value;
} kept_rows;

/* Position of an element, and its A^-1/2. */
typedef struct column_place {
    uint32_t position;
    float over_root;
} column_place;

/* Shared by all threads. */
typedef struct pass_job {
    const wavelet_pass_input *input;
    wavelet_reach reach;
    column_place *columns; /* [n], by element */
    kept_rows *kept;       /* [n_nodes], scaling rows that wait for those of the sibling */
    fine_columns *fine;    /* [n_nodes], their finer columns; NULL: rows are two-sided */
    float least;           /* a coefficient is kept above it times both weights */
    size_t done;           /* elements */
} pass_job;

/* The working area of one thread. */
typedef struct pass_work {
    lanes *dense;           /* [n], rows of a leaf by position: all 0 between leaves */
    bitset lit;             /* positions where they are not 0; AHEAD numbers behind these may be read */
    uint32_t *cells, *work; /* of wavelet_cells */
    live_rows rows[2];      /* of the scaling functions, before and after a level */
    live_rows near[2];      /* of the wavelets, on near clusters alone */
    fine_columns fresh, merged, joined; /* finer columns that a node adds, those of its children, both */
    size_t *runs;                       /* [heights], where each height begins in `fresh` */
    coefficient_list found;
} pass_work;

/* The rows at a column's wavelets: KEEP stores coefficients above the threshold, CARRY adds finer columns. */
enum { KEEP = 1, CARRY = 2 };

/* The node whose rows are transformed. */
typedef struct pass_row {
    const pass_job *job;
    size_t node;
    unsigned wanted; /* at columns that its scaling rows pass: CARRY or 0 */
    uint32_t height;
    uint32_t first;     /* the coefficient of lane k is first + k, for a wavelet k */
    unsigned own_lanes; /* bits of the lanes that are coefficients: wavelets; all of a one-sided root */
    float least;        /* threshold times the weight of the node */
} pass_row;

static void kept_rows_free(kept_rows *k) {
    free(k->cluster);
    free(k->value);
    *k = (kept_rows){.count = 0};
}

/* The scaling functions of the root are the last coefficients. */
static inline uint32_t row_coefficient(const pass_row *row, unsigned lane) {
    const wavelets *w = row->job->input->basis;
    const uint32_t scaling = w->nodes[row->node].scaling;
    return lane < scaling ? (uint32_t)w->n - scaling + lane : row->first + lane;
}

/* Coefficient (i, j) of the row's node and column node b. Two nodes of one height find each other: of
 * two-sided rows the one with i <= j is kept. */
static lam_status keep_coefficient(const pass_row *row, pass_work *d, uint32_t b, uint32_t i, uint32_t j,
                                   float value, lam_error *error) {
    const bool two_sided = row->job->fine == NULL;
    if (two_sided && row->job->reach.height[b] == row->height && j < i) return LAM_OK;
    return coefficient_list_add(&d->found, i, j, value, error);
}

static inline unsigned beyond_portable(const lanes *v, float least) {
    unsigned bits = 0;
    for (int lane = 0; lane < WAVELET_INPUTS; lane++) bits |= (unsigned)(fabsf((*v)[lane]) > least) << lane;
    return bits;
}

#define KERNEL(name) name##_portable
#define TARGET
#define BEYOND(v, x) beyond_portable(v, x)
#include "solver/method/hierarchical/wavelet_pass_kernels.inc"

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define BEYOND(v, x)                                                                                         \
    (unsigned)_mm256_movemask_ps(_mm256_cmp_ps(                                                              \
        _mm256_andnot_ps(_mm256_set1_ps(-0.0f), *(const __m256 *)(v)), _mm256_set1_ps(x), _CMP_GT_OQ))
#include "solver/method/hierarchical/wavelet_pass_kernels.inc"
#endif

/* The fastest kernels for this CPU. */
typedef struct pass_kernels {
    void (*merge)(const wavelets *, size_t, const kept_rows *, const kept_rows *, live_rows *);
    lam_status (*promote)(const pass_row *, uint32_t, unsigned, const live_rows *, live_rows *, pass_work *,
                          lam_error *);
    lam_status (*merge_fine_columns)(const pass_row *, const fine_columns *, const fine_columns *,
                                     fine_columns *, pass_work *, lam_error *);
    lam_status (*begin_leaf)(const pass_row *, size_t, live_rows *, pass_work *, lam_error *);
} pass_kernels;

#define KERNELS(name) {merge_##name, promote_##name, merge_fine_columns_##name, begin_leaf_##name}
static const pass_kernels kernels_of[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx2));
#undef KERNELS

/* Rows S_ij = A_i^1/2 F_ij A_j^-1/2 of a leaf's elements, one a lane, into `dense`. */
static lam_status scatter_rows(const pass_job *job, size_t node, pass_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_pass_input *input = job->input;
    const wavelet_node *a = &input->basis->nodes[node];
    const uint32_t *elements = input->tree->order + a->begin;
    row_block rows = {0};
    /* A row source that traces rays may take seconds for a leaf. */
    if (progress_cancelled(input->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    TRY(row_source_get(input->rows, elements, a->n_elements, &rows, error));
    for (size_t lane = 0; lane < a->n_elements; lane++) {
        const float root = job->reach.place[a->begin + lane].root;
        for (size_t e = 0; e < rows.length[lane]; e++) {
            const column_place *at = &job->columns[rows.indices[lane][e]];
            if (e + AHEAD < rows.length[lane])
                __builtin_prefetch(&d->dense[job->columns[rows.indices[lane][e + AHEAD]].position], 1);
            const size_t p = at->position;
            d->dense[p][lane] += root * at->over_root * rows.data[lane][e];
            bitset_add(&d->lit, p);
        }
    }
done:
    row_block_free(&rows);
    return status;
}

/* Stores the scaling rows of a node until its sibling is done. */
static lam_status keep_rows(const live_rows *rows, size_t scaling, const wavelets *w, kept_rows *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    out->count = rows->count;
    out->cluster = memory_allocate(rows->count, sizeof *out->cluster, "wavelets", error);
    out->value = memory_allocate(rows->count, sizeof *out->value, "wavelets", error);
    if (out->cluster == NULL || out->value == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(out->cluster, rows->cluster, rows->count * sizeof *out->cluster);
    for (size_t e = 0; e < rows->count; e++)
        for (size_t k = 0; k < w->nodes[rows->cluster[e]].scaling; k++)
            for (size_t lane = 0; lane < scaling; lane++)
                out->value[e].of[k][lane] = rows->value[e].of[k][lane];
done:
    return status;
}

/* Coefficients at the scaling functions of the root, of the wavelets of a node, and of all rows of the root.
 */
static lam_status end_at_root(const pass_row *row, size_t node, const live_rows *rows, pass_work *d,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = row->job->input->basis;
    const uint32_t root = (uint32_t)w->n_nodes - 1;
    const wavelet_node *a = &w->nodes[node];
    const size_t scaling = w->nodes[root].scaling;
    for (size_t lane = node == root ? 0 : a->scaling; rows->count > 0 && lane < a->inputs; lane++)
        for (size_t k = 0; k < scaling; k++) {
            const uint32_t i = row_coefficient(row, (unsigned)lane);
            const uint32_t j = (uint32_t)(w->n - scaling + k);
            const float value = rows->value[0].of[k][lane];
            if (fabsf(value) > row->least * row->job->input->weight[root])
                TRY(keep_coefficient(row, d, root, i, j, value, error));
        }
done:
    return status;
}

/* out: the rows on clusters that are near the node. */
static void take_near(const pass_job *job, size_t node, const live_rows *all, live_rows *out) {
    out->count = 0;
    for (size_t e = 0; e < all->count; e++) {
        if (!wavelet_is_near(&job->reach, node, all->cluster[e])) continue;
        out->cluster[out->count] = all->cluster[e];
        out->value[out->count++] = all->value[e];
    }
}

static void swap(live_rows **a, live_rows **b) {
    live_rows *const swapped = *a;
    *a = *b;
    *b = swapped;
}

/* Stores the finer columns of a node's scaling rows: those of its children, and those that its own rows
 * passed, which stand in `fresh` as ascending runs, first of leaf columns, then of each height. */
static lam_status carry_fine_columns(pass_job *job, const pass_row *row, pass_work *d, size_t n_heights,
                                     lam_error *error) {
    lam_status status = LAM_OK;
    fine_columns *all = &d->merged, *next = &d->joined;
    for (size_t k = 0; k <= n_heights; k++) {
        const size_t first = k == 0 ? 0 : d->runs[k - 1], last = k < n_heights ? d->runs[k] : d->fresh.count;
        if (first == last) continue;
        TRY(fine_columns_union(all, d->fresh.list + first, last - first, next, error));
        fine_columns *const swapped = all;
        all = next;
        next = swapped;
    }
    TRY(fine_columns_copy(all, &job->fine[row->node], error));
done:
    return status;
}

/* The rows of one node (wavelet_pass.h): formed from those of its children or of a leaf's elements, its
 * scaling rows coarsened to the height below the parent and stored, its wavelets coarsened up to the root. */
static lam_status run_node(pass_job *job, size_t node, pass_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const pass_kernels kernels = kernels_of[cpu_best()];
    const wavelets *w = job->input->basis;
    const wavelet_node *a = &w->nodes[node];
    const uint32_t root = (uint32_t)w->n_nodes - 1, top = job->reach.height[root];
    const uint32_t keep_at = node == root ? UINT32_MAX : job->reach.height[a->parent] - 1;
    const bool two_sided = job->fine == NULL;
    const unsigned every = (1u << a->inputs) - 1, scaling_lanes = (1u << a->scaling) - 1;
    const pass_row row = {.job = job,
                          .node = node,
                          .wanted = two_sided || node == root ? 0 : CARRY,
                          .height = job->reach.height[node],
                          .first = a->first - a->scaling,
                          .own_lanes = two_sided || node != root ? every & ~scaling_lanes : every,
                          .least = job->least * job->input->weight[node]};
    live_rows *from = &d->rows[0], *to = &d->rows[1];
    uint32_t height = row.height;
    d->fresh.count = d->merged.count = 0;
    if (a->from_left > 0) {
        kernels.merge(w, node, &job->kept[a->left], &job->kept[node - 1], from);
        kept_rows_free(&job->kept[a->left]);
        kept_rows_free(&job->kept[node - 1]);
        if (!two_sided) {
            TRY(kernels.merge_fine_columns(&row, &job->fine[a->left], &job->fine[node - 1], &d->merged, d,
                                           error));
            fine_columns_free(&job->fine[a->left]);
            fine_columns_free(&job->fine[node - 1]);
        }
    } else {
        TRY(scatter_rows(job, node, d, error));
        TRY(kernels.begin_leaf(&row, node, from, d, error));
        height = 1;
    }
    live_rows *near = &d->near[0], *next = &d->near[1];
    take_near(job, node, from, near);
    /* Phi_a S up to the height below the parent */
    for (uint32_t h = height; node != root && h <= keep_at; h++) {
        d->runs[h - height] = d->fresh.count;
        TRY(kernels.promote(&row, h, row.wanted, from, to, d, error));
        swap(&from, &to);
    }
    if (node != root) TRY(keep_rows(from, a->scaling, w, &job->kept[node], error));
    if (node != root && !two_sided) TRY(carry_fine_columns(job, &row, d, keep_at + 1 - height, error));
    /* Psi_a S Psi_b^T for b of every height up to the root */
    for (; height <= top; height++) {
        TRY(kernels.promote(&row, height, KEEP, near, next, d, error));
        swap(&near, &next);
    }
    TRY(end_at_root(&row, node, near, d, error));
done:
    return status;
}

static void job_free(pass_job *job) {
    for (size_t t = 0; job->kept != NULL && t < job->input->basis->n_nodes; t++)
        kept_rows_free(&job->kept[t]);
    for (size_t t = 0; job->fine != NULL && t < job->input->basis->n_nodes; t++)
        fine_columns_free(&job->fine[t]);
    free(job->kept);
    free(job->fine);
    free(job->columns);
    wavelet_reach_free(&job->reach);
}

static lam_status job_make(const wavelet_pass_input *input, pass_job *job, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = input->basis;
    const size_t N = w->n_nodes;
    *job = (pass_job){.input = input, .least = input->threshold * (input->one_sided ? one_sided_share : 1)};
    job->kept = memory_allocate(N, sizeof *job->kept, "wavelets", error);
    if (input->one_sided) job->fine = memory_allocate(N, sizeof *job->fine, "wavelets", error);
    if (input->one_sided && job->fine == NULL) TRY(LAM_ERR_MEMORY);
    job->columns = memory_allocate(w->n, sizeof *job->columns, "wavelets", error);
    if (job->kept == NULL || job->columns == NULL) TRY(LAM_ERR_MEMORY);
    TRY(wavelet_reach_make(w, input->tree, input->area, input->centre, input->reach, &job->reach, error));
    for (size_t p = 0; p < w->n; p++) {
        const uint32_t i = input->tree->order[p];
        job->columns[i] = (column_place){(uint32_t)p, (float)(1 / sqrt(input->area[i]))};
    }
done:
    return status;
}

static void pass_work_free(pass_work *d) {
    free(d->dense);
    bitset_free(&d->lit);
    free(d->cells);
    free(d->work);
    for (int k = 0; k < 2; k++) {
        free(d->rows[k].cluster);
        free(d->rows[k].value);
        free(d->near[k].cluster);
        free(d->near[k].value);
    }
    fine_columns_free(&d->fresh);
    fine_columns_free(&d->merged);
    fine_columns_free(&d->joined);
    free(d->runs);
    coefficient_list_free(&d->found);
    *d = (pass_work){.dense = NULL};
}

static void *aligned_lanes(size_t count, size_t size, lam_error *error) {
    size_t bytes;
    void *made = NULL;
    if (size_multiply(count, size, &bytes) && bytes < SIZE_MAX / 2)
        made = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (made == NULL)
        status_fail(error, LAM_ERR_MEMORY, "wavelets: cannot allocate %zu x %zu bytes", count, size);
    return made;
}

static lam_status pass_work_make(const pass_job *job, pass_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = job->input->basis->n;
    d->dense = aligned_lanes(n, sizeof *d->dense, error);
    TRY(bitset_make(n, AHEAD, "wavelets", &d->lit, error));
    d->cells = memory_allocate(job->reach.n_leaves, sizeof *d->cells, "wavelets", error);
    d->work = memory_allocate(2 * (size_t)job->reach.height[job->input->basis->n_nodes - 1] + 4,
                              sizeof *d->work, "wavelets", error);
    d->runs = memory_allocate((size_t)job->reach.height[job->input->basis->n_nodes - 1] + 1, sizeof *d->runs,
                              "wavelets", error);
    if (d->dense == NULL || d->cells == NULL || d->work == NULL || d->runs == NULL) TRY(LAM_ERR_MEMORY);
    memset(d->dense, 0, n * sizeof *d->dense);
    for (int k = 0; k < 2; k++) {
        d->rows[k].cluster =
            memory_allocate(job->reach.n_leaves, sizeof *d->rows[k].cluster, "wavelets", error);
        d->rows[k].value = aligned_lanes(job->reach.n_leaves, sizeof *d->rows[k].value, error);
        d->near[k].cluster =
            memory_allocate(job->reach.n_leaves, sizeof *d->near[k].cluster, "wavelets", error);
        d->near[k].value = aligned_lanes(job->reach.n_leaves, sizeof *d->near[k].value, error);
        if (d->rows[k].cluster == NULL || d->rows[k].value == NULL || d->near[k].cluster == NULL ||
            d->near[k].value == NULL)
            TRY(LAM_ERR_MEMORY);
    }
done:
    return status;
}

static lam_status report_done(pass_job *job, size_t elements, lam_error *error) {
    lam_status status = LAM_OK;
    const progress *p = job->input->progress;
#pragma omp critical(wavelet_pass_progress)
    {
        job->done += elements;
        progress_report(p, job->input->one_sided ? "rays, wavelets" : "wavelets",
                        (double)job->done / (double)job->input->basis->n);
        if (progress_cancelled(p)) status = status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    }
    return status;
}

/* A thread takes subtrees of at most this many elements at a time. */
static size_t piece_elements(const pass_job *job) {
    return job->input->basis->n / 64 + 8;
}

typedef struct pass_team {
    pass_job *job;
    pass_work *works;
} pass_team;

/* Progress counts whole subtrees; nodes above them add nothing. */
static lam_status run_piece(void *context, wavelet_piece piece, size_t k, lam_error *error) {
    lam_status status = LAM_OK;
    pass_team *team = context;
    pass_job *job = team->job;
    const size_t elements = job->input->basis->nodes[piece.last - 1].n_elements;
    pass_work *d = &team->works[k];
    if (d->dense == NULL) TRY(pass_work_make(job, d, error));
    for (size_t t = piece.first; t < piece.last; t++) TRY(run_node(job, t, d, error));
    if (elements <= piece_elements(job)) TRY(report_done(job, elements, error));
done:
    return status;
}

static lam_status run_all(pass_job *job, pass_work *works, lam_error *error) {
    pass_team team = {job, works};
    return subtrees_run(job->input->basis, piece_elements(job), job->input->n_threads, run_piece, &team,
                        error);
}

static lam_status collect(const pass_job *job, pass_work *works, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_pass_input *input = job->input;
    coefficient_list *lists = memory_allocate(input->n_threads, sizeof *lists, "wavelets", error);
    if (lists == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < input->n_threads; k++) {
        lists[k] = works[k].found;
        works[k].found = (coefficient_list){.count = 0};
        pass_work_free(&works[k]);
    }
    TRY(coefficient_lists_join(input->basis->n, lists, input->n_threads, out, error));
    if (input->one_sided)
        status = wavelet_add_transpose(input->basis, input->weight, input->threshold, out, error);
    if (status != LAM_OK) csr_free(out);
done:
    for (size_t k = 0; k < input->n_threads; k++) coefficient_list_free(&lists[k]);
    free(lists);
    return status;
}

lam_status wavelet_pass(const wavelet_pass_input *input, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    pass_job job = {.input = input};
    pass_work *works = memory_allocate(input->n_threads, sizeof *works, "wavelets", error);
    if (works == NULL) TRY(LAM_ERR_MEMORY);
    TRY(job_make(input, &job, error));
    TRY(run_all(&job, works, error));
    TRY(collect(&job, works, out, error));
done:
    for (size_t k = 0; works != NULL && k < input->n_threads; k++) pass_work_free(&works[k]);
    free(works);
    job_free(&job);
    return status;
}
