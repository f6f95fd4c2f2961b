/* One of two nodes is split until their light is one block (Hanrahan, Salzman and Aupperle 1991): the bound
 * of its 2-norm, max K (A_a A_b)^1/2, times its roughness is at most `open`, and where something stands
 * between, that bound is at most `shadow` as well. Importance scales both; two elements are not split. */
#include "solver/formfactor/blocks/block_walk.h"

#include "solver/base/array_grow.h"
#include "solver/base/random.h"
#include "solver/operator/blocks/importance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where one cluster lies on both sides of the plane of the other, a linear kernel is off by at most this
 * share of its bound (block_kernel_most). */
static const double share_crossing = .15;
/* Clusters of several planes have a block where at least this many radii of the larger one lie between their
 * spheres. */
static const double separation = .5;
/* The spread of a finder holds for blocks of this share of all elements, the geometric mean of both sides.
 * Smaller blocks are many and hold little of the light, larger ones few and hold most of it: n / s of s
 * elements, with s / n of the energy each. Blocks of 1 / spread^2 on each level then err least in sum where
 * spread goes as s^-1/2. A bowl of 40,000 triangles has a third of the blocks that an even spread has for the
 * same error. */
static const double share_of_block = 1. / 2000, spread_times_most = 2;
/* Clusters in planes that meet others at many edges have linear blocks up to this roughness. */
static const double rough_most = .3;
/* Standard errors of the visible share of a pair of elements: within the bound of blocks, and beyond it,
 * where the pair cannot be split and errs by so many times the bound. The errors of pairs are independent of
 * each other, and their signs differ, unlike those of what a block leaves out: with smaller ones, answers in
 * rooms, a patio and an atrium (1,498 to 2,030 elements) gain less by pairs than the time is worth. They do
 * not depend on what the first segments see: small openings would lose the light of pairs in which all are
 * blocked. */
static const double error_within = .0675, error_beyond = .0416, pair_error_in_bounds = .54;
/* So few candidates cost less to test than to sift. */
enum { CANDIDATES_FEW = 4 };

size_t block_finder_size(const block_finder *k, uint32_t t) {
    const block_node *node = &k->flat.tree->nodes[t];
    return node->end - node->begin;
}

node_children block_finder_children(const block_finder *k, uint32_t t) {
    const plane_cluster *c = &k->tree->clusters[t];
    node_children out = {.count = 0};
    if (!c->leaf) {
        out.of[out.count++] = c->left;
        out.of[out.count++] = t - 1;
    } else {
        for (uint32_t p = c->begin; p < c->end; p++) out.of[out.count++] = (uint32_t)k->n_clusters + p;
    }
    return out;
}

static lam_status add_to(block_walk *w, block_list *to, const cluster_block *made) {
    if (array_grow(&to->list, &to->capacity, to->count + 1, sizeof *to->list, "blocks", w->error) != LAM_OK)
        return LAM_ERR_MEMORY;
    to->list[to->count++] = *made;
    return LAM_OK;
}

static lam_status add_block(block_walk *w, const cluster_block *made) {
    return add_to(w, &w->found, made);
}

static lam_status visit(block_walk *w, uint32_t a, uint32_t b, const candidates *among);

/* Visits the children of one of two nodes: of the first where it is of more weight and no single element. */
static lam_status split(block_walk *w, uint32_t a, uint32_t b, const candidates *among, double weight_a,
                        double weight_b) {
    lam_status status = LAM_OK;
    const size_t n_clusters = w->finder->n_clusters;
    const bool first = a < n_clusters && (b >= n_clusters || weight_a >= weight_b);
    const node_children below = block_finder_children(w->finder, first ? a : b);
    for (int k = 0; k < below.count; k++)
        TRY(first ? visit(w, below.of[k], b, among) : visit(w, a, below.of[k], among));
done:
    return status;
}

/* Two nodes that are elements. */
typedef struct element_pair {
    uint32_t element[2];
    const polygon *shape[2];
    polygon made[2];
} element_pair;

static void element_pair_set(const block_finder *k, uint32_t a, uint32_t b, element_pair *out) {
    const uint32_t nodes[2] = {a, b};
    for (int side = 0; side < 2; side++) {
        const uint32_t i = out->element[side] = k->flat.tree->order[nodes[side] - k->n_clusters];
        out->shape[side] = k->shapes != NULL ? &k->shapes[i] : &out->made[side];
        if (k->shapes == NULL) polygon_of_element(k->flat.m, i, &out->made[side]);
    }
}

static double exchange_of_pair(const block_finder *k, const element_pair *two) {
    return pair_factor_exchange(&k->rules, two->shape[0], two->shape[1], k->exact);
}

/* The visible share of two elements. */
static double visible_share_of(const block_finder *k, const element_pair *two, const candidates *among,
                               share_effort *effort) {
    uint32_t of[CANDIDATES_MOST];
    segment_list list = {.count = among->count, .of = of};
    if (among->count > 0) memcpy(of, among->of, (size_t)among->count * sizeof *of);
    return occlusion_share(&k->occlusion, among->count == CANDIDATES_UNKNOWN ? NULL : &list, two->element[0],
                           two->shape[0], two->element[1], two->shape[1], effort);
}

/* Times the bounds of a block of two nodes: its error counts as often as the importance between them, y.
 * Blocks whose number goes as the bound to the power -p, p about 1, have the least sum of (y e)^2 where
 * errors e go as y^(-2 / (p + 2)). */
static double bound_times(const block_finder *k, uint32_t a, uint32_t b) {
    static const double power = -.7;
    const importance *i = k->options->importance;
    return i == NULL ? 1 : i->share_of_bounds * pow(importance_between(&k->important, a, b), power);
}

/* The candidates that segments of a block are tested against. */
static const candidates *segments_among(const block_walk *w, uint32_t a, uint32_t b,
                                        const candidates *among) {
    static const candidates whole_scene = {.count = CANDIDATES_UNKNOWN};
    const unsigned every = w->finder->options->scene_every;
    if (every == 0 || random_hash((uint64_t)a << 32 | b) % every != 0) return among;
    return &whole_scene;
}

static void count_segments(block_walk *w, const candidates *among, double segments) {
    w->report.segments += segments;
    if (among->count == CANDIDATES_UNKNOWN) w->report.cast += segments;
}

/* True where a kernel that is linear on both clusters is near enough to the true one. most: its largest
 * value. */
static bool is_smooth(const block_walk *w, uint32_t a, uint32_t b, double most, bool crosses) {
    const flat_clusters *f = &w->finder->flat;
    const double norm = most * sqrt(f->of[a].area * f->of[b].area);
    const double open = w->finder->options->open * bound_times(w->finder, a, b);
    if (w->finder->joined && (crosses || block_kernel_roughness(f, a, b, 2) > rough_most)) return false;
    if (crosses) return share_crossing * norm <= open;
    return block_kernel_roughness(f, a, b, 2) * norm <= open;
}

/* The bound of the 2-norm of a block that is partly hidden. */
static double shadow_most(const block_walk *w, uint32_t a, uint32_t b) {
    return w->finder->options->shadow * bound_times(w->finder, a, b);
}

/* The bound of the 2-norm of a block. */
static double norm_of(const block_walk *w, uint32_t a, uint32_t b, double most) {
    const flat_clusters *f = &w->finder->flat;
    return most * sqrt(f->of[a].area * f->of[b].area);
}

static lam_status add_linear(block_walk *w, uint32_t a, uint32_t b) {
    cluster_block made = {.a = a, .b = b};
    block_numbers_set(&w->finder->flat, NULL, &made);
    return add_block(w, &made);
}

/* A pair of elements with this exchange area. */
static lam_status add_exchange(block_walk *w, uint32_t a, uint32_t b, double exchange) {
    cluster_block made = {.a = a, .b = b};
    w->report.elements_away += !(exchange > 0);
    if (!(exchange > 0)) return LAM_OK;
    block_numbers_of_pair(&w->finder->flat, exchange, &made);
    return add_block(w, &made);
}

/* Candidates of the pair's own; where they are few already, those are kept. */
static const candidates *sift_for_pair(block_walk *w, uint32_t a, uint32_t b, const candidates *among,
                                       candidates *out) {
    const block_finder *k = w->finder;
    flat_pair at;
    if (among->count == CANDIDATES_UNKNOWN || among->count <= CANDIDATES_FEW) return among;
    flat_clusters_pair(&k->flat, a, b, &at);
    candidates_between(&k->pieces, &k->flat, a, b, &at, among, out);
    w->report.sifted += out->examined;
    return out;
}

/* A pair of elements with candidates between them. Its exchange area is found where the error of the share
 * depends on it, or where some of it is open. */
static lam_status add_shaded_pair(block_walk *w, uint32_t a, uint32_t b, double most, bool crosses,
                                  const candidates *among) {
    const flat_clusters *f = &w->finder->flat;
    element_pair two;
    const double bound = shadow_most(w, a, b);
    double exchange = -1; /* below 0: not known */
    share_effort effort = {.error = error_within};
    candidates mine;
    w->report.shaded_pairs++;
    element_pair_set(w->finder, a, b, &two);
    if (norm_of(w, a, b, most) > bound) {
        exchange = exchange_of_pair(w->finder, &two);
        if (!(exchange > 0)) return add_exchange(w, a, b, 0);
        const double norm = exchange / sqrt(f->of[a].area * f->of[b].area);
        effort.error = fmin(error_beyond, pair_error_in_bounds * bound / norm);
        if (effort.error < error_beyond) among = sift_for_pair(w, a, b, among, &mine);
    }
    const double share = among->hidden ? 0 : visible_share_of(w->finder, &two, among, &effort);
    count_segments(w, among, (double)effort.segments);
    w->report.lines += (double)effort.lines;
    w->report.replaced += (double)effort.replaced;
    w->report.elements_unseen += !(share > 0);
    if (!(share > 0)) return LAM_OK;
    if (share >= 1 && !(effort.through > 0) && is_smooth(w, a, b, most, crosses)) return add_linear(w, a, b);
    if (exchange < 0) exchange = exchange_of_pair(w->finder, &two);
    if (effort.through > 0) {
        cluster_block made = {.a = a, .b = b};
        block_numbers_of_pair(f, exchange * effort.through, &made);
        if (add_to(w, &w->through, &made) != LAM_OK) return LAM_ERR_MEMORY;
    }
    return add_exchange(w, a, b, exchange * share);
}

/* Of two clusters that are not smooth the one that lies on both sides of the other's plane is split, else the
 * larger one. */
static lam_status split_for_smoothness(block_walk *w, uint32_t a, uint32_t b, const bool behind[2],
                                       const candidates *among) {
    const flat_clusters *f = &w->finder->flat;
    const size_t n_clusters = w->finder->n_clusters;
    if (behind[0] && a < n_clusters) return split(w, a, b, among, 1, 0);
    if (behind[1] && b < n_clusters) return split(w, a, b, among, 0, 1);
    return split(w, a, b, among, f->of[a].radius, f->of[b].radius);
}

/* The block of what comes through panes alone. */
static lam_status add_through(block_walk *w, uint32_t a, uint32_t b, seen_segment segments[SEGMENT_LANES]) {
    cluster_block made = {.a = a, .b = b};
    double through = 0;
    for (int k = 0; k < SEGMENT_LANES; k++) {
        through += segments[k].through;
        segments[k].seen = segments[k].through;
    }
    if (!(through > 0)) return LAM_OK;
    const visible_share share = visible_share_fit(segments, SEGMENT_LANES);
    block_numbers_set(&w->finder->flat, &share, &made);
    return add_to(w, &w->through, &made);
}

static lam_status add_shaded(block_walk *w, uint32_t a, uint32_t b, const candidates *among) {
    cluster_block made = {.a = a, .b = b};
    seen_segment segments[SEGMENT_LANES];
    double seen = 0;
    shade_segments(&w->finder->shade, a, b, among, segments);
    for (int k = 0; k < SEGMENT_LANES; k++) seen += segments[k].seen;
    w->report.shaded++;
    count_segments(w, among, SEGMENT_LANES);
    if (seen == 0) {
        w->report.elements_unseen +=
            (double)block_finder_size(w->finder, a) * (double)block_finder_size(w->finder, b);
        return LAM_OK;
    }
    const visible_share share = visible_share_fit(segments, SEGMENT_LANES);
    block_numbers_set(&w->finder->flat, seen < SEGMENT_LANES ? &share : NULL, &made);
    if (w->finder->pieces.glass != NULL && add_through(w, a, b, segments) != LAM_OK) return LAM_ERR_MEMORY;
    return add_block(w, &made);
}

static bool are_elements(const block_finder *k, uint32_t a, uint32_t b) {
    return a >= k->n_clusters && b >= k->n_clusters;
}

/* True where a block of these nodes is not split, however many candidates stand between. */
static bool ends_here(const block_walk *w, uint32_t a, uint32_t b, double most, bool crosses) {
    if (are_elements(w->finder, a, b)) return true;
    return norm_of(w, a, b, most) <= shadow_most(w, a, b) && is_smooth(w, a, b, most, crosses);
}

static lam_status end_shaded(block_walk *w, uint32_t a, uint32_t b, double most, bool crosses,
                             const candidates *among) {
    const candidates *tested = segments_among(w, a, b, among);
    if (are_elements(w->finder, a, b)) return add_shaded_pair(w, a, b, most, crosses, tested);
    return add_shaded(w, a, b, tested);
}

/* Splits the side that moves the shadow more: the one that is farther from the occluder. */
static lam_status visit_shaded(block_walk *w, uint32_t a, uint32_t b, double most, const bool behind[2],
                               const candidates *among) {
    const block_finder *k = w->finder;
    const flat_clusters *f = &k->flat;
    const bool crosses = behind[0] || behind[1];
    if (among->amid[0] || among->amid[1]) return split(w, a, b, among, among->amid[0], !among->amid[0]);
    if (ends_here(w, a, b, most, crosses)) return end_shaded(w, a, b, most, crosses, among);
    if (norm_of(w, a, b, most) > shadow_most(w, a, b)) {
        const double place = candidates_place(&k->pieces, f, a, b, among);
        return split(w, a, b, among, f->of[a].radius * (1 - place), f->of[b].radius * place);
    }
    return split_for_smoothness(w, a, b, behind, among);
}

/* The share of itself that the kernel may vary by in a block of two nodes. */
static double spread_allowed(const block_finder *k, uint32_t a, uint32_t b) {
    const double both = (double)block_finder_size(k, a) * (double)block_finder_size(k, b);
    const double share = sqrt(both) / (double)k->tree->n;
    return k->spread * fmin(sqrt(share_of_block / share), spread_times_most) * sqrt(bound_times(k, a, b));
}

/* Two nodes, one of which joins several planes: the kernel is even on both, or the larger one is split. */
static lam_status decide_joined(block_walk *w, uint32_t a, uint32_t b, const candidates *among) {
    const block_finder *k = w->finder;
    const flat_cluster *x = &k->flat.of[a], *y = &k->flat.of[b];
    const double away[3] = {y->centre[0] - x->centre[0], y->centre[1] - x->centre[1],
                            y->centre[2] - x->centre[2]};
    const double apart = sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
    if (apart - x->radius - y->radius >= separation * fmax(x->radius, y->radius)) {
        const double spread = joined_kernel_spread(&k->kernel, a, b);
        w->report.sampled += JOINED_SAMPLES;
        if (spread <= spread_allowed(k, a, b)) {
            const double mean = joined_kernel_mean(&k->kernel, a, b);
            cluster_block made = {.a = a, .b = b, .L = {{(float)mean}}};
            w->report.sampled += JOINED_SAMPLES;
            w->report.even++;
            return add_block(w, &made);
        }
    }
    return split(w, a, b, among, x->radius, y->radius);
}

/* The pairs of nodes within a node. Within a plane there is no light. */
static lam_status decide_within(block_walk *w, uint32_t t, const candidates *among) {
    lam_status status = LAM_OK;
    if (w->finder->flat.of[t].plane != PLANE_ABOVE) return LAM_OK;
    const node_children below = block_finder_children(w->finder, t);
    for (int i = 0; i < below.count; i++)
        for (int j = i; j < below.count; j++) TRY(visit(w, below.of[i], below.of[j], among));
done:
    return status;
}

/* True where all elements of a node are at one height: nothing stands before some of them only. */
static bool is_level(const flat_clusters *f, uint32_t t) {
    return f->of[t].rise <= f->slack;
}

/* elements: the pairs of elements that a and b stand for. */
static lam_status decide(block_walk *w, uint32_t a, uint32_t b, double elements, const candidates *among) {
    const block_finder *k = w->finder;
    const flat_clusters *f = &k->flat;
    bool behind[2];
    flat_pair at;
    candidates mine = {.count = 0};
    w->report.visits++;
    if (a == b) return decide_within(w, a, among);
    if (f->of[a].plane == PLANE_ABOVE || f->of[b].plane == PLANE_ABOVE) return decide_joined(w, a, b, among);
    flat_clusters_pair(f, a, b, &at);
    const double most = block_kernel_most(f, a, b, &at, behind);
    if (!(most > 0)) {
        w->report.away++;
        w->report.elements_away += elements;
        return LAM_OK;
    }
    const bool crosses = behind[0] || behind[1];
    /* Candidates cost more to sift than to test: those of the parent do where the outcome is the same. */
    if (among != NULL && among->count > 0 && is_level(f, a) && is_level(f, b) &&
        ends_here(w, a, b, most, crosses) && candidates_are_others(&k->pieces, f, a, b, among))
        return end_shaded(w, a, b, most, crosses, among);
    if (among == NULL || among->count != 0) {
        candidates_between(&k->pieces, f, a, b, &at, among, &mine);
        w->report.sifted += mine.examined;
    }
    if (mine.hidden) {
        w->report.hidden++;
        w->report.elements_hidden += elements;
        return LAM_OK;
    }
    if (mine.count != 0) return visit_shaded(w, a, b, most, behind, &mine);
    if (is_smooth(w, a, b, most, crosses)) {
        w->report.linear++;
        return add_linear(w, a, b);
    }
    if (are_elements(k, a, b)) {
        w->report.pairs++;
        element_pair two;
        element_pair_set(k, a, b, &two);
        return add_exchange(w, a, b, exchange_of_pair(k, &two));
    }
    return split_for_smoothness(w, a, b, behind, &mine);
}

/* All of the pair, or where pairs are sampled one of so many. */
static lam_status visit(block_walk *w, uint32_t a, uint32_t b, const candidates *among) {
    lam_status status = LAM_OK;
    block_sampling *s = &w->sampling;
    const int before = s->stage;
    const double elements = (double)block_finder_size(w->finder, a) * (double)block_finder_size(w->finder, b);
    int stage = before;
    while (stage < s->n_stages && elements <= s->limit[stage]) stage++;
    if (stage == before) return decide(w, a, b, elements, among);
    const uint64_t one_of = UINT64_C(1) << (stage - before);
    if (random_hash((uint64_t)a << 32 | b) % one_of != 0) return LAM_OK;
    const block_report so_far = w->report;
    w->report = (block_report){.visits = 0};
    s->stage = stage;
    status = decide(w, a, b, elements, among);
    s->stage = before;
    block_report_add(&w->report, 1, &s->part[stage]);
    w->report = so_far;
    return status;
}

lam_status block_walk_visit(block_walk *w, uint32_t a, uint32_t b) {
    static const candidates none = {.count = 0};
    return visit(w, a, b, w->finder->joined ? &none : NULL);
}

void block_report_add(const block_report *from, double times, block_report *to) {
    to->visits += times * from->visits;
    to->away += times * from->away;
    to->hidden += times * from->hidden;
    to->linear += times * from->linear;
    to->even += times * from->even;
    to->sampled += times * from->sampled;
    to->pairs += times * from->pairs;
    to->shaded += times * from->shaded;
    to->shaded_pairs += times * from->shaded_pairs;
    to->segments += times * from->segments;
    to->lines += times * from->lines;
    to->replaced += times * from->replaced;
    to->sifted += times * from->sifted;
    to->cast += times * from->cast;
    to->elements_away += times * from->elements_away;
    to->elements_hidden += times * from->elements_hidden;
    to->elements_unseen += times * from->elements_unseen;
}
