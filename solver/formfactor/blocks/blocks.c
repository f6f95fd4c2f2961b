#include "solver/formfactor/blocks/blocks.h"

#include "solver/base/array_grow.h"
#include "solver/formfactor/blocks/block_walk.h"
#include "solver/operator/blocks/block_range.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* A piece of work is a pair of clusters with at most this share of all pairs of elements. */
static const double piece_share = 1. / 512;

typedef struct node_pair {
    uint32_t a, b;
    double elements; /* pairs of them */
} node_pair;

typedef struct pair_list {
    node_pair *list;
    size_t count, capacity;
} pair_list;

static lam_status add_work(const block_finder *k, uint32_t a, uint32_t b, pair_list *to, lam_error *error) {
    if (array_grow(&to->list, &to->capacity, to->count + 1, sizeof *to->list, "blocks", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    to->list[to->count++] =
        (node_pair){a, b, (double)block_finder_size(k, a) * (double)block_finder_size(k, b)};
    return LAM_OK;
}

/* With fewer elements in a plane, on average, clusters are hardly more than elements. A furnished room of
 * triangles has 1 to 2 in a plane, which no sample need tell; an atrium of 2,030 elements with round
 * columns 2.6, a city of 1,501 4.6, and both take a half to a third of the time of pairs by blocks. Rooms of
 * walls have 100 and more. */
static const double elements_of_plane = 2;

bool blocks_are_planar(const plane_tree *tree) {
    return tree->n_frames <= BLOCK_PLANES_MOST &&
           (double)tree->n >= elements_of_plane * (double)tree->n_frames;
}

static int larger_first(const void *left, const void *right) {
    const node_pair *a = left, *b = right;
    if (a->elements != b->elements) return a->elements > b->elements ? -1 : 1;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    return a->b < b->b ? -1 : a->b > b->b;
}

/* Replaces a pair of a node with itself by the pairs of its children. */
static lam_status split_within(const block_finder *k, size_t at, pair_list *pairs, lam_error *error) {
    lam_status status = LAM_OK;
    const node_children below = block_finder_children(k, pairs->list[at].a);
    pairs->list[at] = pairs->list[--pairs->count];
    for (int i = 0; i < below.count; i++)
        for (int j = i; j < below.count; j++) TRY(add_work(k, below.of[i], below.of[j], pairs, error));
done:
    return status;
}

/* All pairs of planes, or of the root with itself, the larger ones split, the largest first. */
static lam_status find_work_pairs(const block_finder *k, pair_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *roots = NULL;
    size_t n_roots = 0;
    const double most = fmax(64, piece_share * (double)k->tree->n * (double)k->tree->n);
    TRY(block_finder_planes(k, &roots, &n_roots, error));
    for (size_t i = 0; i < n_roots; i++)
        for (size_t j = k->joined ? i : i + 1; j < n_roots; j++)
            TRY(add_work(k, roots[i], roots[j], out, error));
    for (size_t at = 0; at < out->count;) {
        const node_pair pair = out->list[at];
        const bool first = block_finder_size(k, pair.a) >= block_finder_size(k, pair.b);
        const uint32_t larger = first ? pair.a : pair.b;
        if (pair.elements <= most || k->tree->clusters[larger].leaf) {
            at++;
            continue;
        }
        if (pair.a == pair.b) {
            TRY(split_within(k, at, out, error));
            continue;
        }
        const node_children below = block_finder_children(k, larger);
        out->list[at] = out->list[--out->count];
        for (int c = 0; c < below.count; c++)
            TRY(add_work(k, first ? below.of[c] : pair.a, first ? pair.b : below.of[c], out, error));
    }
    qsort(out->list, out->count, sizeof *out->list, larger_first);
done:
    free(roots);
    return status;
}

/* The state of all threads. */
typedef struct find_team {
    const block_finder *finder;
    const pair_list *pairs;
    block_walk *works;
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
        block_walk *w = &team->works[omp_get_thread_num()];
        w->error = &why;
        const lam_status one = block_walk_visit(w, pair->a, pair->b);
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

/* The blocks of all threads, which lose them. */
static lam_status join_lists(block_walk *works, int n_threads, block_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    block_list *lists = memory_allocate((size_t)n_threads, sizeof *lists, "blocks", error);
    if (lists == NULL) return LAM_ERR_MEMORY;
    for (int t = 0; t < n_threads; t++) lists[t] = works[t].found;
    status = block_factors_end_lists(out, (size_t)n_threads, lists, error);
    for (int t = 0; t < n_threads; t++) works[t].found = lists[t];
    free(lists);
    return status;
}

/* Row sums of the blocks of what comes through panes, by all threads, which lose them; nodes: of all blocks.
 * *out is NULL where there are none. */
static lam_status sum_through(block_walk *works, int n_threads, const block_factors *nodes, double **out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = nodes->n;
    size_t count = 0;
    block_factors blocks = *nodes; /* with nodes, places and areas of theirs */
    double *ones = memory_allocate(n, sizeof *ones, "blocks", error);
    double *sums = memory_allocate(n, sizeof *sums, "blocks", error);
    block_list *lists = memory_allocate((size_t)n_threads, sizeof *lists, "blocks", error);
    if (ones == NULL || sums == NULL || lists == NULL) TRY(LAM_ERR_MEMORY);
    for (int t = 0; t < n_threads; t++) {
        lists[t] = works[t].through;
        works[t].through = (block_list){.list = NULL};
        count += lists[t].count;
    }
    if (count == 0) goto done;
    TRY(block_factors_end_lists(&blocks, (size_t)n_threads, lists, error));
    const factor_product product = block_factors_product(&blocks);
    for (size_t i = 0; i < n; i++) ones[i] = 1;
    TRY(product.multiply(product.context, 1, ones, sums, error));
    *out = sums;
    sums = NULL;
done:
    for (int t = 0; lists != NULL && t < n_threads; t++) free(lists[t].list);
    blocks.nodes = NULL;
    blocks.place = NULL;
    blocks.area = NULL;
    block_factors_free(&blocks);
    free(ones);
    free(sums);
    free(lists);
    return status;
}

block_options block_options_of(const recipe *r) {
    return (block_options){
        .open = r->accuracy, .shadow = recipe_shadow(r), .exact = recipe_tolerance(r), .seed = r->seed};
}

/* Takes the nodes of the blocks. */
static lam_status find(block_finder *k, const block_options *options, block_factors *nodes,
                       block_factors *out, block_report *report, double **through, lam_error *error) {
    lam_status status = LAM_OK;
    const int n_threads = omp_get_max_threads();
    size_t n_reduced = 0;
    pair_list pairs = {.list = NULL};
    block_walk *works = memory_allocate((size_t)n_threads, sizeof *works, "blocks", error);
    if (works == NULL) TRY(LAM_ERR_MEMORY);
    TRY(block_finder_set(k, options, error));
    for (int t = 0; t < n_threads; t++) works[t].finder = k;
    TRY(find_work_pairs(k, &pairs, error));
    find_team team = {.finder = k, .pairs = &pairs, .works = works, .error = error};
    for (size_t p = 0; p < pairs.count; p++) team.all += pairs.list[p].elements;
    find_all(&team, n_threads);
    TRY(team.status);
    if (through != NULL) TRY(sum_through(works, n_threads, nodes, through, error));
    TRY(join_lists(works, n_threads, nodes, error));
    TRY(block_factors_reduce(nodes, &n_reduced, error));
    if (report != NULL) {
        *report = (block_report){.joined = k->joined};
        for (int t = 0; t < n_threads; t++) block_report_add(&works[t].report, 1, report);
        report->reduced = (double)n_reduced;
    }
    *out = *nodes;
    *nodes = (block_factors){.n = 0};
done:
    for (int t = 0; works != NULL && t < n_threads; t++) {
        free(works[t].found.list);
        free(works[t].through.list);
    }
    free(works);
    free(pairs.list);
    return status;
}

lam_status blocks_find(const mesh *m, const visibility *v, const plane_tree *tree,
                       const block_options *options, block_factors *out, block_report *report,
                       lam_error *error) {
    lam_status status = LAM_OK;
    block_factors nodes = {.n = 0};
    block_finder k = {.tree = tree};
    TRY(block_finder_make(m, v, tree, &nodes, &k, error));
    TRY(find(&k, options, &nodes, out, report, NULL, error));
done:
    block_finder_free(&k);
    block_factors_free(&nodes);
    return status;
}

lam_status blocks_find_in(block_scene *s, const block_options *options, block_factors *out,
                          block_report *report, double **through, lam_error *error) {
    if (through != NULL) *through = NULL;
    return find(&s->finder, options, &s->nodes, out, report, through, error);
}

lam_status block_scene_make(const mesh *m, const plane_tree *tree, block_scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    block_scene *s = memory_allocate(1, sizeof *s, "blocks", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    TRY(visibility_create(m, &s->v, error));
    TRY(block_finder_make(m, s->v, tree, &s->nodes, &s->finder, error));
    *out = s;
    s = NULL;
done:
    block_scene_destroy(s);
    return status;
}

void block_scene_destroy(block_scene *s) {
    if (s == NULL) return;
    block_finder_free(&s->finder);
    block_factors_free(&s->nodes);
    visibility_destroy(s->v);
    free(s);
}

const visibility *block_scene_visibility(const block_scene *s) {
    return s->v;
}
