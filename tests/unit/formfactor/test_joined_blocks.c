/* Blocks of clusters that join several planes, where nothing hides anything, beside all pairs one by one. */
#include "solver/formfactor/blocks/joined_kernel.h"
#include "solver/formfactor/blocks/unhidden.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/sight/open_scene.h"
#include "solver/formfactor/source.h"
#include "support/blocks.h"
#include "support/bowl.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/scene.h"

#include <omp.h>

static lam_error error;

/* Half a sphere, a shallow bowl and a deep one, which has a lid: a plane of many elements. */
static const double depths[] = {1, .4, 2};
enum { DEPTHS = sizeof depths / sizeof *depths, LID = 2, RINGS = 12, SECTORS = 26 };
/* A sanitizer watches the same code in each open bowl: one of them is enough, and the one with a lid. */
#ifdef LAMBERT_FEW_CASES
enum { FIRST_DEPTH = 1 };
#else
enum { FIRST_DEPTH = 0 };
#endif

/* The kernel of a block of a 2000th of all elements varies by this share of itself, as all pairs or 16 of
 * them tell. */
static double spread_of(double open) {
    return 5 * sqrt(open);
}

/* Exchange areas of all pairs, [n][n], one by one. */
static double *all_pairs(const mesh *m) {
    double *G = test_allocate(m->n * m->n, sizeof *G);
    pair_factor_rules rules;
    pair_factor_rules_init(&rules);
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t i = 0; i < m->n; i++) {
        G[i * m->n + i] = 0;
        for (size_t j = i + 1; j < m->n; j++) {
            polygon a, b;
            polygon_of_element(m, i, &a);
            polygon_of_element(m, j, &b);
            G[i * m->n + j] = G[j * m->n + i] = pair_factor_exchange(&rules, &a, &b, 1e-8);
        }
    }
    return G;
}

static bool is_unhidden(const mesh *m) {
    plane_tree tree;
    bool unhidden = false;
    ck_ok(mesh_is_unhidden(m, &unhidden, NULL, &error));
    /* A tree without large planes knows it. */
    ck_ok(form_factors_tree(m, &tree, &error));
    if (tree.view != PLANE_VIEW_UNKNOWN) ck_assert_int_eq(tree.view == PLANE_VIEW_UNHIDDEN, unhidden);
    ck_assert_int_eq(tree.view == PLANE_VIEW_UNKNOWN, blocks_are_planar(&tree));
    plane_tree_free(&tree);
    return unhidden;
}

/* Among normals of all directions, which make one chain of small steps, the halves of each trapezoid are
 * still found to lie in one plane, but for some that rounding keeps apart. No plane holds normals that differ
 * by more than twice what is allowed from their mean, 4e-3 in each coordinate. */
START_TEST(planes_are_found_among_many_directions) {
    enum { MANY_RINGS = 70, MANY_SECTORS = 141 };
    mesh m = bowl(MANY_RINGS, MANY_SECTORS, 1, false);
    plane_tree tree;
    ck_ok(form_factors_tree(&m, &tree, &error));
    ck_assert_uint_le(tree.n_frames, (size_t)(1.02 * MANY_RINGS * MANY_SECTORS));
    ck_assert_uint_ge(tree.n_frames, (size_t)(.98 * MANY_RINGS * MANY_SECTORS));
    for (size_t t = 0; t < tree.n_clusters; t++) {
        const plane_cluster *c = &tree.clusters[t];
        if (c->frame == PLANE_ABOVE) continue;
        const float *first = m.normal[tree.order[c->begin]];
        for (size_t p = c->begin; p < c->end; p++)
            for (int d = 0; d < 3; d++)
                ck_assert_double_le(fabs((double)(m.normal[tree.order[p]][d] - first[d])), 8e-3);
    }
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

START_TEST(what_hides_nothing_is_proven) {
    static const generate_options boxes = {
        .kind = "cornell", .elements = 500, .closed = true, .reflectance = .5};
    const double size[3] = {1, 2, 3};
    for (int k = 0; k < DEPTHS; k++) {
        mesh m = bowl(RINGS, SECTORS, depths[k], false);
        ck_assert(is_unhidden(&m));
        /* One vertex moved inwards by a twentieth folds the surface to the other side. */
        m.vertices[1 + 6 * SECTORS][0] *= .95;
        ck_ok(mesh_measure(&m, &error));
        ck_assert(!is_unhidden(&m));
        mesh_free(&m);
    }
    mesh box = box_mesh(size, 3, .5f), blocks = generate_good(&boxes), closed = bowl(RINGS, SECTORS, 2, true);
    ck_assert(is_unhidden(&box));
    ck_assert(is_unhidden(&closed));
    ck_assert(!is_unhidden(&blocks));
    for (size_t i = 0; i < closed.n; i++) { /* seen from outside */
        const uint32_t first = closed.elements[i][0];
        closed.elements[i][0] = closed.elements[i][1];
        closed.elements[i][1] = first;
    }
    ck_ok(mesh_measure(&closed, &error));
    ck_assert(!is_unhidden(&closed));
    mesh_free(&box);
    mesh_free(&blocks);
    mesh_free(&closed);
}
END_TEST

/* In a closed surface a ray from an element crosses as many fronts as backs beyond the first front, so that
 * the unoccluded factors of a row sum to 1 and all that is hidden of it. */
static void find_hidden(const mesh *m, double *most, double *mean) {
    double *G = all_pairs(m), area = 0;
    *most = *mean = 0;
    for (size_t i = 0; i < m->n; i++) {
        double sum = 0;
        for (size_t j = 0; j < m->n; j++) sum += G[i * m->n + j];
        *most = fmax(*most, sum / m->area[i] - 1);
        *mean += sum - m->area[i];
        area += m->area[i];
    }
    *mean /= area;
    free(G);
}

/* A vertex moved inwards makes a dent, and so does rounding to the six digits of a file. It counts as nothing
 * exactly where the light that it hides is within the bounds. Exchange areas are good to 1e-3 of themselves
 * there, and to 1e-8 here. */
START_TEST(dents_count_where_they_hide_light) {
    enum { ROUNDED = 0, MANY = 2 }; /* MANY: .99 for every other vertex of every other ring */
    static const double moved[] = {ROUNDED, MANY, 1, .9995, .999, .998, .995, .99, .98, .97, .96, .95};
    size_t passed = 0, refused = 0;
    for (size_t k = 0; k < sizeof moved / sizeof *moved; k++) {
        mesh m = bowl(RINGS, SECTORS, depths[LID], true);
        double most, mean, stated = -1;
        bool unhidden;
        if (moved[k] >= MANY)
            for (size_t v = 0; v < 4 * SECTORS; v++) {
                if (v / SECTORS % 2 == 0 && v % 2 == 0)
                    for (int d = 0; d < 2; d++) m.vertices[1 + 4 * SECTORS + v][d] *= .99;
            }
        else if (moved[k] > ROUNDED)
            m.vertices[1 + 6 * SECTORS][0] *= moved[k];
        else
            for (size_t v = 0; v < m.n_vertices; v++)
                for (int d = 0; d < 3; d++) m.vertices[v][d] = round(1e6 * m.vertices[v][d]) / 1e6;
        ck_ok(mesh_measure(&m, &error));
        find_hidden(&m, &most, &mean);
        ck_ok(mesh_is_unhidden(&m, &unhidden, &stated, &error));
        /* No case is so near to a bound that 1e-3 of it matters. */
        ck_assert_double_gt(fabs(most / OPEN_SCENE_ROW_MOST - 1), 5e-3);
        ck_assert_double_gt(fabs(mean / OPEN_SCENE_MEAN_MOST - 1), 5e-3);
        ck_assert_int_eq(unhidden, most <= OPEN_SCENE_ROW_MOST && mean <= OPEN_SCENE_MEAN_MOST);
        if (unhidden) ck_assert_double_eq_tol(stated, mean, 1e-3 * mean + 1e-7);
        if (!unhidden) ck_assert_double_eq(stated, -1);
        if (moved[k] >= MANY)
            ck_assert_msg(most < OPEN_SCENE_ROW_MOST && mean > OPEN_SCENE_MEAN_MOST, "%g %g", most, mean);
        passed += unhidden && mean > 1e-6;
        refused += !unhidden;
        mesh_free(&m);
    }
    ck_assert_uint_gt(passed, 0);
    ck_assert_uint_gt(refused, 0);
}
END_TEST

/* Every pair of elements of two planes is in one block, or faces away, once; and the number of each even
 * block is the mean of the kernel between its clusters. The spread over centroids, as all or 16 pairs
 * tell, is at most that of a block of its size; over points it may be twice as large, where clusters are as
 * near as elements are wide, and the mean of 16 of them is then off by half of it in standard deviation. In
 * thousands of blocks none is off by ten times that. */
START_TEST(even_blocks_are_means_of_all_pairs) {
    mesh m = bowl(RINGS, SECTORS, depths[_i], _i == LID);
    plane_tree tree;
    block_report found;
    block_factors f = blocks_of(&m, &tree, blocks_open, blocks_shadow, &found);
    double *G = all_pairs(&m), in_blocks = 0, across = 0, off = 0, all = 0, squares = 0, allowed = 0;
    uint8_t *seen = test_allocate(m.n * m.n, 1);
    uint32_t *plane = test_allocate(m.n, sizeof *plane);
    memset(seen, 0, m.n * m.n);
    for (size_t t = 0; t < tree.n_clusters; t++)
        for (size_t p = tree.clusters[t].begin; tree.clusters[t].leaf && p < tree.clusters[t].end; p++)
            plane[tree.order[p]] = tree.clusters[t].frame;
    size_t even = 0;
    for (size_t k = 0; k < f.n_blocks; k++) {
        const cluster_block *block = &f.blocks[k];
        const block_node *a = &f.nodes[block->a], *b = &f.nodes[block->b];
        double exchange = 0, areas[2] = {0, 0};
        for (size_t p = a->begin; p < a->end; p++) areas[0] += f.area[p];
        for (size_t q = b->begin; q < b->end; q++) areas[1] += f.area[q];
        for (size_t p = a->begin; p < a->end; p++)
            for (size_t q = b->begin; q < b->end; q++) {
                const size_t i = f.order[p], j = f.order[q];
                ck_assert(seen[i * m.n + j] == 0 && seen[j * m.n + i] == 0);
                ck_assert_uint_ne(plane[i], plane[j]);
                seen[i * m.n + j] = 1;
                exchange += G[i * m.n + j];
                in_blocks++;
            }
        const bool above[2] = {block->a < tree.n_clusters && tree.clusters[block->a].frame == PLANE_ABOVE,
                               block->b < tree.n_clusters && tree.clusters[block->b].frame == PLANE_ABOVE};
        if (!above[0] && !above[1]) continue;
        const double mine = (double)block->L[0][0] * areas[0] * areas[1];
        const double share = sqrt((double)(a->end - a->begin) * (double)(b->end - b->begin)) / (double)m.n;
        const double spread = spread_of(blocks_open) * fmin(2, sqrt(1 / (2000 * share)));
        ck_assert_double_eq_tol(mine, exchange, 5 * spread * exchange);
        squares += pow((mine / exchange - 1) / spread, 2);
        allowed += pow(.5 * spread * exchange, 2);
        off += mine - exchange;
        all += exchange;
        even++;
    }
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = i + 1; j < m.n; j++) across += plane[i] != plane[j];
    ck_assert(found.joined);
    ck_assert_double_eq(in_blocks + found.elements_away, across);
    ck_assert_double_eq((double)even, found.even);
    ck_assert_uint_gt(even, 1000);
    ck_assert_double_le(sqrt(squares / (double)even), .5);
    /* Independent errors of half a spread each, three standard deviations; and the kernel of centroids four
     * times the size of elements apart is off by less than 1/(12 16). */
    ck_assert_double_le(fabs(off) / all, 3 * sqrt(allowed) / all + 1. / 192);
    free(G);
    free(seen);
    free(plane);
    block_factors_free(&f);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

/* |F~ x - F x| / |F x|, by area. */
static double product_error(const mesh *m, const block_factors *f, const double *G, const double *x) {
    double *y = test_allocate(m->n, sizeof *y), off = 0, all = 0;
    blocks_multiply(f, x, y);
    for (size_t i = 0; i < m->n; i++) {
        double sum = 0;
        for (size_t j = 0; j < m->n; j++) sum += G[i * m->n + j] * x[j] / m->area[i];
        off += m->area[i] * (y[i] - sum) * (y[i] - sum);
        all += m->area[i] * sum * sum;
    }
    free(y);
    return sqrt(off / all);
}

/* The light of single elements, of a lamp and of all: no part of it is off by more than the spread of a
 * block, and a finer bound has a smaller error. */
START_TEST(products_are_those_of_all_pairs) {
    enum { SINGLES = 24, LAMP = 20, WAYS = 3 };
    mesh m = bowl(RINGS, SECTORS, depths[_i], _i == LID);
    double *G = all_pairs(&m), *x = test_allocate(m.n, sizeof *x), errors[2][WAYS] = {{0}};
    for (int fine = 0; fine < 2; fine++) {
        const double open = fine ? blocks_open / 16 : blocks_open;
        plane_tree tree;
        block_factors f = blocks_of(&m, &tree, open, 1, NULL);
        for (size_t k = 0; k < SINGLES; k++) {
            memset(x, 0, m.n * sizeof *x);
            x[k * m.n / SINGLES] = 1;
            errors[fine][0] += product_error(&m, &f, G, x) / SINGLES;
        }
        memset(x, 0, m.n * sizeof *x);
        for (size_t k = 0; k < LAMP; k++) x[m.n / 2 + k] = 1;
        errors[fine][1] = product_error(&m, &f, G, x);
        for (size_t k = 0; k < m.n; k++) x[k] = 1;
        errors[fine][2] = product_error(&m, &f, G, x);
        for (int way = 0; way < WAYS; way++) ck_assert_double_le(errors[fine][way], spread_of(open));
        block_factors_free(&f);
        plane_tree_free(&tree);
    }
    for (int way = 0; way < WAYS; way++) ck_assert_double_lt(errors[1][way], .5 * errors[0][way]);
    free(G);
    free(x);
    mesh_free(&m);
}
END_TEST

/* Against all pairs: at the centroid in place of over the element, which for twice as many rings and sectors
 * makes a fourth of the error. */
START_TEST(row_sums_are_those_of_all_pairs) {
    double errors[2] = {0, 0};
    for (int fine = 0; fine < 2; fine++) {
        mesh m = bowl(fine ? 16 : 8, fine ? 32 : 16, depths[_i], false);
        double *G = all_pairs(&m), *sums = test_allocate(m.n, sizeof *sums), all = 0;
        bool known = false;
        ck_ok(unhidden_row_sums(&m, &known, sums, &error));
        ck_assert(known);
        for (size_t i = 0; i < m.n; i++) {
            double sum = 0;
            for (size_t j = 0; j < m.n; j++) sum += G[i * m.n + j] / m.area[i];
            errors[fine] += m.area[i] * pow(sums[i] - sum, 2);
            all += m.area[i] * sum * sum;
        }
        errors[fine] = sqrt(errors[fine] / all);
        free(G);
        free(sums);
        mesh_free(&m);
    }
    ck_assert_double_lt(errors[0], .02);
    ck_assert_double_lt(errors[1], .4 * errors[0]);
}
END_TEST

/* In a box every sum is 1, whether its cells share vertices or have edges of their own, which cancel. */
START_TEST(row_sums_of_a_closed_scene_are_1) {
    const double size[3] = {1, 2, 3};
    mesh closed[2] = {box_mesh(size, 4, .5f), bowl(RINGS, SECTORS, .4, true)};
    for (int k = 0; k < 2; k++) {
        double *sums = test_allocate(closed[k].n, sizeof *sums);
        bool known = false;
        ck_ok(unhidden_row_sums(&closed[k], &known, sums, &error));
        ck_assert(known);
        for (size_t i = 0; i < closed[k].n; i++) ck_assert_double_eq_tol(sums[i], 1, 1e-9);
        free(sums);
        mesh_free(&closed[k]);
    }
    /* 6 48^2 cells have more edges than are worth it. */
    mesh fine = box_mesh(size, 48, .5f);
    double none = -1;
    bool known = true;
    ck_ok(unhidden_row_sums(&fine, &known, &none, &error));
    ck_assert(!known && none == -1);
    mesh_free(&fine);
}
END_TEST

/* Form factors have the row sums of the boundary to 2e-8, those of a shallow bowl far below 1; the bits do
 * not depend on the number of threads. */
START_TEST(rows_have_the_sums_of_the_boundary) {
    mesh m = bowl(RINGS, SECTORS, depths[_i], _i == LID);
    const form_factor_options how = {
        .recipe = {.source = &source_blocks, .rays = 8, .accuracy = blocks_open, .seed = 1}, .stage = ""};
    const int most = omp_get_max_threads();
    uint32_t *order = test_allocate(m.n, sizeof *order);
    double *sums = test_allocate(m.n, sizeof *sums), *product[2], *ones = test_allocate(m.n, sizeof *ones);
    bool known;
    plane_tree tree;
    ck_ok(mesh_z_order(&m, order, &error));
    ck_ok(form_factors_tree(&m, &tree, &error));
    ck_ok(unhidden_row_sums(&m, &known, sums, &error));
    for (size_t i = 0; i < m.n; i++) ones[i] = 1;
    for (int k = 0; k < 2; k++) {
        form_factors f;
        block_factors blocks;
        omp_set_num_threads(k == 0 ? 1 : 4);
        ck_ok(form_factors_make_blocks(&m, order, &tree, false, &how, &f, &blocks, &error));
        product[k] = test_allocate(m.n, sizeof **product);
        blocks_multiply(&blocks, ones, product[k]);
        for (size_t i = 0; i < m.n; i++) {
            ck_assert_double_eq_tol(product[k][i], sums[i], 1e-7 * sums[i]);
            ck_assert_double_eq_tol(f.row_sums[i], product[k][i], 1e-12);
        }
        form_factors_free(&f);
        block_factors_free(&blocks);
    }
    omp_set_num_threads(most);
    ck_assert(memcmp(product[0], product[1], m.n * sizeof *ones) == 0);
    free(product[0]);
    free(product[1]);
    free(order);
    free(sums);
    free(ones);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

/* Where nothing hides anything no pair one by one is looked at: each is certain, and as exact as it is
 * computed, also between elements of one leaf, and beside a vertex that hides something none is. */
START_TEST(pairs_of_an_open_scene_are_certain) {
    mesh m = bowl(RINGS, SECTORS, depths[_i], _i == LID);
    const pairs_options options = {
        .tolerance = 1e-8, .accuracy = 1e-4, .segments = 8, .segments_most = 1e9, .seed = 1};
    double *G = all_pairs(&m), facing = 0;
    visibility *v = NULL;
    csr found = {.n = 0};
    pairs_report report;
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(pairs_exchange(&m, v, &options, &found, &report, NULL, &error));
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = i + 1; j < m.n; j++) {
            const double exact = G[i * m.n + j];
            facing += exact > 0;
            /* The tolerance of both, and single precision. */
            ck_assert_double_eq_tol(csr_entry(&found, i, j), exact, (2e-8 + 1.2e-7) * exact + 1e-16);
        }
    ck_assert_double_gt(report.facing, .9 * facing);
    ck_assert_double_eq(report.certain, report.facing);
    csr_free(&found);
    visibility_destroy(v);
    /* One vertex moved inwards folds the surface. */
    m.vertices[1 + 6 * SECTORS][0] *= .99;
    ck_ok(mesh_measure(&m, &error));
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(pairs_exchange(&m, v, &options, &found, &report, NULL, &error));
    ck_assert_double_lt(report.certain, report.facing);
    csr_free(&found);
    visibility_destroy(v);
    free(G);
    mesh_free(&m);
}
END_TEST

/* The sphere of a cluster of several planes is that around the box of all corners of its elements. */
START_TEST(spheres_hold_their_elements) {
    mesh m = bowl(RINGS, SECTORS, 1, false);
    plane_tree tree;
    block_factors nodes;
    flat_clusters flat;
    visibility *v;
    size_t tried = 0;
    double(*centre)[3] = test_allocate(m.n, sizeof *centre);
    for (size_t i = 0; i < m.n; i++) mesh_centroid(&m, i, centre[i]);
    ck_ok(form_factors_tree(&m, &tree, &error));
    ck_ok(block_factors_begin(&tree, m.area, (const double(*)[3])centre, &nodes, &error));
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(flat_clusters_make(&m, v, &tree, &nodes, &flat, &error));
    visibility_destroy(v);
    for (size_t t = 0; t < tree.n_clusters; t++) {
        const plane_cluster *c = &tree.clusters[t];
        double low[3] = {9, 9, 9}, high[3] = {-9, -9, -9}, square = 0;
        if (c->frame != PLANE_ABOVE) continue;
        for (size_t p = c->begin; p < c->end; p++)
            for (size_t k = 0; k < mesh_corners(&m, tree.order[p]); k++)
                for (int d = 0; d < 3; d++) {
                    const double at = m.vertices[m.elements[tree.order[p]][k]][d];
                    low[d] = fmin(low[d], at);
                    high[d] = fmax(high[d], at);
                }
        for (int d = 0; d < 3; d++) {
            ck_assert_double_le(fabs(flat.of[t].centre[d] - (low[d] + high[d]) / 2), 1e-12);
            square += (high[d] - low[d]) * (high[d] - low[d]) / 4;
        }
        ck_assert_double_le(fabs(flat.of[t].radius - sqrt(square)), 1e-12);
        tried++;
    }
    ck_assert_uint_gt(tried, m.n / 8);
    flat_clusters_free(&flat);
    block_factors_free(&nodes);
    plane_tree_free(&tree);
    mesh_free(&m);
    free(centre);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("joined blocks");
    TCase *tests = tcase_create("joined");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, planes_are_found_among_many_directions);
    tcase_add_test(tests, what_hides_nothing_is_proven);
    tcase_add_test(tests, dents_count_where_they_hide_light);
    tcase_add_test(tests, spheres_hold_their_elements);
    tcase_add_loop_test(tests, even_blocks_are_means_of_all_pairs, FIRST_DEPTH, DEPTHS);
    tcase_add_loop_test(tests, products_are_those_of_all_pairs, FIRST_DEPTH, DEPTHS);
    tcase_add_loop_test(tests, row_sums_are_those_of_all_pairs, FIRST_DEPTH, DEPTHS);
    tcase_add_loop_test(tests, pairs_of_an_open_scene_are_certain, FIRST_DEPTH, DEPTHS);
    tcase_add_test(tests, row_sums_of_a_closed_scene_are_1);
    tcase_add_loop_test(tests, rows_have_the_sums_of_the_boundary, FIRST_DEPTH, DEPTHS);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
