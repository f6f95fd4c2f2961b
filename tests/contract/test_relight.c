/* Operators under other reflectances: the same bits as if their cores had been built so; what cannot be relit
 * is refused. The answers of a relit operator are judged with every other kind, by the contract test. */
#include "solver/base/random.h"
#include "solver/linalg/core.h"
#include "support/failing_memory.h"
#include "support/suite.h"
#include "support/transport.h"

enum { N = 700, K = 9, PATCHES = K }; /* more rows than one block of core.c has */

static lam_error error;

typedef struct factors_of_test {
    size_t C;
    float *U, *V, *before, *after; /* [N][K], [C][N] */
    uint32_t *order;
    uint64_t begin[PATCHES + 1];
    float *weight; /* [N], of two meshes */
} factors_of_test;

static factors_of_test make_factors(size_t C) {
    uint64_t state = 5 + C;
    factors_of_test f = {.C = C,
                         .U = test_allocate(N * K, sizeof *f.U),
                         .V = test_allocate(N * K, sizeof *f.V),
                         .weight = test_allocate(N, sizeof *f.weight),
                         .order = random_order(N, &state)};
    random_factors(N, K, f.U, f.V, &state);
    f.before = random_reflectance(N, C, &state);
    f.after = random_reflectance(N, C, &state);
    for (size_t p = 1; p <= PATCHES; p++) f.begin[p] = p * N / PATCHES;
    /* U is small (its rows times the sums of the columns of V are below 1): so are U V^T and these weights.
     */
    for (size_t j = 0; j < N; j++) f.weight[j] = (float)((1 + random_lcg_unit(&state)) / 160);
    return f;
}

static void free_factors(factors_of_test *f) {
    free(f->U);
    free(f->V);
    free(f->before);
    free(f->after);
    free(f->order);
    free(f->weight);
}

static float *copy(const float *x, size_t count) {
    float *y = test_allocate(count, sizeof *y);
    memcpy(y, x, count * sizeof *x);
    return y;
}

/* Makes an operator by a builder's functions alone, under rho. U and V are rows by position. */
static lam_operator *build(const factors_of_test *f, bool two_mesh, const float *U, const float *V,
                           const float *rho) {
    lam_operator *op = NULL;
    float *core = test_allocate(f->C * K * K, sizeof *core);
    for (size_t c = 0; c < f->C; c++) {
        double rcond;
        const core_factors in = {.n = N,
                                 .k = K,
                                 .U = U,
                                 .V = two_mesh ? NULL : V,
                                 .begin = two_mesh ? f->begin : NULL,
                                 .weight = two_mesh ? f->weight : NULL,
                                 .rho = rho + c * N,
                                 .order = f->order};
        ck_assert_msg(core_make(&in, core + c * K * K, &rcond, &error) == LAM_OK, "%s", error.message);
    }
    lam_status status;
    if (two_mesh) {
        two_mesh_arrays arrays = {.left = copy(U, N * K), .core = core, .weight = copy(f->weight, N)};
        arrays.begin = test_allocate(PATCHES + 1, sizeof *arrays.begin);
        memcpy(arrays.begin, f->begin, sizeof f->begin);
        status = operator_two_mesh_create(N, K, f->C, rho, &arrays, &op, &error);
    } else {
        status = operator_low_rank_create_factored(N, K, f->C, rho, copy(U, N * K), copy(V, N * K), core, &op,
                                                   &error);
    }
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    ck_assert(operator_set_order(op, f->order, &error) == LAM_OK);
    return op;
}

static void check_same_bits(const lam_operator *one, const lam_operator *other) {
    const size_t size = lam_operator_channels(one) * N;
    float *E = random_vectors(2 * size, 3);
    for (int adjoint = 0; adjoint < 2; adjoint++)
        for (int q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++) {
            float *a = transport_apply(one, adjoint, 2, (lam_quantity)q, E);
            float *b = transport_apply(other, adjoint, 2, (lam_quantity)q, E);
            ck_assert(memcmp(a, b, 2 * size * sizeof *a) == 0);
            free(a);
            free(b);
        }
    free(E);
}

/* Only the reflectances differ, so a relit operator is, bit for bit, the one built: 0 or not
 * before and after stand beside each other in random_reflectance. */
START_TEST(the_bits_are_those_of_an_operator_built_so) {
    static const panel_precision precisions[] = {PANEL_F32, PANEL_F16, PANEL_I8};
    const bool two_mesh = _i % 2 == 1;
    const panel_precision precision = precisions[_i / 4];
    factors_of_test f = make_factors(_i / 2 % 2 == 1 ? 3 : 1);
    lam_operator *wide = build(&f, two_mesh, f.U, f.V, f.before), *before = wide, *relit = NULL, *back = NULL;
    if (precision != PANEL_F32) {
        /* A store in fewer bits has the factors as they are kept, and the core of them. */
        ck_assert(operator_narrow(wide, precision, &before, &error) == LAM_OK);
        lam_operator_close(wide);
    }
    ck_assert(operator_keeps_factors(before));
    ck_assert_msg(operator_relight(before, f.after, NULL, &relit, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(lam_operator_bytes(relit), lam_operator_bytes(before));
    ck_assert(memcmp(relit->reflectance, f.after, f.C * N * sizeof *f.after) == 0);
    if (precision == PANEL_F32) {
        lam_operator *built = build(&f, two_mesh, f.U, f.V, f.after);
        check_same_bits(relit, built);
        lam_operator_close(built);
    }
    /* And back again, from one that borrows its arrays; a narrow one had the core of what it was before. */
    ck_assert(operator_relight(relit, f.before, NULL, &back, &error) == LAM_OK);
    if (precision == PANEL_F32) check_same_bits(back, before);
    lam_operator *again = NULL;
    ck_assert(operator_relight(before, f.before, NULL, &again, &error) == LAM_OK);
    check_same_bits(back, again);
    lam_operator_close(again);
    lam_operator_close(back);
    lam_operator_close(relit);
    lam_operator_close(before);
    free_factors(&f);
}
END_TEST

/* A relit operator saves and loads like any, and then has arrays of its own. */
START_TEST(a_relit_operator_goes_into_a_store) {
    static const char path[] = "relit-test.h5";
    factors_of_test f = make_factors(3);
    lam_operator *before = build(&f, _i == 1, f.U, f.V, f.before), *relit = NULL, *loaded = NULL;
    store *s = NULL;
    ck_assert(operator_relight(before, f.after, NULL, &relit, &error) == LAM_OK);
    ck_assert(store_create(path, &s, &error) == LAM_OK);
    ck_assert(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){3, N}, f.after, &error) == LAM_OK);
    ck_assert(operator_save(relit, s, &error) == LAM_OK);
    ck_assert(store_seal(s, &error) == LAM_OK);
    ck_assert_msg(lam_operator_open(path, &loaded, &error) == LAM_OK, "%s", error.message);
    check_same_bits(relit, loaded);
    lam_operator_close(relit);
    lam_operator_close(before);
    lam_operator_close(loaded);
    remove(path);
    free_factors(&f);
}
END_TEST

START_TEST(what_has_no_factors_cannot_be_relit) {
    static const transport_kind kinds[] = {TRANSPORT_EXACT, TRANSPORT_FOLDED, TRANSPORT_TWO_MESH,
                                           TRANSPORT_SPARSE_COLOUR};
    transport t = transport_make(kinds[_i], false);
    lam_operator *out = (lam_operator *)&t;
    ck_assert(!operator_keeps_factors(t.op));
    ck_assert(operator_relight(t.op, t.reflectance, NULL, &out, &error) == LAM_ERR_UNSUPPORTED);
    ck_assert_ptr_eq(out, &t);
    transport_free(&t);
}
END_TEST

START_TEST(bad_reflectances_are_refused) {
    static const float bad[] = {1, -.1f, NAN, INFINITY};
    factors_of_test f = make_factors(3);
    lam_operator *op = build(&f, false, f.U, f.V, f.before), *out = NULL;
    f.after[2 * N + 17] = bad[_i];
    ck_assert(operator_relight(op, f.after, NULL, &out, &error) == LAM_ERR_NUMERIC);
    ck_assert_msg(strstr(error.message, "reflectance[2][17] = ") != NULL, "%s", error.message);
    ck_assert_ptr_null(out);
    lam_operator_close(op);
    free_factors(&f);
}
END_TEST

START_TEST(it_can_be_cancelled) {
    factors_of_test f = make_factors(1);
    lam_operator *op = build(&f, _i == 1, f.U, f.V, f.before), *out = NULL;
    atomic_bool cancelled;
    atomic_init(&cancelled, true);
    ck_assert(operator_relight(op, f.after, &cancelled, &out, &error) == LAM_ERR_CANCELLED);
    ck_assert_ptr_null(out);
    atomic_store(&cancelled, false);
    ck_assert(operator_relight(op, f.after, &cancelled, &out, &error) == LAM_OK);
    lam_operator_close(out);
    lam_operator_close(op);
    free_factors(&f);
}
END_TEST

/* U V^T = 2, no form factors: 1 - 2 * .5 = 0. */
START_TEST(a_core_that_is_singular_is_refused) {
    float *U = test_allocate(1, sizeof *U), *V = test_allocate(1, sizeof *V);
    float *core = test_allocate(1, sizeof *core), rho = .25f, worse = .5f;
    lam_operator *op = NULL, *out = NULL;
    *U = 1;
    *V = 2;
    *core = 2;
    ck_assert(operator_low_rank_create_factored(1, 1, 1, &rho, U, V, core, &op, &error) == LAM_OK);
    ck_assert(operator_relight(op, &worse, NULL, &out, &error) == LAM_ERR_NUMERIC);
    ck_assert_msg(strstr(error.message, "nearly singular") != NULL, "%s", error.message);
    ck_assert_ptr_null(out);
    lam_operator_close(op);
}
END_TEST

START_TEST(no_failed_allocation_is_lost) {
    factors_of_test f = make_factors(3);
    lam_operator *op = build(&f, _i == 1, f.U, f.V, f.before), *out = NULL;
    lam_status status = LAM_ERR_MEMORY;
    long k = 0;
    for (; status != LAM_OK; k++) {
        allocations_left = k;
        status = operator_relight(op, f.after, NULL, &out, &error);
        allocations_left = -1;
        ck_assert(status == LAM_OK || (status == LAM_ERR_MEMORY && out == NULL));
    }
    ck_assert_int_gt(k, 8);
    lam_operator_close(out);
    lam_operator_close(op);
    free_factors(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("relit operators");
    TCase *tests = tcase_create("relight");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, the_bits_are_those_of_an_operator_built_so, 0, 12);
    tcase_add_loop_test(tests, a_relit_operator_goes_into_a_store, 0, 2);
    tcase_add_loop_test(tests, what_has_no_factors_cannot_be_relit, 0, 4);
    tcase_add_loop_test(tests, bad_reflectances_are_refused, 0, 4);
    tcase_add_loop_test(tests, it_can_be_cancelled, 0, 2);
    tcase_add_test(tests, a_core_that_is_singular_is_refused);
    tcase_add_loop_test(tests, no_failed_allocation_is_lost, 0, 2);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
