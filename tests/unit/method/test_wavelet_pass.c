/* F in a basis of wavelets and its inverse there, against dense matrices in double. */
#include "solver/base/random.h"
#include "solver/method/hierarchical/wavelet_entries.h"
#include "solver/method/hierarchical/wavelet_impose.h"
#include "support/followed.h"
#include "support/wavelet_subject.h"

static lam_error error;

START_TEST(a_pass_finds_every_coefficient) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    float *weight = ones(&s.basis);
    double *S = dense_S(&s), *truth = in_basis(&s, S);
    csr found = pass(&s, 0, weight, 1), again = pass(&s, 0, weight, 3);
    double *all = whole(&found);
    /* |S| <= 1: rows and columns are transformed once each. */
    ck_assert_double_le(largest_difference(n * n, all, truth), 2 * TRANSFORM_U);
    ck_assert_uint_eq(found.indptr[n], again.indptr[n]);
    ck_assert_mem_eq(found.indices, again.indices, found.indptr[n] * sizeof *found.indices);
    ck_assert_mem_eq(found.data, again.data, found.indptr[n] * sizeof *found.data);
    csr_free(&again);
    /* The entries above a threshold, and no others. */
    for (size_t t = 0; t < s.basis.n_nodes; t++) weight[t] = t % 2 == 0 ? 1 : .5f;
    again = pass(&s, .02f, weight, 2);
    double *some = whole(&again);
    size_t kept = 0;
    for (size_t t = 0; t < s.basis.n_nodes; t++)
        for (size_t u = 0; u < s.basis.n_nodes; u++) {
            const wavelet_node *a = &s.basis.nodes[t], *b = &s.basis.nodes[u];
            for (size_t i = a->first; i < a->first + a->inputs - a->scaling; i++)
                for (size_t j = b->first; j < b->first + b->inputs - b->scaling; j++) {
                    const double limit = .02 * (double)weight[t] * (double)weight[u],
                                 size = fabs(all[i * n + j]);
                    if (fabs(size - limit) < 1e-6) continue;
                    ck_assert((some[i * n + j] != 0) == (size > limit));
                    kept += size > limit;
                }
        }
    ck_assert_uint_gt(kept, n);
    csr_free(&found);
    csr_free(&again);
    free(weight);
    free(S);
    free(truth);
    free(all);
    free(some);
    wavelet_subject_free(&s);
}
END_TEST

/* A finite reach leaves out coefficients, and of coarse ones parts, that are small together. */
START_TEST(a_pass_within_reach) {
    subject s = wavelet_subject_make(ROOM);
    const size_t n = s.m.n;
    float *weight = ones(&s.basis);
    csr far = pass(&s, 0, weight, 1), near = pass_within(&s, 2, 0, weight, 2);
    double *all = whole(&far), *some = whole(&near), lost = 0, kept = 0;
    ck_assert_uint_lt(near.indptr[n], far.indptr[n]);
    for (size_t k = 0; k < n * n; k++) {
        lost += (all[k] - some[k]) * (all[k] - some[k]);
        kept += some[k] * some[k];
    }
    ck_assert_double_gt(kept, 0);
    ck_assert_double_lt(lost, 1e-4 * kept);
    csr_free(&far);
    csr_free(&near);
    free(weight);
    free(all);
    free(some);
    wavelet_subject_free(&s);
}
END_TEST

/* Half of F, or of every pair all of it on one side or the other. */
static csr one_side(const subject *s, bool halves) {
    const size_t n = s->m.n;
    uint64_t used = 0;
    csr F1 = {.n = n,
              .indptr = test_allocate(n + 1, sizeof *F1.indptr),
              .indices = test_allocate(s->F.indptr[n], sizeof *F1.indices),
              .data = test_allocate(s->F.indptr[n], sizeof *F1.data)};
    for (size_t i = 0; i < n; i++) {
        for (uint64_t e = s->F.indptr[i]; e < s->F.indptr[i + 1]; e++) {
            const uint32_t j = s->F.indices[e];
            const size_t least = i < j ? i : j, most = i < j ? j : i;
            if (!halves && ((least + 3 * most) % 2 == 0) != (i < j)) continue;
            F1.indices[used] = j;
            F1.data[used++] = (halves ? .5f : 1) * s->F.data[e];
        }
        F1.indptr[i + 1] = used;
    }
    return F1;
}

/* Rows that know one side of each pair give the coefficients that rows of both sides do. */
START_TEST(a_pass_of_one_side) {
    subject s = wavelet_subject_make(_i % SUBJECTS);
    const size_t n = s.m.n;
    float *weight = ones(&s.basis);
    double *S = dense_S(&s), *truth = in_basis(&s, S);
    csr F1 = one_side(&s, _i < SUBJECTS);
    csr found = pass_of(&s, &F1, true, INFINITY, 0, weight, 1);
    csr again = pass_of(&s, &F1, true, INFINITY, 0, weight, 3);
    double *all = whole(&found);
    ck_assert_double_le(largest_difference(n * n, all, truth), 3 * TRANSFORM_U);
    ck_assert_uint_eq(found.indptr[n], again.indptr[n]);
    ck_assert_mem_eq(found.indices, again.indices, found.indptr[n] * sizeof *found.indices);
    ck_assert_mem_eq(found.data, again.data, found.indptr[n] * sizeof *found.data);
    csr_free(&again);
    /* Above a threshold, by weights: all that is there of it where either side has half. */
    for (size_t t = 0; t < s.basis.n_nodes; t++) weight[t] = t % 2 == 0 ? 1 : .5f;
    csr both = pass(&s, .02f, weight, 1);
    again = pass_of(&s, &F1, true, INFINITY, .02f, weight, 2);
    double *some = whole(&again), *wanted = whole(&both);
    size_t lost = 0;
    for (size_t k = 0; k < n * n; k++) {
        /* A side below a fifth of the threshold counts as nothing. */
        if (some[k] != 0 && wanted[k] != 0)
            ck_assert(fabs(some[k] - wanted[k]) < .2 * .02 + 1e-5);
        else
            ck_assert(fmax(fabs(some[k]), fabs(wanted[k])) < 1.2 * .02 + 1e-5);
        lost += fabs(some[k] - wanted[k]) > 1e-5;
    }
    if (_i < SUBJECTS) ck_assert_uint_lt(lost, 10); /* beside the threshold */
    csr_free(&F1);
    csr_free(&found);
    csr_free(&again);
    csr_free(&both);
    free(weight);
    free(S);
    free(truth);
    free(all);
    free(some);
    free(wanted);
    wavelet_subject_free(&s);
}
END_TEST

/* So they do within a reach: what is left out is as small. */
START_TEST(one_side_within_reach) {
    subject s = wavelet_subject_make(ROOM);
    const size_t n = s.m.n;
    float *weight = ones(&s.basis);
    csr F1 = one_side(&s, true);
    csr far = pass(&s, 0, weight, 1), near = pass_of(&s, &F1, true, 2, 0, weight, 2);
    double *all = whole(&far), *some = whole(&near), lost = 0, kept = 0;
    ck_assert_uint_lt(near.indptr[n], far.indptr[n]);
    for (size_t k = 0; k < n * n; k++) {
        lost += (all[k] - some[k]) * (all[k] - some[k]);
        kept += some[k] * some[k];
    }
    ck_assert_double_lt(lost, 1e-4 * kept);
    csr_free(&F1);
    csr_free(&far);
    csr_free(&near);
    free(weight);
    free(all);
    free(some);
    wavelet_subject_free(&s);
}
END_TEST

/* S A^1/2 becomes A^1/2 s for whatever s is asked for, and nothing else of S changes; a threshold leaves out
 * what is below it; where nothing leaves the last row is 1 on the diagonal. */
START_TEST(one_even_light_is_put_in) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    float *weight = ones(&s.basis);
    double *area = test_allocate(n, sizeof *area), *sums = test_allocate(n, sizeof *sums);
    const double *W = dense_W(&s);
    uint64_t seed = 5;
    csr S = pass(&s, 0, weight, 1);
    double *before = whole(&S), length = 0;
    for (size_t p = 0; p < n; p++) area[p] = s.m.area[s.tree.order[p]];
    for (size_t p = 0; p < n; p++) length += area[p];
    for (size_t i = 0; i < n; i++) sums[i] = random_lcg_unit(&seed);
    ck_ok(wavelet_impose_row_sums(&s.basis, &s.roots, s.tree.order, area, sums, 0, weight, &S, &error));
    double *after = whole(&S), *y = test_allocate(n, sizeof *y);
    for (size_t k = 0; k < n * n; k++)
        if (k % n != n - 1 && k / n != n - 1) ck_assert(after[k] == before[k]);
    for (size_t i = 0; i < n; i++)
        for (size_t p = 0; p < n; p++) y[i] += W[i * n + p] * sqrt(area[p] / length) * sums[s.tree.order[p]];
    const double sign = W[(n - 1) * n] > 0 ? 1 : -1;
    size_t above = 0;
    for (size_t i = 0; i < n; i++) {
        ck_assert(fabs(after[i * n + n - 1] - sign * y[i]) < TRANSFORM_U);
        above += fabs(y[i]) > .02;
    }
    csr_free(&S);
    S = pass(&s, 0, weight, 1);
    ck_ok(wavelet_impose_row_sums(&s.basis, &s.roots, s.tree.order, area, sums, .02f, weight, &S, &error));
    double *some = whole(&S);
    size_t kept = 0;
    for (size_t i = 0; i < n; i++) kept += some[i * n + n - 1] != 0;
    ck_assert_uint_gt(above, 1);
    ck_assert_uint_eq(kept, above);
    for (size_t i = 0; i < n; i++) sums[i] = 1;
    ck_ok(wavelet_impose_row_sums(&s.basis, &s.roots, s.tree.order, area, sums, 1e-5f, weight, &S, &error));
    free(some);
    some = whole(&S);
    for (size_t i = 0; i < n; i++) ck_assert(fabs(some[i * n + n - 1] - (i == n - 1)) < TRANSFORM_U);
    csr_free(&S);
    free(weight);
    free(area);
    free(sums);
    free(before);
    free(after);
    free(some);
    free(y);
    wavelet_subject_free(&s);
}
END_TEST

enum { ONE_FOR_ALL, BLACK_IN_PARTS, EACH_ITS_OWN, ALL_BUT_ONE_BLACK, ALL_BLACK, REFLECTANCES };

static float *reflectance(const subject *s, int which) {
    float *rho = test_allocate(s->m.n, sizeof *rho);
    uint64_t seed = 17;
    for (size_t p = 0; p < s->m.n; p++) {
        const uint32_t i = s->tree.order[p];
        rho[p] = which == ONE_FOR_ALL                     ? .8f
                 : which == EACH_ITS_OWN                  ? (float)(.95 * random_lcg_unit(&seed))
                 : which == ALL_BUT_ONE_BLACK             ? .7f * (i == 1)
                 : which == ALL_BLACK                     ? 0
                 : s->m.normal[i][2] > .5f || i % 50 == 0 ? 0
                                                          : .6f;
    }
    return rho;
}

START_TEST(reflectances_in_the_basis) {
    subject s = wavelet_subject_make(_i % SUBJECTS);
    const size_t n = s.m.n;
    float *rho = reflectance(&s, _i / SUBJECTS);
    csr found;
    double *R = test_allocate(n * n, sizeof *R);
    for (size_t p = 0; p < n; p++) R[p * n + p] = (double)rho[p];
    double *truth = in_basis(&s, R);
    ck_ok(wavelet_diagonal(&s.basis, rho, &found, &error));
    double *all = whole(&found);
    ck_assert_double_le(largest_difference(n * n, all, truth), 1e-6 + 2 * TRANSFORM_U);
    if (_i / SUBJECTS == ONE_FOR_ALL) ck_assert_uint_eq(found.indptr[n], n);
    csr_free(&found);
    free(rho);
    free(R);
    free(truth);
    free(all);
    wavelet_subject_free(&s);
}
END_TEST

/* As a build has it, or (not rough) so fine that only rounding is left. */
static wavelet_inverse_input input_of(const subject *s, csr *S, const float *rho, const float *weight,
                                      bool rough) {
    return (wavelet_inverse_input){.basis = &s->basis,
                                   .S = S,
                                   .rho = rho,
                                   .weight = weight,
                                   .threshold = rough ? 1e-3f : 1e-6f,
                                   .entry = 1,
                                   .inner = rough ? .25f : .01f,
                                   .skipped = rough ? .005f : .001f,
                                   .n_threads = 1};
}

/* Terms that products leave out, and what of R B they make no use of, add up to little: entries that are
 * there either way differ by less than a threshold. */
START_TEST(what_is_skipped_is_small) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    float *rho = reflectance(&s, EACH_ITS_OWN), *weight = ones(&s.basis);
    csr in = pass(&s, 0, weight, 2), some, all;
    wavelet_inverse_report report;
    wavelet_inverse_input input = input_of(&s, &in, rho, weight, true);
    ck_ok(wavelet_inverse(&input, &some, &report, &error));
    input.skipped = 0;
    ck_ok(wavelet_inverse(&input, &all, &report, &error));
    double *a = whole(&some), *b = whole(&all), most = 0;
    for (size_t k = 0; k < n * n; k++)
        if (a[k] != 0 && b[k] != 0) most = fmax(most, fabs(a[k] - b[k]));
    ck_assert_double_gt(most, 0);
    ck_assert_double_lt(most, (double)input.threshold);
    csr_free(&in);
    csr_free(&some);
    csr_free(&all);
    free(rho);
    free(weight);
    free(a);
    free(b);
    wavelet_subject_free(&s);
}
END_TEST

/* Of all entries those are kept that are large enough and stand in a tile that is, and in both triangles
 * alike.
 */
START_TEST(tiles_are_kept_whole) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    float *rho = reflectance(&s, EACH_ITS_OWN), *weight = NULL;
    ck_ok(wavelets_weights(&s.basis, &weight, &error));
    csr in = pass(&s, 0, weight, 2), found, all;
    wavelet_inverse_report report;
    wavelet_inverse_input input = input_of(&s, &in, rho, weight, true);
    input.entry = 0;
    input.n_threads = 2;
    ck_ok(wavelet_inverse(&input, &all, &report, &error));
    input.entry = .5f;
    input.tile = 3;
    ck_ok(wavelet_inverse(&input, &found, &report, &error));
    size_t *node_of = test_allocate(n, sizeof *node_of), kept = 0, small = 0, lone = 0;
    for (size_t t = 0; t < s.basis.n_nodes; t++)
        for (size_t i = s.basis.nodes[t].first; i < n; i++) node_of[i] = t;
    double *norm = test_allocate(s.basis.n_nodes * s.basis.n_nodes, sizeof *norm);
    double *a = whole(&all), *b = whole(&found);
    for (size_t k = 0; k < n * n; k++) {
        const size_t t = node_of[k / n], u = node_of[k % n];
        const double light = a[k] / ((double)weight[t] * (double)weight[u]);
        norm[t * s.basis.n_nodes + u] += light * light;
    }
    for (size_t k = 0; k < n * n; k++) {
        const size_t t = node_of[k / n], u = node_of[k % n];
        const double least = 1e-3 * (double)weight[t] * (double)weight[u], share = fabs(a[k]) / least,
                     tile = sqrt(norm[t * s.basis.n_nodes + u]) / 1e-3;
        /* Both triangles differ by what was left out of products, and sums are rounded. */
        if (fabs(share - .5) < .02 || fabs(tile - 3) < .1) continue;
        ck_assert(b[k] == (share > .5 && tile > 3 ? a[k] : 0));
        kept += share > .5 && tile > 3;
        small += share > .5 && share < 1 && tile > 3;
        lone += share > 1 && tile < 3;
    }
    ck_assert(kept > small && small > 0 && lone > 0);
    csr_free(&in);
    csr_free(&found);
    csr_free(&all);
    free(rho);
    free(weight);
    free(node_of);
    free(norm);
    free(a);
    free(b);
    wavelet_subject_free(&s);
}
END_TEST

START_TEST(doubling_inverts) {
    subject s = wavelet_subject_make(_i % SUBJECTS);
    const size_t n = s.m.n;
    float *rho = reflectance(&s, _i / SUBJECTS), *weight = ones(&s.basis);
    double *S = dense_S(&s), *A = test_allocate(n * n, sizeof *A), *K = test_allocate(n * n, sizeof *K);
    csr in = pass(&s, 0, weight, 2), found, again;
    wavelet_inverse_report report;
    followed seen = {.n_stages = 0};
    const progress told = {.report = followed_report, .context = &seen};
    wavelet_inverse_input input = input_of(&s, &in, rho, weight, false);
    input.progress = &told;
    ck_ok(wavelet_inverse(&input, &found, &report, &error));
    ck_assert_uint_eq(seen.n_stages, report.doublings);
    ck_assert(report.doublings == 0 || seen.share == 1);
    input.progress = NULL;
    /* K = S (I - R S)^-1 */
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) A[p * n + q] = (p == q ? 1 : 0) - (double)rho[p] * S[p * n + q];
    invert(n, A);
    for (size_t p = 0; p < n; p++)
        for (size_t k = 0; k < n; k++)
            for (size_t q = 0; q < n; q++) K[p * n + q] += S[p * n + k] * A[k * n + q];
    double *truth = in_basis(&s, K), *all = whole(&found);
    /* An entry that is left out is below 1e-6 an entry; of single precision |A|^-1 and its square is at most
     * 25 times.
     */
    ck_assert_double_le(largest_difference(n * n, all, truth), 1e-4);
    input.n_threads = 3;
    ck_ok(wavelet_inverse(&input, &again, &report, &error));
    ck_assert_mem_eq(found.indptr, again.indptr, (n + 1) * sizeof *found.indptr);
    ck_assert_mem_eq(found.data, again.data, found.indptr[n] * sizeof *found.data);
    csr_free(&again);
    /* Weights of a build, of which none is above 10, change the thresholds alone. */
    float *uneven = NULL;
    ck_ok(wavelets_weights(&s.basis, &uneven, &error));
    for (size_t t = 0; t < s.basis.n_nodes; t++) ck_assert_float_le(uneven[t], 10);
    input.weight = uneven;
    input.threshold = 1e-8f;
    ck_ok(wavelet_inverse(&input, &again, &report, &error));
    free(all);
    all = whole(&again);
    ck_assert_double_le(largest_difference(n * n, all, truth), 1e-4);
    free(uneven);
    csr_free(&in);
    csr_free(&found);
    csr_free(&again);
    free(rho);
    free(weight);
    free(S);
    free(A);
    free(K);
    free(truth);
    free(all);
    wavelet_subject_free(&s);
}
END_TEST

/* Where the first two bounces cancel, K_2 has no entry and Z_2 has one: S_02 = -r S_01 S_12. */
START_TEST(bounces_that_cancel) {
    enum { PLACES = 3 };
    subject s = wavelet_subject_make(BOX);
    const size_t n = s.m.n;
    const float r = .5f, a = .5f, rows[PLACES][PLACES] = {{0, a, -r * a * a}, {a, 0, a}, {-r * a * a, a, 0}};
    float *rho = test_allocate(n, sizeof *rho), *weight = ones(&s.basis);
    double A[PLACES * PLACES], K[PLACES * PLACES] = {0};
    csr in = {.n = n,
              .indptr = test_allocate(n + 1, sizeof *in.indptr),
              .indices = test_allocate(PLACES, sizeof *in.indices),
              .data = test_allocate(PLACES, sizeof *in.data)};
    csr found;
    wavelet_inverse_report report;
    for (size_t p = 0; p < n; p++) rho[p] = r;
    for (size_t i = 0, used = 0; i < n; in.indptr[++i] = used)
        for (size_t j = i + 1; j < PLACES; j++) {
            in.indices[used] = (uint32_t)j;
            in.data[used++] = rows[i][j];
        }
    const wavelet_inverse_input input = input_of(&s, &in, rho, weight, false);
    ck_ok(wavelet_inverse(&input, &found, &report, &error));
    for (size_t k = 0; k < PLACES * PLACES; k++)
        A[k] = (k % (PLACES + 1) == 0 ? 1 : 0) - (double)r * (double)rows[k / PLACES][k % PLACES];
    invert(PLACES, A);
    for (size_t i = 0; i < PLACES; i++)
        for (size_t k = 0; k < PLACES; k++)
            for (size_t j = 0; j < PLACES; j++) K[i * PLACES + j] += (double)rows[i][k] * A[k * PLACES + j];
    ck_assert_uint_eq(found.indptr[n], found.indptr[PLACES]);
    for (size_t i = 0; i < PLACES; i++)
        for (size_t j = i; j < PLACES; j++) {
            double value = 0;
            for (uint64_t e = found.indptr[i]; e < found.indptr[i + 1]; e++)
                if (found.indices[e] == j) value = (double)found.data[e];
            /* Single precision of numbers below 1, and bounces whose terms are below 1e-8. */
            ck_assert_double_le(fabs(value - K[i * PLACES + j]), 1e-6);
        }
    csr_free(&in);
    csr_free(&found);
    free(rho);
    free(weight);
    wavelet_subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet pass");
    TCase *tests = tcase_create("wavelet pass");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, a_pass_finds_every_coefficient, 0, SUBJECTS);
    tcase_add_test(tests, a_pass_within_reach);
    tcase_add_loop_test(tests, a_pass_of_one_side, 0, 2 * SUBJECTS);
    tcase_add_test(tests, one_side_within_reach);
    tcase_add_loop_test(tests, one_even_light_is_put_in, 0, SUBJECTS);
    tcase_add_loop_test(tests, reflectances_in_the_basis, 0, SUBJECTS * REFLECTANCES);
    tcase_add_loop_test(tests, what_is_skipped_is_small, 0, SUBJECTS);
    tcase_add_loop_test(tests, tiles_are_kept_whole, 0, SUBJECTS);
    tcase_add_test(tests, bounces_that_cancel);
    tcase_add_loop_test(tests, doubling_inverts, 0, SUBJECTS * REFLECTANCES);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
