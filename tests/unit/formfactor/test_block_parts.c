/* The parts of form factors by blocks, one by one: the fit of the visible share, the numbers of a block, and
 * the proof that one piece hides two clusters from each other. */
#include "solver/formfactor/blocks/block_numbers.h"
#include "solver/formfactor/blocks/occluders.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/blocks.h"
#include "support/dense.h"
#include "support/plates.h"

static lam_error error;

/* A mesh with all that blocks are found from. */
typedef struct parts {
    mesh m;
    plane_tree tree;
    block_factors blocks;
    flat_clusters flat;
    visibility *v;
    occluders pieces;
} parts;

static void parts_make(parts *p) {
    double(*centre)[3] = test_allocate(p->m.n, sizeof *centre);
    for (size_t i = 0; i < p->m.n; i++) mesh_centroid(&p->m, i, centre[i]);
    ck_ok(form_factors_tree(&p->m, &p->tree, &error));
    ck_ok(block_factors_begin(&p->tree, p->m.area, (const double(*)[3])centre, &p->blocks, &error));
    ck_ok(flat_clusters_make(&p->m, &p->tree, &p->blocks, &p->flat, &error));
    ck_ok(visibility_create(&p->m, &p->v, &error));
    ck_ok(occluders_make(&p->m, visibility_facets(p->v), &p->pieces, &error));
    free(centre);
}

static void parts_free(parts *p) {
    occluders_free(&p->pieces);
    visibility_destroy(p->v);
    flat_clusters_free(&p->flat);
    block_factors_free(&p->blocks);
    plane_tree_free(&p->tree);
    mesh_free(&p->m);
}

static uint32_t node_of(const parts *p, size_t element) {
    size_t at = 0;
    while (p->tree.order[at] != element) at++;
    return (uint32_t)(p->tree.n_clusters + at);
}

/* The largest cluster in the plane of an element. */
static uint32_t plane_of(const parts *p, size_t element) {
    uint32_t t = node_of(p, element), above = p->blocks.nodes[t].parent;
    for (; above != BLOCK_NO_NODE && p->tree.clusters[above].frame != PLANE_ABOVE;
         above = p->blocks.nodes[t].parent)
        t = above;
    return t;
}

/* Places at all corners and centres of both rectangles have a mean square of 2/3 .64 on each axis, and a
 * ridge of .02 holds slopes back by .02 over that. */
START_TEST(a_linear_share_is_fitted) {
    static const double of[SHARE_TERMS] = {.5, .1, -.07, .04, .02}, places[3] = {-.8, 0, .8};
    const double square = 2. / 3 * .64, held = square / (square + .02);
    seen_segment s[81];
    for (int k = 0; k < 81; k++) {
        int rest = k;
        s[k].seen = of[0];
        for (int d = 0; d < 4; d++, rest /= 3) {
            s[k].place[d] = places[rest % 3];
            s[k].seen += of[1 + d] * s[k].place[d];
        }
    }
    const visible_share share = visible_share_fit(s, 81);
    ck_assert_double_eq_tol(share.of[0], of[0], 1e-9);
    for (int d = 1; d < SHARE_TERMS; d++) ck_assert_double_eq_tol(share.of[d], held * of[d], 1e-9);
}
END_TEST

/* Plates at a distance of four have nearly the same kernel everywhere, within a tenth: a block with a share
 * over one without is the share, at either end. */
START_TEST(a_share_goes_to_its_own_ends) {
    const visible_share share = {.of = {.5, .1, -.07, .04, .02}};
    const mesh_refinement how = {.subdivide_levels = 2};
    parts p = {.m = plates(NULL)};
    cluster_block open, part;
    for (size_t v = 0; v < p.m.n_vertices; v++) p.m.vertices[v][2] *= 4;
    ck_ok(mesh_measure(&p.m, &error));
    ck_ok(mesh_refine(&p.m, &how, &error));
    parts_make(&p);
    open = part = (cluster_block){.a = plane_of(&p, 0), .b = plane_of(&p, p.m.n - 1)};
    block_numbers_set(&p.flat, NULL, &open);
    block_numbers_set(&p.flat, &share, &part);
    const double mean = (double)open.L[0][0];
    ck_assert_double_eq_tol(mean, 1 / (16 * M_PI), .05 / (16 * M_PI));
    ck_assert_double_eq_tol((double)part.L[0][0] / mean, share.of[0], 1e-3);
    for (int d = 0; d < 2; d++) {
        ck_assert_double_eq_tol((double)part.L[1 + d][0] / mean, share.of[1 + d], 5e-3);
        ck_assert_double_eq_tol((double)part.L[0][1 + d] / mean, share.of[3 + d], 5e-3);
    }
    parts_free(&p);
}
END_TEST

/* The mean over a rectangle of cos cos' / (pi r^2) from a point with a normal. */
static double kernel_to(const flat_clusters *f, const double x[3], const float normal[3], uint32_t b) {
    enum { SIDE = 40 };
    double sum = 0;
    for (int k = 0; k < SIDE * SIDE; k++) {
        double y[3], r2 = 0, leaving = 0, arriving = 0;
        flat_cluster_point(f, b, (2 * (k % SIDE) + 1.) / SIDE - 1, (2 * (k / SIDE) + 1.) / SIDE - 1, y);
        for (int d = 0; d < 3; d++) {
            const double r = y[d] - x[d];
            r2 += r * r;
            leaving += r * (double)normal[d];
            arriving -= r * f->planes[f->of[b].plane].normal[d];
        }
        sum += leaving * arriving / (M_PI * r2 * r2) / (SIDE * SIDE);
    }
    return sum;
}

/* A triangle at a right angle to a plate, which sees the more of it the higher it is: the number of an
 * element is that at its centroid, which is not the centre of its rectangle. Lines miss the kernel by some 1
 * %. */
START_TEST(a_triangle_is_taken_at_its_centroid) {
    static const double plate[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    static const double wall[4][3] = {{6, 0, .5}, {6, 0, 1.5}, {6, 1, .5}, {6, 1, .5}};
    for (int turned = 0; turned < 2; turned++) {
        parts p = {.m = {.n = 0}};
        mesh_add_quad(&p.m, plate);
        mesh_add_quad(&p.m, wall);
        p.m.elements[1][3] = UINT32_MAX;
        mesh_finish(&p.m, .5f);
        parts_make(&p);
        double x[3];
        mesh_centroid(&p.m, 1, x);
        const uint32_t triangle = node_of(&p, 1), quad = plane_of(&p, 0);
        cluster_block block =
            turned ? (cluster_block){.a = quad, .b = triangle} : (cluster_block){.a = triangle, .b = quad};
        block_numbers_set(&p.flat, NULL, &block);
        const double truth = kernel_to(&p.flat, x, p.m.normal[1], quad);
        ck_assert_double_gt(truth, 0);
        ck_assert_double_eq_tol((double)block.L[0][0], truth, .02 * truth);
        const double *centre = p.flat.of[triangle].centre; /* a wrong place */
        ck_assert_double_gt(fabs(kernel_to(&p.flat, centre, p.m.normal[1], quad) - truth), .1 * truth);
        parts_free(&p);
    }
}
END_TEST

/* A triangle between unit squares that covers all of what they see of each other but one of four corners: 15
 * of the 16 segments between their corners cross it. It has the points from whose opposite corner the
 * distances along both axes add up to less than reach. */
static mesh plates_but_a_corner(double reach, int which) {
    double corner[4][3] = {
        {-.4, -.4, .5}, {reach + .4, -.4, .5}, {-.4, reach + .4, .5}, {-.4, reach + .4, .5}};
    const mesh_refinement how = {.subdivide_levels = 3};
    mesh open = plates(NULL), m = {0};
    for (int k = 0; k < 4; k++)
        for (int d = 0; d < 2; d++)
            if ((which >> d & 1) != 0) corner[k][d] = 1 - corner[k][d];
    for (size_t i = 0; i < open.n; i++) {
        double own[4][3];
        for (int k = 0; k < 4; k++) memcpy(own[k], open.vertices[open.elements[i][k]], sizeof own[k]);
        mesh_add_quad(&m, (const double(*)[3])own);
    }
    mesh_add_quad(&m, corner);
    m.elements[m.n - 1][3] = UINT32_MAX;
    mesh_finish(&m, .5f);
    ck_ok(mesh_refine(&m, &how, &error));
    mesh_free(&open);
    return m;
}

START_TEST(one_piece_hides_what_it_covers_entirely) {
    for (int k = 0; k < 8; k++) {
        const bool hidden = k >= 4;
        parts p = {.m = plates_but_a_corner(hidden ? 2.1 : 1.9, k % 4)};
        parts_make(&p);
        const uint32_t low = plane_of(&p, 0), high = plane_of(&p, 64);
        candidates among;
        occluders_between(&p.pieces, &p.flat, low, high, NULL, &among);
        ck_assert_int_gt(among.count, 0);
        ck_assert(occluders_hide(&p.pieces, &p.flat, low, high, &among) == hidden);
        parts_free(&p);
    }
}
END_TEST

/* Pairs of points whose distances from the corner, along both axes, add up to less than .2: a simplex of
 * .2^4/24, with a kernel of 1/pi less some per cent. */
START_TEST(light_passes_a_corner) {
    mesh m = plates_but_a_corner(1.9, 0);
    plane_tree tree;
    block_factors f = blocks_of(&m, &tree, 1e-6, 1e-7, NULL);
    const double truth = pow(.2, 4) / 24 / M_PI;
    ck_assert_double_eq_tol(blocks_exchange(&m, &f, 0, 64, 64, 64), truth, .4 * truth);
    block_factors_free(&f);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("parts of blocks");
    TCase *tests = tcase_create("parts");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, a_linear_share_is_fitted);
    tcase_add_test(tests, a_share_goes_to_its_own_ends);
    tcase_add_test(tests, a_triangle_is_taken_at_its_centroid);
    tcase_add_test(tests, one_piece_hides_what_it_covers_entirely);
    tcase_add_test(tests, light_passes_a_corner);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
