/* Figures of groups that a command line asks for, and arrays as files, on a mesh made by hand. */
#include "solver/codec/request.h"
#include "solver/output/output.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { N = 4 };

static double area[N] = {1, 2, 3, 4};
static uint32_t group[N] = {0, 1, 1, 2};
static const char *const names[] = {"lamp", "table.top", "table.leg"};

static group_index make_groups(void) {
    return named_groups(N, group, 3, names);
}

START_TEST(test_reduce) {
    const mesh m = {.n = N, .area = area, .group = group, .n_channels = 1};
    const float x[N] = {9, 1, 3, 2};
    const double wide[N] = {9, 1, 3, 2};
    group_index groups = make_groups();
    reduction r[3] = {0};
    size_t n = 0;
    lam_error error;
    ck_assert_int_eq(reductions_add(r, &n, "table=mean,variance", &error), LAM_OK);
    ck_assert_int_eq(reductions_add(r, &n, "lamp=sum", &error), LAM_OK);
    ck_assert_int_eq(reductions_add(r, &n, "table=sum,min,max,uniformity", &error), LAM_OK);
    ck_assert_uint_eq(n, 2);
    ck_assert_int_eq(reductions_bind(r, n, &groups, &error), LAM_OK);
    for (int doubles = 0; doubles < 2; doubles++) {
        solution s = {.m = &m,
                      .groups = &groups,
                      .n_vectors = 1,
                      .values = doubles ? NULL : x,
                      .refined = doubles ? wide : NULL,
                      .reductions = r,
                      .n_reductions = n};
        ck_assert_int_eq(reductions_fill(&s, &error), LAM_OK);
        /* areas 2, 3, 4 and values 1, 3, 2: sum 19, mean 19/9; variance (2 + 27 + 16)/9 - (19/9)^2 */
        const double wanted[] = {19. / 9, 5 - 361. / 81, 19, 1, 3, 9. / 19};
        for (size_t k = 0; k < 6; k++)
            ck_assert_double_eq_tol(output_figure(&s, &r[0], k, 0), wanted[k], 1e-12);
        ck_assert_double_eq(output_figure(&s, &r[1], 0, 0), 9);
        free(r[0].figures);
        free(r[1].figures);
        r[0].figures = r[1].figures = NULL;
    }
    double none[REDUCE_COUNT];
    reduce_groups(0, NULL, &groups, area, (reduce_values){.floats = x, .whole = true}, none);
    ck_assert(isnan(none[REDUCE_MEAN]) && isnan(none[REDUCE_MIN]));
    reductions_free(r, n);
    static const char *const bad[] = {"table",        "=mean",          "table=",         "table=mean,",
                                      "table=median", "table=mean;max", "table=mean,mean"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        reduction one[1] = {0};
        n = 0;
        ck_assert_msg(reductions_add(one, &n, bad[i], &error) == LAM_ERR_ARGUMENT, "'%s' was read", bad[i]);
        ck_assert_ptr_nonnull(strstr(error.message, bad[i]));
        reductions_free(one, n);
    }
    reduction chair[1] = {0};
    n = 0;
    ck_assert_int_eq(reductions_add(chair, &n, "tabel=mean", &error), LAM_OK);
    ck_assert_int_eq(reductions_bind(chair, n, &groups, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "no group \"tabel\"; did you mean \"table\"?"));
    reductions_free(chair, n);
    group_index_free(&groups);
}
END_TEST

/* More values than a block, in both types; no values at all. */
START_TEST(test_arrays) {
    enum { MANY = 200000 };
    float *floats = malloc(MANY * sizeof *floats);
    double *doubles = malloc(MANY * sizeof *doubles);
    lam_error error;
    for (size_t i = 0; i < MANY; i++) doubles[i] = floats[i] = (float)i / 3;
    for (int k = 0; k < 4; k++) {
        const bool wide = k & 1, empty = k & 2;
        const size_t shape[] = {2, empty ? 0 : MANY / 2}, bytes = empty ? 0 : MANY * (wide ? 8 : 4);
        char *data = NULL;
        size_t size = 0;
        FILE *stream = open_memstream(&data, &size);
        ck_assert_int_eq(output_array(stream, 2, shape, wide ? NULL : floats, wide ? doubles : NULL, &error),
                         LAM_OK);
        fclose(stream);
        ck_assert_uint_eq((size - bytes) % 64, 0);
        ck_assert_mem_eq(data + size - bytes, wide ? (void *)doubles : (void *)floats, bytes);
        ck_assert_ptr_nonnull(memmem(data, size - bytes, wide ? "<f8" : "<f4", 3));
        free(data);
    }
    free(floats);
    free(doubles);
}
END_TEST

int main(void) {
    Suite *s = suite_create("output");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, test_reduce);
    tcase_add_test(c, test_arrays);
    suite_add_tcase(s, c);
    return suite_run(s);
}
