#include "solver/formfactor/blocks/blocks.h"

#include "solver/base/array_grow.h"
#include "solver/formfactor/blocks/block_shade.h"
#include "solver/formfactor/pairs/pair_factor.h"
#include "solver/operator/blocks/block_range.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Where one cluster lies on both sides of the plane of the other, a linear kernel is off by at most this
 * share of its bound (block_kernel_most). */
static const double share_crossing = .15;
/* A piece of work is a pair of clusters with at most this share of all pairs of elements. */
static const double piece_share = 1. / 512;
/* Segments of a partly hidden block: SEGMENT_LANES; of a pair of elements: twice as many. */
enum { PAIR_ROUNDS = 2 };

typedef struct node_pair {
    uint32_t a, b;
    double elements; /* pairs of them */
} node_pair;

typedef struct block_list {
    cluster_block *list;
    size_t count, capacity;
} block_list;

typedef struct finder {
    const block_options *options;
    const plane_tree *tree;
    flat_clusters flat;
    shade_scene shade;
    pair_factor_rules rules;
    size_t n_clusters;
} finder;

/* The work of one thread. */
typedef struct find_work {
    const finder *finder;
    block_list found;
    block_report report;
    lam_error *error;
} find_work;

static size_t size_of(const finder *k, uint32_t t) {
    const block_node *node = &k->flat.tree->nodes[t];
    return node->end - node->begin;
}

/* The children of a node: two clusters, or the elements of a leaf. */
typedef struct children {
    uint32_t of[8];
    int count;
} children;

static children children_of(const finder *k, uint32_t t) {
    const plane_cluster *c = &k->tree->clusters[t];
    children out = {.count = 0};
    if (!c->leaf) {
        out.of[out.count++] = c->left;
        out.of[out.count++] = t - 1;
    } else {
        for (uint32_t p = c->begin; p < c->end; p++) out.of[out.count++] = (uint32_t)k->n_clusters + p;
    }
    return out;
}

static lam_status add_block(find_work *w, const cluster_block *made) {
    block_list *to = &w->found;
    if (array_grow(&to->list, &to->capacity, to->count + 1, sizeof *to->list, "blocks", w->error) != LAM_OK)
        return LAM_ERR_MEMORY;
    to->list[to->count++] = *made;
    return LAM_OK;
}

static lam_status visit(find_work *w, uint32_t a, uint32_t b, const candidates *among);

/* Visits the children of one of two nodes: of the first where it is of more weight and no single element. */
static lam_status split(find_work *w, uint32_t a, uint32_t b, const candidates *among, double weight_a,
                        double weight_b) {
    lam_status status = LAM_OK;
    const size_t n_clusters = w->finder->n_clusters;
    const bool first = a < n_clusters && (b >= n_clusters || weight_a >= weight_b);
    const children below = children_of(w->finder, first ? a : b);
    for (int k = 0; k < below.count; k++)
        TRY(first ? visit(w, below.of[k], b, among) : visit(w, a, below.of[k], among));
done:
    return status;
}

static double exchange_of_pair(const find_work *w, uint32_t a, uint32_t b) {
    const finder *k = w->finder;
    polygon shapes[2];
    const uint32_t *order = k->flat.tree->order;
    polygon_of_element(k->flat.m, order[a - k->n_clusters], &shapes[0]);
    polygon_of_element(k->flat.m, order[b - k->n_clusters], &shapes[1]);
    return pair_factor_exchange(&k->rules, &shapes[0], &shapes[1], k->options->exact);
}

/* The candidates that segments are tested against. */
static const candidates *segments_among(const find_work *w, const candidates *among) {
    static const candidates whole_scene = {.count = OCCLUDERS_UNKNOWN};
    return w->finder->options->by_scene ? &whole_scene : among;
}

/* A pair of elements; among NULL: nothing stands between. */
static lam_status add_pair(find_work *w, uint32_t a, uint32_t b, const candidates *among) {
    cluster_block made = {.a = a, .b = b};
    double exchange = exchange_of_pair(w, a, b);
    if (among == NULL && exchange > 0) {
        w->report.pairs++;
    } else if (exchange > 0) {
        double all = 0, seen = 0;
        w->report.shaded_pairs++;
        for (size_t round = 0; round < PAIR_ROUNDS; round++) {
            seen_segment segments[SEGMENT_LANES];
            double kernel[SEGMENT_LANES];
            shade_segments(&w->finder->shade, a, b, segments_among(w, among), round * SEGMENT_LANES, segments,
                           kernel);
            for (int k = 0; k < SEGMENT_LANES; k++) {
                all += kernel[k];
                seen += kernel[k] * segments[k].seen;
            }
        }
        w->report.segments += PAIR_ROUNDS * SEGMENT_LANES;
        w->report.elements_unseen += !(seen > 0);
        exchange *= all > 0 ? seen / all : 0;
    } else {
        w->report.elements_away++;
    }
    if (!(exchange > 0)) return LAM_OK;
    block_numbers_of_pair(&w->finder->flat, exchange, &made);
    return add_block(w, &made);
}

/* True where a kernel that is linear on both clusters is near enough to the true one. most: its largest
 * value. */
static bool is_smooth(const find_work *w, uint32_t a, uint32_t b, double most, bool crosses) {
    const flat_clusters *f = &w->finder->flat;
    const double norm = most * sqrt(f->of[a].area * f->of[b].area);
    if (crosses) return share_crossing * norm <= w->finder->options->open;
    return block_kernel_roughness(f, a, b, 2) * norm <= w->finder->options->open;
}

/* Of two clusters that are not smooth the one that lies on both sides of the other's plane is split, else the
 * larger one. */
static lam_status split_for_smoothness(find_work *w, uint32_t a, uint32_t b, const bool behind[2],
                                       const candidates *among) {
    const flat_clusters *f = &w->finder->flat;
    const size_t n_clusters = w->finder->n_clusters;
    if (behind[0] && a < n_clusters) return split(w, a, b, among, 1, 0);
    if (behind[1] && b < n_clusters) return split(w, a, b, among, 0, 1);
    return split(w, a, b, among, f->of[a].radius, f->of[b].radius);
}

static lam_status add_shaded(find_work *w, uint32_t a, uint32_t b, const candidates *among) {
    cluster_block made = {.a = a, .b = b};
    seen_segment segments[SEGMENT_LANES];
    double seen = 0;
    shade_segments(&w->finder->shade, a, b, segments_among(w, among), 0, segments, NULL);
    for (int k = 0; k < SEGMENT_LANES; k++) seen += segments[k].seen;
    w->report.shaded++;
    w->report.segments += SEGMENT_LANES;
    if (seen == 0) {
        w->report.elements_unseen += (double)size_of(w->finder, a) * (double)size_of(w->finder, b);
        return LAM_OK;
    }
    const visible_share share = visible_share_fit(segments, SEGMENT_LANES);
    block_numbers_set(&w->finder->flat, seen < SEGMENT_LANES ? &share : NULL, &made);
    return add_block(w, &made);
}

/* Splits the side that moves the shadow more: the one that is farther from the occluder. */
static lam_status visit_shaded(find_work *w, uint32_t a, uint32_t b, double most, const bool behind[2],
                               const candidates *among) {
    const finder *k = w->finder;
    const flat_clusters *f = &k->flat;
    const bool crosses = behind[0] || behind[1];
    if (a >= k->n_clusters && b >= k->n_clusters) return add_pair(w, a, b, among);
    if (most * sqrt(f->of[a].area * f->of[b].area) > k->options->shadow) {
        const double place = occluders_place(k->shade.occluders, f, a, b, among);
        return split(w, a, b, among, f->of[a].radius * (1 - place), f->of[b].radius * place);
    }
    if (!is_smooth(w, a, b, most, crosses)) return split_for_smoothness(w, a, b, behind, among);
    return add_shaded(w, a, b, among);
}

static lam_status visit(find_work *w, uint32_t a, uint32_t b, const candidates *among) {
    const finder *k = w->finder;
    const flat_clusters *f = &k->flat;
    const double elements = (double)size_of(k, a) * (double)size_of(k, b);
    bool behind[2];
    candidates mine = {.count = 0};
    w->report.visits++;
    const double most = block_kernel_most(f, a, b, behind);
    if (!(most > 0)) {
        w->report.away++;
        w->report.elements_away += elements;
        return LAM_OK;
    }
    if (among == NULL || among->count != 0) occluders_between(k->shade.occluders, f, a, b, among, &mine);
    if (mine.count > 0 && occluders_hide(k->shade.occluders, f, a, b, &mine)) {
        w->report.hidden++;
        w->report.elements_hidden += elements;
        return LAM_OK;
    }
    if (mine.count != 0) return visit_shaded(w, a, b, most, behind, &mine);
    if (is_smooth(w, a, b, most, behind[0] || behind[1])) {
        cluster_block made = {.a = a, .b = b};
        w->report.linear++;
        block_numbers_set(f, NULL, &made);
        return add_block(w, &made);
    }
    if (a >= k->n_clusters && b >= k->n_clusters) return add_pair(w, a, b, NULL);
    return split_for_smoothness(w, a, b, behind, &mine);
}

typedef struct pair_list {
    node_pair *list;
    size_t count, capacity;
} pair_list;

static lam_status add_work(const finder *k, uint32_t a, uint32_t b, pair_list *to, lam_error *error) {
    if (array_grow(&to->list, &to->capacity, to->count + 1, sizeof *to->list, "blocks", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    to->list[to->count++] = (node_pair){a, b, (double)size_of(k, a) * (double)size_of(k, b)};
    return LAM_OK;
}

static int larger_first(const void *left, const void *right) {
    const node_pair *a = left, *b = right;
    if (a->elements != b->elements) return a->elements > b->elements ? -1 : 1;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    return a->b < b->b ? -1 : a->b > b->b;
}

static lam_status find_planes(const finder *k, uint32_t **out, size_t *count, lam_error *error) {
    const plane_tree *tree = k->tree;
    uint32_t *roots = memory_allocate(tree->n_frames, sizeof *roots, "blocks", error);
    if (roots == NULL) return LAM_ERR_MEMORY;
    *count = 0;
    for (uint32_t t = 0; t < tree->n_clusters; t++) {
        const uint32_t parent = k->flat.tree->nodes[t].parent;
        if (tree->clusters[t].frame == PLANE_ABOVE) continue;
        if (parent == BLOCK_NO_NODE || tree->clusters[parent].frame == PLANE_ABOVE) roots[(*count)++] = t;
    }
    *out = roots;
    return LAM_OK;
}

/* All pairs of planes, the larger ones split, the largest first. */
static lam_status find_work_pairs(const finder *k, pair_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *roots = NULL;
    size_t n_roots = 0;
    const double most = fmax(64, piece_share * (double)k->tree->n * (double)k->tree->n);
    TRY(find_planes(k, &roots, &n_roots, error));
    for (size_t i = 0; i < n_roots; i++)
        for (size_t j = i + 1; j < n_roots; j++) TRY(add_work(k, roots[i], roots[j], out, error));
    for (size_t at = 0; at < out->count;) {
        const node_pair pair = out->list[at];
        const bool first = size_of(k, pair.a) >= size_of(k, pair.b);
        const uint32_t larger = first ? pair.a : pair.b;
        if (pair.elements <= most || k->tree->clusters[larger].leaf) {
            at++;
            continue;
        }
        const children below = children_of(k, larger);
        out->list[at] = out->list[--out->count];
        for (int c = 0; c < below.count; c++)
            TRY(add_work(k, first ? below.of[c] : pair.a, first ? pair.b : below.of[c], out, error));
    }
    qsort(out->list, out->count, sizeof *out->list, larger_first);
done:
    free(roots);
    return status;
}

static void add_report(const block_report *from, block_report *to) {
    to->visits += from->visits;
    to->away += from->away;
    to->hidden += from->hidden;
    to->linear += from->linear;
    to->pairs += from->pairs;
    to->shaded += from->shaded;
    to->shaded_pairs += from->shaded_pairs;
    to->segments += from->segments;
    to->elements_away += from->elements_away;
    to->elements_hidden += from->elements_hidden;
    to->elements_unseen += from->elements_unseen;
}

/* The state of all threads. */
typedef struct find_team {
    const finder *finder;
    const pair_list *pairs;
    find_work *works;
    lam_status status;
    lam_error *error;
    double done, all;
} find_team;

/* True unless another thread has failed or the user gives up. */
static bool report_done(find_team *team, double elements) {
    bool goes_on;
    const block_options *o = team->finder->options;
#pragma omp critical(blocks_progress)
    {
        team->done += elements;
        progress_report(o->progress, o->stage, team->done / team->all);
        if (team->status == LAM_OK && progress_cancelled(o->progress))
            team->status = status_fail(team->error, LAM_ERR_CANCELLED, "cancelled");
        goes_on = team->status == LAM_OK;
    }
    return goes_on;
}

static void find_all(find_team *team, int n_threads) {
    bool goes_on = true;
#pragma omp parallel for schedule(dynamic, 1) num_threads(n_threads)
    for (size_t k = 0; k < team->pairs->count; k++) {
        bool mine;
#pragma omp atomic read
        mine = goes_on;
        if (!mine) continue;
        const node_pair *pair = &team->pairs->list[k];
        lam_error why = {.message = ""};
        find_work *w = &team->works[omp_get_thread_num()];
        w->error = &why;
        const lam_status one = visit(w, pair->a, pair->b, NULL);
        if (one != LAM_OK) {
#pragma omp critical(blocks_progress)
            team->status = status_fail(team->error, one, "%s", why.message);
        }
        if (!report_done(team, pair->elements)) {
#pragma omp atomic write
            goes_on = false;
        }
    }
}

static lam_status join_lists(find_work *works, int n_threads, block_factors *out, lam_error *error) {
    size_t count = 0;
    for (int k = 0; k < n_threads; k++) count += works[k].found.count;
    out->blocks = memory_allocate(count, sizeof *out->blocks, "blocks", error);
    if (out->blocks == NULL) return LAM_ERR_MEMORY;
    for (int k = 0; k < n_threads; k++) {
        block_list *from = &works[k].found;
        if (from->count > 0)
            memcpy(out->blocks + out->n_blocks, from->list, from->count * sizeof *from->list);
        out->n_blocks += from->count;
        free(from->list);
        *from = (block_list){.list = NULL};
    }
    return LAM_OK;
}

lam_status blocks_find(const mesh *m, const visibility *v, const plane_tree *tree,
                       const block_options *options, block_factors *out, block_report *report,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const int n_threads = omp_get_max_threads();
    size_t n_reduced = 0;
    block_factors made = {.n = 0};
    occluders pieces = {.n = 0};
    pair_list pairs = {.list = NULL};
    finder k = {.options = options, .tree = tree, .n_clusters = tree->n_clusters};
    find_work *works = memory_allocate((size_t)n_threads, sizeof *works, "blocks", error);
    double(*centre)[3] = memory_allocate(m->n, sizeof *centre, "blocks", error);
    if (works == NULL || centre == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) mesh_centroid(m, i, centre[i]);
    TRY(block_factors_begin(tree, m->area, (const double(*)[3])centre, &made, error));
    TRY(flat_clusters_make(m, tree, &made, &k.flat, error));
    TRY(occluders_make(m, visibility_facets(v), &pieces, error));
    pair_factor_rules_init(&k.rules);
    k.shade = (shade_scene){.f = &k.flat, .occluders = &pieces, .v = v, .seed = options->seed};
    for (int t = 0; t < n_threads; t++) works[t].finder = &k;
    TRY(find_work_pairs(&k, &pairs, error));
    find_team team = {.finder = &k, .pairs = &pairs, .works = works, .error = error};
    for (size_t p = 0; p < pairs.count; p++) team.all += pairs.list[p].elements;
    find_all(&team, n_threads);
    TRY(team.status);
    TRY(join_lists(works, n_threads, &made, error));
    TRY(block_factors_end(&made, error));
    TRY(block_factors_reduce(&made, &n_reduced, error));
    if (report != NULL) {
        *report = (block_report){.visits = 0};
        for (int t = 0; t < n_threads; t++) add_report(&works[t].report, report);
        report->reduced = n_reduced;
    }
    *out = made;
    made = (block_factors){.n = 0};
done:
    for (int t = 0; works != NULL && t < n_threads; t++) free(works[t].found.list);
    free(works);
    free(centre);
    free(pairs.list);
    occluders_free(&pieces);
    flat_clusters_free(&k.flat);
    block_factors_free(&made);
    return status;
}
