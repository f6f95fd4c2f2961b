/* Segments tested against the lists of pairs beside the search of the whole scene. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/pairs/few_occluders.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/sight/occlusion.h"
#include "solver/formfactor/sight/segment_occluders.h"
#include "support/box.h"
#include "support/scene.h"

#include <omp.h>

static const struct {
    const char *kind;
    size_t elements;
} scenes[] = {{"patio", 1200}, {"atrium", 1200}, {"rooms", 1200}};
enum { SCENES = sizeof scenes / sizeof *scenes };

typedef struct setting {
    mesh m;
    visibility *v;
    polygon *polygons;
    pair_factor_rules rules;
    few_occluders few;
    cluster_tree tree;
    uint32_t *leaf; /* [n], of a position */
    segment_occluder *listed;
} setting;

static mesh scene_of(int k) {
    const generate_options how = {
        .kind = scenes[k].kind, .elements = scenes[k].elements, .seed = 1, .reflectance = .5};
    return generate_good(&how);
}

static void setting_open(setting *s, int k) {
    lam_error error = {.message = ""};
    *s = (setting){.m = scene_of(k)};
    ck_ok(visibility_create(&s->m, &s->v, &error));
    s->polygons = malloc(s->m.n * sizeof *s->polygons);
    s->leaf = malloc(s->m.n * sizeof *s->leaf);
    for (size_t i = 0; i < s->m.n; i++) polygon_of_element(&s->m, i, &s->polygons[i]);
    pair_factor_rules_init(&s->rules);
    ck_ok(few_occluders_make(&s->m, s->v, s->polygons, &s->rules, 1, UNCUT_OCCLUDERS_MOST, &s->few, &error));
    ck_ok(cluster_tree_build(&s->m, s->few.occluders.slack, &s->tree, &error));
    ck_ok(segment_occluders_make(&s->few.occluders, visibility_centre(s->v), &s->listed, &error));
    for (size_t c = 0; c < s->tree.n_clusters; c++)
        if (cluster_is_leaf(&s->tree.clusters[c]))
            for (uint32_t p = s->tree.clusters[c].first; p < s->tree.clusters[c].last; p++)
                s->leaf[p] = (uint32_t)c;
}

static void setting_close(setting *s) {
    few_occluders_free(&s->few);
    cluster_tree_free(&s->tree);
    visibility_destroy(s->v);
    free(s->polygons);
    free(s->leaf);
    free(s->listed);
    mesh_free(&s->m);
}

static bool lies_in(const polygon *p, const occluder *o, double slack) {
    for (int c = 0; c < p->n; c++)
        if (fabs(dot3(o->normal, p->corner[c]) - o->level) > slack) return false;
    return true;
}

/* True where moving the ends by `slack` may change whether a segment between a and b meets an occluder of the
 * scene: where it crosses the plane within slack / cosine of an edge, or ends within slack of the plane. An
 * occluder in the plane of a or of b blocks nothing of them. */
static bool grazes(const occluders *all, const polygon *a, const double x[3], const polygon *b,
                   const double y[3], double slack) {
    double d[3];
    subtract3(y, x, d);
    const double length = sqrt(dot3(d, d));
    for (size_t k = 0; k < all->n; k++) {
        const occluder *o = &all->of[k];
        const double f = dot3(o->normal, x) - o->level, g = dot3(o->normal, y) - o->level;
        const double cosine = fabs(g - f) / length;
        if (lies_in(a, o, slack) || lies_in(b, o, slack)) continue;
        if (f * g > 0 && fmin(fabs(f), fabs(g)) > slack) continue;
        double at[3], inside = INFINITY;
        if (cosine * length <= slack) return true;
        const double t = fmin(fmax(f / (f - g), 0), 1);
        for (int e = 0; e < 3; e++) at[e] = x[e] + t * d[e];
        for (int e = 0; e < o->n; e++) inside = fmin(inside, dot3(o->edge[e], at) + o->edge[e][3]);
        if (inside < -slack / cosine) continue;
        if (inside < slack / cosine || fmin(fabs(f), fabs(g)) < slack) return true;
    }
    return false;
}

/* Compares the verdicts of eight segments, for pairs of leaves, each with its own list. The search of the
 * whole scene lifts both ends by two roundings, and each of it, the lists and their margin is off by another:
 * segments that nothing grazes within eight are blocked by both or by neither. */
START_TEST(lists_block_what_the_scene_blocks) {
    enum { PAIRS = 20000 };
    setting s;
    setting_open(&s, _i);
    const double slack = 8 * visibility_rounding(s.v);
    uint64_t seed = 3;
    size_t compared = 0, blocked = 0, shaded = 0, listed = 0, open = 0, hidden = 0, most = 0;
    for (size_t k = 0; k < PAIRS; k++) {
        const uint32_t p = (uint32_t)(random_unit(&seed) * (double)s.m.n),
                       q = (uint32_t)(random_unit(&seed) * (double)s.m.n), i = s.tree.element[p],
                       j = s.tree.element[q];
        const cluster *a = &s.tree.clusters[s.leaf[p]], *b = &s.tree.clusters[s.leaf[q]];
        if (i == j || pair_factor_exchange(&s.rules, &s.polygons[i], &s.polygons[j], 1e-3) <= 0) continue;
        shaft between;
        link_occluders among;
        pair_occluders own;
        cluster_shaft_init(&between, a, b, s.few.occluders.slack);
        link_occluders_find(&s.few.occluders, &between, a, b, LINK_OCCLUDERS_MOST, &among);
        const few_verdict found = few_occluders_between(&s.few, &among, i, j, &own);
        if (own.count == OCCLUDERS_UNCOUNTED) continue;
        double x[VISIBILITY_PACKET][3], y[VISIBILITY_PACKET][3];
        bool faces[VISIBILITY_PACKET];
        uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
        ray_packet segments;
        for (int c = 0; c < VISIBILITY_PACKET; c++) {
            double d[3];
            polygon_point(&s.polygons[i], random_unit(&seed), random_unit(&seed), x[c]);
            polygon_point(&s.polygons[j], random_unit(&seed), random_unit(&seed), y[c]);
            subtract3(y[c], x[c], d);
            faces[c] = dot3(d, s.polygons[i].normal) > slack && dot3(d, s.polygons[j].normal) < -slack;
            from[c] = i, to[c] = j;
            for (int e = 0; e < 3; e++) {
                segments.origin[e][c] = (float)(x[c][e] - visibility_centre(s.v)[e]);
                segments.direction[e][c] = (float)d[e];
            }
        }
        segment_list list = {own.count, own.of};
        const unsigned scene = visibility_blocked(s.v, &segments, VISIBILITY_PACKET, from, to);
        unsigned mine = found == FEW_HIDDEN ? ~0u : 0;
        if (found == FEW_UNDECIDED) segment_occluders_block(s.listed, &list, &segments, 1, &mine);
        open += found == FEW_OPEN;
        hidden += found == FEW_HIDDEN;
        listed += found == FEW_UNDECIDED;
        most = (size_t)own.count > most ? (size_t)own.count : most;
        for (int c = 0; c < VISIBILITY_PACKET; c++) {
            if (!faces[c] || grazes(&s.few.occluders, &s.polygons[i], x[c], &s.polygons[j], y[c], slack))
                continue;
            compared++;
            blocked += scene >> c & 1;
            shaded += found == FEW_UNDECIDED && (scene >> c & 1) != 0;
            ck_assert_msg((scene >> c & 1) == (mine >> c & 1),
                          "%s: elements %u and %u, %d occluders: the scene %s, the list does not",
                          scenes[_i].kind, i, j, own.count, scene >> c & 1 ? "blocks" : "lets pass");
        }
    }
    /* All verdicts and long lists are among them, and hardly a segment grazes. */
    ck_assert_uint_gt(compared, 7 * (open + hidden + listed));
    ck_assert_uint_gt(compared, blocked);
    ck_assert_uint_gt(shaded, 1000);
    ck_assert_uint_gt(open, 100);
    ck_assert_uint_gt(hidden, 100);
    ck_assert_uint_gt(listed, 1000);
    ck_assert_uint_gt(most, UNCUT_OCCLUDERS_MOST);
    setting_close(&s);
}
END_TEST

/* The verdict of segments by the list of a link is that of the search of the whole scene, but where one
 * grazes an occluder: the ends are rounded by a millionth of the scene, and of 10,000 pairs with 8 to 256
 * segments and some dozens of edges a few may. */
START_TEST(links_block_what_the_scene_blocks) {
    enum { PAIRS = 40000, GRAZED_MOST = 10 };
    setting s;
    setting_open(&s, _i);
    const occlusion o = {.v = s.v,
                         .area = s.m.area,
                         .polygons = s.polygons,
                         .rules = &s.rules,
                         .tolerance = 1e-4,
                         .accuracy = 7e-5,
                         .segments = VISIBILITY_PACKET,
                         .seed = 1,
                         .occluders = s.listed};
    uint64_t seed = 5;
    size_t of_verdict[3] = {0}, differ = 0;
    for (size_t k = 0; k < PAIRS; k++) {
        const uint32_t p = (uint32_t)(random_unit(&seed) * (double)s.m.n),
                       q = (uint32_t)(random_unit(&seed) * (double)s.m.n), i = s.tree.element[p],
                       j = s.tree.element[q];
        const cluster *a = &s.tree.clusters[s.leaf[p]], *b = &s.tree.clusters[s.leaf[q]];
        const double g = i == j ? 0 : pair_factor_exchange(&s.rules, &s.polygons[i], &s.polygons[j], 1e-3);
        if (g <= 0) continue;
        double seen, by_list;
        shaft between;
        link_occluders among;
        cluster_shaft_init(&between, a, b, s.few.occluders.slack);
        link_occluders_find(&s.few.occluders, &between, a, b, TESTED_OCCLUDERS_MOST, &among);
        if (among.count == OCCLUDERS_UNCOUNTED) continue;
        segment_list list = {among.count, among.of};
        const occlusion_verdict verdict = occlusion_test(&o, NULL, i, j, g, &seen);
        of_verdict[verdict]++;
        differ += occlusion_test(&o, &list, i, j, g, &by_list) != verdict || fabs(seen - by_list) > 1e-6 * g;
    }
    ck_assert_uint_gt(of_verdict[OCCLUSION_NONE], 500);
    ck_assert_uint_gt(of_verdict[OCCLUSION_TOTAL], 500);
    ck_assert_uint_gt(of_verdict[OCCLUSION_PARTIAL], 500);
    ck_assert_uint_le(differ, GRAZED_MOST);
    setting_close(&s);
}
END_TEST

/* Nothing passes where two occluders meet, wherever rounding puts the ends. */
START_TEST(edges_do_not_leak) {
    enum { PACKETS = 2000 };
    mesh m = {0};
    lam_error error = {.message = ""};
    visibility *v;
    occluders o;
    segment_occluder *listed;
    const double roof[2][4][3] = {{{-1.1, -2, -.3}, {.1, -2, .7}, {.1, 2, .7}, {-1.1, 2, -.3}},
                                  {{.1, -2, .7}, {1.3, -2, -.4}, {1.3, 2, -.4}, {.1, 2, .7}}};
    for (int k = 0; k < 2; k++) mesh_add_quad(&m, roof[k]);
    mesh_finish(&m, .5f);
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(occluders_make(&m, visibility_facets(v), visibility_rounding(v), &o, &error));
    ck_ok(segment_occluders_make(&o, visibility_centre(v), &listed, &error));
    ck_assert_uint_eq(o.n, 2);
    uint32_t both[2] = {0, 1};
    segment_list list = {2, both}, none = {0, both};
    uint64_t seed = 7;
    for (int k = 0; k < PACKETS; k++) {
        ray_packet segments;
        for (int c = 0; c < VISIBILITY_PACKET; c++) {
            const double at[3] = {.1, 3.6 * random_unit(&seed) - 1.8, .7};
            const double d[3] = {.8 * random_unit(&seed) - .4, random_unit(&seed) - .5,
                                 -.5 - random_unit(&seed)};
            const double before = .1 + random_unit(&seed), all = before + .1 + random_unit(&seed);
            for (int e = 0; e < 3; e++) {
                segments.origin[e][c] = (float)(at[e] - before * d[e] - visibility_centre(v)[e]);
                segments.direction[e][c] = (float)(all * d[e]);
            }
        }
        unsigned blocked = 0, free_of_none = 5, together[SEGMENT_PACKETS] = {0};
        ray_packet all[SEGMENT_PACKETS];
        for (int p = 0; p < SEGMENT_PACKETS; p++) all[p] = segments;
        for (int d = 0; d < 3; d++)
            for (int c = 0; c < VISIBILITY_PACKET; c++) all[1].direction[d][c] *= (float)(c % 3 != 0);
        segment_occluders_block(listed, &list, all, SEGMENT_PACKETS, together);
        ck_assert_uint_eq(together[0], (1u << VISIBILITY_PACKET) - 1);
        ck_assert_uint_eq(together[1], 1u << 1 | 1u << 2 | 1u << 4 | 1u << 5 | 1u << 7);
        segment_occluders_block(listed, &list, &segments, 1, &blocked);
        segment_occluders_block(listed, &none, &segments, 1, &free_of_none);
        ck_assert_uint_eq(blocked, (1u << VISIBILITY_PACKET) - 1);
        ck_assert_uint_eq(free_of_none, 5);
    }
    free(listed);
    occluders_free(&o);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Two plates of 3 x 3 elements and 14 slats between them, one above the other and turned at random. */
static mesh slatted_plates(void) {
    enum { SLATS = 14, CELLS = 3 };
    mesh m = {0};
    uint64_t seed = 11;
    for (int side = 0; side < 2; side++)
        for (int x = 0; x < CELLS; x++)
            for (int y = 0; y < CELLS; y++) {
                const box_cell cell = {.axis = 2,
                                       .level = side,
                                       .from = {(double)x / CELLS, (double)y / CELLS, side},
                                       .to = {(x + 1.) / CELLS, (y + 1.) / CELLS, side}};
                mesh_add_cell(&m, &cell, side == 0);
            }
    for (int k = 0; k < SLATS; k++) {
        const double turn = 3 * random_unit(&seed), level = .2 + .6 * k / SLATS;
        const double x = .3 + .4 * random_unit(&seed), y = .3 + .4 * random_unit(&seed);
        const double along[2] = {.4 * cos(turn), .4 * sin(turn)},
                     across[2] = {-.05 * sin(turn), .05 * cos(turn)};
        double corner[4][3];
        for (int c = 0; c < 4; c++) {
            const double u = c == 1 || c == 2 ? 1 : -1, w = c >= 2 ? 1 : -1;
            corner[c][0] = x + u * along[0] + w * across[0];
            corner[c][1] = y + u * along[1] + w * across[1];
            corner[c][2] = level + .01 * u;
        }
        mesh_add_quad(&m, (const double(*)[3])corner);
    }
    mesh_finish(&m, .5f);
    return m;
}

enum { PLATES = 18 };
static const double accuracy = 5e-5;

static csr exchange(const mesh *m, const visibility *v, int most_projected, int n_threads) {
    const pairs_options options = {.tolerance = 1e-6,
                                   .accuracy = accuracy,
                                   .segments = VISIBILITY_PACKET,
                                   .segments_most = 1e12,
                                   .occluders = most_projected,
                                   .seed = 1};
    const int most = omp_get_max_threads();
    lam_error error = {.message = ""};
    csr G = {0};
    pairs_report report;
    omp_set_num_threads(n_threads);
    ck_ok(pairs_exchange(m, v, &options, &G, &report, NULL, &error));
    omp_set_num_threads(most);
    return G;
}

/* The visible part of a pair by segments through the whole scene, at `accuracy`, also where an occlusion test
 * sees nothing. */
static double seen_through(const mesh *m, const visibility *v, uint32_t i, uint32_t j) {
    pair_factor_rules rules;
    polygon *polygons = calloc(m->n, sizeof *polygons);
    ck_assert_ptr_nonnull(polygons);
    pair_factor_rules_init(&rules);
    for (size_t k = 0; k < m->n; k++) polygon_of_element(m, k, &polygons[k]);
    const occlusion o = {.v = v,
                         .area = m->area,
                         .polygons = polygons,
                         .rules = &rules,
                         .tolerance = 1e-6,
                         .accuracy = accuracy,
                         .segments = VISIBILITY_PACKET,
                         .seed = 2};
    const double g = pair_factor_exchange(&rules, &polygons[i], &polygons[j], o.tolerance);
    const double seen = occlusion_estimate(&o, NULL, i, j, g);
    free(polygons);
    return seen;
}

/* Pairs with lists beside pairs without any, and the same bits from any number of threads. Both have the
 * standard error `accuracy`, those between few slats less: six of a difference are passed once in 10^9 pairs,
 * and a slat hides some hundredths of a factor of .02 to .1. A pair with lists may demand more segments where
 * those of its test saw nothing (pair_demand.h), so that it is compared with as many through the scene. */
START_TEST(pairs_with_lists_are_pairs_without) {
    mesh m = slatted_plates();
    lam_error error = {.message = ""};
    visibility *v;
    ck_ok(visibility_create(&m, &v, &error));
    csr with = exchange(&m, v, UNCUT_OCCLUDERS_MOST, 1), same = exchange(&m, v, UNCUT_OCCLUDERS_MOST, 3),
        without = exchange(&m, v, 0, 2);
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = i + 1; j < m.n; j++) {
            const double g = csr_entry(&with, i, j);
            double other = csr_entry(&without, i, j);
            ck_assert_double_eq(g, csr_entry(&same, i, j));
            if (j >= PLATES) continue;
            if (g > 0 && !(other > 0)) other = seen_through(&m, v, (uint32_t)i, (uint32_t)j);
            ck_assert_double_le(fabs(g - other) / m.area[i], 6 * sqrt(2) * accuracy);
        }
    csr_free(&with);
    csr_free(&same);
    csr_free(&without);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("formfactor/segment_occluders");
    TCase *cases = tcase_create("segment_occluders");
    tcase_set_timeout(cases, 120);
    suite_add_tcase(suite, cases);
    tcase_add_loop_test(cases, lists_block_what_the_scene_blocks, 0, SCENES);
    tcase_add_loop_test(cases, links_block_what_the_scene_blocks, 0, SCENES);
    tcase_add_test(cases, edges_do_not_leak);
    tcase_add_test(cases, pairs_with_lists_are_pairs_without);
    return suite_run_together(suite);
}
