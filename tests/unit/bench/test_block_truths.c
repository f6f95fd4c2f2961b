/* Form factors by blocks against all closed forms of the suite formfactors, at the bounds of the defaults and
 * at bounds ten times finer. */
#include "support/blocks.h"
#include "tests/bench/suites/formfactors_truths.h"

#include <math.h>

/* Every piece is in 4^LEVELS elements; where something is hidden, one level more, so that blocks and not
 * elements resolve the shadow. Sanitizers watch the same code at the bounds of the defaults. */
#ifdef LAMBERT_FEW_CASES
enum { LEVELS = 4, FINENESS = 1 };
#else
enum { LEVELS = 4, FINENESS = 2 };
#endif
static const double finer[2] = {1, .1};

static mesh fine_scene(const scene_piece *pieces, size_t n, unsigned levels) {
    lam_error error = {.message = ""};
    const mesh_refinement how = {.subdivide_levels = levels};
    mesh m;
    ck_ok(scene_of_pieces(pieces, n, &m, &error));
    ck_ok(mesh_refine(&m, &how, &error));
    return m;
}

static double area_of(const mesh *m, size_t first, size_t count) {
    double area = 0;
    for (size_t i = first; i < first + count; i++) area += m->area[i];
    return area;
}

/* The tolerance of F_12 = sum of A_a A_b L / A_1 over the blocks of two surfaces. An error of a block has the
 * norm e in S, and adds up to e sqrt(A_a A_b) / A_1 at most. Blocks are disjoint parts of A_1 x A_2; of
 * errors that are independent the variance is at most the sum of e^2 A_a A_b / A_1^2 <= e^2 A_2 / A_1. The
 * bound of open blocks is that of all of the error, of which the mean over a block is a small part: one e =
 * open is enough. The visible share of 16 segments has the standard deviation (1/4)^(1/2) / 16^(1/2), so that
 * e = shadow / 8, of which four are taken. */
static double tolerance(double open, double shadow, double from, double to) {
    return (open + .5 * shadow) * sqrt(to / from);
}

static bool is_between(const block_factors *f, const cluster_block *k, size_t from, size_t to, size_t each) {
    const size_t a = f->order[f->nodes[k->a].begin] / each, b = f->order[f->nodes[k->b].begin] / each;
    return (a == from && b == to) || (a == to && b == from);
}

/* Of triangles the elements of a cluster do not fill its rectangle, and the mean of the error over them does
 * not vanish: the tolerance is the sum of e sqrt(A_a A_b) / A_1 over all blocks. */
static double tolerance_of_sum(const block_factors *f, const formfactors_truth *t, double open, double from) {
    double sum = 0;
    for (size_t k = 0; k < f->n_blocks; k++) {
        double area[2] = {0};
        if (!is_between(f, &f->blocks[k], t->from, t->to, f->n / t->n)) continue;
        for (size_t p = f->nodes[f->blocks[k].a].begin; p < f->nodes[f->blocks[k].a].end; p++)
            area[0] += f->area[p];
        for (size_t p = f->nodes[f->blocks[k].b].begin; p < f->nodes[f->blocks[k].b].end; p++)
            area[1] += f->area[p];
        sum += open * sqrt(area[0] * area[1]) / from;
    }
    return sum;
}

static double factor(const formfactors_truth *t, unsigned levels, double by, uint64_t seed, double *within) {
    mesh m = fine_scene(t->pieces, t->n, levels);
    const size_t each = m.n / t->n;
    const double from = area_of(&m, t->from * each, each), to = area_of(&m, t->to * each, each);
    /* Of a small element and a large one bounds in S say little: they are scaled to the same tolerance of F.
     */
    const double scale = by * fmin(1, sqrt(from / to));
    const block_options options = {
        .open = scale * blocks_open, .shadow = scale * blocks_shadow, .exact = 1e-6, .seed = seed};
    plane_tree tree;
    block_factors f = blocks_with(&m, &tree, &options, NULL);
    const double F = blocks_exchange(&m, &f, t->from * each, each, t->to * each, each) / from;
    *within = t->pieces[t->from].triangle
                  ? tolerance_of_sum(&f, t, options.open, from)
                  : tolerance(options.open, t->occluded ? options.shadow : 0, from, to);
    block_factors_free(&f);
    plane_tree_free(&tree);
    mesh_free(&m);
    return F;
}

START_TEST(open_factors_are_right) {
    double all[2] = {0};
    size_t count = 0;
    for (const formfactors_truth *t = formfactors_truths; t->name != NULL; t++) {
        if (t->occluded) continue;
        count++;
        for (int k = 0; k < FINENESS; k++) {
            double within;
            const double off = fabs(factor(t, LEVELS, finer[k], 1, &within) - t->F);
            ck_assert_msg(off <= within, "%s: off by %g, which is more than %g", t->name, off, within);
            all[k] += off;
        }
    }
    ck_assert_uint_eq(count, 28);
    /* Errors are proportional to the bound; the root of it would be lost to one that does not count. */
    if (FINENESS > 1) ck_assert_double_lt(all[1], all[0] * sqrt(finer[1]));
}
END_TEST

START_TEST(hidden_factors_are_right) {
    enum { SEEDS = 2 };
    double all[2] = {0};
    size_t count = 0;
    for (const formfactors_truth *t = formfactors_truths; t->name != NULL; t++) {
        if (!t->occluded) continue;
        count++;
        for (int k = 0; k < FINENESS; k++)
            for (uint64_t seed = 1; seed <= SEEDS; seed++) {
                double within;
                const double F = factor(t, LEVELS + 1, finer[k], seed, &within), off = fabs(F - t->F);
                ck_assert_msg(off <= within, "%s: off by %g, which is more than %g", t->name, off, within);
                all[k] += off;
                if (t->F > 0) continue;
                ck_assert_msg(F == 0, "%s: %g leaks", t->name, F);
                break; /* no segment decides that */
            }
    }
    ck_assert_uint_eq(count, 6);
    if (FINENESS > 1) ck_assert_double_lt(all[1], all[0] * sqrt(finer[1]));
}
END_TEST

/* Area-weighted means over the pieces of a surface; of strips the first piece emits. */
static void check_enclosure(const formfactors_enclosure *e, double by) {
    mesh m = fine_scene(e->pieces, e->n, LEVELS);
    const size_t each = m.n / e->n;
    const double open = by * blocks_open, shadow = by * blocks_shadow;
    plane_tree tree;
    block_factors f = blocks_of(&m, &tree, open, shadow, NULL);
    for (size_t s = 0; s < e->n_surfaces; s++)
        for (size_t t = 0; t < e->n_surfaces; t++) {
            double F = 0, from = 0, to = 0;
            for (size_t i = 0; i < e->n; i++) {
                if (e->surface[i] != (int)s || (e->strips && from > 0)) continue;
                from += area_of(&m, i * each, each);
                to = 0;
                for (size_t j = 0; j < e->n; j++) {
                    if (e->surface[j] != (int)t) continue;
                    F += blocks_exchange(&m, &f, i * each, each, j * each, each);
                    to += area_of(&m, j * each, each);
                }
            }
            const double off = fabs(F / from - e->F[s * e->n_surfaces + t]);
            const double within = e->F_within + tolerance(open, shadow, from, to);
            ck_assert_msg(off <= within, "%s, %zu to %zu: off by %g, which is more than %g", e->name, s + 1,
                          t + 1, off, within);
        }
    block_factors_free(&f);
    plane_tree_free(&tree);
    mesh_free(&m);
}

START_TEST(enclosures_are_right) {
    size_t count = 0;
    for (const formfactors_enclosure *e = formfactors_enclosures; e->name != NULL; e++, count++)
        for (int k = 0; k < FINENESS; k++) check_enclosure(e, finer[k]);
    ck_assert_uint_eq(count, 3);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("block truths");
    TCase *cases = tcase_create("block truths");
    tcase_set_timeout(cases, 240);
    tcase_add_test(cases, open_factors_are_right);
    tcase_add_test(cases, hidden_factors_are_right);
    tcase_add_test(cases, enclosures_are_right);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
