/* The parts of form factors by blocks, one by one: the fit of the visible share, the numbers of a block, the
 * pieces that may stand between two clusters, and the proof that one of them hides these from each other. */
#include "solver/base/random.h"
#include "solver/formfactor/blocks/block_numbers.h"
#include "solver/formfactor/blocks/candidates.h"
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
    ck_ok(visibility_create(&p->m, &p->v, &error));
    ck_ok(flat_clusters_make(&p->m, p->v, &p->tree, &p->blocks, &p->flat, &error));
    ck_ok(occluders_make(&p->m, visibility_facets(p->v), p->flat.slack, &p->pieces, &error));
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
        flat_pair at;
        flat_clusters_pair(&p.flat, low, high, &at);
        candidates_between(&p.pieces, &p.flat, low, high, &at, NULL, &among);
        ck_assert_int_gt(among.count, 0);
        ck_assert(among.hidden == hidden);
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

/* A random rectangle about a point, with sides of up to twice the size and a random normal. */
static void add_random_rectangle(mesh *m, const double at[3], double size, uint64_t *state) {
    double x[4][3], side[2][3], normal[3], length[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        for (int d = 0; d < 3; d++) side[k][d] = random_between(state, -1, 1);
    for (int d = 0; d < 3; d++) length[0] += side[0][d] * side[0][d];
    for (int d = 0; d < 3; d++) side[0][d] /= sqrt(length[0]);
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, g = (d + 2) % 3;
        normal[d] = side[0][e] * side[1][g] - side[0][g] * side[1][e];
    }
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, g = (d + 2) % 3;
        side[1][d] = normal[e] * side[0][g] - normal[g] * side[0][e];
        length[1] += side[1][d] * side[1][d];
    }
    for (int d = 0; d < 3; d++) side[1][d] /= sqrt(length[1]);
    const double half[2] = {size * random_between(state, .2, 1), size * random_between(state, .2, 1)};
    for (int c = 0; c < 4; c++)
        for (int d = 0; d < 3; d++)
            x[c][d] = at[d] + (c == 0 || c == 3 ? -1 : 1) * half[0] * side[0][d] +
                      (c < 2 ? -1 : 1) * half[1] * side[1][d];
    mesh_add_quad(m, (const double(*)[3])x);
}

/* The place u, v in [-1, 1]^2 of one of two rectangles. */
static void point_of(const flat_pair *at, int side, double u, double v, double out[3]) {
    for (int d = 0; d < 3; d++) {
        const double *x = at->x[d] + (size_t)side * FLAT_CORNERS / 2;
        out[d] = x[0] + .5 * (1 + u) * (x[1] - x[0]) + .5 * (1 + v) * (x[3] - x[0]);
    }
}

/* True where a segment crosses a quad, whose corners all lie to its left as seen along it, or to its right.
 */
static bool crosses(const double quad[4][3], const double x[3], const double y[3]) {
    int left = 0, right = 0;
    double normal[3], from = 0, to = 0;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, g = (d + 2) % 3;
        normal[d] = (quad[1][e] - quad[0][e]) * (quad[3][g] - quad[0][g]) -
                    (quad[1][g] - quad[0][g]) * (quad[3][e] - quad[0][e]);
        from += normal[d] * (x[d] - quad[0][d]);
        to += normal[d] * (y[d] - quad[0][d]);
    }
    for (int k = 0; k < 4; k++) {
        const double *p = quad[k], *q = quad[(k + 1) % 4];
        double volume = 0;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, g = (d + 2) % 3;
            volume += (y[d] - x[d]) * ((p[e] - x[e]) * (q[g] - x[g]) - (p[g] - x[g]) * (q[e] - x[e]));
        }
        left += volume > 0;
        right += volume < 0;
    }
    return ((from < 0) != (to < 0)) && (left == 4 || right == 4);
}

/* Random rectangles at three places of a line, the middle one at one of several distances: where a segment
 * between the outer two crosses it, it is a candidate; it hides where all between corners do, and only there.
 * Of pieces that none of many segments crosses, a plane through an edge of the piece tells all but those that
 * only one through an edge of a rectangle would. */
START_TEST(candidates_are_those_that_segments_cross) {
    enum { SCENES = 3000, STEPS = 6 };
    int n_crossed = 0, n_hidden = 0, n_clear = 0, n_kept = 0;
    uint64_t state = 5;
    for (int scene = 0; scene < SCENES; scene++) {
        const double apart = 1 + 2 * fabs(random_between(&state, -1, 1)),
                     share = .5 + .4 * random_between(&state, -1, 1);
        const double places[3][3] = {
            {0, 0, 0},
            {random_between(&state, -1, 1), random_between(&state, -1, 1), share * apart},
            {0, 0, apart}};
        parts p = {.m = {.n = 0}};
        for (int k = 0; k < 3; k++)
            add_random_rectangle(&p.m, places[k], k == 1 && scene % 2 == 1 ? 4 : 1, &state);
        mesh_finish(&p.m, .5f);
        parts_make(&p);
        const uint32_t a = node_of(&p, 0), b = node_of(&p, 2);
        double quad[4][3];
        flat_pair at;
        candidates among;
        int n_met = 0, n_corners_met = 0;
        bool facing[2] = {false, false}, found = false;
        for (int k = 0; k < 4; k++) memcpy(quad[k], p.m.vertices[p.m.elements[1][k]], sizeof quad[k]);
        flat_clusters_pair(&p.flat, a, b, &at);
        for (int k = 0; k < 4; k++) {
            double height[2] = {-p.flat.of[a].level, -p.flat.of[b].level};
            for (int d = 0; d < 3; d++) {
                height[0] += p.flat.planes[p.flat.of[a].plane].normal[d] * quad[k][d];
                height[1] += p.flat.planes[p.flat.of[b].plane].normal[d] * quad[k][d];
            }
            for (int e = 0; e < 2; e++) facing[e] = facing[e] || height[e] > p.flat.slack;
        }
        for (int k = 0; k < STEPS * STEPS * STEPS * STEPS; k++) {
            double x[3], y[3], place[4];
            bool corners = true;
            for (int d = 0, rest = k; d < 4; d++, rest /= STEPS) {
                place[d] = 2. * (rest % STEPS) / (STEPS - 1) - 1;
                corners = corners && fabs(place[d]) > .999;
            }
            point_of(&at, 0, place[0], place[1], x);
            point_of(&at, 1, place[2], place[3], y);
            const bool met = crosses((const double(*)[3])quad, x, y);
            n_met += met;
            n_corners_met += met && corners;
        }
        candidates_between(&p.pieces, &p.flat, a, b, &at, NULL, &among);
        for (int k = 0; k < among.count; k++)
            for (int c = 0; c < 4; c++)
                found = found || memcmp(p.pieces.of[among.of[k]].corner[c], quad[0], sizeof quad[0]) == 0;
        if (facing[0] && facing[1]) {
            if (n_met > 0) ck_assert(found);
            n_crossed += n_met > 0;
            n_clear += n_met == 0;
            n_kept += n_met == 0 && found;
            if (n_corners_met == 16) {
                n_hidden++;
                ck_assert_int_eq(n_met, STEPS * STEPS * STEPS * STEPS);
                ck_assert(among.hidden);
            }
        } else {
            ck_assert(!found);
        }
        if (n_met < STEPS * STEPS * STEPS * STEPS) ck_assert(!among.hidden);
        parts_free(&p);
    }
    ck_assert_int_gt(n_crossed, SCENES / 10);
    ck_assert_int_gt(n_hidden, SCENES / 100);
    ck_assert_int_gt(n_clear, SCENES / 100);
    ck_assert_int_lt(2 * n_kept, n_clear);
}
END_TEST

/* A wall, a board of its size close before it, and a wall beside these that stands farther in front, all of
 * the same plane; a wall far away that faces them, and a strip of floor between wall and board; also with x
 * turned round: the board hides the wall and not itself, and no cluster of both is hidden as a whole or taken
 * for flat. */
START_TEST(a_board_before_a_wall_hides_only_the_wall) {
    enum { WALL, BOARD, FAR, STRIP, BESIDE, ALL };
    const double step = 1e-3, away = 20;
    const box_cell cells[] = {{0, 0, {0, 0, 0}, {0, 1, 1}},
                              {0, step, {step, 0, 0}, {step, 1, 1}},
                              {0, away, {away, 0, 0}, {away, 1, 1}},
                              {2, 0, {0, 0, 0}, {.4 * step, 1, 0}},
                              {0, 3 * step, {3 * step, 2, 0}, {3 * step, 3, 1}}};
    const double sign = _i == 0 ? 1 : -1;
    parts p = {.m = {.n = 0}};
    for (int k = 0; k < ALL; k++) {
        box_cell c = cells[k];
        if (c.axis == 0) c.level *= sign;
        c.from[0] = fmin(sign * cells[k].from[0], sign * cells[k].to[0]);
        c.to[0] = fmax(sign * cells[k].from[0], sign * cells[k].to[0]);
        mesh_add_cell(&p.m, &c, (k != FAR) == (c.axis == 2 || sign > 0));
    }
    mesh_finish(&p.m, .5f);
    parts_make(&p);
    const uint32_t both = plane_of(&p, WALL), far = node_of(&p, FAR), strip = node_of(&p, STRIP);
    const uint32_t single[2] = {node_of(&p, WALL), node_of(&p, BOARD)};
    bool behind[2];
    candidates among;
    flat_pair at;
    ck_assert_uint_eq(both, plane_of(&p, BOARD));
    ck_assert(!p.flat.of[both].full && p.flat.of[single[0]].full);
    ck_assert_double_eq_tol(p.flat.of[both].rise, 1.5 * step, 1e-12);
    for (int k = 0; k < 2; k++) {
        flat_clusters_pair(&p.flat, single[k], far, &at);
        ck_assert_double_eq_tol(p.flat.of[single[k]].level, k * step, 1e-12);
        ck_assert_double_eq_tol(at.x[0][0], sign * k * step, 1e-12);
        candidates_between(&p.pieces, &p.flat, single[k], far, &at, NULL, &among);
        ck_assert(among.hidden == (k == 0));
        ck_assert_int_eq(among.count, k == 0);
    }
    for (int turned = 0; turned < 2; turned++) {
        const uint32_t ends[2] = {turned ? far : both, turned ? both : far};
        flat_clusters_pair(&p.flat, ends[0], ends[1], &at);
        candidates_between(&p.pieces, &p.flat, ends[0], ends[1], &at, NULL, &among);
        bool board = false;
        for (int k = 0; k < among.count; k++)
            board = board || (fabs(p.pieces.of[among.of[k]].low[0] - sign * step) < 1e-12 &&
                              p.pieces.of[among.of[k]].high[1] < 1.5);
        ck_assert(board && !among.hidden);
        ck_assert(among.amid[turned] && !among.amid[1 - turned]);
    }
    flat_clusters_pair(&p.flat, both, strip, &at); /* it is in front of the wall */
    ck_assert_double_gt(block_kernel_most(&p.flat, both, strip, &at, behind), 0);
    parts_free(&p);
}
END_TEST

/* The same by blocks that may be as large as the cluster of both. */
START_TEST(a_board_has_the_light_of_its_wall) {
    const box_cell wall = {0, 0, {0, 0, 0}, {0, 1, 1}}, board = {0, 1e-3, {1e-3, 0, 0}, {1e-3, 1, 1}},
                   far = {0, 20, {20, 0, 0}, {20, 1, 1}};
    const double truth = box_exchange(&board, &far);
    mesh m = {.n = 0};
    mesh_add_cell(&m, &wall, true);
    mesh_add_cell(&m, &board, true);
    mesh_add_cell(&m, &far, false);
    mesh_finish(&m, .5f);
    plane_tree tree;
    block_factors f = blocks_of(&m, &tree, 1, 1, NULL);
    ck_assert_double_eq(blocks_exchange(&m, &f, 0, 1, 2, 1), 0);
    ck_assert_double_eq_tol(blocks_exchange(&m, &f, 1, 1, 2, 1), truth, .01 * truth);
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
    tcase_add_test(tests, candidates_are_those_that_segments_cross);
    tcase_add_loop_test(tests, a_board_before_a_wall_hides_only_the_wall, 0, 2);
    tcase_add_test(tests, a_board_has_the_light_of_its_wall);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
