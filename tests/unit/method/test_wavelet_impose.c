/* An answer that is imposed on an operator in a wavelet basis, and the furnace that stands on it: E = 1 - rho
 * in a closed scene of one reflectance makes B = 1. */
#include "solver/base/random.h"
#include "solver/method/hierarchical/wavelet_impose.h"
#include "support/closed_box.h"
#include "support/random_blocks.h"
#include "support/wavelet_subject.h"

#include <string.h>

static lam_error error;

/* A symmetric matrix, an emission and an irradiance that have nothing to do with one another. */
typedef struct sample {
    subject s;
    size_t n;
    csr K;
    float *weight;                /* by node */
    double *area, *E, *H, *u, *v; /* u = W A^1/2 E, v = W A^1/2 H, by a dense W */
} sample;

static sample sample_make(int which) {
    sample a = {.s = wavelet_subject_make(which)};
    const double *W = dense_W(&a.s);
    const size_t n = a.n = a.s.m.n;
    uint64_t seed = 11;
    ck_ok(wavelets_weights(&a.s.basis, &a.weight, &error));
    a.K = pass(&a.s, .02f, a.weight, 1);
    double **const all[] = {&a.area, &a.E, &a.H, &a.u, &a.v};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) *all[k] = test_allocate(n, sizeof **all[k]);
    for (size_t p = 0; p < n; p++) a.area[p] = a.s.m.area[a.s.tree.order[p]];
    for (size_t i = 0; i < n; i++) a.H[i] = random_lcg_unit(&seed);
    /* The root's row of a closed scene has one entry alone. */
    ck_ok(wavelet_impose_row_sums(&a.s.basis, &a.s.roots, a.s.tree.order, a.area, a.H, .04f, a.weight, &a.K,
                                  &error));
    for (size_t i = 0; i < n; i++) a.E[i] = .5 + random_lcg_unit(&seed);
    for (size_t i = 0; i < n; i++) a.H[i] = random_lcg_unit(&seed);
    for (size_t i = 0; i < n; i++)
        for (size_t p = 0; p < n; p++) {
            a.u[i] += W[i * n + p] * sqrt(a.area[p]) * a.E[a.s.tree.order[p]];
            a.v[i] += W[i * n + p] * sqrt(a.area[p]) * a.H[a.s.tree.order[p]];
        }
    return a;
}

static void sample_free(sample *a) {
    csr_free(&a->K);
    free(a->weight);
    free(a->area);
    free(a->E);
    free(a->H);
    free(a->u);
    free(a->v);
    wavelet_subject_free(&a->s);
}

/* K with the answer imposed, as a whole matrix. */
static double *imposed(const sample *a, float threshold) {
    csr K = {.n = a->n, .indptr = test_allocate(a->n + 1, sizeof *K.indptr)};
    memcpy(K.indptr, a->K.indptr, (a->n + 1) * sizeof *K.indptr);
    ck_ok(csr_reserve(&K, K.indptr[a->n], &error));
    memcpy(K.indices, a->K.indices, K.indptr[a->n] * sizeof *K.indices);
    memcpy(K.data, a->K.data, K.indptr[a->n] * sizeof *K.data);
    ck_ok(wavelet_impose_answer(&a->s.basis, &a->s.roots, a->s.tree.order, a->area, a->E, a->H, threshold,
                                a->weight, &K, &error));
    double *out = whole(&K);
    csr_free(&K);
    return out;
}

/* Row i of v - K u, over the magnitudes of its terms. */
static double row_left(const sample *a, const double *K, size_t i) {
    double left = a->v[i], size = fabs(a->v[i]);
    for (size_t j = 0; j < a->n; j++) {
        left -= K[i * a->n + j] * a->u[j];
        size += fabs(K[i * a->n + j] * a->u[j]);
    }
    return fabs(left) / size;
}

/* Every row has its irradiance, and nothing but the roots' entries of their own parts is another. Numbers of
 * K are rounded once to floats, and W of the test is known as well as a transform in float. */
START_TEST(an_answer_is_imposed) {
    sample a = sample_make(_i);
    const size_t n = a.n;
    double *before = whole(&a.K), *after = imposed(&a, 0);
    const uint32_t *root = a.s.roots.of_coefficient;
    for (size_t k = 0; k < n * n; k++)
        if (k % n != root[k / n] && k / n != root[k % n]) ck_assert(after[k] == before[k]);
    double off = 0;
    for (size_t i = 0; i < n; i++) {
        ck_assert_double_lt(row_left(&a, after, i), TRANSFORM_U);
        off = fmax(off, row_left(&a, before, i));
    }
    ck_assert_double_gt(off, .1);
    free(before);
    free(after);
    sample_free(&a);
}
END_TEST

/* Entries that K has stay, others where they are above the threshold, and the roots' own are right beside
 * those that are left. */
START_TEST(small_entries_are_left_out) {
    sample a = sample_make(_i);
    const size_t n = a.n;
    const uint32_t *root = a.s.roots.of_coefficient;
    const wavelets *const w = &a.s.basis;
    const float threshold = .03f;
    float *of = test_allocate(n, sizeof *of);
    of[n - 1] = a.weight[w->n_nodes - 1];
    for (size_t t = 0; t < w->n_nodes; t++)
        for (size_t k = 0; k < w->nodes[t].inputs - w->nodes[t].scaling; k++)
            of[w->nodes[t].first + k] = a.weight[t];
    double *before = whole(&a.K), *all = imposed(&a, 0), *some = imposed(&a, threshold);
    size_t stayed = 0, added = 0, dropped = 0;
    for (size_t i = 0; i < n; i++) {
        const size_t r = root[i];
        if (r == i) {
            ck_assert_double_lt(row_left(&a, some, r), TRANSFORM_U);
            continue;
        }
        const double least = (double)(threshold * of[i] * of[r]);
        const bool had = before[i * n + r] != 0, large = fabs(all[i * n + r]) > least;
        ck_assert(some[i * n + r] == (had || large ? all[i * n + r] : 0));
        stayed += had;
        added += !had && large;
        dropped += !had && !large;
    }
    ck_assert_uint_gt(stayed, 0);
    ck_assert_uint_gt(added, 0);
    ck_assert_uint_gt(dropped, 0);
    free(of);
    free(before);
    free(all);
    free(some);
    sample_free(&a);
}
END_TEST

/* Light whose mean is not above 0 says nothing of the last column. */
START_TEST(no_light_in_the_mean) {
    sample a = sample_make(BOX);
    double *before = whole(&a.K);
    for (int k = 0; k < 2; k++) {
        for (size_t i = 0; i < a.n; i++) a.E[i] = -k;
        double *after = imposed(&a, 0);
        ck_assert(memcmp(before, after, a.n * a.n * sizeof *after) == 0);
        free(after);
    }
    free(before);
    sample_free(&a);
}
END_TEST

/* |H~ - s| / |s|, by areas, of E = 1 - rho s, the largest over channels, and in *mean that of the mean over
 * all elements. */
static double furnace_error(const build_problem *problem, const lam_operator *op, double s, double *mean) {
    const size_t n = problem->n, C = problem->n_channels, bytes = lam_operator_work_bytes(op, 1);
    float *E = test_allocate(C, n * sizeof *E), *H = test_allocate(C, n * sizeof *H);
    void *work = test_allocate(1, bytes);
    double most = 0;
    *mean = 0;
    for (size_t k = 0; k < C * n; k++) E[k] = (float)(1 - (double)problem->reflectance[k] * s);
    ck_ok(lam_operator_apply(op, 1, LAM_IRRADIANCE, E, H, work, bytes, &error));
    for (size_t c = 0; c < C; c++) {
        double off = 0, sum = 0, area = 0;
        for (size_t i = 0; i < n; i++) {
            const double d = (double)H[c * n + i] - s;
            off += problem->area[i] * d * d;
            sum += problem->area[i] * d;
            area += problem->area[i];
        }
        most = fmax(most, sqrt(off / area) / s);
        *mean = fmax(*mean, fabs(sum) / area / s);
    }
    free(E);
    free(H);
    free(work);
    return most;
}

/* A box whose channels have a reflectance each. */
typedef struct furnace {
    closed_box box;
    float *reflectance; /* [CHANNELS][n] */
} furnace;

enum { CHANNELS = 3 };

static furnace furnace_make(const double size[3], unsigned divisions) {
    furnace f = {.box = closed_box_make(size, divisions, .5f)};
    f.reflectance = test_allocate(CHANNELS * f.box.f.m.n, sizeof *f.reflectance);
    return f;
}

/* The problem has these reflectances, and rows of the sum s, as exact as floats are. */
static build_problem furnace_problem(furnace *f, const float rho[CHANNELS], double s) {
    build_problem problem = *closed_box_problem(&f->box);
    const size_t n = problem.n;
    csr *F = &f->box.f.F;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) sum += (double)F->data[e];
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
            F->data[e] = (float)(s * (double)F->data[e] / sum);
    }
    for (size_t k = 0; k < CHANNELS * n; k++) f->reflectance[k] = rho[k / n];
    problem.n_channels = CHANNELS;
    problem.reflectance = f->reflectance;
    return problem;
}

static void furnace_free(furnace *f) {
    free(f->reflectance);
    closed_box_free(&f->box);
}

static const double epsilons[] = {.05, .1, .2, .4, .8};

/* Checks furnaces by pairs and by blocks, at every epsilon. Row sums are rounded by 3e-8, of which 1 / (1 -
 * rho) makes 3e-7, and K_rr, E and the numbers of two transforms by 6e-8 each, up or down: less than 1e-6
 * together. */
static void check_furnace(const build_problem *rows, double s) {
    build_problem others = *rows;
    plane_tree tree;
    block_factors blocks;
    double mean;
    build_report report;
    ck_ok(plane_tree_make(rows->n, rows->centre, rows->normal, NULL, NULL, 4, &tree, &error));
    ck_ok(block_factors_begin(&tree, rows->area, rows->centre, &blocks, &error));
    blocks_of_pairs(rows->F, &blocks);
    ck_ok(block_factors_end(&blocks, &error));
    others.F = NULL;
    others.blocks = &blocks;
    for (size_t e = 0; e < sizeof epsilons / sizeof *epsilons; e++) {
        lam_operator *by_rows = hierarchical_good(rows, epsilons[e], &report),
                     *by_blocks = hierarchical_good(&others, epsilons[e], &report);
        ck_assert_double_lt(furnace_error(rows, by_rows, s, &mean), 1e-6);
        ck_assert_double_lt(furnace_error(&others, by_blocks, s, &mean), 1e-6);
        lam_operator_close(by_rows);
        lam_operator_close(by_blocks);
    }
    block_factors_free(&blocks);
    plane_tree_free(&tree);
}

/* Closed and open, with a black channel, and with others whose last bounces lie below the threshold of some
 * epsilon. */
START_TEST(furnaces) {
    static const float rhos[][CHANNELS] = {{0, .3f, .5f}, {.6f, .8f, .9f}};
    furnace f = furnace_make(_i == 0 ? unit_cube : room, _i == 0 ? 3 : 7);
    for (size_t k = 0; k < sizeof rhos / sizeof *rhos; k++)
        for (double s = 1; s > .4; s /= 2) {
            const build_problem rows = furnace_problem(&f, rhos[k], s);
            check_furnace(&rows, s);
        }
    furnace_free(&f);
}
END_TEST

/* Where reflectances differ the mean of the irradiance is right, and its parts that are large enough to be
 * kept: black elements, white ones, one wall of another paint. Numbers of the root's row are rounded to steps
 * of 1/512 of a threshold of .0008 to .016, a hundred of them as likely up as down. */
START_TEST(black_elements) {
    const float rho[CHANNELS] = {.7f, .3f, .9f};
    furnace f = furnace_make(room, 8);
    const build_problem problem = furnace_problem(&f, rho, 1);
    const size_t n = problem.n;
    for (size_t i = 0; i < n; i++) {
        if (i % 7 == 0) f.reflectance[i] = 0;
        if (i < n / 6) f.reflectance[n + i] = .8f;
        if (i > n / 2) f.reflectance[2 * n + i] = i % 2 == 0 ? .99f : 0;
    }
    for (size_t e = 0; e < sizeof epsilons / sizeof *epsilons; e++) {
        double mean;
        build_report report;
        lam_operator *op = hierarchical_good(&problem, epsilons[e], &report);
        const double all = furnace_error(&problem, op, 1, &mean);
        ck_assert_double_lt(all, .1 * epsilons[e]);
        ck_assert_double_lt(mean, 1e-5);
        lam_operator_close(op);
    }
    furnace_free(&f);
}
END_TEST

/* Row sums are imposed on the roots of all parts: S of a part's constant, and of others where F joins them.
 */
START_TEST(row_sums_are_imposed_on_parts) {
    sample a = sample_make(PARTED + _i);
    const size_t n = a.n;
    const double *W = dense_W(&a.s);
    double *S = NULL, *v = test_allocate(n, sizeof *v), *u = test_allocate(n, sizeof *u);
    for (size_t i = 0; i < n; i++)
        for (size_t p = 0; p < n; p++) {
            u[i] += W[i * n + p] * sqrt(a.area[p]);
            v[i] += W[i * n + p] * sqrt(a.area[p]) * a.H[a.s.tree.order[p]];
        }
    ck_ok(wavelet_impose_row_sums(&a.s.basis, &a.s.roots, a.s.tree.order, a.area, a.H, 0, a.weight, &a.K,
                                  &error));
    S = whole(&a.K);
    for (size_t i = 0; i < n; i++) {
        double left = v[i], size = fabs(v[i]);
        for (size_t j = 0; j < n; j++) {
            left -= S[i * n + j] * u[j];
            size += fabs(S[i * n + j] * u[j]);
        }
        ck_assert_double_lt(fabs(left), 2 * TRANSFORM_U * (size + 1));
        /* The constants of parts alone are no 0. */
        ck_assert(a.s.roots.of_coefficient[i] == i || fabs(u[i]) < TRANSFORM_U);
    }
    free(S);
    free(u);
    free(v);
    sample_free(&a);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet impose");
    TCase *tests = tcase_create("wavelet impose");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, an_answer_is_imposed, 0, SUBJECTS_AND_PARTED);
    tcase_add_loop_test(tests, small_entries_are_left_out, 0, SUBJECTS_AND_PARTED);
    tcase_add_test(tests, no_light_in_the_mean);
    tcase_add_loop_test(tests, row_sums_are_imposed_on_parts, 0, SUBJECTS);
    tcase_add_loop_test(tests, furnaces, 0, 2);
    tcase_add_test(tests, black_elements);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
