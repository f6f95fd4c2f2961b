/* The runtime half of a sky: H0 = first_bounce^T L from a store. */
#include "solver/base/random.h"
#include "solver/operator/sky_light.h"
#include "store/store.h"
#include "support/suite.h"
#include "support/transport.h"

#include <unistd.h>

enum { M = 37, N = 1300 };

static void write_store(const char *path, size_t m, size_t n, const float *first_bounce) {
    lam_error error = {0};
    store *s = NULL;
    double *area = test_allocate(N, sizeof *area);
    ck_assert_int_eq(store_create(path, &s, &error), LAM_OK);
    ck_assert_int_eq(store_write(s, "/mesh/area", STORE_F64, 1, (size_t[]){N}, area, &error), LAM_OK);
    if (first_bounce != NULL)
        ck_assert_int_eq(
            store_write(s, "/sky/first_bounce", STORE_F32, 2, (size_t[]){m, n}, first_bounce, &error),
            LAM_OK);
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
    free(area);
}

static void name_store(char path[64]) {
    snprintf(path, 64, "/tmp/lambert-sky-light-%d.h5", (int)getpid());
}

/* Against sums in double; a batch gives each row its own bits. */
START_TEST(irradiance) {
    char path[64];
    lam_error error = {0};
    lam_sky *sky = NULL;
    enum { ROWS = 5 };
    float *first_bounce = test_random_positive((size_t)M * N, 1), *L = test_random_positive(ROWS * M, 2);
    float *H0 = test_allocate(ROWS * N, sizeof *H0), *one = test_allocate(N, sizeof *one);
    for (size_t t = 0; t < M; t++) L[2 * M + t] = t == 20 ? 1 : 0; /* one tile alone */
    name_store(path);
    write_store(path, M, N, first_bounce);
    ck_assert_msg(lam_sky_open(path, &sky, &error) == LAM_OK, "%s", error.message);
    ck_assert_uint_eq(lam_sky_tiles(sky), M);
    ck_assert_uint_eq(lam_sky_elements(sky), N);
    for (size_t i = 0; i < ROWS * N; i++) H0[i] = NAN;
    lam_sky_irradiance(sky, ROWS, L, H0);
    for (size_t r = 0; r < ROWS; r++) {
        for (size_t i = 0; i < N; i++) {
            double sum = 0;
            for (size_t t = 0; t < M; t++) sum += (double)first_bounce[t * N + i] * (double)L[r * M + t];
            ck_assert_float_eq(H0[r * N + i], (float)sum);
        }
        lam_sky_irradiance(sky, 1, L + r * M, one);
        ck_assert_mem_eq(one, H0 + r * N, N * sizeof *one);
    }
    ck_assert_mem_eq(H0 + 2 * N, first_bounce + 20 * N, N * sizeof *H0);
    lam_sky_close(sky);
    unlink(path);
    free(first_bounce);
    free(L);
    free(H0);
    free(one);
}
END_TEST

START_TEST(stores_without_a_sky_and_bad_ones) {
    char path[64];
    lam_error error = {0};
    lam_sky *sky = (lam_sky *)&error;
    float *first_bounce = test_random_positive((size_t)M * N, 1);
    name_store(path);
    write_store(path, 0, 0, NULL);
    ck_assert_int_eq(lam_sky_open(path, &sky, &error), LAM_OK);
    ck_assert_ptr_null(sky);
    lam_sky_close(sky);
    write_store(path, 0, N, first_bounce);
    ck_assert_int_eq(lam_sky_open(path, &sky, &error), LAM_ERR_FORMAT);
    write_store(path, M, N - 1, first_bounce);
    ck_assert_int_eq(lam_sky_open(path, &sky, &error), LAM_ERR_FORMAT);
    static const float wrong[] = {-1e-30f, NAN, INFINITY};
    for (size_t k = 0; k < 3; k++) {
        first_bounce[2 * N + 5] = wrong[k];
        write_store(path, M, N, first_bounce);
        ck_assert_int_eq(lam_sky_open(path, &sky, &error), LAM_ERR_FORMAT);
        ck_assert_msg(strstr(error.message, "first_bounce[2][5]") != NULL, "%s", error.message);
    }
    ck_assert_int_eq(lam_sky_open("/tmp/lambert-no-such.h5", &sky, &error), LAM_ERR_IO);
    unlink(path);
    free(first_bounce);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sky_light");
    TCase *tests = tcase_create("sky_light");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, irradiance);
    tcase_add_test(tests, stores_without_a_sky_and_bad_ones);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
