/* Form factors by blocks: every pair of elements is decided once, and the laws that hold to rounding whatever
 * the blocks are. */
#include "solver/base/random.h"
#include "solver/formfactor/source.h"
#include "support/blocks.h"
#include "support/scene.h"

#include <float.h>
#include <omp.h>

enum { SCENES = 3 };
/* A sanitizer watches the same code with each seed. */
#ifdef LAMBERT_FEW_CASES
enum { SEEDS = 2 };
#else
enum { SEEDS = 16 };
#endif

/* Closed scenes: two blocks in a box, rooms with doors, a furnace. */
static mesh closed_scene(int which) {
    static const generate_options how[SCENES] = {
        {.kind = "cornell", .elements = 500, .closed = true, .reflectance = .5},
        {.kind = "rooms", .elements = 500, .reflectance = .5, .seed = 1},
        {.kind = "furnace", .elements = 600, .reflectance = .5}};
    return generate_good(&how[which]);
}

static double *random_vector(size_t n, uint64_t seed) {
    double *x = malloc(n * sizeof *x);
    for (size_t i = 0; i < n; i++) x[i] = random_lcg_unit(&seed);
    return x;
}

/* The plane of each element, as the tree has it. */
static uint32_t *planes_of(const plane_tree *tree) {
    uint32_t *plane = malloc(tree->n * sizeof *plane);
    for (size_t t = 0; t < tree->n_clusters; t++)
        for (size_t p = tree->clusters[t].begin; tree->clusters[t].leaf && p < tree->clusters[t].end; p++)
            plane[tree->order[p]] = tree->clusters[t].frame;
    return plane;
}

START_TEST(every_pair_is_decided_once) {
    mesh m = closed_scene(_i);
    plane_tree tree;
    block_report found;
    block_factors f = blocks_of(&m, &tree, blocks_open, blocks_shadow, &found);
    uint32_t *plane = planes_of(&tree);
    uint8_t *seen = calloc(m.n * m.n, 1);
    double in_blocks = 0, across = 0;
    for (size_t k = 0; k < f.n_blocks; k++) {
        const block_node *a = &f.nodes[f.blocks[k].a], *b = &f.nodes[f.blocks[k].b];
        for (size_t p = a->begin; p < a->end; p++)
            for (size_t q = b->begin; q < b->end; q++) {
                const size_t i = f.order[p], j = f.order[q];
                ck_assert(seen[i * m.n + j] == 0 && seen[j * m.n + i] == 0);
                ck_assert_uint_ne(plane[i], plane[j]);
                seen[i * m.n + j] = 1;
                in_blocks++;
            }
    }
    for (size_t i = 0; i < m.n; i++)
        for (size_t j = i + 1; j < m.n; j++) across += plane[i] != plane[j];
    ck_assert_double_eq(in_blocks + found.elements_away + found.elements_hidden + found.elements_unseen,
                        across);
    ck_assert_double_gt(found.elements_away, 0);
    if (_i < SCENES - 1) ck_assert_double_gt(found.elements_hidden, 0);
    free(seen);
    free(plane);
    block_factors_free(&f);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

/* In a closed scene sum A_i F_ij = sum A_i, whatever hides what: the mean of the row sums is off by the sum
 * of the errors of all blocks over A. They are disjoint parts of A x A, twice each; by the same reasons as
 * for a single form factor (test_block_truths.c) it is off by at most open + 4 sqrt(2) shadow / 8 for one
 * seed, and by the last over the root of their number for several. */
START_TEST(light_is_neither_lost_nor_won) {
    mesh m = closed_scene(_i);
    double *one = malloc(m.n * sizeof *one), *sums = malloc(m.n * sizeof *sums), off = 0, area = 0;
    for (size_t i = 0; i < m.n; i++) one[i] = 1;
    for (size_t i = 0; i < m.n; i++) area += m.area[i];
    for (int s = 0; s < SEEDS; s++) {
        plane_tree tree;
        block_factors f = blocks_of_seed(&m, &tree, (uint64_t)s);
        double mean = 0;
        blocks_multiply(&f, one, sums);
        for (size_t i = 0; i < m.n; i++) mean += m.area[i] * (sums[i] - 1) / area;
        ck_assert_double_le(fabs(mean), blocks_open + M_SQRT1_2 * blocks_shadow);
        off += mean / SEEDS;
        block_factors_free(&f);
        plane_tree_free(&tree);
    }
    ck_assert_double_le(fabs(off), blocks_open + M_SQRT1_2 * blocks_shadow / sqrt(SEEDS));
    free(one);
    free(sums);
    mesh_free(&m);
}
END_TEST

typedef struct made_blocks {
    mesh m;
    uint32_t *order;
    plane_tree tree;
    form_factors f;
    block_factors blocks;
} made_blocks;

/* Blocks point to the tree: made must stay where it is. */
static void make(int scene, const form_factors *judged, made_blocks *made) {
    lam_error error = {.message = ""};
    const form_factor_options how = {
        .recipe = {.source = &source_blocks, .rays = 64, .accuracy = blocks_open, .seed = 1}};
    *made = (made_blocks){.m = closed_scene(scene)};
    made->order = malloc(made->m.n * sizeof *made->order);
    ck_ok(mesh_z_order(&made->m, made->order, &error));
    ck_ok(form_factors_tree(&made->m, &made->tree, &error));
    ck_ok(form_factors_make_blocks(&made->m, made->order, &made->tree, judged, &how, &made->f, &made->blocks,
                                   &error));
}

static void unmake(made_blocks *made) {
    form_factors_free(&made->f);
    block_factors_free(&made->blocks);
    plane_tree_free(&made->tree);
    mesh_free(&made->m);
    free(made->order);
}

/* sum A_i x_i (F y)_i = sum A_i y_i (F x)_i and F (x + c y) = F x + c F y. Products sum moments of positive
 * vectors in double over some 12 levels, up and down. */
START_TEST(exchange_is_symmetric_and_linear) {
    made_blocks made;
    make(_i, NULL, &made);
    const mesh *m = &made.m;
    const double c = .375;
    double *x = random_vector(m->n, 1), *y = random_vector(m->n, 2), *both = malloc(m->n * sizeof *both);
    double *Fx = malloc(m->n * sizeof *Fx), *Fy = malloc(m->n * sizeof *Fy);
    double *Fboth = malloc(m->n * sizeof *Fboth), one = 0, other = 0;
    for (size_t i = 0; i < m->n; i++) both[i] = x[i] + c * y[i];
    blocks_multiply(&made.blocks, x, Fx);
    blocks_multiply(&made.blocks, y, Fy);
    blocks_multiply(&made.blocks, both, Fboth);
    for (size_t i = 0; i < m->n; i++) {
        one += m->area[i] * x[i] * Fy[i];
        other += m->area[i] * y[i] * Fx[i];
        ck_assert_double_le(fabs(Fboth[i] - Fx[i] - c * Fy[i]), 1e3 * DBL_EPSILON);
    }
    ck_assert_double_le(fabs(one - other), 1e3 * DBL_EPSILON * one);
    free(x);
    free(y);
    free(both);
    free(Fx);
    free(Fy);
    free(Fboth);
    unmake(&made);
}
END_TEST

/* White furnace: E_i = 1 - rho_i gives B_i = 1 for any rho. With row sums off by e, |B - 1| is at most
 * rho e / (1 - rho). */
START_TEST(a_furnace_is_white) {
    enum { BOUNCES = 200 };
    made_blocks made;
    make(_i, NULL, &made);
    const size_t n = made.m.n;
    double *rho = random_vector(n, 3), *B = calloc(n, sizeof *B), *H = calloc(n, sizeof *H);
    ck_assert(made.f.closed);
    ck_assert_double_le(made.f.closure_error, 1e-7);
    for (size_t i = 0; i < n; i++) rho[i] = .1 + .75 * rho[i];
    for (int k = 0; k < BOUNCES; k++) { /* .85^200 = 8e-15 */
        for (size_t i = 0; i < n; i++) B[i] = 1 - rho[i] + rho[i] * H[i];
        blocks_multiply(&made.blocks, B, H);
    }
    for (size_t i = 0; i < n; i++) ck_assert_double_le(fabs(B[i] - 1), 1e-6);
    free(rho);
    free(B);
    free(H);
    unmake(&made);
}
END_TEST

START_TEST(bits_are_the_same_for_any_number_of_threads) {
    const int most = omp_get_max_threads();
    made_blocks judged;
    make(_i, NULL, &judged);
    for (int judge = 0; judge < 2; judge++) {
        const form_factors *const of = judge ? &judged.f : NULL;
        made_blocks one, other;
        omp_set_num_threads(1);
        make(_i, of, &one);
        /* A judge casts some against the whole scene that others do not. */
        if (judged.f.blocks.shaded_pairs > 100)
            ck_assert(judge ? one.f.blocks.cast > judged.f.blocks.cast
                            : one.f.blocks.cast == judged.f.blocks.cast);
        for (int threads = 2; threads <= 3; threads++) {
            omp_set_num_threads(threads);
            make(_i, of, &other);
            const size_t n = one.m.n, count = one.blocks.n_blocks;
            ck_assert_uint_eq(count, other.blocks.n_blocks);
            ck_assert_mem_eq(one.blocks.blocks, other.blocks.blocks, count * sizeof *one.blocks.blocks);
            ck_assert_mem_eq(one.blocks.balance, other.blocks.balance, n * sizeof *one.blocks.balance);
            ck_assert_mem_eq(one.f.row_sums, other.f.row_sums, n * sizeof *one.f.row_sums);
            unmake(&other);
        }
        unmake(&one);
    }
    unmake(&judged);
    omp_set_num_threads(most);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("block invariants");
    TCase *cases = tcase_create("block invariants");
    tcase_set_timeout(cases, 240);
    tcase_add_loop_test(cases, every_pair_is_decided_once, 0, SCENES);
    tcase_add_loop_test(cases, light_is_neither_lost_nor_won, 0, SCENES);
    tcase_add_loop_test(cases, exchange_is_symmetric_and_linear, 0, SCENES);
    tcase_add_loop_test(cases, a_furnace_is_white, 0, SCENES);
    tcase_add_loop_test(cases, bits_are_the_same_for_any_number_of_threads, 0, SCENES);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
