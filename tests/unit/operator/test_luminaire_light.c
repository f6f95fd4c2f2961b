/* The runtime half of luminaires: H0 += colour dimmer irradiance from a store. */
#include "solver/base/random.h"
#include "solver/operator/luminaire_light.h"
#include "store/store.h"
#include "support/suite.h"
#include "support/transport.h"

#include <unistd.h>

enum { K = 7, N = 1300, C = 3, G = 2 };

/* A number of /luminaires, and what is wrong with it. */
typedef struct wrong_value {
    const char *array;
    size_t at;
    double value;
} wrong_value;

static void write_numbers(store *s, const char *name, size_t width, uint64_t seed, const wrong_value *wrong) {
    lam_error error = {0};
    char path[64];
    double *x = test_allocate(K * 12, sizeof *x);
    for (size_t i = 0; i < K * 12; i++) x[i] = random_lcg_unit(&seed);
    /* Shapes are numbers of a list. */
    for (size_t k = 0; strcmp(name, "opening") == 0 && k < K; k++) x[k * 8] = (double)k;
    if (wrong != NULL && strcmp(wrong->array, name) == 0) x[wrong->at] = wrong->value;
    snprintf(path, sizeof path, "/luminaires/%s", name);
    ck_assert_int_eq(store_write(s, path, STORE_F64, width == 0 ? 1 : 2, (size_t[]){K, width}, x, &error),
                     LAM_OK);
    free(x);
}

static void write_store(const char *path, size_t k, const float *irradiance, const wrong_value *wrong) {
    static const char *const groups[] = {"row"};
    const char *names[K] = {"a", "b.0", "b.1", "c", "d", "e", "f"};
    uint32_t group[K] = {0, 0, LUMINAIRE_NO_GROUP, 0, 0, 0, 0};
    lam_error error = {0};
    store *s = NULL;
    float *reflectance = test_allocate(C * N, sizeof *reflectance);
    if (wrong != NULL && strcmp(wrong->array, "names") == 0) names[wrong->at] = names[(size_t)wrong->value];
    if (wrong != NULL && strcmp(wrong->array, "group") == 0) group[wrong->at] = (uint32_t)wrong->value;
    ck_assert_int_eq(store_create(path, &s, &error), LAM_OK);
    ck_assert_int_eq(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){C, N}, reflectance, &error),
                     LAM_OK);
    if (irradiance != NULL) {
        ck_assert_int_eq(
            store_write(s, "/luminaires/irradiance", STORE_F32, 2, (size_t[]){k, N}, irradiance, &error),
            LAM_OK);
        ck_assert_int_eq(store_write_texts(s, "/luminaires/names", K, names, &error), LAM_OK);
        ck_assert_int_eq(store_write_texts(s, "/luminaires/group_names", 1, groups, &error), LAM_OK);
        ck_assert_int_eq(store_write(s, "/luminaires/group", STORE_U32, 1, (size_t[]){K}, group, &error),
                         LAM_OK);
        write_numbers(s, "dimmers", 0, 1, wrong);
        write_numbers(s, "lumens", 0, 2, wrong);
        write_numbers(s, "colour", 3, 3, wrong);
        write_numbers(s, "place", 12, 4, wrong);
        write_numbers(s, "opening", 8, 5, wrong);
        write_numbers(s, "elements_off", G, 6, wrong);
        write_numbers(s, "means_off", G, 7, wrong);
    }
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
    free(reflectance);
}

static void name_store(char path[64]) {
    snprintf(path, 64, "/tmp/lambert-luminaire-light-%d.h5", (int)getpid());
}

/* Against sums in double, added to a sky; the transpose is one. */
START_TEST(irradiance) {
    char path[64];
    lam_error error = {0};
    lam_luminaires *l = NULL;
    enum { RHS = 3, ROWS = RHS * C };
    float *values = test_random_positive((size_t)K * N, 1), *D = test_random_positive(ROWS * K, 2);
    float *H0 = test_random_positive((size_t)ROWS * N, 3), *sky = test_random_positive((size_t)ROWS * N, 3);
    float *one = test_random_positive((size_t)C * N, 3), *g = test_random_positive((size_t)ROWS * N, 4);
    float *w = test_allocate(ROWS * K, sizeof *w);
    double *twice = test_allocate(ROWS * N, sizeof *twice), *D2 = test_allocate(ROWS * K, sizeof *D2);
    name_store(path);
    write_store(path, K, values, NULL);
    ck_assert_msg(lam_luminaires_open(path, &l, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(lam_luminaires_count(l), K);
    ck_assert_uint_eq(lam_luminaires_channels(l), C);
    ck_assert_uint_eq(lam_luminaires_elements(l), N);
    lam_luminaires_irradiance(l, RHS, D, H0);
    lam_luminaires_adjoint(l, RHS, g, w);
    for (size_t i = 0; i < ROWS * K; i++) D2[i] = (double)D[i];
    luminaires_irradiance_double(l, RHS, D2, twice);
    double left = 0, right = 0;
    for (size_t q = 0; q < ROWS; q++) {
        for (size_t i = 0; i < N; i++) {
            double sum = 0;
            for (size_t k = 0; k < K; k++)
                sum +=
                    luminaires_shown(l, k).colour[q % C] * (double)D[q * K + k] * (double)values[k * N + i];
            ck_assert_double_eq_tol(twice[q * N + i], sum, 1e-12);
            ck_assert_double_eq_tol((double)H0[q * N + i], sum + (double)sky[q * N + i], 1e-6);
            left += sum * (double)g[q * N + i];
        }
        for (size_t k = 0; k < K; k++) right += (double)w[q * K + k] * (double)D[q * K + k];
    }
    ck_assert_double_eq_tol(left, right, 1e-6 * left);
    memcpy(one, sky + C * N, C * N * sizeof *one);
    lam_luminaires_irradiance(l, 1, D + C * K, one);
    ck_assert_mem_eq(one, H0 + C * N, C * N * sizeof *one);
    lam_luminaires_close(l);
    unlink(path);
    free(values);
    free(D);
    free(H0);
    free(sky);
    free(one);
    free(g);
    free(w);
    free(twice);
    free(D2);
}
END_TEST

START_TEST(words_and_places) {
    char path[64];
    lam_error error = {0};
    lam_luminaires *l = NULL;
    float *values = test_random_positive((size_t)K * N, 1);
    name_store(path);
    write_store(path, K, values, NULL);
    ck_assert_msg(lam_luminaires_open(path, &l, &error) == LAM_OK, "%s", error.message);
    ck_assert_str_eq(lam_luminaires_name(l, 2), "b.1");
    ck_assert_ptr_null(luminaires_shown(l, 2).group);
    ck_assert_str_eq(luminaires_shown(l, 1).group, "row");
    ck_assert_int_eq(luminaires_shown(l, 5).shape, OPENING_CYLINDER);
    ck_assert_uint_eq(luminaires_groups(l), 1);
    ck_assert_uint_eq(luminaires_error_groups(l), G);
    ck_assert_double_gt(lam_luminaires_dimmer(l, 6), 0);
    lam_luminaires_close(l);
    unlink(path);
    free(values);
}
END_TEST

START_TEST(stores_without_luminaires_and_bad_ones) {
    static const wrong_value wrong[] = {
        {"dimmers", 2, -1},         {"lumens", 3, NAN},      {"colour", 4, -.5},  {"group", 1, 7},
        {"elements_off", 3, -1e-3}, {"place", 20, INFINITY}, {"opening", 5, NAN}, {"opening", 16, 11},
        {"opening", 16, .5},        {"opening", 16, 1e300},  {"names", 5, 0}};
    char path[64];
    lam_error error = {0};
    lam_luminaires *l = (lam_luminaires *)&error;
    float *values = test_random_positive((size_t)K * N, 1);
    name_store(path);
    write_store(path, 0, NULL, NULL);
    ck_assert_int_eq(lam_luminaires_open(path, &l, &error), LAM_OK);
    ck_assert_ptr_null(l);
    write_store(path, K - 1, values, NULL);
    ck_assert_int_eq(lam_luminaires_open(path, &l, &error), LAM_ERR_FORMAT);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        write_store(path, K, values, &wrong[k]);
        ck_assert_int_eq(lam_luminaires_open(path, &l, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, wrong[k].array) != NULL, "%s", error.message);
    }
    values[2 * N + 5] = -1e-30f;
    write_store(path, K, values, NULL);
    ck_assert_int_eq(lam_luminaires_open(path, &l, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, "irradiance[2][5]") != NULL, "%s", error.message);
    unlink(path);
    free(values);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("luminaire_light");
    TCase *tests = tcase_create("luminaire_light");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, irradiance);
    tcase_add_test(tests, words_and_places);
    tcase_add_test(tests, stores_without_luminaires_and_bad_ones);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
