/* Operators of a mapped store answer with the bits of copies, and live as long as they are open. */
#include "solver/base/random.h"
#include "solver/operator/operator.h"
#include "solver/operator/sky_light.h"
#include "store/store_map.h"
#include "support/closed_box.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* 131 columns are no whole number of chunks; even bytes of 8,200 rows of them are worth a mapping. */
enum { N = 8200, K = 131, TILES = 70, VECTORS = 17, SELECTED = 9 };

static char file_folder[64], path[256];
static lam_error error;

static void setup(void) {
    sample_folder(file_folder);
    snprintf(path, sizeof path, "%s/operator.h5", file_folder);
    error = (lam_error){.message = ""};
}

static void teardown(void) {
    sample_folder_remove(file_folder);
}

static uint64_t random_state = 11;

static float *random_floats(size_t count, float least, float most) {
    float *x = malloc(count * sizeof *x);
    for (size_t i = 0; i < count; i++) {
        x[i] = least + (most - least) * random_to_float(random_lcg(&random_state));
    }
    return x;
}

typedef struct subject {
    const char *name;
    bool factored, two_mesh;
    panel_precision precision;
    size_t n_mapped; /* arrays of [N][K] that are */
} subject;

static const subject subjects[] = {
    {"low_rank, folded", false, false, PANEL_F32, 2},
    {"low_rank, folded, f16", false, false, PANEL_F16, 2},
    {"low_rank, folded, i8", false, false, PANEL_I8, 2},
    {"low_rank, factored", true, false, PANEL_F32, 2},
    {"low_rank, factored, i8", true, false, PANEL_I8, 2},
    {"two_mesh, folded", false, true, PANEL_F32, 1},
    {"two_mesh, factored, f16", true, true, PANEL_F16, 1},
};
enum { SUBJECTS = sizeof subjects / sizeof *subjects };

static lam_operator *make(const subject *s) {
    const size_t C = s->factored ? 2 : 1;
    float *reflectance = random_floats(C * N, 0, .9f), *left = random_floats((size_t)N * K, -.01f, .01f);
    float *V = random_floats((size_t)N * K, -.01f, .01f);
    float *core = s->factored ? random_floats(C * K * K, -.1f, .1f) : NULL;
    lam_operator *op = NULL, *narrow = NULL;
    for (size_t i = 0; i < N; i += 5) reflectance[i] = 0;
    if (s->two_mesh) {
        two_mesh_arrays arrays = {.left = left, .core = core};
        arrays.begin = malloc((K + 1) * sizeof *arrays.begin);
        for (size_t p = 0; p <= K; p++) arrays.begin[p] = p * N / K;
        free(V);
        ck_ok(operator_two_mesh_create(N, K, C, reflectance, &arrays, &op, &error));
    } else if (s->factored) {
        ck_ok(operator_low_rank_create_factored(N, K, C, reflectance, left, V, core, &op, &error));
    } else {
        ck_ok(operator_low_rank_create_folded(N, K, reflectance, left, V, &op, &error));
    }
    uint32_t *order = malloc(N * sizeof *order);
    for (size_t p = 0; p < N; p++) order[p] = (uint32_t)(p * 3 % N); /* 3 does not divide N */
    ck_ok(operator_set_order(op, order, &error));
    free(order);
    free(reflectance);
    if (s->precision == PANEL_F32) return op;
    ck_ok(operator_narrow(op, s->precision, &narrow, &error));
    lam_operator_close(op);
    return narrow;
}

static void save(const lam_operator *op, const float *first_bounce) {
    store *s = NULL;
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){op->n_channels, N}, op->reflectance,
                      &error));
    ck_ok(operator_save(op, s, &error));
    double *area = calloc(N, sizeof *area);
    ck_ok(store_write(s, "/mesh/area", STORE_F64, 1, (size_t[]){N}, area, &error));
    free(area);
    if (first_bounce != NULL)
        ck_ok(store_write(s, "/sky/first_bounce", STORE_F32, 2, (size_t[]){TILES, N}, first_bounce, &error));
    ck_ok(store_seal(s, &error));
}

/* Opens the file mapped, and takes it away: neither its name nor the store is needed any more. */
static lam_operator *load_mapped(size_t *mapped_bytes, lam_sky **sky) {
    store *s = NULL;
    lam_operator *op = NULL;
    ck_ok(store_open(path, &s, &error));
    ck_ok(store_map_file(s, &error));
    ck_ok(operator_load(s, &op, &error));
    if (sky != NULL) ck_ok(sky_load(s, N, sky, &error));
    *mapped_bytes = store_map_bytes(store_map_of(s));
    store_close(s);
    unlink(path);
    return op;
}

/* Every answer that there is, one after the other. */
static float *answers(lam_operator *op, size_t n_threads, size_t *count) {
    const size_t C = op->n_channels, whole = VECTORS * C * N, some = VECTORS * C * SELECTED;
    const uint32_t selected[SELECTED] = {0, 1, 2, 3, 4099, 8199, 8198, 8197, 1};
    lam_operator_set_threads(op, n_threads);
    const size_t work_bytes = lam_operator_work_bytes(op, VECTORS);
    random_state = 5;
    float *E = random_floats(whole, 0, 1), *out = malloc((3 * whole + some) * sizeof *out);
    void *work = malloc(work_bytes);
    for (size_t i = 0; i < C * N; i++) E[i] *= i % 700 == 3; /* the first is almost dark */
    ck_ok(lam_operator_apply(op, VECTORS, LAM_RADIOSITY, E, out, work, work_bytes, &error));
    ck_ok(lam_operator_apply(op, 1, LAM_IRRADIANCE, E + whole / VECTORS, out + whole, work, work_bytes,
                             &error));
    ck_ok(lam_operator_apply(op, VECTORS - 1, LAM_INDIRECT, E, out + whole + whole / VECTORS, work,
                             work_bytes, &error));
    ck_ok(
        lam_operator_apply_adjoint(op, VECTORS, LAM_RADIOSITY, E, out + 2 * whole, work, work_bytes, &error));
    ck_ok(lam_operator_apply_selected(op, VECTORS, LAM_RADIOSITY, E, NULL, SELECTED, selected,
                                      out + 3 * whole, work, work_bytes, &error));
    free(E);
    free(work);
    *count = 3 * whole + some;
    return out;
}

START_TEST(mapped_operators_have_the_bits_of_copies) {
    const subject *s = &subjects[_i];
    size_t count, mapped_bytes;
    lam_operator *made = make(s), *copy = NULL;
    save(made, NULL);
    ck_ok(lam_operator_open(path, &copy, &error));
    lam_operator *mapped = load_mapped(&mapped_bytes, NULL);
    /* The reflectances of two channels and the cores are long enough, too. */
    const size_t more = s->factored ? 2 * (N + K * K) * sizeof(float) : 0;
    ck_assert_msg(mapped_bytes == s->n_mapped * N * K * panel_value_size(s->precision) + more,
                  "%s: %zu bytes mapped", s->name, mapped_bytes);
    ck_assert_uint_le(mapped_bytes, lam_operator_bytes(mapped) + made->n_channels * N * sizeof(float));
    float *wanted = answers(copy, 1, &count);
    for (size_t n_threads = 1; n_threads <= 3; n_threads += 2) {
        float *found = answers(mapped, n_threads, &count);
        ck_assert_msg(memcmp(found, wanted, count * sizeof *found) == 0, "%s", s->name);
        free(found);
    }
    /* A mapped operator can be saved again, with the same bits. */
    lam_operator *again = NULL;
    save(mapped, NULL);
    lam_operator_close(mapped);
    ck_ok(lam_operator_open(path, &again, &error));
    float *found = answers(again, 1, &count);
    ck_assert_msg(memcmp(found, wanted, count * sizeof *found) == 0, "%s", s->name);
    free(found);
    free(wanted);
    lam_operator_close(made);
    lam_operator_close(copy);
    lam_operator_close(again);
}
END_TEST

/* A box whose tiles are worth a mapping. */
START_TEST(mapped_hierarchical_operators_have_the_bits_of_copies) {
    closed_box box = closed_box_make((double[]){1, 1, 1}, 16, .5f);
    const build_problem *problem = closed_box_problem(&box);
    const size_t n = problem->n;
    build_report report;
    lam_operator *made = hierarchical_good(problem, .005, &report), *copy = NULL;
    store *s = NULL;
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){1, n}, made->reflectance, &error));
    ck_ok(store_write(s, "/mesh/area", STORE_F64, 1, (size_t[]){n}, problem->area, &error));
    ck_ok(operator_save(made, s, &error));
    ck_ok(store_seal(s, &error));
    size_t mapped_bytes;
    ck_ok(lam_operator_open(path, &copy, &error));
    lam_operator *mapped = load_mapped(&mapped_bytes, NULL);
    ck_assert_uint_gt(mapped_bytes, STORE_MAP_LEAST);
    ck_assert_ptr_null(mapped->order); /* it waits for an answer */
    ck_assert_uint_eq(lam_operator_bytes(mapped), lam_operator_bytes(made));
    for (size_t n_rhs = 1; n_rhs <= 16; n_rhs += 15) {
        const size_t count = n_rhs * n;
        float *E = random_floats(count, 0, 1), *out[3];
        const lam_operator *const all[] = {made, copy, mapped};
        for (size_t k = 0; k < 3; k++) {
            const size_t bytes = lam_operator_work_bytes(all[k], n_rhs);
            void *work = malloc(bytes);
            out[k] = malloc(2 * count * sizeof(float));
            ck_ok(lam_operator_apply(all[k], n_rhs, LAM_RADIOSITY, E, out[k], work, bytes, &error));
            ck_ok(lam_operator_apply_adjoint(all[k], n_rhs, LAM_IRRADIANCE, E, out[k] + count, work, bytes,
                                             &error));
            ck_assert_mem_eq(out[k], out[0], 2 * count * sizeof(float));
            free(work);
        }
        for (size_t k = 0; k < 3; k++) free(out[k]);
        free(E);
    }
    lam_operator_close(made);
    lam_operator_close(copy);
    lam_operator_close(mapped);
    closed_box_free(&box);
}
END_TEST

START_TEST(mapped_skies_have_the_bits_of_copies) {
    lam_operator *made = make(&subjects[0]);
    lam_sky *copy = NULL, *mapped = NULL;
    float *first_bounce = random_floats((size_t)TILES * N, 0, 1), *L = random_floats(3 * TILES, 0, 1);
    float *H0[2], *back[2];
    size_t mapped_bytes;
    save(made, first_bounce);
    ck_ok(lam_sky_open(path, &copy, &error));
    lam_operator_close(load_mapped(&mapped_bytes, &mapped));
    ck_assert_uint_eq(mapped_bytes, (2 * K + TILES) * N * sizeof(float));
    for (int i = 0; i < 2; i++) {
        H0[i] = malloc((size_t)3 * N * sizeof **H0);
        back[i] = malloc((size_t)3 * TILES * sizeof **back);
        lam_sky_irradiance(i == 0 ? copy : mapped, 3, L, H0[i]);
        lam_sky_adjoint(i == 0 ? copy : mapped, 3, H0[i], back[i]);
    }
    ck_assert_mem_eq(H0[0], H0[1], (size_t)3 * N * sizeof **H0);
    ck_assert_mem_eq(back[0], back[1], (size_t)3 * TILES * sizeof **back);
    for (int i = 0; i < 2; i++) {
        free(H0[i]);
        free(back[i]);
    }
    lam_sky_close(copy);
    lam_sky_close(mapped);
    lam_operator_close(made);
    free(first_bounce);
    free(L);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("operator mapped");
    TCase *tests = tcase_create("operator mapped");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_loop_test(tests, mapped_operators_have_the_bits_of_copies, 0, SUBJECTS);
    tcase_add_test(tests, mapped_hierarchical_operators_have_the_bits_of_copies);
    tcase_add_test(tests, mapped_skies_have_the_bits_of_copies);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
