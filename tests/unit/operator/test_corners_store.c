/* lam_corners: the corners of a store, light there and its transpose, and stores that are wrong. */
#include "lambert/lambert.h"
#include "store/groups.h"
#include "store/store.h"
#include "support/suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Two squares and a triangle beside them, in one plane; the second square is of another group. */
enum { N = 3, V = 7 };
#define NONE 0xFFFFFFFFu

typedef struct sample {
    double vertices[V][3];
    uint32_t elements[N][4];
    float normal[N][3];
    uint32_t group[N];
} sample;

static sample make(void) {
    return (sample){.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {0, 2, 0}},
                    .elements = {{0, 1, 4, 3}, {1, 2, 5, 4}, {3, 4, 6, NONE}},
                    .normal = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
                    .group = {0, 1, 0}};
}

static void save(const sample *a, char path[64]) {
    lam_error error = {.message = ""};
    store *s = NULL;
    snprintf(path, 64, "/tmp/lambert-corners-%d.h5", (int)getpid());
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, STORE_MESH "/vertices", STORE_F64, 2, (size_t[]){V, 3}, a->vertices, &error));
    ck_ok(store_write(s, STORE_MESH "/elements", STORE_U32, 2, (size_t[]){N, 4}, a->elements, &error));
    ck_ok(store_write(s, STORE_MESH "/normal", STORE_F32, 2, (size_t[]){N, 3}, a->normal, &error));
    ck_ok(store_write(s, STORE_MESH "/group", STORE_U32, 1, (size_t[]){N}, a->group, &error));
    ck_ok(store_seal(s, &error));
}

/* Sums of 9 products of numbers of about 10, in single precision. */
START_TEST(light_and_its_transpose) {
    char path[64];
    lam_error error = {.message = ""};
    lam_corners *c = NULL;
    const sample a = make();
    const uint32_t *list = NULL;
    const float x[2 * N] = {8, 9, 10, 7, 9, 11},
                      g[2 * 9] = {1, 2, -1, 3, 0, 1, 2, 1, 4, 2, 1, 1, 0, 5, 1, 1, 1, 2};
    float out[2 * 9], w[2 * N], work[N + 2 * 9];
    save(&a, path);
    ck_ok(lam_corners_open(path, &c, &error));
    unlink(path);
    ck_assert_uint_eq(lam_corners_elements(c), N);
    ck_assert_uint_eq(lam_corners_count(c), 9); /* 5 of group 0, and 4 */
    ck_assert_uint_eq(lam_corners_of(c, 0, &list), 4);
    ck_assert_uint_eq(list[0], 0);
    ck_assert_uint_eq(lam_corners_of(c, 2, &list), 3);
    for (int d = 0; d < 3; d++)
        ck_assert_double_eq(lam_corners_positions(c)[3 * list[2] + (uint32_t)d], a.vertices[6][d]);
    lam_corners_apply(c, 2, x, out, work);
    for (int r = 0; r < 2; r++) {
        double left = 0, right = 0;
        /* The other group alone has its own light, at all of its corners. */
        for (int j = 5; j < 9; j++) ck_assert_float_eq(out[9 * r + j], 9);
        lam_corners_adjoint(c, 1, g + 9 * r, w + N * r, work);
        for (int j = 0; j < 9; j++) left += (double)g[9 * r + j] * (double)out[9 * r + j];
        for (int i = 0; i < N; i++) right += (double)w[N * r + i] * (double)x[N * r + i];
        ck_assert_double_eq_tol(left, right, 1e-3);
    }
    lam_corners_close(c);
    lam_corners_close(NULL);
}
END_TEST

START_TEST(wrong_stores_are_refused) {
    char path[64];
    lam_error error = {.message = ""};
    lam_corners *c = NULL;
    sample a = make();
    a.elements[1][2] = V;
    save(&a, path);
    ck_assert_int_eq(lam_corners_open(path, &c, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, "/mesh/elements[1][2] = 7, there are 7 vertices") != NULL, "%s",
                  error.message);
    a = make();
    a.vertices[2][1] = INFINITY;
    save(&a, path);
    ck_assert_int_eq(lam_corners_open(path, &c, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, "/mesh/vertices[2][1] = inf") != NULL, "%s", error.message);
    unlink(path);
    ck_assert_int_eq(lam_corners_open(path, &c, &error), LAM_ERR_IO);
    ck_assert_int_eq(lam_corners_open(NULL, &c, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_null(c);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("corners_store");
    TCase *tests = tcase_create("corners_store");
    tcase_add_test(tests, light_and_its_transpose);
    tcase_add_test(tests, wrong_stores_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
