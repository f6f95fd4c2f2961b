/* Operators in a store: what is saved comes back bit for bit, what cannot be is refused in one clear line,
 * and no failed allocation is lost. */
#include "solver/base/random.h"
#include "support/failing_memory.h"
#include "support/operator_file.h"
#include "support/suite.h"

static lam_error error;

static void setup(void) {
    operator_file_setup();
    allocations_left = -1;
}

static lam_status save(const lam_operator *op, lam_error *cause) {
    lam_status status = LAM_OK;
    store *s = NULL;
    size_t dims[2] = {op->n_channels, op->n};
    double area[512];
    TRY(store_create(operator_file_path, &s, cause));
    for (size_t i = 0; i < sizeof area / sizeof *area; i++) area[i] = transport_area(i);
    ck_assert_uint_le(op->n, sizeof area / sizeof *area);
    TRY(store_write(s, "/mesh/reflectance", STORE_F32, 2, dims, op->reflectance, cause));
    TRY(store_write(s, "/mesh/area", STORE_F64, 1, &op->n, area, cause));
    TRY(operator_save(op, s, cause));
    status = store_seal(s, cause);
    s = NULL;
done:
    store_close(s);
    return status;
}

START_TEST(what_is_saved_comes_back_bit_for_bit) {
    static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};
    const transport *t = transport_kept(_i);
    size_t count = 17 * t->n * t->n_channels;
    float *in = random_vectors(count, 12);
    lam_operator *loaded = NULL;
    ck_ok(save(t->op, &error));
    ck_ok(lam_operator_open(operator_file_path, &loaded, &error));
    ck_assert_str_eq(lam_operator_kind(loaded), lam_operator_kind(t->op));
    ck_assert_uint_eq(lam_operator_bytes(loaded), lam_operator_bytes(t->op));
    ck_assert_uint_eq(lam_operator_work_bytes(loaded, 17), lam_operator_work_bytes(t->op, 17));
    ck_assert((loaded->order != NULL) == (t->order != NULL));
    for (int q = 0; q < 3; q++)
        for (int adjoint = 0; adjoint < 2; adjoint++) {
            float *before = transport_apply(t->op, adjoint, 17, quantities[q], in);
            float *after = transport_apply(loaded, adjoint, 17, quantities[q], in);
            ck_assert_mem_eq(before, after, count * sizeof *before);
            free(before);
            free(after);
        }
    lam_operator_close(loaded);
    free(in);
}
END_TEST

/* The contract of the file: M has the identity in it, whatever is kept inside. */
START_TEST(exact_is_stored_as_the_whole_matrix) {
    transport t = transport_make(TRANSPORT_EXACT, false);
    store *s = NULL;
    void *data = NULL;
    size_t n = t.n, dims[STORE_MAX_RANK] = {1, n, n};
    char *layout = NULL;
    ck_ok(save(t.op, &error));
    ck_ok(store_open(operator_file_path, &s, &error));
    ck_ok(store_read(s, "/operator/M", STORE_F32, 3, dims, &data, &error));
    ck_ok(store_get_text(s, "/operator", "layout", &layout, &error));
    ck_assert_str_eq(layout, "rows");
    const float *M = data;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double truth = t.P[i * n + j] + (i == j ? 1 : 0);
            /* P is rounded, 1 + P_ii again */
            ck_assert_double_le(fabs((double)M[i * n + j] - truth), 2.001 * TRANSPORT_U * fabs(truth));
        }
    free(layout);
    free(data);
    store_close(s);
    transport_free(&t);
}
END_TEST

/* The allocation that fails after the k-th: each in turn, or 1, 2, 3, 5, 8, ... */
static long next_failure(long k) {
#ifdef LAMBERT_QUICK
    return k + 1 + k / 2;
#else
    return k + 1;
#endif
}

START_TEST(every_failed_allocation_is_an_error) {
    const transport *t = transport_kept(_i);
    long failures[2] = {0, 0};
    for (int loads = 0; loads < 2; loads++)
        for (long k = 0;; k = next_failure(k)) {
            lam_operator *op = NULL;
            ck_assert_int_lt(k, 100000);
            allocations_left = k;
            lam_status status =
                loads ? lam_operator_open(operator_file_path, &op, &error) : save(t->op, &error);
            allocations_left = -1;
            lam_operator_close(op);
            if (status == LAM_OK) break;
            ck_assert_msg(status == LAM_ERR_MEMORY && op == NULL, "allocation %ld: %s", k, error.message);
            failures[loads]++;
        }
    ck_assert_int_gt(failures[0], 1);
    ck_assert_int_gt(failures[1], 3);
}
END_TEST

static const file_recipe recipes[] = {
    {.what = "good, folded"},
    {.what = "good, factored", .form = "factored"},
    {.what = "good, exact", .kind = "exact", .n_channels = 3},
    {.what = "good, layout unsaid", .layout = "-"},
    {.what = "good, ordered", .order_size = 6, .order = {5, 4, 3, 0, 1, 2}},
    {.what = "no operator", .without = "/operator", .status = LAM_ERR_FORMAT, .word = "no operator"},
    {.what = "no kind", .kind = "-", .status = LAM_ERR_FORMAT, .word = "kind"},
    {.what = "emitters without names",
     .kind = "emitters",
     .status = LAM_ERR_FORMAT,
     .word = "/operator/names"},
    {.what = "hierarchical without a mesh",
     .kind = "hierarchical",
     .status = LAM_ERR_FORMAT,
     .word = "/mesh/area"},
    {.what = "kind unknown", .kind = "magic", .status = LAM_ERR_FORMAT, .word = "unknown kind 'magic'"},
    {.what = "panels", .layout = "panel64", .status = LAM_ERR_FORMAT, .word = "panel64"},
    {.what = "layout unknown", .layout = "columns", .status = LAM_ERR_FORMAT, .word = "'columns'"},
    {.what = "no form", .form = "-", .status = LAM_ERR_FORMAT, .word = "form"},
    {.what = "form unknown", .form = "loose", .status = LAM_ERR_FORMAT, .word = "'loose'"},
    {.what = "folded colour", .n_channels = 3, .status = LAM_ERR_FORMAT, .word = "1 channel"},
    {.what = "no reflectance",
     .without = "/mesh/reflectance",
     .status = LAM_ERR_FORMAT,
     .word = "/mesh/reflectance"},
    {.what = "no Y", .without = "/operator/Y", .status = LAM_ERR_FORMAT, .word = "/operator/Y"},
    {.what = "no V", .without = "/operator/V", .status = LAM_ERR_FORMAT, .word = "/operator/V"},
    {.what = "no U",
     .form = "factored",
     .without = "/operator/U",
     .status = LAM_ERR_FORMAT,
     .word = "/operator/U"},
    {.what = "no core",
     .form = "factored",
     .without = "/operator/core",
     .status = LAM_ERR_FORMAT,
     .word = "/operator/core"},
    {.what = "no M",
     .kind = "exact",
     .without = "/operator/M",
     .status = LAM_ERR_FORMAT,
     .word = "/operator/M"},
    {.what = "Y in double", .other_type = "/operator/Y", .status = LAM_ERR_FORMAT, .word = "/operator/Y"},
    {.what = "reflectance in double",
     .other_type = "/mesh/reflectance",
     .status = LAM_ERR_FORMAT,
     .word = "/mesh/reflectance"},
    {.what = "Y short", .left = {5}, .status = LAM_ERR_FORMAT, .word = "/operator/Y"},
    {.what = "V short", .V = {5}, .status = LAM_ERR_FORMAT, .word = "/operator/V"},
    {.what = "V narrow", .V = {6, 1}, .status = LAM_ERR_FORMAT, .word = "/operator/V"},
    {.what = "V transposed", .V = {2, 6}, .status = LAM_ERR_FORMAT, .word = "/operator/V"},
    {.what = "core wide",
     .form = "factored",
     .core = {2, 3, 2},
     .status = LAM_ERR_FORMAT,
     .word = "/operator/core"},
    {.what = "core high",
     .form = "factored",
     .core = {2, 2, 3},
     .status = LAM_ERR_FORMAT,
     .word = "/operator/core"},
    {.what = "core of 1",
     .form = "factored",
     .core = {1},
     .status = LAM_ERR_FORMAT,
     .word = "/operator/core"},
    {.what = "M narrow", .kind = "exact", .M = {1, 6, 5}, .status = LAM_ERR_FORMAT, .word = "/operator/M"},
    {.what = "M short", .kind = "exact", .M = {1, 5, 6}, .status = LAM_ERR_FORMAT, .word = "/operator/M"},
    {.what = "M of 2", .kind = "exact", .M = {2}, .status = LAM_ERR_FORMAT, .word = "/operator/M"},
    {.what = "NaN in Y",
     .bad = "/operator/Y",
     .bad_value = NAN,
     .bad_index = 7,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/Y[3][1] = nan"},
    {.what = "infinity in V",
     .bad = "/operator/V",
     .bad_value = INFINITY,
     .bad_index = 4,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/V[2][0] = inf"},
    {.what = "NaN in U",
     .form = "factored",
     .bad = "/operator/U",
     .bad_value = NAN,
     .bad_index = 11,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/U[5][1]"},
    {.what = "NaN in core",
     .form = "factored",
     .bad = "/operator/core",
     .bad_value = NAN,
     .bad_index = 6,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/core[1][1][0]"},
    {.what = "infinity in M",
     .kind = "exact",
     .bad = "/operator/M",
     .bad_value = -INFINITY,
     .bad_index = 13,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/M[0][2][1] = -inf"},
    {.what = "infinity on M's diagonal",
     .kind = "exact",
     .bad = "/operator/M",
     .bad_value = INFINITY,
     .bad_index = 14,
     .status = LAM_ERR_FORMAT,
     .word = "/operator/M[0][2][2]"},
    {.what = "reflectance 1",
     .bad = "/mesh/reflectance",
     .bad_value = 1,
     .bad_index = 2,
     .status = LAM_ERR_FORMAT,
     .word = "reflectance[0][2] = 1, must be at least 0 and below 1"},
    {.what = "reflectance negative",
     .bad = "/mesh/reflectance",
     .bad_value = -0.1f,
     .bad_index = 5,
     .status = LAM_ERR_FORMAT,
     .word = "reflectance[0][5] = -0.1"},
    {.what = "reflectance NaN",
     .bad = "/mesh/reflectance",
     .bad_value = NAN,
     .status = LAM_ERR_FORMAT,
     .word = "reflectance[0][0] = nan"},
    {.what = "order short",
     .order_size = 5,
     .order = {0, 1, 2, 3, 4},
     .status = LAM_ERR_FORMAT,
     .word = "/operator/order"},
    {.what = "order past n",
     .order_size = 6,
     .order = {0, 1, 2, 3, 4, 6},
     .status = LAM_ERR_FORMAT,
     .word = "order[5] = 6, must be below 6"},
    {.what = "order twice",
     .order_size = 6,
     .order = {0, 1, 2, 3, 4, 1},
     .status = LAM_ERR_FORMAT,
     .word = "order[5] = 1"},
};

START_TEST(files_that_cannot_be_are_refused) {
    const file_recipe *r = &recipes[_i];
    operator_file_write(r);
    operator_file_judge(r->what, r->status, r->word);
}
END_TEST

START_TEST(missing_arguments_and_files_are_errors) {
    lam_operator *op = NULL;
    ck_assert(lam_operator_open(NULL, &op, &error) == LAM_ERR_ARGUMENT);
    ck_assert(lam_operator_open(operator_file_path, NULL, &error) == LAM_ERR_ARGUMENT);
    ck_assert(lam_operator_open(operator_file_path, &op, &error) == LAM_ERR_IO);
    ck_assert(lam_operator_open(operator_file_path, &op, NULL) == LAM_ERR_IO);
    ck_assert_ptr_null(op);
    lam_operator_close(NULL);
}
END_TEST

static float *constant(size_t count, float value) {
    float *x = test_allocate(count, sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = value;
    return x;
}

/* Arrays are taken over on errors too (a leak would show under the sanitizer), and the handle is left alone.
 */
START_TEST(builders_are_told_what_is_wrong) {
    const float good[2] = {0.5f, 0.25f}, bad[2] = {0.5f, 1.0f};
    float *nan_V = constant(6, 1);
    lam_operator *op = NULL;
    nan_V[5] = NAN;
    ck_assert(operator_low_rank_create_folded(2, 3, bad, constant(6, 1), constant(6, 1), &op, &error) ==
              LAM_ERR_NUMERIC);
    ck_assert_ptr_nonnull(strstr(error.message, "reflectance[0][1] = 1"));
    ck_assert(operator_low_rank_create_folded(2, 3, good, constant(6, 1), nan_V, &op, &error) ==
              LAM_ERR_NUMERIC);
    ck_assert_ptr_nonnull(strstr(error.message, "/operator/V[1][2] = nan"));
    ck_assert(operator_low_rank_create_factored(2, 1, 1, bad, constant(2, 1), constant(2, 1), constant(1, 1),
                                                &op, &error) == LAM_ERR_NUMERIC);
    ck_assert(operator_exact_create(2, 1, bad, constant(4, 1), &op, &error) == LAM_ERR_NUMERIC);
    ck_assert(operator_exact_create(2, 1, good, constant(4, INFINITY), &op, &error) == LAM_ERR_NUMERIC);
    ck_assert(operator_exact_create(0, 1, good, constant(4, 1), &op, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_null(op);
}
END_TEST

/* A rank of 0 is a scene where nothing sees anything. */
START_TEST(rank_zero_is_direct_light_only) {
    const float rho[3] = {0.5f, 0, 0.25f}, E[3] = {1, 2, 3};
    for (int factored = 0; factored < 2; factored++) {
        lam_operator *op = NULL, *loaded = NULL;
        if (factored)
            ck_ok(operator_low_rank_create_factored(3, 0, 1, rho, constant(0, 0), constant(0, 0),
                                                    constant(0, 0), &op, &error));
        else
            ck_ok(operator_low_rank_create_folded(3, 0, rho, constant(0, 0), constant(0, 0), &op, &error));
        ck_ok(save(op, &error));
        ck_ok(lam_operator_open(operator_file_path, &loaded, &error));
        for (int adjoint = 0; adjoint < 2; adjoint++) {
            float *B = transport_apply(loaded, adjoint, 1, LAM_RADIOSITY, E);
            float *H = transport_apply(loaded, adjoint, 1, LAM_IRRADIANCE, E);
            for (size_t i = 0; i < 3; i++) ck_assert(B[i] == E[i] && H[i] == 0);
            free(B);
            free(H);
        }
        lam_operator_close(op);
        lam_operator_close(loaded);
    }
}
END_TEST

/* A closed sphere, F_ij = A_j / A: M - I has rank 1 and B_i = E_i + rho_i mean(E) / (1 - mean(rho)), means by
 * area. */
START_TEST(sphere_is_exact_with_one_column) {
    enum { N = 400 };
    uint64_t state = 21;
    double area[N], total = 0, mean_rho = 0, mean_E = 0;
    float rho[N], E[N];
    for (size_t i = 0; i < N; i++) {
        area[i] = 0.5 + random_lcg_unit(&state);
        rho[i] = i % 10 == 0 ? 0.0f : (float)(0.9 * random_lcg_unit(&state));
        E[i] = (float)random_lcg_unit(&state);
        total += area[i];
        mean_rho += area[i] * (double)rho[i];
        mean_E += area[i] * (double)E[i];
    }
    mean_rho /= total;
    mean_E /= total;
    for (int factored = 0; factored < 2; factored++) {
        lam_operator *op = NULL;
        float *left = constant(N, 1), *V = constant(N, 0);
        for (size_t i = 0; i < N; i++) {
            V[i] = (float)(area[i] / total);
            if (!factored) left[i] = (float)(-rho_or_one(rho[i]) / (1 - mean_rho));
        }
        if (factored)
            ck_ok(operator_low_rank_create_factored(N, 1, 1, rho, left, V,
                                                    constant(1, (float)(1 / (1 - mean_rho))), &op, &error));
        else
            ck_ok(operator_low_rank_create_folded(N, 1, rho, left, V, &op, &error));
        float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E),
              *H = transport_apply(op, false, 1, LAM_IRRADIANCE, E);
        for (size_t i = 0; i < N; i++) {
            double h = mean_E / (1 - mean_rho), b = (double)E[i] + (double)rho[i] * h;
            /* V, Y or core, the sum over N, at most two products of one term, rho', a division: all positive.
             */
            double tolerance = 1.001 * (2 + sum_roundings(N) + 2 * sum_roundings(1) + 3) * TRANSPORT_U;
            ck_assert_double_le(fabs((double)B[i] - b), tolerance * b);
            ck_assert_double_le(fabs((double)H[i] - h), tolerance * h);
        }
        free(B);
        free(H);
        lam_operator_close(op);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("operator store");
    TCase *tests = tcase_create("files");
    tcase_set_timeout(tests, 300);
    tcase_add_unchecked_fixture(tests, transport_keep_all, transport_free_all);
    tcase_add_checked_fixture(tests, setup, operator_file_teardown);
    tcase_add_loop_test(tests, what_is_saved_comes_back_bit_for_bit, 0, TRANSPORTS);
    tcase_add_test(tests, exact_is_stored_as_the_whole_matrix);
    tcase_add_loop_test(tests, every_failed_allocation_is_an_error, 0, TRANSPORTS);
    tcase_add_loop_test(tests, files_that_cannot_be_are_refused, 0, (int)(sizeof recipes / sizeof *recipes));
    tcase_add_test(tests, missing_arguments_and_files_are_errors);
    tcase_add_test(tests, builders_are_told_what_is_wrong);
    tcase_add_test(tests, rank_zero_is_direct_light_only);
    tcase_add_test(tests, sphere_is_exact_with_one_column);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
