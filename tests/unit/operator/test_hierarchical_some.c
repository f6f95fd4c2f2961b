/* Answers of kind "hierarchical" of which some elements are asked, or few are lit, on a tree of several
 * pieces: the bits are those of the whole answer. */
#include "solver/base/random.h"
#include "solver/base/work_area.h"
#include "solver/operator/hierarchical_some.h"
#include "support/dense.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

/* Leaves of six elements below a complete tree; a run of elements that is few. */
enum { LEAF = 6, HEIGHT = 11, N = LEAF << HEIGHT, NODES = (2 << HEIGHT) - 1, CHANNELS = 2, RUN = N / 25 };

static lam_error error;

/* The nodes of a subtree in postorder: shape 0 is a leaf, 1 has two children. */
static size_t add_nodes(unsigned height, uint32_t *shapes, size_t count) {
    for (int side = 0; height > 0 && side < 2; side++) count = add_nodes(height - 1, shapes, count);
    shapes[count] = height > 0;
    return count + 1;
}

/* Of six inputs three are handed on, by matrices that are not far from a permutation. */
static wavelets make_basis(uint64_t *state) {
    wavelets basis = {.n = 0};
    wavelet_shape *shapes = test_allocate(2, sizeof *shapes);
    uint32_t *of_node = test_allocate(NODES, sizeof *of_node);
    float *matrices = test_allocate(2, LEAF * LEAF * sizeof *matrices);
    for (size_t s = 0; s < 2; s++) {
        shapes[s] = (wavelet_shape){.leaf = s == 0, .inputs = LEAF, .scaling = LEAF / 2};
        for (size_t k = 0; k < LEAF * LEAF; k++)
            matrices[s * LEAF * LEAF + k] =
                (float)((k % LEAF == (k / LEAF + 2) % LEAF) + .2 * (random_lcg_unit(state) - .5));
    }
    ck_assert_uint_eq(add_nodes(HEIGHT, of_node, 0), NODES);
    ck_ok(wavelets_create(N, NODES, of_node, 2, shapes, matrices, 2 * LEAF * LEAF, &basis, &error));
    free(of_node);
    return basis;
}

/* A third of the nodes have numbers, near the diagonal and far from it; those of the root all. */
static csr random_K(uint64_t *state) {
    csr K = {.n = N,
             .indptr = test_allocate(N + 1, sizeof *K.indptr),
             .indices = test_allocate(8 * N, sizeof *K.indices),
             .data = test_allocate(8 * N, sizeof *K.data)};
    uint64_t count = 0;
    for (size_t i = 0; i < N; i++) {
        const bool used = i / (LEAF / 2) % 3 == 0 || i + LEAF > N;
        for (size_t j = i; used && j < N;
             j = j < i + 3 ? j + 1 : j + 1 + (size_t)(random_lcg_unit(state) * N)) {
            if (j / (LEAF / 2) % 3 != 0 && j + LEAF <= N) continue;
            K.indices[count] = (uint32_t)j;
            K.data[count++] = (float)((random_lcg_unit(state) - .3) * exp2(-6 * random_lcg_unit(state)));
        }
        K.indptr[i + 1] = count;
    }
    ck_assert_uint_lt(count, 8 * N);
    return K;
}

/* Two channels that reflect differently; ordered: positions are not in mesh order; corrected: of the mean
 * error. */
static lam_operator *make_operator(bool ordered, bool corrected) {
    uint64_t state = 5;
    lam_operator *op = NULL;
    hierarchical_arrays arrays = {.basis = make_basis(&state)};
    float *rho = test_allocate(CHANNELS * N, sizeof *rho);
    double *area = test_allocate(N, sizeof *area), *missing = test_allocate(CHANNELS * N, sizeof *missing);
    uint32_t *order = test_allocate(N, sizeof *order);
    arrays.K = test_allocate(CHANNELS, sizeof *arrays.K);
    arrays.step = test_allocate(N, sizeof *arrays.step);
    for (size_t c = 0; c < CHANNELS; c++) arrays.K[c] = random_K(&state);
    for (size_t i = 0; i < N; i++) {
        order[i] = (uint32_t)((i * 5 + 3) % N);
        area[i] = .5 + random_lcg_unit(&state);
        arrays.step[i] = 1e-3f;
    }
    for (size_t i = 0; i < CHANNELS * N; i++) {
        rho[i] = i % 11 == 0 ? 0 : (float)(.8 * random_lcg_unit(&state));
        missing[i] = .01 * random_lcg_unit(&state);
    }
    ck_ok(operator_hierarchical_create(N, CHANNELS, rho, area, ordered ? order : NULL, &arrays, &op, &error));
    if (corrected) ck_ok(operator_hierarchical_correct(op, missing, (double[]){.01 * N, .02 * N}, &error));
    free(rho);
    free(area);
    free(missing);
    free(order);
    return op;
}

/* Vectors emit: one element, in one channel; a run; a third of all; nothing; a run of either sign, with
 * zeros of either in it; then the same again. */
enum { LIGHTS = 5, VECTORS = 9 };

static void light(size_t which, float *E) {
    uint64_t state = 17 + which;
    memset(E, 0, CHANNELS * N * sizeof *E);
    if (which == 0) E[N + N / 7] = 2;
    for (size_t i = 0; (which == 1 || which == 4) && i < RUN; i++)
        for (size_t c = 0; c < CHANNELS; c++)
            E[c * N + N / 3 + i] = which == 1   ? 1
                                   : i % 5 == 0 ? -0.0f
                                                : (float)(random_lcg_unit(&state) - .5);
    for (size_t i = 0; which == 2 && i < CHANNELS * N; i += 3) E[i] = (float)random_lcg_unit(&state);
}

/* These elements are asked: one; a run; some, scattered, one of them twice; more than half; more than all. */
static const size_t counts[] = {1, RUN, 50, N / 2 + 90, N + 5};

static void choose(size_t which, uint32_t *selected) {
    for (size_t r = 0; r < counts[which]; r++)
        selected[r] = (uint32_t)((which == 1 || which == 3 ? N / 2 - 70 + r : r * r * 7 + r / 49) % N);
    if (which == 2) selected[20] = selected[4];
}

static void check(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *E,
                  const float *H0) {
    const size_t bytes = lam_operator_work_bytes(op, n_rhs), rows = n_rhs * CHANNELS;
    void *work = test_allocate(1, bytes);
    float *all = test_allocate(rows * N, sizeof *all), *some = test_allocate(rows * (N + 5), sizeof *some);
    uint32_t *selected = test_allocate(N + 5, sizeof *selected);
    ck_ok(lam_operator_apply_lit(op, n_rhs, quantity, E, H0, all, work, bytes, &error));
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        choose(k, selected);
        memset(work, 0xA5, bytes);
        ck_ok(lam_operator_apply_selected(op, n_rhs, quantity, E, H0, counts[k], selected, some, work, bytes,
                                          &error));
        for (size_t row = 0; row < rows; row++)
            for (size_t r = 0; r < counts[k]; r++)
                ck_assert_msg(memcmp(&some[row * counts[k] + r], &all[row * N + selected[r]], sizeof *some) ==
                                  0,
                              "selection %zu, row %zu, element %u: %a, not %a", k, row, selected[r],
                              (double)some[row * counts[k] + r], (double)all[row * N + selected[r]]);
    }
    free(work);
    free(all);
    free(some);
    free(selected);
}

START_TEST(some_elements_have_the_bits_of_all) {
    static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};
    lam_operator *op = make_operator(_i & 1, _i & 2);
    float *E = test_allocate(VECTORS * CHANNELS * N, sizeof *E),
          *H0 = test_allocate(VECTORS * CHANNELS * N, sizeof *H0);
    ck_assert_uint_gt(((const hierarchical *)op)->plan.n_pieces, 2);
    for (size_t v = 0; v < VECTORS; v++) light(v % LIGHTS, E + v * CHANNELS * N);
    for (size_t v = 0; v < VECTORS; v++) /* a lamp shines on a few elements, a sky on all */
        for (size_t i = 0; i < CHANNELS * N; i++)
            H0[v * CHANNELS * N + i] = i % N < 40 || v == 2 ? (float)(i % 7) : 0;
    for (size_t q = 0; q < 3; q++)
        for (size_t n_rhs = LIGHTS; n_rhs <= VECTORS; n_rhs += VECTORS - LIGHTS) {
            check(op, n_rhs, quantities[q], E, NULL);
            check(op, n_rhs, quantities[q], E, H0);
        }
    lam_operator_close(op);
    free(E);
    free(H0);
}
END_TEST

/* A run of elements needs a small part of the tree and of K, a third of all no such part. */
START_TEST(parts_are_small) {
    lam_operator *op = make_operator(false, false);
    const hierarchical *self = (const hierarchical *)op;
    size_t bytes = WORK_AREA_ALIGN;
    ck_assert(hierarchical_some_add(self, &bytes));
    void *work = test_allocate(1, bytes), *rest = work_area_begin(work);
    float *E = test_allocate(CHANNELS * N, sizeof *E), *X = test_allocate(N, sizeof *X),
          *other = test_allocate(CHANNELS * N, sizeof *other),
          *C = test_allocate(self->plan.n_used + TILED_PAST, sizeof *C),
          *slots = test_allocate(wavelet_plan_work(&self->plan), sizeof *slots);
    uint32_t *selected = test_allocate(N, sizeof *selected);
    hierarchical_some some = hierarchical_some_take(self, &rest);
    choose(1, selected);
    ck_assert(hierarchical_some_ask(&some, counts[1], selected, 2));
    ck_assert_uint_lt(some.asked.n_steps * 15, self->plan.n_steps);
    ck_assert_uint_lt(some.asked.n_groups * 15, self->n_groups);
    ck_assert_uint_eq(some.asked.steps[some.asked.n_steps - 1], self->plan.n_steps - 1);
    ck_assert_uint_eq(some.asked.groups[some.asked.n_groups - 1], self->n_groups - 1);
    choose(3, selected);
    ck_assert(!hierarchical_some_ask(&some, counts[3], selected, 2));
    light(1, E);
    ck_assert(!hierarchical_some_light(&some, E, NULL) && some.extent == LIT_FEW);
    ck_assert_uint_lt(some.lit.n_steps * 15, self->plan.n_steps);
    hierarchical_some_forward(&some, 0, E, NULL, X, C, slots);
    ck_assert(tiled_few_columns_of(&self->K[0], some.lit.n_groups, some.lit.groups, C));
    ck_assert(hierarchical_some_light(&some, E + N, NULL)); /* the second channel is lit alike */
    light(2, other);
    ck_assert(!hierarchical_some_light(&some, other, NULL) && some.extent == LIT_MANY);
    light(3, E);
    ck_assert(!hierarchical_some_light(&some, E, NULL) && some.extent == LIT_NOWHERE);
    ck_assert(!hierarchical_some_light(&some, E, other) && some.extent == LIT_MANY);
    lam_operator_close(op);
    free(E);
    free(X);
    free(other);
    free(C);
    free(slots);
    free(selected);
    free(work);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("hierarchical, of some elements");
    TCase *tests = tcase_create("answers");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, some_elements_have_the_bits_of_all, 0, 4);
    tcase_add_test(tests, parts_are_small);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
