/* Light through small openings: what blocks find between two rooms against the exact exchange. */
#include "support/blocks.h"
#include "support/box.h"

#include <math.h>

static const double side = 3;
static const double holes[] = {.02, .1, .2, .5, 1}, thicknesses[] = {0, .2};
/* Pairs of them; a sanitizer watches the same code with each, so that one hole is enough. */
#ifdef LAMBERT_FEW_CASES
enum { FIRST = 4, LAST = 6 };
#else
enum { FIRST = 0, LAST = 10 };
#endif

/* Lines of a wall across [0, side] about a hole, none longer than `cell` on average. */
typedef struct wall_lines {
    size_t count;
    double at[64];
} wall_lines;

static void add_lines(wall_lines *w, double from, double to, double cell) {
    const size_t n = (size_t)fmax(1, round((to - from) / cell));
    for (size_t k = 0; k < n; k++) w->at[w->count++] = from + (to - from) * (double)k / (double)n;
}

static void add_wall(mesh *m, int axis, double level, bool positive, const double from[3], const double to[3],
                     double cell, double hole) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    wall_lines lines[2] = {{.count = 0}, {.count = 0}};
    const double low = .5 * (side - hole), high = .5 * (side + hole);
    for (int k = 0; k < 2; k++) {
        const int a = k == 0 ? u : v;
        if (hole > 0) {
            add_lines(&lines[k], from[a], low, cell);
            add_lines(&lines[k], low, high, cell);
            add_lines(&lines[k], high, to[a], cell);
        } else {
            add_lines(&lines[k], from[a], to[a], cell);
        }
        lines[k].at[lines[k].count] = to[a];
    }
    for (size_t i = 0; i < lines[0].count; i++)
        for (size_t j = 0; j < lines[1].count; j++) {
            const double *x = &lines[0].at[i], *y = &lines[1].at[j];
            const bool open = hole > 0 && x[0] > low - 1e-9 && x[1] < high + 1e-9 && y[0] > low - 1e-9 &&
                              y[1] < high + 1e-9;
            box_cell c = {.axis = axis, .level = level};
            c.from[axis] = c.to[axis] = level;
            c.from[u] = x[0], c.to[u] = x[1], c.from[v] = y[0], c.to[v] = y[1];
            if (!open) mesh_add_cell(m, &c, positive);
        }
}

/* Two cubes of `side` with a wall of a thickness between and a square hole in its middle: elements of the
 * first room, of the second one, of the reveal. */
static mesh two_rooms(double hole, double thickness, double cell, size_t count[2]) {
    mesh m = {0};
    for (int room = 0; room < 2; room++) {
        const size_t before = m.n;
        const double x = room * (side + thickness), from[3] = {x, 0, 0}, to[3] = {x + side, side, side};
        for (int axis = 0; axis < 3; axis++)
            for (int end = 0; end < 2; end++)
                add_wall(&m, axis, end == 0 ? from[axis] : to[axis], end == 0, from, to, cell,
                         axis == 0 && end != room ? hole : 0);
        count[room] = m.n - before;
    }
    if (thickness > 0) {
        const double low = .5 * (side - hole), high = .5 * (side + hole);
        const double from[3] = {side, low, low}, to[3] = {side + thickness, high, high};
        for (int axis = 1; axis < 3; axis++)
            for (int end = 0; end < 2; end++)
                add_wall(&m, axis, end == 0 ? low : high, end == 0, from, to, cell, 0);
    }
    mesh_finish(&m, .5f);
    return m;
}

/* Opposed squares of side a at distance c: Howell C-11. */
static double opposed_squares(double a, double c) {
    if (!(c > 0)) return 1;
    const double x = a / c, s = sqrt(1 + x * x);
    return 2 / (M_PI * x * x) *
           (log(s * s / sqrt(1 + 2 * x * x)) + 2 * x * s * atan(x / s) - 2 * x * atan(x));
}

/* With E = 1 all over a first room without reflectance the second one receives on average the exchange of
 * both over its area: that of the hole, or of the two ends of the reveal in a thick wall. Blocks all of whose
 * segments are blocked count as 0; those that a few see make up for them, and no more than the noise of
 * segments and the bound of open blocks is allowed. Where few segments found all the light their spread says
 * little. Their number is Poisson's then, and the variance of a seed is at least truth times the share of a
 * segment: at most the exchange that a seed found, and in a block that is bounded by its norm about
 * shadow sqrt(A_a A_b) / 16. As much as two standard errors of 64 seeds is allowed, of which twice as many
 * pass more surely where nothing is wrong. */
START_TEST(small_openings_lose_nothing) {
    static const double cell = .75;
    const double hole = holes[_i / 2], thickness = thicknesses[_i % 2];
    const double truth = hole * hole * opposed_squares(hole, thickness);
    const int seeds = 128;
    size_t count[2];
    mesh m = two_rooms(hole, thickness, cell, count);
    double sum = 0, square = 0, most = 0;
    for (int s = 0; s < seeds; s++) {
        plane_tree tree;
        block_factors f = blocks_of_seed(&m, &tree, (uint64_t)s);
        const double exchange = blocks_exchange(&m, &f, 0, count[0], count[0], count[1]);
        sum += exchange / seeds;
        square += exchange * exchange / seeds;
        most = fmax(most, exchange);
        block_factors_free(&f);
        plane_tree_free(&tree);
    }
    const double share = fmax(most, blocks_shadow * cell * cell / 16);
    const double variance = fmax(square - sum * sum, sum < .5 * truth ? truth * share : 0);
    const double within = 2 * M_SQRT2 * sqrt(variance / (seeds - 1)) + blocks_open * truth;
    ck_assert_msg(fabs(sum - truth) <= within, "hole %g, wall %g: %g, not %g within %g", hole, thickness, sum,
                  truth, within);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("block openings");
    TCase *cases = tcase_create("block openings");
    tcase_set_timeout(cases, 240);
    tcase_add_loop_test(cases, small_openings_lose_nothing, FIRST, LAST);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
