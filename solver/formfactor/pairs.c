#include "solver/formfactor/pairs.h"

#include "solver/formfactor/far.h"
#include "solver/formfactor/links.h"
#include "solver/formfactor/neighbours.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* What is known of a pair, and beside it that no more need be known. */
typedef enum pair_state { UNKNOWN, CERTAIN, OPEN, HIDDEN, MIXED } pair_state;
enum { SETTLED = 8 };

/* Pairs of a position with greater ones, in the order they were found: one array a member. */
typedef struct pair_pool {
    uint32_t *other;
    float *exchange;
    uint8_t *state;
    size_t used, capacity;
} pair_pool;

/* Where the row of a position lies. */
typedef struct row_place {
    uint32_t thread, length;
    size_t offset;
} row_place;

typedef struct pairs_run {
    const mesh *m;
    const pairs_options *options;
    pair_rules rules;
    polygon *polygons; /* [n], by element */
    look look;
    cluster_tree tree;
    far_table far;
    cluster_links links;
    uint32_t (*neighbours)[NEIGHBOURS_MOST]; /* [n], by element */
    size_t n_pools;
    pair_pool *pools;  /* a thread's each */
    row_place *places; /* [n], by position: the pairs with greater positions, ascending */
} pairs_run;

/* --- rows ---------------------------------------------------------------------------------------------- */

static bool pool_reserve(pair_pool *p, size_t more) {
    if (p->capacity - p->used >= more) return true;
    const size_t capacity = p->capacity + p->capacity / 2 + more + 4096;
    uint32_t *other = realloc(p->other, capacity * sizeof *other);
    if (other != NULL) p->other = other;
    float *exchange = realloc(p->exchange, capacity * sizeof *exchange);
    if (exchange != NULL) p->exchange = exchange;
    uint8_t *state = realloc(p->state, capacity * sizeof *state);
    if (state != NULL) p->state = state;
    if (other == NULL || exchange == NULL || state == NULL) return false;
    p->capacity = capacity;
    return true;
}

static void pool_free(pair_pool *p) {
    free(p->other);
    free(p->exchange);
    free(p->state);
}

/* What a leaf is linked with, itself or as part of a larger cluster: positions first ... last-1. */
typedef struct reach {
    uint32_t first, last;
    bool open;
} reach;

/* A walk down to the leaves with all the reaches met on the way. */
typedef struct leaf_reaches {
    reach *reaches;
    size_t n, capacity;
    uint32_t leaf;
} leaf_reaches;

static int compare_reaches(const void *a, const void *b) {
    const reach *one = a, *two = b;
    return (one->first > two->first) - (one->first < two->first);
}

/* All that the leaf's ancestors and itself are linked with, by position; their positions do not overlap. */
static bool find_reaches(const pairs_run *run, const uint32_t *parent, uint32_t leaf, leaf_reaches *out) {
    out->n = 0;
    for (uint32_t c = leaf;; c = parent[c]) {
        const size_t first = run->links.of_cluster[c], last = run->links.of_cluster[c + 1];
        if (out->n + (last - first) > out->capacity) {
            const size_t capacity = 2 * (out->n + (last - first)) + 64;
            reach *more = realloc(out->reaches, capacity * sizeof *more);
            if (more == NULL) return false;
            out->reaches = more;
            out->capacity = capacity;
        }
        for (size_t k = first; k < last; k++) {
            const cluster *b = &run->tree.clusters[run->links.links[k].b];
            out->reaches[out->n++] = (reach){b->first, b->last, run->links.links[k].open};
        }
        if (c == 0) break;
    }
    qsort(out->reaches, out->n, sizeof *out->reaches, compare_reaches);
    return true;
}

/* The larger of F_ij and F_ji. */
static double factor_of(const pairs_run *run, uint32_t i, uint32_t j, double g) {
    return g / fmin(run->m->area[i], run->m->area[j]);
}

/* A first look; where it suffices the pair is settled, and g becomes what is seen of it. */
static int look_at(const pairs_run *run, uint32_t i, uint32_t j, double *g) {
    double seen;
    const look_verdict verdict = look_first(&run->look, i, j, *g, &seen);
    const int state = verdict == LOOK_OPEN ? OPEN : verdict == LOOK_HIDDEN ? HIDDEN : MIXED;
    if (!look_suffices(&run->look, i, j, *g)) return state;
    *g = seen;
    return state | SETTLED;
}

/* The pairs of one position: magnitudes and, where something may be between, a first look. */
static bool find_row(pairs_run *run, uint32_t position, const leaf_reaches *to, pair_pool *pool,
                     row_place *place) {
    enum { PIECE = 64 };
    const uint32_t i = run->tree.element[position];
    *place = (row_place){.thread = (uint32_t)(pool - run->pools), .offset = pool->used};
    for (size_t k = 0; k < to->n; k++) {
        const reach *r = &to->reaches[k];
        const uint32_t begin = r->first > position ? r->first : position + 1;
        for (uint32_t first = begin; first < r->last; first += PIECE) {
            double exchange[PIECE];
            const uint32_t count = r->last - first < PIECE ? r->last - first : PIECE;
            if (!pool_reserve(pool, count)) return false;
            far_row(&run->far, position, first, count, exchange);
            for (uint32_t c = 0; c < count; c++) {
                const uint32_t j = run->tree.element[first + c];
                double g = exchange[c];
                if (g < 0)
                    g = pair_exchange(&run->rules, &run->polygons[i], &run->polygons[j],
                                      run->options->tolerance);
                if (!((float)g > 0) || factor_of(run, i, j, g) < run->options->threshold) continue;
                pool->state[pool->used] = (uint8_t)(r->open ? CERTAIN : look_at(run, i, j, &g));
                pool->other[pool->used] = first + c;
                pool->exchange[pool->used++] = (float)g;
            }
        }
    }
    place->length = (uint32_t)(pool->used - place->offset);
    return true;
}

/* --- refinement ---------------------------------------------------------------------------------------- */

/* The state of a pair of elements; UNKNOWN where they do not face each other or their clusters are hidden. */
static pair_state state_of(const pairs_run *run, uint32_t i, uint32_t j) {
    const uint32_t p = run->tree.position[i], q = run->tree.position[j];
    const uint32_t row = p < q ? p : q, wanted = p < q ? q : p;
    const row_place *place = &run->places[row];
    const pair_pool *pool = &run->pools[place->thread];
    size_t low = place->offset, high = place->offset + place->length;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (pool->other[middle] < wanted)
            low = middle + 1;
        else
            high = middle;
    }
    return low < place->offset + place->length && pool->other[low] == wanted
               ? (pair_state)(pool->state[low] & ~SETTLED)
               : UNKNOWN;
}

/* Whether a pair next to this one, with either element replaced by a neighbour of it, came out otherwise. */
static bool at_a_border(const pairs_run *run, uint32_t i, uint32_t j, pair_state state) {
    for (int side = 0; side < 2; side++) {
        const uint32_t kept = side == 0 ? i : j;
        const uint32_t *others = run->neighbours[side == 0 ? j : i];
        for (int k = 0; k < NEIGHBOURS_MOST && others[k] != UINT32_MAX; k++) {
            if (others[k] == kept) continue;
            const pair_state other = state_of(run, kept, others[k]);
            if (other == MIXED || (state == OPEN ? other == HIDDEN : other == OPEN || other == CERTAIN))
                return true;
        }
    }
    return false;
}

/* What is hidden of the pairs of one position. States stay as they were found: neighbours ask for them. */
static void refine_row(pairs_run *run, uint32_t position, pairs_report *row) {
    const row_place *place = &run->places[position];
    pair_pool *pool = &run->pools[place->thread];
    const uint32_t i = run->tree.element[position];
    for (size_t at = place->offset; at < place->offset + place->length; at++) {
        const pair_state state = (pair_state)(pool->state[at] & ~SETTLED);
        const uint32_t j = run->tree.element[pool->other[at]];
        row->facing++;
        if (state == CERTAIN) {
            row->certain++;
        } else if (pool->state[at] & SETTLED) {
            row->settled++;
        } else if (state == MIXED || at_a_border(run, i, j, state)) {
            row->mixed++;
            pool->exchange[at] = (float)look_closely(&run->look, i, j, (double)pool->exchange[at]);
        } else if (state == OPEN) {
            row->open++;
        } else {
            row->hidden++;
            pool->exchange[at] = 0;
        }
    }
}

/* --- passes -------------------------------------------------------------------------------------------- */

/* What each of the passes over the tree's leaves does with one. */
typedef struct pass_state {
    pairs_run *run;
    const uint32_t *parent;
    double share_before, share; /* of the work, for the progress line */
    size_t finished;
    bool stop, out_of_memory;
    pairs_report report;
} pass_state;

static void add_report(pairs_report *sum, const pairs_report *row) {
    sum->facing += row->facing;
    sum->certain += row->certain;
    sum->open += row->open;
    sum->hidden += row->hidden;
    sum->mixed += row->mixed;
    sum->settled += row->settled;
}

static bool pass_stopped(pass_state *p) {
    bool stop;
#pragma omp atomic read
    stop = p->stop;
    return stop;
}

static void pass_finished(pass_state *p, const pairs_report *row, uint32_t elements, bool memory) {
    const pairs_options *o = p->run->options;
#pragma omp critical(pairs_progress)
    {
        add_report(&p->report, row);
        p->finished += elements;
        p->out_of_memory = p->out_of_memory || !memory;
        progress_report(o->progress, o->stage,
                        p->share_before + p->share * (double)p->finished / (double)p->run->m->n);
        if (!memory || progress_cancelled(o->progress)) {
#pragma omp atomic write
            p->stop = true;
        }
    }
}

static lam_status pass_result(const pass_state *p, lam_error *error) {
    if (p->out_of_memory)
        return status_fail(error, LAM_ERR_MEMORY, "pairs of %zu elements: out of memory; use --quality draft",
                           p->run->m->n);
    if (p->stop) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    return LAM_OK;
}

static lam_status find_rows(pairs_run *run, const uint32_t *parent, lam_error *error) {
    pass_state p = {.run = run, .parent = parent, .share_before = .1, .share = .5};
    const cluster_tree *t = &run->tree;
    leaf_reaches *reaches = memory_allocate(run->n_pools, sizeof *reaches, "pairs", error);
    if (reaches == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t c = 0; c < t->n_clusters; c++) {
        if (!cluster_is_leaf(&t->clusters[c]) || pass_stopped(&p)) continue;
        const cluster *leaf = &t->clusters[c];
        const int thread = omp_get_thread_num();
        const pairs_report nothing = {0};
        bool memory = find_reaches(run, parent, (uint32_t)c, &reaches[thread]);
        for (uint32_t at = leaf->first; at < leaf->last && memory; at++)
            memory = find_row(run, at, &reaches[thread], &run->pools[thread], &run->places[at]);
        pass_finished(&p, &nothing, leaf->last - leaf->first, memory);
    }
    for (size_t k = 0; k < run->n_pools; k++) free(reaches[k].reaches);
    free(reaches);
    return pass_result(&p, error);
}

static lam_status refine_rows(pairs_run *run, pairs_report *report, lam_error *error) {
    pass_state p = {.run = run, .share_before = .6, .share = .4};
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t at = 0; at < run->m->n; at++) {
        pairs_report row = {0};
        if (pass_stopped(&p)) continue;
        refine_row(run, (uint32_t)at, &row);
        pass_finished(&p, &row, 1, true);
    }
    *report = p.report;
    return pass_result(&p, error);
}

/* --- result -------------------------------------------------------------------------------------------- */

/* Puts a row whose entries stand in any order in that of their indices, by way of a whole row of nothing. */
static void sort_row(csr *rows, size_t i, size_t n, float *dense, uint64_t *touched) {
    for (uint64_t p = rows->indptr[i]; p < rows->indptr[i + 1]; p++) {
        const uint32_t j = rows->indices[p];
        dense[j] = rows->data[p];
        touched[j >> 6] |= 1ull << (j & 63);
    }
    uint64_t at = rows->indptr[i];
    for (size_t w = 0; w < (n + 63) / 64; w++) {
        for (uint64_t bits = touched[w]; bits != 0; bits &= bits - 1) {
            const size_t j = w * 64 + (size_t)__builtin_ctzll(bits);
            rows->indices[at] = (uint32_t)j;
            rows->data[at++] = dense[j];
        }
        touched[w] = 0;
    }
}

static lam_status sort_rows(csr *rows, lam_error *error) {
    const size_t n = rows->n;
    bool out_of_memory = false;
#pragma omp parallel
    {
        lam_error ignored;
        float *dense = memory_allocate(n, sizeof *dense, "form factor rows", &ignored);
        uint64_t *touched = memory_allocate((n + 63) / 64, sizeof *touched, "form factor rows", &ignored);
        const bool enough = dense != NULL && touched != NULL;
        if (!enough) {
#pragma omp atomic write
            out_of_memory = true;
        }
#pragma omp for schedule(dynamic, 16)
        for (size_t i = 0; i < n; i++)
            if (enough) sort_row(rows, i, n, dense, touched);
        free(dense);
        free(touched);
    }
    return out_of_memory ? status_fail(error, LAM_ERR_MEMORY, "rows of %zu elements: out of memory", n)
                         : LAM_OK;
}

/* What is not zero, by element, above the diagonal, rows ascending. */
static lam_status gather(const pairs_run *run, csr *G, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = run->m->n;
    const bool keep = run->options->keep_hidden;
    csr rows = {.n = n};
    uint64_t *next = memory_allocate(n + 1, sizeof *next, "form factor rows", error);
    rows.indptr = memory_allocate(n + 1, sizeof *rows.indptr, "form factor rows", error);
    if (rows.indptr == NULL || next == NULL) TRY(LAM_ERR_MEMORY);
    for (int fill = 0; fill < 2; fill++) {
#pragma omp parallel for schedule(dynamic, 64)
        for (size_t at = 0; at < n; at++) {
            const row_place *place = &run->places[at];
            const pair_pool *pool = &run->pools[place->thread];
            const uint32_t one = run->tree.element[at];
            for (size_t p = place->offset; p < place->offset + place->length; p++) {
                const float g = pool->exchange[p];
                const uint32_t two = run->tree.element[pool->other[p]];
                const uint32_t i = one < two ? one : two, j = one < two ? two : one;
                if (!(g > 0 || keep)) continue;
                if (fill == 0) {
                    __atomic_fetch_add(&rows.indptr[i + 1], 1, __ATOMIC_RELAXED);
                    continue;
                }
                const uint64_t there = __atomic_fetch_add(&next[i], 1, __ATOMIC_RELAXED);
                rows.indices[there] = j;
                rows.data[there] = g;
            }
        }
        if (fill == 1) break;
        for (size_t i = 0; i < n; i++) rows.indptr[i + 1] += rows.indptr[i];
        memcpy(next, rows.indptr, (n + 1) * sizeof *next);
        rows.indices = memory_allocate(rows.indptr[n], sizeof *rows.indices, "form factor rows", error);
        rows.data = memory_allocate(rows.indptr[n], sizeof *rows.data, "form factor rows", error);
        if (rows.indices == NULL || rows.data == NULL) TRY(LAM_ERR_MEMORY);
    }
    TRY(sort_rows(&rows, error));
    *G = rows;
    rows = (csr){0};
done:
    free(next);
    csr_free(&rows);
    return status;
}

static lam_status find_parents(const cluster_tree *t, uint32_t **out, lam_error *error) {
    uint32_t *parent = memory_allocate(t->n_clusters, sizeof *parent, "pairs", error);
    if (parent == NULL) return LAM_ERR_MEMORY;
    for (size_t c = 0; c < t->n_clusters; c++)
        for (int k = 0; k < 2 && !cluster_is_leaf(&t->clusters[c]); k++)
            parent[t->clusters[c].child[k]] = (uint32_t)c;
    *out = parent;
    return LAM_OK;
}

lam_status pairs_exchange(const mesh *m, const visibility *v, const pairs_options *options, csr *G,
                          pairs_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    const double slack = visibility_rounding(v);
    uint32_t *parent = NULL;
    pairs_run run = {.m = m, .options = options, .n_pools = (size_t)omp_get_max_threads()};
    const link_options how = {.threshold = options->threshold, .slack = slack, .progress = options->progress};
    pair_rules_init(&run.rules);
    run.polygons = memory_allocate(n, sizeof *run.polygons, "pairs", error);
    run.neighbours = memory_allocate(n, sizeof *run.neighbours, "pairs", error);
    run.pools = memory_allocate(run.n_pools, sizeof *run.pools, "pairs", error);
    run.places = memory_allocate(n, sizeof *run.places, "pairs", error);
    if (run.polygons == NULL || run.neighbours == NULL || run.pools == NULL || run.places == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) polygon_of_element(m, i, &run.polygons[i]);
    run.look = (look){.v = v,
                      .area = m->area,
                      .polygons = run.polygons,
                      .rules = &run.rules,
                      .tolerance = options->tolerance,
                      .accuracy = options->accuracy,
                      .segments = options->segments,
                      .seed = options->seed};
    TRY(neighbours_find(m, run.neighbours, error));
    TRY(cluster_tree_build(m, slack, &run.tree, error));
    TRY(far_table_build(run.polygons, &run.tree, &run.rules, options->tolerance, &run.far, error));
    TRY(cluster_links_find(m, &run.tree, &run.look, &how, &run.links, error));
    TRY(find_parents(&run.tree, &parent, error));
    TRY(find_rows(&run, parent, error));
    TRY(refine_rows(&run, report, error));
    report->hidden += run.links.hidden_pairs;
    report->facing += run.links.hidden_pairs;
    TRY(gather(&run, G, error));
done:
    if (run.pools != NULL)
        for (size_t k = 0; k < run.n_pools; k++) pool_free(&run.pools[k]);
    free(run.pools);
    free(run.places);
    free(run.polygons);
    free(run.neighbours);
    free(parent);
    far_table_free(&run.far);
    cluster_links_free(&run.links);
    cluster_tree_free(&run.tree);
    return status;
}
