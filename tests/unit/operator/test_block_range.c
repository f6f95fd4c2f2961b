/* The least value of a block beside all of its pairs of elements, and blocks made non-negative. */
#include "solver/base/random.h"
#include "solver/operator/blocks/block_range.h"
#include "support/failing_memory.h"
#include "support/random_blocks.h"
#include "support/suite.h"

#include <float.h>
#include <omp.h>

static lam_error error;

/* Two planes of uneven grids, one of them with a single row. */
enum { FIRST = 7 * 9, SECOND = 13, ELEMENTS = FIRST + SECOND, ROUNDS = 3000 };

static block_factors subject(plane_tree *tree) {
    double(*centre)[3] = test_allocate(ELEMENTS, sizeof *centre),
    *area = test_allocate(ELEMENTS, sizeof *area);
    float(*normal)[3] = test_allocate(ELEMENTS, sizeof *normal);
    uint64_t seed = 11;
    block_factors f;
    for (size_t i = 0; i < ELEMENTS; i++) {
        const bool first = i < FIRST;
        centre[i][0] = first ? (double)(i % 9) + .1 * random_lcg_unit(&seed) : -2;
        centre[i][1] = first ? (double)(i / 9) : (double)((i - FIRST) * (i - FIRST)) / 20;
        centre[i][2] = first ? 0 : 4;
        normal[i][first ? 2 : 0] = 1;
        area[i] = .5 + random_lcg_unit(&seed);
    }
    ck_ok(plane_tree_make(ELEMENTS, (const double(*)[3])centre, (const float(*)[3])normal, NULL, NULL, 6,
                          tree, &error));
    ck_ok(block_factors_begin(tree, area, (const double(*)[3])centre, &f, &error));
    random_blocks(&f, ROUNDS, &seed);
    /* Values from far below 0 to far above, of any size. */
    for (size_t k = 0; k < f.n_blocks; k++)
        for (int r = 0; r < BLOCK_FUNCTIONS; r++)
            for (int c = 0; c < BLOCK_FUNCTIONS; c++)
                f.blocks[k].L[r][c] *= (r + c == 0 ? 3 : 1) * (k % 3 == 0 ? 1e-20f : 1);
    ck_ok(block_factors_end(&f, &error));
    free(centre);
    free(area);
    free(normal);
    return f;
}

typedef struct extremes {
    double least, most, size;
} extremes;

/* Over all pairs of elements of a block. */
static extremes extremes_of(const block_factors *f, const cluster_block *k) {
    extremes e = {INFINITY, -INFINITY, 0};
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = 0; c < BLOCK_FUNCTIONS; c++) e.size += fabs((double)k->L[r][c]);
    for (size_t i = f->nodes[k->a].begin; i < f->nodes[k->a].end; i++)
        for (size_t j = f->nodes[k->b].begin; j < f->nodes[k->b].end; j++) {
            double x[BLOCK_FUNCTIONS], y[BLOCK_FUNCTIONS], value = 0;
            block_functions_at(f, k->a, i, x);
            block_functions_at(f, k->b, j, y);
            for (int r = 0; r < BLOCK_FUNCTIONS; r++)
                for (int c = 0; c < BLOCK_FUNCTIONS; c++) value += x[r] * (double)k->L[r][c] * y[c];
            e.least = fmin(e.least, value);
            e.most = fmax(e.most, value);
        }
    return e;
}

START_TEST(bounds_hold) {
    plane_tree tree;
    block_factors f = subject(&tree);
    block_range *ranges;
    size_t near = 0;
    ck_ok(block_ranges(&f, &ranges, &error));
    for (size_t k = 0; k < f.n_blocks; k++) {
        const extremes e = extremes_of(&f, &f.blocks[k]);
        const double least = block_least(ranges, &f.blocks[k]), most = block_most(ranges, &f.blocks[k]);
        ck_assert_double_le(least, e.least - 16 * DBL_EPSILON * e.size);
        ck_assert_double_ge(most, e.most + 16 * DBL_EPSILON * e.size);
        /* On a full grid elements lie at the corners. */
        near += least > e.least - 1e-9 * e.size && most < e.most + 1e-9 * e.size;
    }
    ck_assert_uint_gt(4 * near, 3 * f.n_blocks);
    free(ranges);
    block_factors_free(&f);
    plane_tree_free(&tree);
}
END_TEST

/* No pair of elements of any block stays below 0; a block that has none keeps its bits, any block the value
 * at the centres. */
START_TEST(reduced_blocks_are_not_negative) {
    plane_tree tree;
    block_factors f = subject(&tree);
    cluster_block *before = test_allocate(f.n_blocks, sizeof *before);
    size_t reduced, negative = 0, able = 0, sloped = 0;
    memcpy(before, f.blocks, f.n_blocks * sizeof *before);
    omp_set_num_threads(3);
    ck_ok(block_factors_reduce(&f, &reduced, &error));
    for (size_t k = 0; k < f.n_blocks; k++) {
        const extremes was = extremes_of(&f, &before[k]), is = extremes_of(&f, &f.blocks[k]);
        const bool below = was.least < 0;
        const float middle = before[k].L[0][0];
        ck_assert_double_ge(is.least, 0);
        ck_assert(f.blocks[k].L[0][0] == (middle > 0 ? middle : 0));
        if (!below && was.least > 1e-9 * was.size) ck_assert_mem_eq(&before[k], &f.blocks[k], sizeof *before);
        negative += below;
        /* It stays as steep as it can: near 0 at some corner. */
        if (!below || !(middle > 0)) continue;
        ck_assert_double_gt(is.most - is.least, 0);
        able++;
        sloped += is.least < .02 * (double)middle;
    }
    ck_assert_uint_gt(negative, f.n_blocks / 10);
    ck_assert_uint_lt(negative, f.n_blocks);
    ck_assert_uint_ge(reduced, negative);
    ck_assert_uint_gt(able, 20);
    ck_assert_uint_gt(3 * sloped, 2 * able);
    /* A second time there is nothing to do. */
    memcpy(before, f.blocks, f.n_blocks * sizeof *before);
    ck_ok(block_factors_reduce(&f, &reduced, &error));
    ck_assert_uint_eq(reduced, 0);
    ck_assert_mem_eq(before, f.blocks, f.n_blocks * sizeof *before);
    allocations_left = 0;
    ck_assert_int_eq(block_factors_reduce(&f, &reduced, &error), LAM_ERR_MEMORY);
    allocations_left = -1;
    free(before);
    block_factors_free(&f);
    plane_tree_free(&tree);
}
END_TEST

/* Where the light of one corner of a cluster alone is negative, the slopes change along the functions at that
 * corner over their mean squares, (3 u, 3 v), until it is a 1e-5 of the value at the centre. */
START_TEST(one_corner_is_projected) {
    plane_tree tree;
    block_factors f = subject(&tree);
    block_range *ranges;
    size_t reduced, tried = 0;
    ck_ok(block_ranges(&f, &ranges, &error));
    f.n_blocks = 1;
    for (uint32_t t = 0; t < f.n_clusters; t++) {
        const block_range *r = &ranges[t];
        bool whole = f.nodes[t].begin > 0;
        for (int d = 0; d < 2; d++)
            whole = whole && fabs(r->low[d] + 1) < 1e-12 && fabs(r->high[d] - 1) < 1e-12;
        if (!whole) continue;
        for (int turned = 0; turned < 2; turned++) {
            cluster_block *const k = &f.blocks[0];
            const uint32_t element = (uint32_t)f.n_clusters;
            *k = (cluster_block){.a = turned ? element : t, .b = turned ? t : element};
            float *const u = turned ? &k->L[0][1] : &k->L[1][0], *const v =
                                                                     turned ? &k->L[0][2] : &k->L[2][0];
            k->L[0][0] = 1;
            *u = 1.25f;
            *v = .5f;
            ck_ok(block_factors_reduce(&f, &reduced, &error));
            ck_assert_uint_eq(reduced, 1);
            /* 1 - u - v = -.75 becomes 1e-5 by (.75 + 1e-5) / 6 of (3, 3); single precision. */
            ck_assert_double_le(fabs((double)*u - (1.25 - .375005)), 1e-6);
            ck_assert_double_le(fabs((double)*v - (.5 - .375005)), 1e-6);
            ck_assert(k->L[0][0] == 1 && k->L[1][1] == 0 && k->L[2][2] == 0);
            tried++;
        }
    }
    ck_assert_uint_gt(tried, 4);
    free(ranges);
    block_factors_free(&f);
    plane_tree_free(&tree);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("block range");
    TCase *tests = tcase_create("block range");
    tcase_add_test(tests, bounds_hold);
    tcase_add_test(tests, reduced_blocks_are_not_negative);
    tcase_add_test(tests, one_corner_is_projected);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
