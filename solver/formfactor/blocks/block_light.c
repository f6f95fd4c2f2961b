/* H = F E of few elements is found by a descent from each source: a smooth block adds L^T sum A E m to its
 * cluster, near elements exchange as exact pairs, and where something stands between, the open light is
 * multiplied by sum K E V / sum K E over segments, K = cos cos' / r^2. H is the mean of two such halves. */
#include "solver/formfactor/blocks/block_light.h"

#include "solver/base/random.h"
#include "solver/formfactor/blocks/block_walk.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Blocks may have this roughness (block_kernel_roughness), which bounds their relative error. Errors of an
 * operator from blocks are alike, so that they count in full: .02 gave .0263 for .0273 of single elements
 * (163,811), .005 did. */
static const double roughness_most = .003;
/* Relative tolerance of single pairs. */
static const double pair_tolerance = 1e-5;
/* Segments go to points all over a source whose centre is this many of its radii away. */
static const double radii_away = 2;
/* Independent estimates of a source and an element that it does not see all of, and segments of each: the
 * least beside blocks of middle_accuracy, those of the judge by preset, more beside finer ones. */
enum { HALVES = 2, SEGMENTS_LEAST = 8, SEGMENTS_MOST = 64 };
static const double middle_accuracy = 1.19e-4;
/* Pairs of a source and a piece at most, each of which takes about a microsecond. */
static const double visits_most = 5e6;
/* One of so many elements may shine at most; pieces of the receivers that threads take one at a time. */
enum { SHARE_LIT = 4, PIECES = 64, LEAST_OF_PIECE = 8 };

struct block_light {
    const mesh *m;
    const plane_tree *tree;
    visibility *v;
    block_options options;
    block_factors nodes;
    block_finder finder;
    uint64_t seeds[HALVES];
    uint32_t segments;         /* of each half */
    uint32_t *planes, *pieces; /* the topmost clusters; those below them of few elements each */
    size_t n_planes, n_pieces;
};

/* One emission on its way. */
typedef struct shining {
    const block_light *l;
    const float *E;
    uint32_t *before;                  /* [n + 1], the elements that shine before a position */
    double (*moment)[BLOCK_FUNCTIONS]; /* [n_clusters], sum A E m of the elements of a cluster */
    uint32_t *sources;                 /* the smallest nodes that hold all the light of a plane */
    size_t n_sources;
    double (*arriving)[BLOCK_FUNCTIONS]; /* [n_clusters] H is m^T arriving, beside that of single elements */
    double *at[HALVES];                  /* [n] by position */
} shining;

void block_light_destroy(block_light *l) {
    if (l == NULL) return;
    block_finder_free(&l->finder);
    block_factors_free(&l->nodes);
    visibility_destroy(l->v);
    free(l->planes);
    free(l->pieces);
    free(l);
}

/* Adds the largest clusters below a node that have at most `most` elements. */
static void cut(block_light *l, uint32_t t, size_t most) {
    const plane_cluster *c = &l->tree->clusters[t];
    if (c->leaf || block_finder_size(&l->finder, t) <= most) {
        l->pieces[l->n_pieces++] = t;
        return;
    }
    cut(l, c->left, most);
    cut(l, t - 1, most);
}

/* Lists the largest clusters of one plane each. */
static lam_status find_planes(block_light *l, lam_error *error) {
    l->planes = memory_allocate(l->tree->n_frames, sizeof *l->planes, "direct illumination", error);
    if (l->planes == NULL) return LAM_ERR_MEMORY;
    for (uint32_t t = 0; t < l->tree->n_clusters; t++) {
        const uint32_t parent = l->nodes.nodes[t].parent;
        if (l->tree->clusters[t].frame == PLANE_ABOVE) continue;
        if (parent == BLOCK_NO_NODE || l->tree->clusters[parent].frame == PLANE_ABOVE)
            l->planes[l->n_planes++] = t;
    }
    return LAM_OK;
}

/* As fine as blocks of this bound: with 16 in both halves a patio's lamps (1,508 elements) are stated to be
 * off by .011 at bounds of 3e-5 and of 7e-6, where they are off by .0040 and .0015. Powers of two, as the
 * sequence of points is even then. */
static uint32_t segments_of_half(double accuracy) {
    uint32_t segments = SEGMENTS_LEAST;
    while (segments < SEGMENTS_MOST && segments * accuracy < SEGMENTS_LEAST * middle_accuracy) segments *= 2;
    return segments;
}

lam_status block_light_create(const mesh *m, const plane_tree *tree, double accuracy, uint64_t seed,
                              block_light **out, lam_error *error) {
    lam_status status = LAM_OK;
    block_light *l = memory_allocate(1, sizeof *l, "direct illumination", error);
    if (l == NULL) return LAM_ERR_MEMORY;
    l->m = m;
    l->tree = tree;
    l->options.exact = pair_tolerance;
    l->segments = segments_of_half(accuracy);
    for (uint64_t h = 0; h < HALVES; h++) l->seeds[h] = random_stream(seed, h);
    TRY(visibility_create(m, &l->v, error));
    TRY(block_finder_make(m, l->v, tree, &l->nodes, &l->finder, error));
    TRY(block_finder_set(&l->finder, &l->options, error));
    TRY(find_planes(l, error));
    l->pieces = memory_allocate(tree->n_clusters, sizeof *l->pieces, "direct illumination", error);
    if (l->pieces == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < l->n_planes; k++) cut(l, l->planes[k], m->n / PIECES + LEAST_OF_PIECE);
    *out = l;
    l = NULL;
done:
    block_light_destroy(l);
    return status;
}

static uint32_t count_lit(const shining *s, uint32_t t) {
    const block_node *node = &s->l->nodes.nodes[t];
    return s->before[node->end] - s->before[node->begin];
}

static double emission_of(const shining *s, uint32_t element_node) {
    return (double)s->E[s->l->nodes.order[element_node - s->l->nodes.n_clusters]];
}

/* sum A E m of a node, whose functions are m. */
static void moments_of(const shining *s, uint32_t t, double out[BLOCK_FUNCTIONS]) {
    const block_factors *f = &s->l->nodes;
    if (t < f->n_clusters) {
        memcpy(out, s->moment[t], sizeof s->moment[t]);
        return;
    }
    out[0] = f->area[t - f->n_clusters] * emission_of(s, t);
    out[1] = out[2] = 0;
}

static void add_moments(const shining *s, uint32_t t, double to[BLOCK_FUNCTIONS], const block_node *above) {
    const block_step step = block_step_up(&s->l->nodes.nodes[t], above);
    double x[BLOCK_FUNCTIONS];
    moments_of(s, t, x);
    to[0] += x[0];
    for (int k = 0; k < 2; k++) to[k + 1] += step.shift[k] * x[0] + step.scale[k] * x[k + 1];
}

/* Children stand before their parents. */
static void find_moments(shining *s) {
    const block_factors *f = &s->l->nodes;
    for (uint32_t t = 0; t < f->n_clusters; t++) {
        if (s->l->tree->clusters[t].frame == PLANE_ABOVE || count_lit(s, t) == 0) continue;
        const node_children below = block_finder_children(&s->l->finder, t);
        for (int k = 0; k < below.count; k++) add_moments(s, below.of[k], s->moment[t], &f->nodes[t]);
    }
}

/* The smallest node below t with all of its light. */
static uint32_t narrow(const shining *s, uint32_t t) {
    while (t < s->l->nodes.n_clusters) {
        const node_children below = block_finder_children(&s->l->finder, t);
        uint32_t lit = 0;
        int count = 0;
        for (int k = 0; k < below.count; k++)
            if (count_lit(s, below.of[k]) > 0) lit = below.of[k], count++;
        if (count != 1) break;
        t = lit;
    }
    return t;
}

static bool is_element(const shining *s, uint32_t t) {
    return t >= s->l->nodes.n_clusters;
}

static bool is_smooth(const shining *s, uint32_t a, uint32_t b, const bool behind[2]) {
    return !behind[0] && !behind[1] && block_kernel_roughness(&s->l->finder.flat, a, b, 2) <= roughness_most;
}

/* A_b H of element b from element a. */
static double exchange(const shining *s, uint32_t a, uint32_t b) {
    const block_factors *f = &s->l->nodes;
    polygon shapes[2];
    polygon_of_element(s->l->m, f->order[a - f->n_clusters], &shapes[0]);
    polygon_of_element(s->l->m, f->order[b - f->n_clusters], &shapes[1]);
    return pair_factor_exchange(&s->l->finder.rules, &shapes[0], &shapes[1], pair_tolerance);
}

static double light_of_pair(const shining *s, uint32_t a, uint32_t b) {
    return emission_of(s, a) * exchange(s, a, b) / s->l->nodes.area[b - s->l->nodes.n_clusters];
}

/* Adds the light of a smooth block: light [BLOCK_FUNCTIONS] += L^T sum A E m_a. */
static void add_smooth(const shining *s, uint32_t a, uint32_t b, double *light) {
    cluster_block block = {.a = a, .b = b};
    double x[BLOCK_FUNCTIONS];
    block_numbers_set(&s->l->finder.flat, NULL, &block);
    moments_of(s, a, x);
    for (int h = 0; h < (is_element(s, b) ? 1 : BLOCK_FUNCTIONS); h++)
        for (int g = 0; g < BLOCK_FUNCTIONS; g++) light[h] += (double)block.L[g][h] * x[g];
}

/* H of element b by source a where nothing stands between. */
static double open_light(const shining *s, uint32_t a, uint32_t b) {
    bool behind[2];
    flat_pair at;
    double light[BLOCK_FUNCTIONS] = {0};
    if (count_lit(s, a) == 0) return 0;
    flat_clusters_pair(&s->l->finder.flat, a, b, &at);
    if (!(block_kernel_most(&s->l->finder.flat, a, b, &at, behind) > 0)) return 0;
    if (is_smooth(s, a, b, behind)) {
        add_smooth(s, a, b, light);
    } else if (is_element(s, a)) {
        return light_of_pair(s, a, b);
    } else {
        const node_children below = block_finder_children(&s->l->finder, a);
        for (int k = 0; k < below.count; k++) light[0] += open_light(s, below.of[k], b);
    }
    return light[0];
}

/* Eight segments from a to b: *all gets sum K E, *seen of those that are not blocked. */
static void cast_packet(const shining *s, const pair_sampler *sampler, uint32_t first, uint32_t a, uint32_t b,
                        double *all, double *seen) {
    const flat_clusters *f = &s->l->finder.flat;
    const double *normals[2] = {f->planes[f->of[a].plane].normal, f->planes[f->of[b].plane].normal};
    uint32_t ends[2][VISIBILITY_PACKET];
    double weight[VISIBILITY_PACKET];
    ray_packet segments;
    for (uint32_t k = 0; k < VISIBILITY_PACKET; k++) {
        double at[4], place[2], points[2][3], r2 = 0, leaving = 0, arriving = 0;
        float from[3], to[3];
        pair_sampler_place(sampler, first + k, at);
        ends[0][k] = f->tree->order[flat_cluster_sample(f, a, at[0], at[1], place, points[0])];
        ends[1][k] = f->tree->order[flat_cluster_sample(f, b, at[2], at[3], place, points[1])];
        visibility_recentre(s->l->v, points[0], from);
        visibility_recentre(s->l->v, points[1], to);
        for (int d = 0; d < 3; d++) {
            const double r = points[1][d] - points[0][d];
            r2 += r * r;
            leaving += r * normals[0][d];
            arriving -= r * normals[1][d];
            segments.origin[d][k] = from[d];
            segments.direction[d][k] = to[d] - from[d];
        }
        weight[k] =
            leaving > 0 && arriving > 0 ? (double)s->E[ends[0][k]] * leaving * arriving / (r2 * r2) : 0;
    }
    const unsigned blocked = visibility_blocked(s->l->v, &segments, VISIBILITY_PACKET, ends[0], ends[1]);
    double passed[VISIBILITY_PACKET];
    pane_path_between(s->l->v, s->l->m, &segments, VISIBILITY_PACKET, ends[0], ends[1], blocked, passed);
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        *all += weight[k];
        *seen += passed[k] * weight[k];
    }
}

/* H of element b by source a, that does not see all of it: the open light times sum K E V / sum K E over
 * segments, in two halves. Where no segment of a half counts, the other one speaks for it. */
static void add_shaded(const shining *s, uint32_t a, uint32_t b) {
    const double light = open_light(s, a, b);
    double all[HALVES] = {0}, seen[HALVES] = {0};
    if (!(light > 0)) return;
    for (int h = 0; h < HALVES; h++) {
        pair_sampler sampler;
        pair_sampler_init(&sampler, s->l->seeds[h], a, b);
        for (uint32_t first = 0; first < s->l->segments; first += VISIBILITY_PACKET)
            cast_packet(s, &sampler, first, a, b, &all[h], &seen[h]);
    }
    for (int h = 0; h < HALVES; h++) {
        const int of = all[h] > 0 ? h : 1 - h;
        s->at[h][b - s->l->nodes.n_clusters] += light * (all[of] > 0 ? seen[of] / all[of] : 1);
    }
}

/* True where segments to all of source a estimate its light on b well. */
static bool can_sample(const shining *s, uint32_t a, uint32_t b) {
    const flat_clusters *f = &s->l->finder.flat;
    if (is_element(s, a)) return true;
    return 2 * (size_t)count_lit(s, a) >= block_finder_size(&s->l->finder, a) &&
           flat_cluster_distance(f, b, f->of[a].centre) >= radii_away * f->of[a].radius;
}

static void visit(const shining *s, uint32_t a, uint32_t b, const candidates *among);

static void split(const shining *s, uint32_t a, uint32_t b, bool first, const candidates *among) {
    const node_children below = block_finder_children(&s->l->finder, first ? a : b);
    for (int k = 0; k < below.count; k++) visit(s, first ? below.of[k] : a, first ? b : below.of[k], among);
}

/* True where the source is to be split, not the receiver: the larger one, or that on both sides of the plane
 * of the other. */
static bool splits_source(const shining *s, uint32_t a, uint32_t b, const bool behind[2]) {
    const flat_cluster *of = s->l->finder.flat.of;
    if (is_element(s, a) || is_element(s, b)) return is_element(s, b);
    if (behind[0] != behind[1]) return behind[0];
    return of[a].radius > of[b].radius;
}

/* Adds the light of source a on node b; among: the occluders that may stand between, NULL: any. */
static void visit(const shining *s, uint32_t a, uint32_t b, const candidates *among) {
    const block_finder *k = &s->l->finder;
    const bool elements = is_element(s, a) && is_element(s, b);
    bool behind[2];
    flat_pair at;
    candidates mine = {.count = 0};
    if (count_lit(s, a) == 0) return;
    flat_clusters_pair(&k->flat, a, b, &at);
    if (!(block_kernel_most(&k->flat, a, b, &at, behind) > 0)) return;
    if (among == NULL || among->count != 0) candidates_between(&k->pieces, &k->flat, a, b, &at, among, &mine);
    if (mine.hidden) return;
    if (mine.count != 0) {
        const bool near = !can_sample(s, a, b);
        if (is_element(s, b) && !near)
            add_shaded(s, a, b);
        else
            split(s, a, b, is_element(s, b) || (near && splits_source(s, a, b, behind)), &mine);
        return;
    }
    if (is_smooth(s, a, b, behind)) {
        double light[BLOCK_FUNCTIONS] = {0};
        add_smooth(s, a, b, light);
        if (is_element(s, b))
            for (int h = 0; h < HALVES; h++) s->at[h][b - k->n_clusters] += light[0];
        else
            for (int g = 0; g < BLOCK_FUNCTIONS; g++) s->arriving[b][g] += light[g];
    } else if (elements) {
        const double light = light_of_pair(s, a, b);
        for (int h = 0; h < HALVES; h++) s->at[h][b - k->n_clusters] += light;
    } else {
        split(s, a, b, splits_source(s, a, b, behind), &mine);
    }
}

/* Light of clusters goes down to their elements; H and D in mesh order. */
static void hand_down(shining *s, double *H, double *D) {
    const block_factors *f = &s->l->nodes;
    for (size_t t = f->n_clusters; t-- > 0;) {
        const block_node *node = &f->nodes[t];
        double *const own = s->arriving[t];
        if (s->l->tree->clusters[t].frame == PLANE_ABOVE) continue;
        if (node->parent != BLOCK_NO_NODE) {
            const block_step step = block_step_up(node, &f->nodes[node->parent]);
            const double *from = s->arriving[node->parent];
            own[0] += from[0] + step.shift[0] * from[1] + step.shift[1] * from[2];
            for (int k = 0; k < 2; k++) own[k + 1] += step.scale[k] * from[k + 1];
        }
        if (!s->l->tree->clusters[t].leaf) continue;
        for (uint32_t p = node->begin; p < node->end; p++) {
            const block_step step = block_step_up(&f->nodes[f->n_clusters + p], node);
            const double open = own[0] + step.shift[0] * own[1] + step.shift[1] * own[2];
            H[f->order[p]] = open + .5 * (s->at[0][p] + s->at[1][p]);
            D[f->order[p]] = .5 * (s->at[0][p] - s->at[1][p]);
        }
    }
}

static void shining_free(shining *s) {
    free(s->before);
    free(s->moment);
    free(s->sources);
    free(s->arriving);
    for (int h = 0; h < HALVES; h++) free(s->at[h]);
}

static lam_status shining_make(const block_light *l, const float *E, shining *s, lam_error *error) {
    const block_factors *f = &l->nodes;
    *s = (shining){.l = l, .E = E};
    s->before = memory_allocate(f->n + 1, sizeof *s->before, "direct illumination", error);
    s->moment = memory_allocate(f->n_clusters, sizeof *s->moment, "direct illumination", error);
    s->sources = memory_allocate(l->n_planes, sizeof *s->sources, "direct illumination", error);
    s->arriving = memory_allocate(f->n_clusters, sizeof *s->arriving, "direct illumination", error);
    for (int h = 0; h < HALVES; h++) {
        s->at[h] = memory_allocate(f->n, sizeof *s->at[h], "direct illumination", error);
        if (s->at[h] == NULL) return LAM_ERR_MEMORY;
    }
    if (s->before == NULL || s->moment == NULL || s->sources == NULL || s->arriving == NULL)
        return LAM_ERR_MEMORY;
    for (size_t p = 0; p < f->n; p++) s->before[p + 1] = s->before[p] + (E[f->order[p]] != 0);
    return LAM_OK;
}

lam_status block_light_of(const block_light *l, const float *E, double *H, double *D, bool *known,
                          lam_error *error) {
    static const candidates none = {.count = 0}; /* nothing hides anything */
    lam_status status = LAM_OK;
    shining s = {.l = l};
    TRY(shining_make(l, E, &s, error));
    for (size_t k = 0; k < l->n_planes; k++)
        if (count_lit(&s, l->planes[k]) > 0) s.sources[s.n_sources++] = narrow(&s, l->planes[k]);
    *known =
        s.before[l->m->n] <= l->m->n / SHARE_LIT && (double)s.n_sources * (double)l->n_pieces <= visits_most;
    if (!*known) goto done;
    find_moments(&s);
    /* Every piece is of one thread, and takes its sources in their order. */
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t p = 0; p < l->n_pieces; p++)
        for (size_t k = 0; k < s.n_sources; k++)
            visit(&s, s.sources[k], l->pieces[p], l->finder.joined ? &none : NULL);
    hand_down(&s, H, D);
done:
    shining_free(&s);
    return status;
}
