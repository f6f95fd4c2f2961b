/* Clusters, the shafts between them, their links, and rows of far exchange areas: each against brute force.
 */
#include "solver/base/random.h"
#include "solver/formfactor/clusters/cluster_shaft.h"
#include "solver/formfactor/exchange/pair_far.h"
#include "solver/formfactor/pairs/cluster_links.h"
#include "support/box.h"
#include "support/suite.h"

#include <stdio.h>

/* Adds a box of divisions x divisions cells a face, turned about z, seen from outside or from inside. */
static void add_turned_box(mesh *m, const double low[3], const double size[3], unsigned divisions,
                           double turn, bool inward) {
    for (size_t i = 0; i < 6 * (size_t)divisions * divisions; i++) {
        const box_cell cell = box_cell_of(size, divisions, i);
        mesh_add_cell(m, &cell, (cell.level == 0) == inward);
        double(*corner)[3] = m->vertices + m->n_vertices - 4;
        for (int c = 0; c < 4; c++) {
            const double x = corner[c][0], y = corner[c][1];
            corner[c][0] = low[0] + cos(turn) * x - sin(turn) * y;
            corner[c][1] = low[1] + sin(turn) * x + cos(turn) * y;
            corner[c][2] += low[2];
        }
    }
}

/* A room with a long and high box along its axes and a turned one. */
static mesh room(void) {
    mesh m = {0};
    add_turned_box(&m, (double[]){0, 0, 0}, (double[]){3, 3, 2}, 7, 0, true);
    add_turned_box(&m, (double[]){.9, .2, 0}, (double[]){.3, 2.5, 1.7}, 3, 0, false);
    add_turned_box(&m, (double[]){1.8, 1.4, .3}, (double[]){.7, .7, .8}, 3, .4, false);
    /* Two elements that are no parallelograms, and a triangle. */
    const double trapezoid[4][3] = {{.2, .2, 1.9}, {.2, .8, 1.9}, {.5, .7, 1.9}, {.5, .3, 1.9}},
                 other[4][3] = {{2.9, 1, .2}, {2.9, 1.1, .9}, {2.9, 1.8, .8}, {2.9, 2, .2}},
                 triangle[4][3] = {{2.2, 2.2, .05}, {2.8, 2.2, .05}, {2.4, 2.8, .05}, {2.2, 2.2, .05}};
    mesh_add_quad(&m, trapezoid);
    mesh_add_quad(&m, other);
    mesh_add_quad(&m, triangle);
    m.elements[m.n - 1][3] = MESH_NO_VERTEX;
    mesh_finish(&m, .5f);
    return m;
}

/* The input of cluster_links_find. */
typedef struct site {
    mesh m;
    visibility *v;
    polygon *polygons;
    pair_factor_rules rules;
    cluster_tree tree;
    occlusion occlusion;
} site;

static site *site_open(void) {
    static site s; /* a test's process has one */
    lam_error error = {0};
    s.m = room();
    pair_factor_rules_init(&s.rules);
    s.polygons = malloc(s.m.n * sizeof *s.polygons);
    ck_assert_ptr_nonnull(s.polygons);
    for (size_t i = 0; i < s.m.n; i++) polygon_of_element(&s.m, i, &s.polygons[i]);
    ck_assert_msg(visibility_create(&s.m, &s.v, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(cluster_tree_build(&s.m, visibility_rounding(s.v), &s.tree, &error) == LAM_OK, "%s",
                  error.message);
    s.occlusion = (occlusion){.v = s.v,
                              .area = s.m.area,
                              .polygons = s.polygons,
                              .rules = &s.rules,
                              .tolerance = 1e-6,
                              .accuracy = 1e-4,
                              .segments = 8,
                              .seed = 5};
    return &s;
}

static void site_close(site *s) {
    cluster_tree_free(&s->tree);
    visibility_destroy(s->v);
    free(s->polygons);
    mesh_free(&s->m);
}

START_TEST(tree_holds_every_element) {
    site *s = site_open();
    const cluster_tree *t = &s->tree;
    ck_assert_uint_eq(t->clusters[0].first, 0);
    ck_assert_uint_eq(t->clusters[0].last, s->m.n);
    for (size_t p = 0; p < t->n; p++) ck_assert_uint_eq(t->position[t->element[p]], p);
    for (size_t c = 0; c < t->n_clusters; c++) {
        const cluster *one = &t->clusters[c];
        ck_assert_uint_lt(one->first, one->last);
        if (cluster_is_leaf(one)) {
            ck_assert_uint_le(one->last - one->first, CLUSTER_LEAF);
        } else {
            ck_assert_uint_eq(t->clusters[one->child[0]].first, one->first);
            ck_assert_uint_eq(t->clusters[one->child[0]].last, t->clusters[one->child[1]].first);
            ck_assert_uint_eq(t->clusters[one->child[1]].last, one->last);
        }
        for (uint32_t p = one->first; p < one->last; p++) {
            const polygon *x = &s->polygons[t->element[p]];
            double turned = 0;
            for (int d = 0; d < 3; d++) {
                turned += x->normal[d] * one->normal[d];
                for (int k = 0; k < x->n; k++)
                    ck_assert(x->corner[k][d] >= one->low[d] && x->corner[k][d] <= one->high[d]);
            }
            if (one->spread < 3) ck_assert_double_ge(turned, cos(one->spread));
            if (one->plane) ck_assert_double_ge(turned, 1 - 1e-6);
        }
    }
    site_close(s);
}
END_TEST

/* Two elements face each other: a part of either lies in front of the other. */
static bool facing(const site *s, uint32_t i, uint32_t j) {
    polygon seen;
    polygon_in_front(&s->polygons[i], &s->polygons[j], &seen);
    if (seen.n == 0) return false;
    polygon_in_front(&s->polygons[j], &s->polygons[i], &seen);
    return seen.n > 0;
}

START_TEST(clusters_that_face_away_have_no_facing_pairs) {
    site *s = site_open();
    const cluster_tree *t = &s->tree;
    const double slack = visibility_rounding(s->v);
    size_t away = 0;
    for (size_t a = 0; a < t->n_clusters; a++)
        for (size_t b = 0; b < t->n_clusters; b++) {
            if (!cluster_faces_away(&t->clusters[a], &t->clusters[b], slack)) continue;
            away++;
            for (uint32_t p = t->clusters[a].first; p < t->clusters[a].last; p++)
                for (uint32_t q = t->clusters[b].first; q < t->clusters[b].last; q++)
                    ck_assert(!facing(s, t->element[p], t->element[q]));
        }
    ck_assert_uint_gt(away, t->n_clusters);
    site_close(s);
}
END_TEST

/* Links hold each pair at most once. Each pair without a link faces away or is hidden. Of a pair with an open
 * link none of many segments is blocked. */
START_TEST(links_are_right) {
    site *s = site_open();
    const size_t n = s->m.n;
    const cluster_tree *t = &s->tree;
    const cluster_link_options how = {.slack = visibility_rounding(s->v)};
    cluster_links l;
    lam_error error = {0};
    uint8_t *held = calloc(n * n, 1);
    ck_assert_ptr_nonnull(held);
    ck_assert_msg(cluster_links_find(&s->m, t, &s->occlusion, &how, &l, &error) == LAM_OK, "%s",
                  error.message);
    for (size_t k = 0; k < l.n; k++) {
        const cluster *a = &t->clusters[l.links[k].a], *b = &t->clusters[l.links[k].b];
        for (uint32_t p = a->first; p < a->last; p++)
            for (uint32_t q = b->first; q < b->last; q++) {
                if (a == b && q <= p) continue;
                ck_assert_uint_lt(p, q);
                ck_assert_uint_eq(held[p * n + q], 0);
                held[p * n + q] = l.links[k].open ? 2 : 1;
            }
    }
    size_t open = 0, missing = 0;
    double lost = 0;
    for (uint32_t p = 0; p < n; p++)
        for (uint32_t q = p + 1; q < n; q++) {
            const uint32_t i = t->element[p], j = t->element[q];
            double seen;
            const double g = pair_factor_exchange(&s->rules, &s->polygons[i], &s->polygons[j], 1e-4);
            if (g <= 0) continue;
            /* Many segments, independent of those that decided. */
            occlusion other = s->occlusion;
            for (other.seed = 100; held[p * n + q] != 1 && other.seed < 104; other.seed++) {
                occlusion_test(&other, NULL, i, j, g, &seen);
                if (held[p * n + q] == 2) ck_assert_double_eq_tol(seen, g, 1e-12 * g);
                if (held[p * n + q] == 0) lost += seen / s->m.area[i] / 4;
            }
            open += held[p * n + q] == 2;
            missing += held[p * n + q] == 0;
        }
    ck_assert_uint_gt(open, n);
    ck_assert_uint_gt(missing, 0);
    ck_assert_double_gt(l.hidden_pairs, 0);
    /* The factors lost in hidden links are, for each element, far below the accuracy. */
    ck_assert_double_le(lost / (double)n, .1 * s->occlusion.accuracy);
    cluster_links_free(&l);
    free(held);
    site_close(s);
}
END_TEST

/* With a threshold no pair above it is lost. */
START_TEST(threshold_keeps_what_is_above) {
    site *s = site_open();
    const size_t n = s->m.n;
    const cluster_tree *t = &s->tree;
    const double threshold = .02;
    const cluster_link_options how = {.threshold = threshold, .slack = visibility_rounding(s->v)};
    cluster_links l;
    lam_error error = {0};
    uint8_t *held = calloc(n * n, 1);
    ck_assert_ptr_nonnull(held);
    ck_assert_msg(cluster_links_find(&s->m, t, &s->occlusion, &how, &l, &error) == LAM_OK, "%s",
                  error.message);
    for (size_t k = 0; k < l.n; k++) {
        const cluster *a = &t->clusters[l.links[k].a], *b = &t->clusters[l.links[k].b];
        for (uint32_t p = a->first; p < a->last; p++)
            for (uint32_t q = b->first; q < b->last; q++) held[p * n + q] = 1;
    }
    size_t above = 0, held_pairs = 0;
    for (uint32_t p = 0; p < n; p++)
        for (uint32_t q = p + 1; q < n; q++) {
            const uint32_t i = t->element[p], j = t->element[q];
            const double g = pair_factor_exchange(&s->rules, &s->polygons[i], &s->polygons[j], 1e-4);
            double seen;
            held_pairs += held[p * n + q];
            if (2 * g / (s->m.area[i] + s->m.area[j]) < threshold) continue;
            above++;
            if (held[p * n + q] == 0)
                ck_assert_int_eq(occlusion_test(&s->occlusion, NULL, i, j, g, &seen), OCCLUSION_TOTAL);
        }
    ck_assert_uint_gt(above, 0);
    ck_assert_uint_lt(held_pairs, n * n / 4); /* and most pairs below it have no link */
    ck_assert_double_gt(l.distant_pairs, 0);
    cluster_links_free(&l);
    free(held);
    site_close(s);
}
END_TEST

/* pair_far_row agrees with pair_factor_exchange. */
START_TEST(far_rows_are_pair_exchange) {
    static const double tolerances[] = {1e-4, 1e-6};
    site *s = site_open();
    const size_t n = s->m.n;
    double *g = malloc((n + PAIR_FAR_LANES) * sizeof *g);
    ck_assert_ptr_nonnull(g);
    pair_far_table table;
    lam_error error = {0};
    const double tolerance = tolerances[_i];
    size_t close = 0, far = 0;
    ck_assert_msg(pair_far_table_build(s->polygons, &s->tree, &s->rules, tolerance, &table, &error) == LAM_OK,
                  "%s", error.message);
    for (size_t p = 0; p < n; p++) {
        pair_far_row(&table, p, 0, n, g);
        for (size_t q = 0; q < n; q++) {
            const uint32_t i = s->tree.element[p], j = s->tree.element[q];
            const double exact =
                i == j ? 0 : pair_factor_exchange(&s->rules, &s->polygons[i], &s->polygons[j], 1e-8);
            close += g[q] < 0;
            if (g[q] < 0) continue;
            far += g[q] > 0;
            ck_assert_double_eq_tol(g[q], exact, tolerance * exact + 1e-10 * s->m.area[i]);
        }
    }
    ck_assert_uint_gt(far, n);
    ck_assert_uint_gt(close, n);
    pair_far_table_free(&table);
    free(g);
    site_close(s);
}
END_TEST

/* An element that a shaft misses blocks no segment between its clusters. */
START_TEST(shafts_miss_only_what_is_not_between) {
    site *s = site_open();
    const cluster_tree *t = &s->tree;
    const double slack = visibility_rounding(s->v);
    uint64_t state = 7;
    size_t missed = 0, hit = 0;
    for (int trial = 0; trial < 4000; trial++) {
        uint32_t pick[3];
        double u[4];
        for (int k = 0; k < 3; k++)
            pick[k] = (uint32_t)((random_lcg(&state) >> 33) % (k < 2 ? t->n_clusters : s->m.n));
        for (int k = 0; k < 4; k++) u[k] = random_lcg_unit(&state);
        const cluster *a = &t->clusters[pick[0]], *b = &t->clusters[pick[1]];
        shaft box;
        cluster_shaft_init(&box, a, b, slack);
        const bool misses = shaft_misses_element(&box, &s->m, pick[2]);
        missed += misses;
        hit += !misses;
        if (!misses) continue;
        /* Segments between points of their elements in front of each other, against the element's plane. */
        const polygon *x = &s->polygons[pick[2]];
        for (uint32_t p = a->first; p < a->last; p++)
            for (uint32_t q = b->first; q < b->last; q++) {
                const polygon *from = &s->polygons[t->element[p]], *to = &s->polygons[t->element[q]];
                double points[2][3], height[2] = {0}, at[3], leaving = 0, arriving = 0;
                if (t->element[p] == pick[2] || t->element[q] == pick[2]) continue;
                polygon_point(from, u[0], u[1], points[0]);
                polygon_point(to, u[2], u[3], points[1]);
                for (int d = 0; d < 3; d++) {
                    leaving += (points[1][d] - points[0][d]) * from->normal[d];
                    arriving -= (points[1][d] - points[0][d]) * to->normal[d];
                    for (int e = 0; e < 2; e++) height[e] += (points[e][d] - x->centre[d]) * x->normal[d];
                }
                if (leaving <= 1e-9 || arriving <= 1e-9 || height[0] * height[1] >= 0) continue;
                const double along = height[0] / (height[0] - height[1]);
                bool within = true;
                for (int d = 0; d < 3; d++) at[d] = points[0][d] + along * (points[1][d] - points[0][d]);
                for (int c = 0; c < x->n; c++) {
                    const double *one = x->corner[c], *two = x->corner[(c + 1) % x->n];
                    double side = 0;
                    for (int d = 0; d < 3; d++) {
                        const int e = (d + 1) % 3, f = (d + 2) % 3;
                        side += x->normal[d] *
                                ((two[e] - one[e]) * (at[f] - one[f]) - (two[f] - one[f]) * (at[e] - one[e]));
                    }
                    within = within && side > 1e-6;
                }
                ck_assert(!within || fabs(height[0]) < 1e-6 || fabs(height[1]) < 1e-6);
            }
    }
    ck_assert_uint_gt(missed, 100);
    ck_assert_uint_gt(hit, 100);
    site_close(s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("clusters");
    TCase *cases = tcase_create("clusters");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, tree_holds_every_element);
    tcase_add_test(cases, clusters_that_face_away_have_no_facing_pairs);
    tcase_add_test(cases, links_are_right);
    tcase_add_test(cases, threshold_keeps_what_is_above);
    tcase_add_loop_test(cases, far_rows_are_pair_exchange, 0, 2);
    tcase_add_test(cases, shafts_miss_only_what_is_not_between);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
