/* Form factors by cluster blocks against the dense matrix of their formula. */
#include "solver/base/random.h"
#include "solver/operator/blocks/block_factors.h"
#include "support/dense.h"
#include "support/failing_memory.h"
#include "support/random_blocks.h"
#include "support/suite.h"

#include <float.h>
#include <omp.h>

static lam_error error;

/* Planes of 8 x 9, 5 x 7 and 1 x 11 elements that face different ways, and single elements. */
enum { GRIDS = 3, SINGLES = 9, ELEMENTS = 8 * 9 + 5 * 7 + 11 + SINGLES, ROUNDS = 4000 };
static const size_t grid_rows[GRIDS] = {8, 5, 1}, grid_columns[GRIDS] = {9, 7, 11};

typedef struct places {
    double centre[ELEMENTS][3], area[ELEMENTS];
    float normal[ELEMENTS][3];
} places;

static void make_places(places *s, uint64_t *seed) {
    size_t n = 0;
    for (size_t g = 0; g < GRIDS; g++)
        for (size_t r = 0; r < grid_rows[g]; r++)
            for (size_t c = 0; c < grid_columns[g]; c++, n++) {
                const double along = (double)c + .2 * (double)(c * c) / 9, across = .7 * (double)r;
                const double at[3] = {along - 3, across + 2, -1};
                for (size_t d = 0; d < 3; d++) s->centre[n][(d + g) % 3] = at[d];
                s->normal[n][(2 + g) % 3] = 1;
            }
    for (; n < ELEMENTS; n++) {
        double length = 0;
        for (int d = 0; d < 3; d++) {
            s->centre[n][d] = 4 * random_lcg_unit(seed);
            s->normal[n][d] = (float)(random_lcg_unit(seed) - .5);
            length += (double)s->normal[n][d] * (double)s->normal[n][d];
        }
        for (int d = 0; d < 3; d++) s->normal[n][d] /= (float)sqrt(length);
    }
    for (size_t i = 0; i < ELEMENTS; i++) s->area[i] = .1 + random_lcg_unit(seed);
}

enum { PLAIN, BALANCED, WIDENED, EMPTY, CASES };

/* Rectangles that reach beyond the centroids, each in its own way. */
static void widen(const plane_tree *tree, block_factors *f, uint64_t *seed) {
    for (size_t t = 0; t < f->n_clusters; t++)
        for (int d = 0; d < 2 && tree->clusters[t].frame != PLANE_ABOVE; d++) {
            f->nodes[t].centre[d] += .2 * random_lcg_unit(seed);
            f->nodes[t].over[d] = 1 / (4 + random_lcg_unit(seed));
        }
}

/* Blocks of one case; F and size [n][n] dense. */
static block_factors subject(int which, plane_tree *tree, double *F, double *size) {
    uint64_t seed = 7 + (uint64_t)which;
    places *s = test_allocate(1, sizeof *s);
    block_factors f;
    make_places(s, &seed);
    ck_ok(plane_tree_make(ELEMENTS, (const double(*)[3])s->centre, (const float(*)[3])s->normal, NULL, NULL,
                          6, tree, &error));
    ck_ok(block_factors_begin(tree, s->area, (const double(*)[3])s->centre, &f, &error));
    if (which == WIDENED) widen(tree, &f, &seed);
    if (which == BALANCED) f.balance = test_allocate(ELEMENTS, sizeof *f.balance);
    for (size_t p = 0; f.balance != NULL && p < ELEMENTS; p++) f.balance[p] = .5 + random_lcg_unit(&seed);
    if (which != EMPTY) random_blocks(&f, ROUNDS, &seed);
    for (size_t k = 0; k < f.n_blocks; k++) block_add_dense(&f, &f.blocks[k], F, size);
    ck_ok(block_factors_end(&f, &error));
    free(s);
    return f;
}

/* Nodes hold the positions of their children, and the functions of a plane run from -1 to 1 across it. */
START_TEST(nodes_follow_the_tree) {
    plane_tree tree;
    double *F = test_allocate(ELEMENTS * ELEMENTS, sizeof *F);
    block_factors f = subject(EMPTY, &tree, F, F);
    size_t flat = 0, above = 0;
    ck_assert_uint_eq(f.n, ELEMENTS);
    ck_assert_uint_eq(f.n_clusters, tree.n_clusters);
    ck_assert(f.tree == &tree && f.order == tree.order);
    for (uint32_t t = 0; t < f.n_clusters + f.n; t++) {
        const block_node *a = &f.nodes[t];
        if (t >= f.n_clusters) {
            ck_assert(a->begin == t - f.n_clusters && a->end == a->begin + 1);
            ck_assert(tree.clusters[a->parent].leaf && tree.clusters[a->parent].begin <= a->begin &&
                      a->end <= tree.clusters[a->parent].end);
            ck_assert(a->over[0] == 0 && a->over[1] == 0);
            continue;
        }
        const plane_cluster *c = &tree.clusters[t];
        ck_assert(a->begin == c->begin && a->end == c->end);
        ck_assert((a->parent == BLOCK_NO_NODE) == (t + 1 == f.n_clusters));
        if (!c->leaf) ck_assert(f.nodes[c->left].parent == t && f.nodes[t - 1].parent == t);
        above += c->frame == PLANE_ABOVE;
        for (int d = 0; d < 2; d++) {
            double low = 2, high = -2;
            if (c->frame == PLANE_ABOVE) ck_assert(a->over[d] == 0);
            if (c->frame != PLANE_ABOVE) flat += a->over[d] == 0;
            for (size_t i = a->begin; a->over[d] != 0 && i < a->end; i++) {
                double m[BLOCK_FUNCTIONS];
                block_functions_at(&f, t, i, m);
                low = fmin(low, m[1 + d]);
                high = fmax(high, m[1 + d]);
            }
            if (a->over[d] == 0) continue;
            ck_assert_double_le(fabs(low + 1), 1e-12);
            ck_assert_double_le(fabs(high - 1), 1e-12);
        }
    }
    ck_assert_uint_gt(flat, 2 * SINGLES); /* single elements, and the plane of one row */
    ck_assert_uint_gt(above, SINGLES);
    block_factors_free(&f);
    plane_tree_free(&tree);
    free(F);
}
END_TEST

START_TEST(blocks_are_sorted_and_turned) {
    plane_tree tree;
    double *F = test_allocate(ELEMENTS * ELEMENTS, sizeof *F),
           *size = test_allocate(ELEMENTS * ELEMENTS, sizeof *size),
           *again = test_allocate(ELEMENTS * ELEMENTS, sizeof *again);
    block_factors f = subject(PLAIN, &tree, F, size);
    const size_t n_nodes = f.n_clusters + f.n;
    size_t of_elements = 0, of_clusters = 0;
    ck_assert_uint_gt(f.n_blocks, 100);
    ck_assert(f.from[0] == 0 && f.from[n_nodes] == f.n_blocks);
    ck_assert(f.into_from[0] == 0 && f.into_from[n_nodes] == f.n_blocks);
    for (size_t t = 0; t < n_nodes; t++) {
        for (size_t k = f.from[t]; k < f.from[t + 1]; k++) {
            ck_assert_uint_eq(f.blocks[k].a, t);
            ck_assert_uint_le(f.nodes[t].end, f.nodes[f.blocks[k].b].begin);
            if (k > f.from[t]) ck_assert_uint_lt(f.blocks[k - 1].b, f.blocks[k].b);
            of_elements += t >= f.n_clusters && f.blocks[k].b >= f.n_clusters;
            of_clusters += t < f.n_clusters && f.blocks[k].b < f.n_clusters;
        }
        for (size_t k = f.into_from[t]; k < f.into_from[t + 1]; k++) {
            ck_assert_uint_eq(f.blocks[f.into[k]].b, t);
            if (k > f.into_from[t]) ck_assert_uint_lt(f.into[k - 1], f.into[k]);
        }
    }
    ck_assert_uint_gt(of_elements, 20);
    ck_assert_uint_gt(of_clusters, 20);
    /* The matrix is the one of the blocks as they were given. */
    memset(size, 0, ELEMENTS * ELEMENTS * sizeof *size);
    for (size_t k = 0; k < f.n_blocks; k++) block_add_dense(&f, &f.blocks[k], again, size);
    for (size_t k = 0; k < ELEMENTS * ELEMENTS; k++)
        ck_assert(fabs(F[k] - again[k]) <= 16 * DBL_EPSILON * size[k]);
    block_factors_free(&f);
    plane_tree_free(&tree);
    free(F);
    free(size);
    free(again);
}
END_TEST

/* Blocks of several lists, with ends of either order, are those of one list. */
START_TEST(lists_are_joined) {
    enum { LISTS = 3 };
    plane_tree tree;
    double *F = test_allocate(ELEMENTS * ELEMENTS, sizeof *F);
    block_factors whole = subject(PLAIN, &tree, F, F);
    const int most = omp_get_max_threads();
    for (int threads = 1; threads <= 3; threads++) {
        block_list lists[LISTS + 1] = {{.list = NULL}};
        block_factors parted = {.n = 0};
        parted.tree = &tree;
        parted.n = whole.n;
        parted.n_clusters = whole.n_clusters;
        parted.nodes = test_allocate(whole.n_clusters + whole.n, sizeof *parted.nodes);
        memcpy(parted.nodes, whole.nodes, (whole.n_clusters + whole.n) * sizeof *parted.nodes);
        for (int l = 0; l <= LISTS; l += l == 0 ? 2 : 1)
            lists[l].list = test_allocate(whole.n_blocks, sizeof *lists[l].list);
        for (size_t k = whole.n_blocks; k-- > 0;) {
            const size_t l = k * 7 % LISTS;
            block_list *to = &lists[l == 1 ? LISTS : l]; /* list 1 is empty */
            cluster_block one = whole.blocks[k];
            for (int r = 0; k % 2 == 1 && r < BLOCK_FUNCTIONS; r++)
                for (int c = 0; c < BLOCK_FUNCTIONS; c++) one.L[r][c] = whole.blocks[k].L[c][r];
            if (k % 2 == 1) one.a = whole.blocks[k].b, one.b = whole.blocks[k].a;
            to->list[to->count++] = one;
        }
        omp_set_num_threads(threads);
        ck_ok(block_factors_end_lists(&parted, LISTS + 1, lists, &error));
        ck_assert_uint_eq(parted.n_blocks, whole.n_blocks);
        ck_assert_mem_eq(parted.blocks, whole.blocks, whole.n_blocks * sizeof *whole.blocks);
        ck_assert_mem_eq(parted.into, whole.into, whole.n_blocks * sizeof *whole.into);
        for (int l = 0; l <= LISTS; l++) ck_assert(lists[l].list == NULL && lists[l].count == 0);
        block_factors_free(&parted);
    }
    omp_set_num_threads(most);
    block_factors_free(&whole);
    plane_tree_free(&tree);
    free(F);
}
END_TEST

enum { VECTORS = 19 };
/* 9: the last passes alone, in memory that others have used. */
static const size_t vectors_tried[] = {1, 7, 9, VECTORS};

START_TEST(a_product_is_that_of_the_dense_matrix) {
    plane_tree tree;
    const size_t n = ELEMENTS, m = vectors_tried[_i / CASES];
    double *F = test_allocate(n * n, sizeof *F), *size = test_allocate(n * n, sizeof *size);
    double *x = test_allocate(n * m, sizeof *x), *y = test_allocate(n * m, sizeof *y),
           *again = test_allocate(n * m, sizeof *again);
    block_factors f = subject(_i % CASES, &tree, F, size);
    uint64_t seed = 3;
    for (size_t k = 0; k < n * m; k++) x[k] = random_lcg_unit(&seed) - .5;
    for (size_t k = 0; k < n * m; k++) y[k] = NAN;
    omp_set_num_threads(1);
    ck_ok(block_factors_multiply(&f, m, x, y, &error));
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < m; v++) {
            double sum = 0, most = 0;
            for (size_t j = 0; j < n; j++) sum += F[i * n + j] * x[j * m + v];
            for (size_t j = 0; j < n; j++) most += size[i * n + j] * fabs(x[j * m + v]);
            /* Some roundings a level for 12 levels, up and down; moments of a parent may be a few times those
             * of its child. */
            ck_assert(fabs(y[i * m + v] - sum) <= 1e3 * DBL_EPSILON * most);
        }
    for (int threads = 2; threads <= 3; threads++) {
        memset(again, 0, n * m * sizeof *again);
        omp_set_num_threads(threads);
        ck_ok(block_factors_multiply(&f, m, x, again, &error));
        ck_assert_mem_eq(y, again, n * m * sizeof *y);
    }
    block_factors_free(&f);
    plane_tree_free(&tree);
    free(F);
    free(size);
    free(x);
    free(y);
    free(again);
}
END_TEST

/* Each allocation that fails leaves an error and nothing behind. */
START_TEST(memory_runs_out) {
    plane_tree tree;
    double *F = test_allocate(ELEMENTS * ELEMENTS, sizeof *F), *x = test_allocate(ELEMENTS, sizeof *x);
    places *s = test_allocate(1, sizeof *s);
    uint64_t seed = 1;
    block_factors whole = subject(PLAIN, &tree, F, F);
    make_places(s, &seed);
    int failed = 0;
    for (long left = 0;; left++) {
        block_factors f = {.n = 0};
        allocations_left = left;
        lam_status status = block_factors_begin(&tree, s->area, (const double(*)[3])s->centre, &f, &error);
        const bool begun = status == LAM_OK;
        if (begun) {
            f.n_blocks = 2; /* to be sorted */
            f.blocks = test_allocate(2, sizeof *f.blocks);
            f.blocks[0] = whole.blocks[1];
            f.blocks[1] = whole.blocks[0];
            status = block_factors_end(&f, &error);
        }
        if (status == LAM_OK) status = block_factors_multiply(&f, 1, x, F, &error);
        allocations_left = -1;
        if (begun) block_factors_free(&f);
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        failed++;
    }
    ck_assert_int_eq(failed, 4 + 10 + 1);
    block_factors_free(&whole);
    plane_tree_free(&tree);
    free(F);
    free(x);
    free(s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("block factors");
    TCase *tests = tcase_create("block factors");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, nodes_follow_the_tree);
    tcase_add_test(tests, blocks_are_sorted_and_turned);
    tcase_add_test(tests, lists_are_joined);
    tcase_add_loop_test(tests, a_product_is_that_of_the_dense_matrix, 0,
                        CASES * (int)(sizeof vectors_tried / sizeof *vectors_tried));
    tcase_add_test(tests, memory_runs_out);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
