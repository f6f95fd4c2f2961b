/* W S W^T is made from cluster blocks, S = S1 + S1^T (Gortler et al. 1993): a block is M_a L M_b^T at the
 * scaling functions of its nodes, columns and then rows climb the tree by (Phi_t; Psi_t) = Q_t (Phi_left;
 * Phi_right), and a coefficient is kept above threshold weight_i weight_j. */
#include "solver/method/hierarchical/wavelet_blocks.h"

#include "solver/base/array_grow.h"
#include "solver/method/hierarchical/subtrees.h"
#include "solver/method/hierarchical/wavelet_entries.h"

#include "store/status.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of two nested nodes both directions of the light have coefficients at the same place, found apart: either
 * is kept above this share of the threshold, and their sum is compared with the whole. */
static const float share_nested = .2f;
/* Carried columns are dropped up to this share of the threshold. */
static const float share_carried = .1f;

/* Rows side by side: the scaling functions of a cluster are one group, the elements of a leaf two. */
enum { GROUP = 4, GROUPS = WAVELET_INPUTS / GROUP };
typedef float rows __attribute__((vector_size(4 * GROUP), may_alias));

/* M_t of a cluster; rows beyond its scaling functions are 0. */
typedef struct node_moments {
    double of[ENTRY_LANES][BLOCK_FUNCTIONS];
} node_moments;

/* Shared by all threads. */
typedef struct blocks_job {
    const wavelet_blocks_input *input;
    node_moments *moments; /* [n_nodes] */
    uint32_t *begin_of;    /* [n], by coefficient the first position of its node */
    fine_columns *kept;    /* [n_nodes], scaling rows that wait for those of the sibling */
    size_t deepest;        /* nodes on a path from the root, at most */
    size_t done;           /* elements */
} blocks_job;

/* A block of the row node at hand, at its column node. */
typedef struct column_item {
    uint32_t begin, end, node, block;
} column_item;

/* A column node, items within which are being added to its inputs. */
typedef struct open_column {
    rows in[WAVELET_INPUTS][GROUPS];
    uint32_t node;
} open_column;

/* The weight of an element in S: A^1/2, times its balance. */
static double weight_of(const block_factors *f, size_t position) {
    return sqrt(f->area[position]) * (f->balance != NULL ? f->balance[position] : 1);
}

/* The working area of one thread. */
typedef struct blocks_work {
    column_item *items;
    size_t n_items, items_capacity;
    open_column *open; /* [deepest], each within the one before */
    size_t n_open;
    fine_columns own, leaf, merged; /* of a node's own blocks, of the blocks of a leaf's elements, of all */
    coefficient_list found;
} blocks_work;

/* The node whose rows are formed. */
typedef struct blocks_row {
    const blocks_job *job;
    size_t node;
    const wavelet_node *a;
    const float *columns;       /* of its matrix */
    bool root;                  /* its scaling rows are coefficients */
    uint32_t own_end;           /* one beyond its last coefficient: those before it are within the node */
    float least, least_carried; /* thresholds, to be multiplied by the weight of the column */
} blocks_row;

static blocks_row row_of(const blocks_job *job, size_t node) {
    const wavelet_blocks_input *input = job->input;
    const wavelets *w = input->basis;
    const wavelet_node *a = &w->nodes[node];
    const bool root = a->parent == WAVELET_NONE;
    return (blocks_row){
        .job = job,
        .node = node,
        .a = a,
        .columns = wavelet_columns(w, a),
        .root = root,
        .own_end = a->first + a->inputs - a->scaling,
        .least = input->threshold * input->weight[node],
        .least_carried = root ? 0 : share_carried * input->threshold * input->weight[a->parent],
    };
}

/* Keeps the coefficient of a row at column j. Its transpose has the same place where the nodes are nested:
 * rows begin before their columns, so that columns before own_end are within the node. */
static inline lam_status keep(const blocks_row *r, size_t lane, uint32_t j, float weight, float value,
                              blocks_work *d, lam_error *error) {
    const float size = fabsf(value), least = r->least * weight;
    if (!(size > share_nested * least)) return LAM_OK;
    const bool nested = j < r->own_end || r->job->begin_of[j] <= r->a->begin;
    if (!nested && !(size > least)) return LAM_OK;
    const size_t n = r->job->input->basis->n;
    const size_t i = lane < r->a->scaling ? n - r->a->scaling + lane : r->a->first + lane - r->a->scaling;
    return coefficient_list_add(&d->found, (uint32_t)i, j, value, error);
}

/* Appends column j of the scaling rows, for which there is room, unless it is small. */
static inline void carry(const blocks_row *r, uint32_t j, float weight, const float *of, fine_columns *to) {
    float most = 0;
    for (int lane = 0; lane < ENTRY_LANES; lane++) most = fabsf(of[lane]) > most ? fabsf(of[lane]) : most;
    if (!(most > r->least_carried * weight)) return;
    fine_column *const made = &to->list[to->count++];
    *made = (fine_column){.j = j, .weight = weight};
    for (int lane = 0; lane < ENTRY_LANES; lane++) made->of[lane] = of[lane];
}

/* Column j of the node's inputs, x, becomes that of its functions: y = Q x. Wavelets are coefficients; y
 * [WAVELET_INPUTS] begins with the scaling functions, which are coefficients of a root. */
static inline lam_status turn_column(const blocks_row *r, uint32_t j, float weight, const float *x, float *y,
                                     blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    rows sums[GROUPS] = {{0}};
    for (size_t m = 0; m < r->a->inputs; m++)
        for (size_t g = 0; g < GROUPS; g++) {
            rows column;
            memcpy(&column, r->columns + m * WAVELET_INPUTS + g * GROUP, sizeof column);
            sums[g] += x[m] * column;
        }
    memcpy(y, sums, sizeof sums);
    for (size_t lane = r->root ? 0 : r->a->scaling; lane < r->a->inputs; lane++)
        TRY(keep(r, lane, j, weight, y[lane], d, error));
    for (size_t lane = r->a->scaling; lane < ENTRY_LANES; lane++) y[lane] = 0;
done:
    return status;
}

/* Column j of rows that have come up the column tree: of the scaling functions of a node (groups 1), or of
 * the elements of a leaf (groups 2). */
static inline lam_status end_column(const blocks_row *r, uint32_t j, float weight, const rows *x,
                                    size_t groups, blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    fine_columns *to = groups == 1 ? &d->own : &d->leaf;
    float of[WAVELET_INPUTS], y[WAVELET_INPUTS];
    memcpy(of, x, groups * sizeof *x);
    TRY(fine_columns_reserve(to, 1, error));
    if (groups > 1) TRY(turn_column(r, j, weight, of, y, d, error));
    fine_column *const made = &to->list[to->count++];
    *made = (fine_column){.j = j, .weight = weight};
    for (int lane = 0; lane < ENTRY_LANES; lane++) made->of[lane] = groups > 1 ? y[lane] : of[lane];
done:
    return status;
}

/* The first input of a node's parent that the node gives. */
static inline size_t slot_of(const wavelets *w, size_t node) {
    const wavelet_node *parent = &w->nodes[w->nodes[node].parent];
    return parent->left == node ? 0 : parent->from_left;
}

/* Rows at the innermost open column become rows at its functions: those at its wavelets end, those at its
 * scaling functions go to its parent, which is open from then on; those of the root end too. */
static inline lam_status close_column(const blocks_row *r, size_t groups, blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = r->job->input->basis;
    open_column *top = &d->open[d->n_open - 1];
    const size_t node = top->node;
    const wavelet_node *b = &w->nodes[node];
    const float *Q = wavelet_columns(w, b), weight = r->job->input->weight[node];
    rows out[WAVELET_INPUTS][GROUPS] = {{{0}}};
    for (size_t m = 0; m < b->inputs; m++)
        for (size_t k = 0; k < b->inputs; k++)
            for (size_t g = 0; g < groups; g++) out[k][g] += Q[m * WAVELET_INPUTS + k] * top->in[m][g];
    for (size_t k = b->scaling; k < b->inputs; k++)
        TRY(end_column(r, b->first + (uint32_t)(k - b->scaling), weight, out[k], groups, d, error));
    if (b->parent == WAVELET_NONE) {
        for (size_t k = 0; k < b->scaling; k++)
            TRY(end_column(r, (uint32_t)(w->n - b->scaling + k), weight, out[k], groups, d, error));
        d->n_open--;
        goto done;
    }
    if (d->n_open > 1 && d->open[d->n_open - 2].node == b->parent) {
        top--;
        d->n_open--;
    } else {
        *top = (open_column){.node = b->parent};
    }
    const size_t slot = slot_of(w, node);
    for (size_t k = 0; k < b->scaling; k++)
        for (size_t g = 0; g < groups; g++) top->in[slot + k][g] += out[k][g];
done:
    return status;
}

/* Adds M_a L M_b^T of an item to the inputs of the node above b, which is the innermost open one; an element
 * is an input of its leaf and a row of its own. */
static inline void add_item(const blocks_row *r, const column_item *item, size_t groups, blocks_work *d) {
    const block_factors *f = r->job->input->blocks;
    const wavelets *w = r->job->input->basis;
    const cluster_block *k = &f->blocks[item->block];
    rows(*in)[GROUPS] = d->open[d->n_open - 1].in;
    double left[ENTRY_LANES][BLOCK_FUNCTIONS];
    const size_t n_left = groups == 1 ? r->a->scaling : 1;
    for (size_t g = 0; g < n_left; g++)
        for (size_t c = 0; c < BLOCK_FUNCTIONS; c++) {
            if (groups > 1) {
                left[g][c] = weight_of(f, k->a - f->n_clusters) * (double)k->L[0][c];
                continue;
            }
            const double *m = r->job->moments[r->node].of[g];
            left[g][c] = m[0] * (double)k->L[0][c] + m[1] * (double)k->L[1][c] + m[2] * (double)k->L[2][c];
        }
    const size_t lane = groups == 1 ? 0 : k->a - f->n_clusters - r->a->begin;
    if (k->b >= f->n_clusters) {
        const uint32_t p = k->b - (uint32_t)f->n_clusters;
        const size_t slot = p - w->nodes[f->nodes[k->b].parent].begin;
        for (size_t g = 0; g < n_left; g++)
            in[slot][(lane + g) / GROUP][(lane + g) % GROUP] += (float)(left[g][0] * weight_of(f, p));
        return;
    }
    const size_t slot = slot_of(w, k->b);
    for (size_t h = 0; h < w->nodes[k->b].scaling; h++) {
        const double *m = r->job->moments[k->b].of[h];
        for (size_t g = 0; g < n_left; g++)
            in[slot + h][(lane + g) / GROUP][(lane + g) % GROUP] +=
                (float)(left[g][0] * m[0] + left[g][1] * m[1] + left[g][2] * m[2]);
    }
}

/* Inner nodes before those around them, elements before a leaf of one. */
static int by_end(const void *left, const void *right) {
    const column_item *a = left, *b = right;
    if (a->end != b->end) return a->end < b->end ? -1 : 1;
    if (a->begin != b->begin) return a->begin > b->begin ? -1 : 1;
    if (a->node != b->node) return a->node > b->node ? -1 : 1;
    return a->block < b->block ? -1 : a->block > b->block;
}

static lam_status take_items(const blocks_job *job, size_t node, blocks_work *d, lam_error *error) {
    const block_factors *f = job->input->blocks;
    const size_t first = f->from[node], last = f->from[node + 1];
    if (first == last) return LAM_OK;
    const lam_status status = array_grow(&d->items, &d->items_capacity, d->n_items + last - first,
                                         sizeof *d->items, "wavelets", error);
    for (size_t k = first; status == LAM_OK && k < last; k++) {
        const uint32_t b = f->blocks[k].b;
        d->items[d->n_items++] = (column_item){f->nodes[b].begin, f->nodes[b].end, b, (uint32_t)k};
    }
    return status;
}

static bool is_around(const block_factors *f, uint32_t outer, const column_item *item) {
    return outer != item->node && f->nodes[outer].begin <= item->begin && item->end <= f->nodes[outer].end;
}

/* Takes the items of the row node up the column tree. They are in the order of their ends, so that a node is
 * complete when an item comes that is not within it, and columns end in ascending order. */
static inline __attribute__((always_inline)) lam_status climb(const blocks_row *r, size_t groups,
                                                              blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const block_factors *f = r->job->input->blocks;
    bool sorted = true;
    d->n_open = 0;
    for (size_t e = 1; sorted && e < d->n_items; e++) sorted = by_end(&d->items[e - 1], &d->items[e]) < 0;
    if (!sorted) qsort(d->items, d->n_items, sizeof *d->items, by_end);
    for (size_t e = 0; e < d->n_items; e++) {
        const column_item *item = &d->items[e];
        const uint32_t above = f->nodes[item->node].parent;
        while (d->n_open > 0 && !is_around(f, d->open[d->n_open - 1].node, item))
            TRY(close_column(r, groups, d, error));
        if (d->n_open == 0 || d->open[d->n_open - 1].node != above)
            d->open[d->n_open++] = (open_column){.node = above};
        add_item(r, item, groups, d);
    }
    while (d->n_open > 0) TRY(close_column(r, groups, d, error));
    d->n_items = 0;
done:
    return status;
}

static lam_status climb_cluster(const blocks_row *r, blocks_work *d, lam_error *error) {
    return climb(r, 1, d, error);
}

static lam_status climb_elements(const blocks_row *r, blocks_work *d, lam_error *error) {
    return climb(r, GROUPS, d, error);
}

/* The next column of a list, UINT32_MAX behind its end. */
static inline uint32_t column_at(const fine_columns *c, size_t at) {
    return at < c->count ? c->list[at].j : UINT32_MAX;
}

/* merged = the columns of a leaf's elements and of its own blocks. */
static lam_status merge_leaf(const blocks_row *r, blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    size_t l = 0, o = 0;
    TRY(fine_columns_reserve(&d->merged, d->leaf.count + d->own.count, error));
    while (l < d->leaf.count || o < d->own.count) {
        const uint32_t at_leaf = column_at(&d->leaf, l), at_own = column_at(&d->own, o);
        fine_column sum = at_leaf < at_own ? d->leaf.list[l] : d->own.list[o];
        for (int lane = 0; at_leaf == at_own && lane < ENTRY_LANES; lane++)
            sum.of[lane] += d->leaf.list[l].of[lane];
        l += at_leaf <= at_own;
        o += at_own <= at_leaf;
        carry(r, sum.j, sum.weight, sum.of, &d->merged);
    }
done:
    return status;
}

/* merged = the columns of both children, turned, and of the node's own blocks. */
static lam_status merge_children(const blocks_row *r, blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_node *a = r->a;
    fine_columns *left = &r->job->kept[a->left], *right = &r->job->kept[r->node - 1];
    size_t x_left = 0, x_right = 0, x_own = 0;
    TRY(fine_columns_reserve(&d->merged, left->count + right->count + d->own.count, error));
    for (;;) {
        const uint32_t at_left = column_at(left, x_left), at_right = column_at(right, x_right),
                       at_own = column_at(&d->own, x_own), children = at_left < at_right ? at_left : at_right,
                       j = children < at_own ? children : at_own;
        float x[WAVELET_INPUTS] = {0}, y[WAVELET_INPUTS] = {0}, weight = 0;
        if (j == UINT32_MAX) break;
        if (j == at_left) {
            weight = left->list[x_left].weight;
            for (size_t m = 0; m < a->from_left; m++) x[m] = left->list[x_left].of[m];
            x_left++;
        }
        if (j == at_right) {
            weight = right->list[x_right].weight;
            for (size_t m = a->from_left; m < a->inputs; m++)
                x[m] = right->list[x_right].of[m - a->from_left];
            x_right++;
        }
        if (j == children) TRY(turn_column(r, j, weight, x, y, d, error));
        if (j == at_own) {
            weight = d->own.list[x_own].weight;
            for (int lane = 0; lane < ENTRY_LANES; lane++) y[lane] += d->own.list[x_own].of[lane];
            x_own++;
        }
        if (!r->root) carry(r, j, weight, y, &d->merged);
    }
    fine_columns_free(left);
    fine_columns_free(right);
done:
    return status;
}

static lam_status run_node(blocks_job *job, size_t node, blocks_work *d, lam_error *error) {
    lam_status status = LAM_OK;
    const blocks_row r = row_of(job, node);
    d->own.count = d->leaf.count = d->merged.count = 0;
    TRY(take_items(job, node, d, error));
    TRY(climb_cluster(&r, d, error));
    if (r.a->from_left > 0) {
        TRY(merge_children(&r, d, error));
    } else {
        for (size_t p = r.a->begin; p < r.a->begin + r.a->n_elements; p++)
            TRY(take_items(job, job->input->blocks->n_clusters + p, d, error));
        TRY(climb_elements(&r, d, error));
        TRY(merge_leaf(&r, d, error));
    }
    if (!r.root) TRY(fine_columns_copy(&d->merged, &job->kept[node], error));
done:
    return status;
}

/* M_t of a leaf from its elements, of a node from its children in the coordinates of the node. */
static void find_moments(const block_factors *f, const wavelets *w, size_t node, node_moments *all) {
    const wavelet_node *a = &w->nodes[node];
    const float *Q = wavelet_columns(w, a);
    node_moments *out = &all[node];
    *out = (node_moments){.of = {{0}}};
    for (size_t m = 0; m < a->inputs; m++) {
        const bool leaf = a->from_left == 0, from_left = m < a->from_left;
        const size_t child = leaf ? f->n_clusters + a->begin + m : from_left ? a->left : node - 1;
        const block_step s = block_step_up(&f->nodes[child], &f->nodes[node]);
        const double root[BLOCK_FUNCTIONS] = {leaf ? weight_of(f, a->begin + m) : 0, 0, 0};
        const double *was = leaf ? root : all[child].of[from_left ? m : m - a->from_left];
        const double now[BLOCK_FUNCTIONS] = {was[0], s.shift[0] * was[0] + s.scale[0] * was[1],
                                             s.shift[1] * was[0] + s.scale[1] * was[2]};
        for (size_t h = 0; h < a->scaling; h++)
            for (int k = 0; k < BLOCK_FUNCTIONS; k++)
                out->of[h][k] += (double)Q[m * WAVELET_INPUTS + h] * now[k];
    }
}

static void job_free(blocks_job *job) {
    for (size_t t = 0; job->kept != NULL && t < job->input->basis->n_nodes; t++)
        fine_columns_free(&job->kept[t]);
    free(job->kept);
    free(job->moments);
    free(job->begin_of);
}

static lam_status job_make(const wavelet_blocks_input *input, blocks_job *job, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = input->basis;
    uint32_t *heights = memory_allocate(w->n_nodes, sizeof *heights, "wavelets", error);
    assert(w->n == input->blocks->n && w->n_nodes == input->blocks->n_clusters);
    *job = (blocks_job){.input = input};
    job->moments = memory_allocate(w->n_nodes, sizeof *job->moments, "wavelets", error);
    job->begin_of = memory_allocate(w->n, sizeof *job->begin_of, "wavelets", error);
    job->kept = memory_allocate(w->n_nodes, sizeof *job->kept, "wavelets", error);
    if (heights == NULL || job->moments == NULL || job->begin_of == NULL || job->kept == NULL)
        TRY(LAM_ERR_MEMORY);
    wavelets_heights(w, heights);
    job->deepest = (size_t)heights[w->n_nodes - 1] + 1;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const size_t count = a->inputs - (a->parent == WAVELET_NONE ? 0 : a->scaling);
        assert(a->scaling <= ENTRY_LANES);
        find_moments(input->blocks, w, t, job->moments);
        for (size_t k = 0; k < count; k++) job->begin_of[a->first + k] = a->begin;
    }
done:
    free(heights);
    return status;
}

static void work_free(blocks_work *d) {
    free(d->items);
    free(d->open);
    fine_columns_free(&d->own);
    fine_columns_free(&d->leaf);
    fine_columns_free(&d->merged);
    coefficient_list_free(&d->found);
}

typedef struct blocks_team {
    blocks_job *job;
    blocks_work *works;
} blocks_team;

/* A thread takes subtrees of at most this many elements at a time. */
static size_t piece_elements(const blocks_job *job) {
    return job->input->basis->n / 64 + 8;
}

/* Progress counts whole subtrees; nodes above them add nothing. */
static lam_status report_done(blocks_job *job, size_t elements, lam_error *error) {
    lam_status status = LAM_OK;
    const progress *p = job->input->progress;
#pragma omp critical(wavelet_blocks_progress)
    {
        if (elements <= piece_elements(job)) job->done += elements;
        progress_report(p, "wavelets", (double)job->done / (double)job->input->basis->n);
        if (progress_cancelled(p)) status = status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    }
    return status;
}

static lam_status run_piece(void *context, wavelet_piece piece, size_t k, lam_error *error) {
    lam_status status = LAM_OK;
    const blocks_team *team = context;
    blocks_work *d = &team->works[k];
    if (d->open == NULL) {
        d->open = aligned_alloc(sizeof(rows), team->job->deepest * sizeof *d->open);
        if (d->open == NULL)
            FAIL(error, LAM_ERR_MEMORY, "wavelets: cannot allocate %zu x %zu bytes", team->job->deepest,
                 sizeof *d->open);
    }
    for (size_t t = piece.first; t < piece.last; t++) TRY(run_node(team->job, t, d, error));
    TRY(report_done(team->job, team->job->input->basis->nodes[piece.last - 1].n_elements, error));
done:
    return status;
}

static lam_status collect(const blocks_job *job, blocks_work *works, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelet_blocks_input *input = job->input;
    coefficient_list *lists = memory_allocate(input->n_threads, sizeof *lists, "wavelets", error);
    if (lists == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < input->n_threads; k++) {
        lists[k] = works[k].found;
        works[k].found = (coefficient_list){.count = 0};
    }
    TRY(coefficient_lists_join(input->basis->n, lists, input->n_threads, out, error));
    status = wavelet_add_transpose(input->basis, input->weight, input->threshold, out, error);
    if (status != LAM_OK) csr_free(out);
done:
    for (size_t k = 0; k < input->n_threads; k++) coefficient_list_free(&lists[k]);
    free(lists);
    return status;
}

lam_status wavelet_blocks(const wavelet_blocks_input *input, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    blocks_job job = {.input = input};
    blocks_team team = {&job, memory_allocate(input->n_threads, sizeof *team.works, "wavelets", error)};
    if (team.works == NULL) TRY(LAM_ERR_MEMORY);
    TRY(job_make(input, &job, error));
    TRY(subtrees_run(input->basis, piece_elements(&job), input->n_threads, run_piece, &team, error));
    TRY(collect(&job, team.works, out, error));
done:
    for (size_t k = 0; team.works != NULL && k < input->n_threads; k++) work_free(&team.works[k]);
    free(team.works);
    job_free(&job);
    return status;
}
