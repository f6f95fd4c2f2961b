/* Gradients by reflectance and by the sky's irradiance, against central differences of B = E + rho H,
 * H = H0 + F B, converged in double; and figures over groups, against sums written out. */
#include "solver/codec/group_figures.h"
#include "solver/operator/groups/gradient.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 7 };

typedef struct problem_of_seven {
    double F[N][N], rho[N], E[N], H0[N], g[N];
} problem_of_seven;

static double next_random(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (double)(*state >> 11) * 0x1p-53;
}

/* Rows of F sum to .9; elements 0 and 4 are black. All but F is exact in single precision. */
static problem_of_seven make_problem(uint64_t seed) {
    problem_of_seven p;
    for (int i = 0; i < N; i++) {
        double sum = 0;
        for (int j = 0; j < N; j++) sum += p.F[i][j] = i == j ? 0 : next_random(&seed);
        for (int j = 0; j < N; j++) p.F[i][j] *= .9 / sum;
        p.rho[i] = i % 4 == 0 ? 0 : (double)(float)(.2 + .6 * next_random(&seed));
        p.E[i] = (double)(float)next_random(&seed);
        p.H0[i] = (double)(float)next_random(&seed);
        p.g[i] = (double)(float)(next_random(&seed) - .5);
    }
    return p;
}

/* Radiosity, irradiance and indirect light; 400 sweeps leave .8^400 < 1e-38. */
static void solve(const problem_of_seven *p, double q[3][N]) {
    double B[N] = {0}, H[N];
    for (int sweep = 0; sweep < 400; sweep++) {
        for (int i = 0; i < N; i++) {
            H[i] = p->H0[i];
            for (int j = 0; j < N; j++) H[i] += p->F[i][j] * B[j];
        }
        for (int i = 0; i < N; i++) B[i] = p->E[i] + p->rho[i] * H[i];
    }
    for (int i = 0; i < N; i++) {
        q[LAM_RADIOSITY][i] = B[i];
        q[LAM_IRRADIANCE][i] = H[i];
        q[LAM_INDIRECT][i] = B[i] - p->E[i] - p->rho[i] * p->H0[i];
    }
}

static double J_of(const problem_of_seven *p, lam_quantity quantity) {
    double q[3][N], J = 0;
    solve(p, q);
    for (int i = 0; i < N; i++) J += p->g[i] * q[quantity][i];
    return J;
}

/* dJ/dx by central differences: h^2 J''' / 6 + 1e-16 / h, some 1e-9 at h = 1e-5. */
static double difference(problem_of_seven *p, lam_quantity quantity, double *x) {
    const double h = 1e-5, kept = *x;
    *x = kept + h;
    const double up = J_of(p, quantity);
    *x = kept - h;
    const double down = J_of(p, quantity);
    *x = kept;
    return (up - down) / (2 * h);
}

static void narrow(const double *x, float *out) {
    for (int i = 0; i < N; i++) out[i] = (float)x[i];
}

START_TEST(gradients_are_differences) {
    for (int q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++)
        for (int sky = 0; sky < 2; sky++) {
            const lam_quantity quantity = (lam_quantity)q;
            problem_of_seven p = make_problem(0x1234 + (uint64_t)q);
            if (!sky) memset(p.H0, 0, sizeof p.H0);
            double solved[3][N], w[N];
            solve(&p, solved);
            for (int i = 0; i < N; i++) w[i] = difference(&p, quantity, &p.E[i]);
            float g_f[N], w_f[N], H_f[N], H0_f[N], rho_f[N], by_rho[N], by_H0[N];
            narrow(p.g, g_f);
            narrow(w, w_f);
            narrow(solved[LAM_IRRADIANCE], H_f);
            narrow(p.H0, H0_f);
            narrow(p.rho, rho_f);
            gradient_of_reflectance(quantity, N, g_f, w_f, H_f, sky ? H0_f : NULL, by_rho);
            gradient_of_direct_irradiance(quantity, N, rho_f, g_f, w_f, by_H0);
            for (int i = 0; i < N; i++) {
                /* Values are below 10, each rounded to 6e-8 of it, three of them in a sum of two products. */
                ck_assert_double_eq_tol((double)by_rho[i], difference(&p, quantity, &p.rho[i]), 1e-5);
                ck_assert_double_eq_tol((double)by_H0[i], difference(&p, quantity, &p.H0[i]), 1e-5);
            }
            /* The result may take the place of an argument. */
            gradient_of_reflectance(quantity, N, g_f, w_f, H_f, sky ? H0_f : NULL, H_f);
            ck_assert_mem_eq(H_f, by_rho, sizeof by_rho);
            gradient_of_direct_irradiance(quantity, N, rho_f, g_f, w_f, g_f);
            ck_assert_mem_eq(g_f, by_H0, sizeof by_H0);
        }
}
END_TEST

/* Elements 0 2 4 are "a.x", 1 3 "a.y", 5 6 "b", none "empty". */
static group_index make_groups(void) {
    static const char *const names[4] = {"a.x", "a.y", "b", "empty"};
    static const uint32_t group[N] = {0, 1, 0, 1, 0, 2, 2};
    return named_groups(N, group, 4, names);
}

static void add(reduce_request *r, const group_index *groups, const char *name, bool good) {
    const uint32_t *found = NULL;
    problem why = {0};
    const size_t count = group_index_find(groups, name, strlen(name), &found);
    ck_assert_uint_gt(count, 0);
    ck_assert(reduce_request_add(r, name, strlen(name), found, count, &why) == good);
    ck_assert_uint_eq(why.status, good ? 0 : 422);
}

static void write_is(const reduce_request *r, size_t C, size_t n_rhs, bool batch, const double *figures,
                     const char *wanted) {
    buffer b = {0};
    ck_assert(reduce_write(r, C, n_rhs, batch, figures, &b));
    ck_assert_str_eq(b.bytes, wanted);
    buffer_free(&b);
}

START_TEST(figures_are_sums_written_out) {
    static const double area[N] = {1, 2, 3, 1, 1, 4, 0};
    group_index groups = make_groups();
    reduce_request r = {
        .with = {REDUCE_MEAN, REDUCE_SUM, REDUCE_MIN, REDUCE_MAX, REDUCE_UNIFORMITY, REDUCE_VARIANCE},
        .n_with = 6};
    add(&r, &groups, "a.y", true);
    add(&r, &groups, "a", true);
    add(&r, &groups, "empty", true);
    add(&r, &groups, "b", true);
    add(&r, &groups, "a", false);
    uint32_t *elements = NULL;
    size_t count = 0;
    ck_assert(reduce_elements(&r, &groups, &elements, &count));
    ck_assert_uint_eq(count, N);
    ck_assert_mem_eq(elements, ((uint32_t[]){1, 3, 0, 2, 4, 5, 6}), N * sizeof *elements);
    /* Values of elements 0 ... 6: 8 3 2 6 1 -1 5, and all of them 0. */
    static const float x[2][N] = {{3, 6, 8, 2, 1, -1, 5}, {0}};
    double *figures = reduce_figures(&r, 2, 1);
    ck_assert_ptr_nonnull(figures);
    for (size_t v = 0; v < 2; v++)
        ck_assert(reduce_vectors(&r, &groups, area, 1, 2, v, 1, (reduce_values){.floats = x[v]}, figures));
    /* a.y: (2 3 + 1 6) / 3 = 4; (2 1 + 1 4) / 3 = 2. a: (8 + 6 + 6 + 6 + 1) / 8 = 3.375; variance (64 + 18 +
     * 12 + 36 + 1) / 8 - 3.375^2 = 4.984375. b: only the first has an area, the least and the largest are of
     * both. */
    write_is(&r, 1, 2, true, figures,
             "{\"a.y\":{\"mean\":[4,0],\"sum\":[12,0],\"min\":[3,0],\"max\":[6,0],\"uniformity\":[0.75,null],"
             "\"variance\":[2,0]},"
             "\"a\":{\"mean\":[3.375,0],\"sum\":[27,0],\"min\":[1,0],\"max\":[8,0],"
             "\"uniformity\":[0.2962962962962963,null],\"variance\":[4.984375,0]},"
             "\"empty\":{\"mean\":[null,null],\"sum\":[null,null],\"min\":[null,null],\"max\":[null,null],"
             "\"uniformity\":[null,null],\"variance\":[null,null]},"
             "\"b\":{\"mean\":[-1,0],\"sum\":[-4,0],\"min\":[-1,0],\"max\":[5,0],\"uniformity\":[1,null],"
             "\"variance\":[0,0]}}");
    free(figures);
    free(elements);
    reduce_request_free(&r);
    group_index_free(&groups);
}
END_TEST

/* Of elements 0 2 4 and 1 3 the second and the last are buried, and all of b. */
START_TEST(figures_leave_out_what_is_buried) {
    static const double area[N] = {1, 2, 3, 1, 1, 4, 0};
    static const bool buried[N] = {false, false, true, true, false, true, true};
    static const float x[N] = {3, 6, 0, -1, 1, 7, 5}, part[5] = {6, -1, 3, 0, 1};
    group_index groups = make_groups();
    reduce_request r = {
        .with = {REDUCE_MEAN, REDUCE_SUM, REDUCE_MIN, REDUCE_MAX, REDUCE_UNIFORMITY, REDUCE_VARIANCE},
        .n_with = 6};
    group_extent counted, left_out;
    double every[REDUCE_COUNT];
    groups.buried = malloc(sizeof buried);
    memcpy(groups.buried, buried, sizeof buried);
    add(&r, &groups, "a.y", true);
    add(&r, &groups, "a.x", true);
    double *figures = reduce_figures(&r, 1, 1);
    const char *wanted =
        "{\"a.y\":{\"mean\":6,\"sum\":12,\"min\":6,\"max\":6,\"uniformity\":1,\"variance\":0},"
        "\"a.x\":{\"mean\":2,\"sum\":4,\"min\":1,\"max\":3,\"uniformity\":0.5,\"variance\":1}}";
    ck_assert(
        reduce_vectors(&r, &groups, area, 1, 1, 0, 1, (reduce_values){.floats = x, .whole = true}, figures));
    write_is(&r, 1, 1, false, figures, wanted);
    ck_assert(reduce_vectors(&r, &groups, area, 1, 1, 0, 1, (reduce_values){.floats = part}, figures));
    write_is(&r, 1, 1, false, figures, wanted);
    reduce_groups(1, (uint32_t[]){2}, &groups, area, (reduce_values){.floats = x}, every);
    for (int k = 0; k < REDUCE_COUNT; k++) ck_assert(isnan(every[k]));
    group_index_extent(&groups, 0, area, &counted, &left_out);
    ck_assert(counted.elements == 2 && counted.area == 2 && left_out.elements == 1 && left_out.area == 3);
    free(figures);
    reduce_request_free(&r);
    group_index_free(&groups);
}
END_TEST

START_TEST(figures_have_the_shape_asked) {
    group_index groups = make_groups();
    reduce_request r = {.with = {REDUCE_SUM, REDUCE_MEAN}, .n_with = 2};
    add(&r, &groups, "b", true);
    double figures[8];
    reduce_means(&r, 0, 2, 2, 10, (double[]){1, 2, 3, 4}, figures);
    write_is(&r, 2, 2, true, figures, "{\"b\":{\"sum\":[[10,20],[30,40]],\"mean\":[[1,2],[3,4]]}}");
    reduce_means(&r, 0, 2, 1, 10, (double[]){1, 2}, figures);
    write_is(&r, 2, 1, false, figures, "{\"b\":{\"sum\":[10,20],\"mean\":[1,2]}}");
    write_is(&r, 2, 1, true, figures, "{\"b\":{\"sum\":[[10,20]],\"mean\":[[1,2]]}}");
    reduce_means(&r, 0, 1, 1, 10, (double[]){.1}, figures);
    write_is(&r, 1, 1, false, figures, "{\"b\":{\"sum\":1,\"mean\":0.1}}");
    reduce_means(&r, 0, 1, 1, 0, (double[]){.1}, figures);
    write_is(&r, 1, 1, false, figures, "{\"b\":{\"sum\":null,\"mean\":null}}");
    reduce_request_free(&r);
    group_index_free(&groups);
}
END_TEST

/* Ratings are written by who has them, between what stands before and after; else they are null. */
START_TEST(ratings_stand_among_figures) {
    group_index groups = make_groups();
    reduce_request r = {.with = {REDUCE_MEAN, REDUCE_MAX}, .n_with = 2, .linear = true};
    static const float x[2][N] = {{3, 6, 8, 2, 1, -1, 5}, {0}};
    buffer b = {0};
    ck_assert(!reduce_has_ugr(&r));
    reduce_request_ugr(&r);
    reduce_request_shares(&r, 1, 1, (double[]){5});
    ck_assert(reduce_has_ugr(&r) && !r.linear);
    add(&r, &groups, "b", true);
    add(&r, &groups, "a.y", true);
    double *figures = reduce_figures(&r, 2, 1);
    ck_assert_ptr_nonnull(figures);
    for (size_t v = 0; v < 2; v++)
        ck_assert(reduce_vectors(&r, &groups, NULL, 1, 2, v, 1,
                                 (reduce_values){.floats = x[v], .whole = true}, figures));
    write_is(&r, 1, 2, true, figures,
             "{\"b\":{\"mean\":[2,0],\"share\":{\"5\":[0.5,0]},\"max\":[5,0],\"ugr\":[null,null]},"
             "\"a.y\":{\"mean\":[4,0],\"share\":{\"5\":[0.5,0]},\"max\":[6,0],\"ugr\":[null,null]}}");
    for (size_t at = 0; at < reduce_vectors_written(&r, 2); at++) {
        const reduce_place place = reduce_place_of(&r, 2, at);
        ck_assert(at == (place.name * r.n_with + place.statistic) * 2 + place.vector);
        if (r.with[place.statistic] != REDUCE_UGR)
            ck_assert(reduce_write_some(&r, 1, 2, true, figures, at, 1, &b));
        else
            ck_assert(reduce_write_before(&r, 2, true, at, &b) && buffer_printf(&b, "[%zu]", place.vector) &&
                      reduce_write_after(&r, 2, true, at, &b));
    }
    ck_assert_str_eq(b.bytes,
                     "\"b\":{\"mean\":[2,0],\"share\":{\"5\":[0.5,0]},\"max\":[5,0],\"ugr\":[[0],[1]]},"
                     "\"a.y\":{\"mean\":[4,0],\"share\":{\"5\":[0.5,0]},\"max\":[6,0],\"ugr\":[[0],[1]]}");
    buffer_free(&b);
    free(figures);
    reduce_request_free(&r);
    group_index_free(&groups);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("gradient");
    TCase *tcase = tcase_create("gradient");
    tcase_add_test(tcase, gradients_are_differences);
    tcase_add_test(tcase, figures_are_sums_written_out);
    tcase_add_test(tcase, figures_leave_out_what_is_buried);
    tcase_add_test(tcase, figures_have_the_shape_asked);
    tcase_add_test(tcase, ratings_stand_among_figures);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
