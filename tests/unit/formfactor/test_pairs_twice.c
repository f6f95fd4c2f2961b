/* A reference by two samples of pairs that share what is projected: its noise against its error, by a sample
 * that is far finer, for scenes with and without pairs that are projected. */
#include "solver/formfactor/pairs/few_occluders.h"
#include "solver/formfactor/pairs/pairs_twice.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>

enum { SEEDS = 4 };
static const char *const stages[] = {"", ""};

static mesh make_scene(const char *kind, size_t elements) {
    const generate_options how = {.kind = kind,
                                  .elements = elements,
                                  .seed = 1,
                                  .reflectance = .5,
                                  .closed = true,
                                  .variant = 1,
                                  .terrain = "flat"};
    return generate_good(&how);
}

/* The unoccluded factor, which both samples share, is found far better. */
static pairs_options options_of(double accuracy, int projected, uint64_t seed) {
    return (pairs_options){.tolerance = 1e-8,
                           .accuracy = accuracy,
                           .segments = 8,
                           .segments_most = 1e12,
                           .occluders = projected,
                           .seed = seed};
}

/* Entries of both, in one dense matrix each. */
static double *dense_of(const csr *G) {
    double *out = calloc(G->n * G->n, sizeof *out);
    for (size_t i = 0; i < G->n; i++)
        for (uint64_t p = G->indptr[i]; p < G->indptr[i + 1]; p++)
            out[i * G->n + G->indices[p]] = (double)G->data[p];
    return out;
}

/* Sums over some seeds: squares of the error of the first reference, of the noise beside it, of the mean of
 * both over the seeds, and the pairs that noise was found for. */
typedef struct squares {
    double error, noise, bias, alone; /* alone: of errors of one sample */
    size_t disturbed, pairs;
} squares;

static squares measure(const mesh *m, const visibility *v, double accuracy, int projected) {
    lam_error error = {.message = ""};
    squares sum = {.error = 0};
    csr fine;
    pairs_report report;
    const size_t count = m->n * m->n;
    /* A hundredth of the error, where projection reaches it. */
    const pairs_options finest = options_of(accuracy / 100, UNCUT_OCCLUDERS_MOST, 77);
    ck_ok(pairs_exchange(m, v, &finest, &fine, &report, NULL, &error));
    double *const truth = dense_of(&fine), *bias = calloc(count, sizeof *bias);
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const pairs_options how = options_of(accuracy, projected, 2 * seed + 1);
        csr G[2], one;
        ck_ok(pairs_exchange_twice(m, v, &how, 2 * seed + 2, stages, G, &report, &error));
        ck_ok(pairs_exchange(m, v, &how, &one, &report, NULL, &error));
        double *const by_one = dense_of(&one);
        double *const mean = dense_of(&G[0]), *const noisy = dense_of(&G[1]);
        for (size_t k = 0; k < count; k++) {
            const double off = mean[k] - truth[k], noise = noisy[k] - mean[k];
            sum.error += off * off;
            sum.alone += (by_one[k] - truth[k]) * (by_one[k] - truth[k]);
            sum.noise += noise * noise;
            sum.disturbed += noise < 0 || noise > 0;
            bias[k] += off / SEEDS;
        }
        sum.pairs += G[0].indptr[m->n];
        csr_free(&G[0]);
        csr_free(&G[1]);
        csr_free(&one);
        free(by_one);
        free(mean);
        free(noisy);
    }
    for (size_t k = 0; k < count; k++) sum.bias += bias[k] * bias[k];
    csr_free(&fine);
    free(truth);
    free(bias);
    return sum;
}

/* times: that errors and noise may differ by. */
static void compare(const char *kind, int projected, bool projects, double times) {
    lam_error error = {.message = ""};
    visibility *v;
    mesh m = make_scene(kind, 150);
    ck_ok(visibility_create(&m, &v, &error));
    /* Coarser pairs that few segments are enough for are not projected. */
    const squares s = measure(&m, v, projects ? 1e-4 : 7e-4, projected);
    ck_assert_uint_gt(s.disturbed, 0);
    ck_assert_msg(s.error < times * times * s.noise && s.noise < times * times * s.error,
                  "error %g, noise %g", sqrt(s.error), sqrt(s.noise));
    /* N segments have an error as N^-3/4, few of them as N^-1/2: the mean of two samples of N/2 has one or
     * 2^(1/2) times the squared error of one of N. With N each it would be half. */
    if (projected == 0)
        ck_assert_msg(s.error > .8 * s.alone && s.error < 1.8 * s.alone, "error %g, of one sample %g",
                      sqrt(s.error), sqrt(s.alone));
    /* Of projected pairs one in eight is projected twice. */
    if (projects) ck_assert_uint_lt(4 * s.disturbed, s.pairs);
    /* Errors of the seeds are independent, up to a factor of 2 as above: their mean has 1/SEEDS of the sum.
     */
    ck_assert_double_lt(s.bias, 4 * s.error / (SEEDS * SEEDS));
    visibility_destroy(v);
    mesh_free(&m);
}

/* By segments thousands of pairs have an error each: of those a sum of squares is known to 2 %, and all but a
 * few of them have as many segments as they need. By projection, and in a maze, a few pairs have most of the
 * error, and cells miss the same breaks of a factor whatever their nodes are. */
START_TEST(noise_is_as_the_error) {
    if (_i == 0) compare("cornell", 0, false, 1.2);
    if (_i == 1) compare("cornell", UNCUT_OCCLUDERS_MOST, true, 2);
    if (_i == 2) compare("maze", UNCUT_OCCLUDERS_MOST, false, 2);
}
END_TEST

START_TEST(threads_change_no_bit) {
    lam_error error = {.message = ""};
    visibility *v;
    mesh m = make_scene("cornell", 150);
    csr G[2][2];
    const pairs_options how = options_of(7e-4, UNCUT_OCCLUDERS_MOST, 1);
    const int before = omp_get_max_threads();
    ck_ok(visibility_create(&m, &v, &error));
    for (int k = 0; k < 2; k++) {
        pairs_report report;
        omp_set_num_threads(1 + 2 * k);
        ck_ok(pairs_exchange_twice(&m, v, &how, 2, stages, G[k], &report, &error));
    }
    omp_set_num_threads(before);
    for (int h = 0; h < 2; h++) {
        ck_assert_uint_eq(G[0][h].indptr[m.n], G[1][h].indptr[m.n]);
        ck_assert_mem_eq(G[0][h].data, G[1][h].data, G[0][h].indptr[m.n] * sizeof *G[0][h].data);
        ck_assert_mem_eq(G[0][h].indices, G[1][h].indices, G[0][h].indptr[m.n] * sizeof *G[0][h].indices);
        csr_free(&G[0][h]);
        csr_free(&G[1][h]);
    }
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("pairs_twice");
    TCase *cases = tcase_create("pairs_twice");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, noise_is_as_the_error, 0, 3);
    tcase_add_test(cases, threads_change_no_bit);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
