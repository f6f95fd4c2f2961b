/* Multiwavelets of a mesh: the tree, the basis, and plans of what is used of it. */
#include "solver/base/random.h"
#include "solver/operator/wavelet/wavelet_wide.h"
#include "support/wavelet_subject.h"

#include <string.h>

static lam_error error;

START_TEST(every_element_is_in_one_leaf_of_one_plane) {
    subject s = wavelet_subject_make(_i);
    const plane_tree *t = &s.tree;
    bool *seen = test_allocate(s.m.n, sizeof *seen);
    uint32_t at = 0;
    for (size_t p = 0; p < s.m.n; p++) {
        ck_assert(t->order[p] < s.m.n && !seen[t->order[p]]);
        seen[t->order[p]] = true;
    }
    for (size_t k = 0; k < t->n_clusters; k++) {
        const plane_cluster *c = &t->clusters[k];
        if (!c->leaf) {
            const plane_cluster *left = &t->clusters[c->left], *right = &t->clusters[k - 1];
            ck_assert(c->begin == left->begin && left->end == right->begin && right->end == c->end);
            ck_assert(c->frame == PLANE_ABOVE || (left->frame == c->frame && right->frame == c->frame));
            continue;
        }
        ck_assert(c->begin == at && c->end > at && c->end - c->begin <= 6);
        at = c->end;
        const uint32_t first = t->order[c->begin];
        for (uint32_t p = c->begin; p < c->end; p++) {
            const uint32_t i = t->order[p];
            double turned = 0, away = 0;
            for (int d = 0; d < 3; d++) {
                turned += (double)s.m.normal[i][d] * (double)s.m.normal[first][d];
                away += (double)s.m.normal[first][d] * (s.centre[i][d] - s.centre[first][d]);
            }
            ck_assert_double_gt(turned, .999);
            ck_assert_double_lt(fabs(away), .01);
        }
    }
    ck_assert_uint_eq(at, s.m.n);
    if (_i == BOX || _i == ROOM) ck_assert_uint_eq(t->n_frames, 6);
    free(seen);
    wavelet_subject_free(&s);
}
END_TEST

/* Below nodes that are apart, and in no other, all elements are of one part, and each part is one subtree; no
 * function of the basis, as floats, has elements of two parts. Roots are the constants of parts, and the last
 * coefficients of theirs. */
START_TEST(parts_are_kept_apart) {
    subject s = wavelet_subject_make(PARTED + _i);
    const plane_tree *t = &s.tree;
    const size_t n = s.m.n;
    const double *W = dense_W(&s);
    size_t apart = 0;
    for (size_t k = 0; k < t->n_clusters; k++) {
        const plane_cluster *c = &t->clusters[k];
        bool several = false;
        for (uint32_t p = c->begin; p < c->end; p++)
            several = several ||
                      wavelet_subject_part(&s, t->order[p]) != wavelet_subject_part(&s, t->order[c->begin]);
        ck_assert(c->apart == several);
        ck_assert(!c->apart || c->frame == PLANE_ABOVE);
        apart += c->apart;
    }
    ck_assert_uint_eq(apart, PARTS - 1);
    ck_assert_uint_eq(s.roots.count, PARTS);
    uint32_t root_of_part[PARTS];
    for (size_t i = 0; i < PARTS; i++) root_of_part[i] = WAVELET_NONE;
    for (size_t i = 0; i < n; i++) {
        uint32_t part = PARTS;
        const uint32_t root = s.roots.of_coefficient[i];
        ck_assert_uint_ge(root, i);
        for (size_t p = 0; p < n; p++) {
            const uint32_t own = wavelet_subject_part(&s, t->order[p]);
            if (W[i * n + p] == 0) continue;
            ck_assert(part == PARTS || part == own);
            part = own;
        }
        ck_assert_uint_lt(part, PARTS);
        ck_assert(root_of_part[part] == WAVELET_NONE || root_of_part[part] == root);
        root_of_part[part] = root;
        if (root != i) continue;
        double area = 0;
        for (size_t e = 0; e < n; e++) area += wavelet_subject_part(&s, e) == part ? s.m.area[e] : 0;
        for (size_t p = 0; p < n; p++) {
            const uint32_t e = t->order[p];
            const double constant = wavelet_subject_part(&s, e) == part ? sqrt(s.m.area[e] / area) : 0;
            ck_assert_double_eq_tol(W[i * n + p], constant, TRANSFORM_U);
        }
    }
    wavelet_subject_free(&s);
}
END_TEST

START_TEST(the_basis_is_orthonormal) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    const double *W = dense_W(&s);
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c);
    uint64_t seed = 4;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= i; j++) {
            double sum = 0;
            for (size_t p = 0; p < n; p++) sum += W[i * n + p] * W[j * n + p];
            ck_assert(fabs(sum - (i == j ? 1 : 0)) <= 2 * TRANSFORM_U);
        }
    for (size_t p = 0; p < n; p++) x[p] = (float)random_lcg_unit(&seed);
    transform(&s, false, x, c);
    float *back = test_allocate(n, sizeof *back);
    transform(&s, true, c, back);
    for (size_t p = 0; p < n; p++)
        ck_assert(fabs((double)back[p] - (double)x[p]) <= sqrt((double)n) * 2 * TRANSFORM_U);
    free(x);
    free(c);
    free(back);
    wavelet_subject_free(&s);
}
END_TEST

/* A constant is one coefficient; a function that is linear on a plane has none within it. */
START_TEST(smooth_functions_are_few_numbers) {
    subject s = wavelet_subject_make(_i);
    const size_t n = s.m.n;
    const wavelets *w = &s.basis;
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c);
    double norm = 0;
    for (size_t p = 0; p < n; p++) {
        x[p] = (float)sqrt(s.m.area[s.tree.order[p]]);
        norm += s.m.area[s.tree.order[p]];
    }
    transform(&s, false, x, c);
    for (size_t k = 0; k + 1 < n; k++) ck_assert(fabs((double)c[k]) <= TRANSFORM_U * sqrt(norm));
    ck_assert_double_eq_tol(fabs((double)c[n - 1]), sqrt(norm), TRANSFORM_U * sqrt(norm));
    norm = 0;
    for (size_t p = 0; p < n; p++) {
        const double *at = s.centre[s.tree.order[p]];
        const double linear = 1 + .3 * at[0] - .2 * at[1] + .5 * at[2];
        x[p] = (float)(sqrt(s.m.area[s.tree.order[p]]) * linear);
        norm += (double)x[p] * (double)x[p];
    }
    transform(&s, false, x, c);
    for (size_t t = 0; t < w->n_nodes; t++)
        for (size_t k = 0;
             s.tree.clusters[t].frame != PLANE_ABOVE && k < w->nodes[t].inputs - w->nodes[t].scaling; k++)
            ck_assert(fabs((double)c[w->nodes[t].first + k]) <= 4 * TRANSFORM_U * sqrt(norm));
    free(x);
    free(c);
    wavelet_subject_free(&s);
}
END_TEST

/* Congruent nodes share a matrix. */
START_TEST(grids_have_few_shapes) {
    subject s = wavelet_subject_make(ROOM);
    ck_assert_uint_lt(s.basis.n_shapes, s.basis.n_nodes / 2);
    wavelet_subject_free(&s);
}
END_TEST

/* Copies pieces of a vector, or of vectors side by side, and counts the positions. */
typedef struct visited {
    const float *from;
    float *X;
    size_t n, positions;
} visited;

static void visit(void *context, size_t piece, size_t first, size_t last) {
    visited *seen = context;
    (void)piece;
    for (size_t p = first; p < last; p++) seen->X[p] = seen->from[p];
    __atomic_fetch_add(&seen->positions, last - first, __ATOMIC_RELAXED);
}

enum { LANES = 3 };

static void fill_lanes(void *context, size_t piece, size_t first, size_t last, float *X) {
    visited *seen = context;
    (void)piece;
    for (size_t p = first; p < last; p++)
        for (size_t v = 0; v < WAVELET_WIDE; v++)
            X[(p - first) * WAVELET_WIDE + v] = v < LANES ? seen->from[v * seen->n + p] : 0;
    __atomic_fetch_add(&seen->positions, last - first, __ATOMIC_RELAXED);
}

static void take_lanes(void *context, size_t piece, size_t first, size_t last, float *X) {
    visited *seen = context;
    (void)piece;
    for (size_t p = first; p < last; p++)
        for (size_t v = 0; v < LANES; v++) seen->X[v * seen->n + p] = X[(p - first) * WAVELET_WIDE + v];
    __atomic_fetch_add(&seen->positions, last - first, __ATOMIC_RELAXED);
}

/* Vectors side by side have the bits that each has alone, but for the sign of a 0: X [LANES][n]. */
static void check_lanes(const wavelet_plan *plan, const float *X, size_t n_threads) {
    const size_t n = plan->n, n_used = plan->n_used;
    float *scale = test_allocate(n_used + WAVELET_INPUTS, sizeof *scale),
          *one = test_allocate(n_used, sizeof *one), *back = test_allocate(n, sizeof *back),
          *Y = test_allocate(LANES * n, sizeof *Y),
          *small = test_allocate(wavelet_plan_work(plan), sizeof *small);
    float *C = aligned_alloc(64, (n_used * WAVELET_WIDE + 15) / 16 * 16 * sizeof *C);
    float *work = aligned_alloc(64, (wavelet_wide_work(plan, n_threads) + 15) / 16 * 16 * sizeof *work);
    visited seen = {.from = X, .X = Y, .n = n};
    for (size_t i = 0; i < n_used; i++) scale[i] = 1 + (float)(i % 5);
    wavelet_wide_forward(plan, fill_lanes, &seen, scale, C, work, n_threads);
    wavelet_wide_inverse(plan, C, take_lanes, &seen, work, n_threads);
    ck_assert_uint_eq(seen.positions, 2 * n);
    for (size_t v = 0; v < LANES; v++) {
        wavelet_plan_forward(plan, NULL, NULL, X + v * n, scale, one, small, 1);
        for (size_t i = 0; i < n_used; i++) ck_assert_float_eq(C[i * WAVELET_WIDE + v], one[i]);
        wavelet_plan_inverse(plan, one, back, NULL, NULL, small, 1);
        for (size_t p = 0; p < n; p++) ck_assert_float_eq(Y[v * n + p], back[p]);
    }
    free(scale);
    free(one);
    free(back);
    free(Y);
    free(small);
    free(C);
    free(work);
}

/* Pieces for threads, several vectors, any number of threads, and pieces that are visited: the same bits. */
START_TEST(bits_do_not_depend_on_threads) {
    enum { SIDE = 120, N = SIDE * SIDE, VECTORS = LANES };
    double(*centre)[3] = test_allocate(N, sizeof *centre), *area = test_allocate(N, sizeof *area);
    float(*normal)[3] = test_allocate(N, sizeof *normal);
    float *X = test_allocate(VECTORS * N, sizeof *X), *one = test_allocate(N, sizeof *one),
          *many = test_allocate(N, sizeof *many), *Y = test_allocate(N, sizeof *Y);
    plane_tree tree;
    wavelets w;
    uint64_t seed = 9;
    for (size_t i = 0; i < N; i++) {
        centre[i][0] = (double)(i % SIDE);
        centre[i][1] = (double)(i / SIDE);
        normal[i][2] = 1;
        area[i] = 1;
    }
    ck_ok(plane_tree_make(N, (const double(*)[3])centre, (const float(*)[3])normal, NULL, NULL, 6, &tree,
                          &error));
    ck_ok(wavelet_basis_make(&tree, area, (const double(*)[3])centre, &w, &error));
    wavelet_plan plan = plan_of_all(&w);
    ck_assert_uint_gt(plan.n_pieces, 2);
    ck_assert_uint_gt(plan.n_above, 2);
    float *work = test_allocate(wavelet_plan_work(&plan), sizeof *work);
    for (size_t k = 0; k < VECTORS * N; k++) X[k] = (float)random_lcg_unit(&seed);
    /* Most of the second vector is dark, and all of the third but one element. */
    for (size_t p = 0; p < N; p++) {
        if (p > N / 3) X[N + p] = 0;
        if (p != N / 2) X[2 * N + p] = 0;
    }
    for (size_t v = 0; v < VECTORS; v++) {
        visited seen = {.from = X + v * N, .X = Y, .n = N};
        wavelet_plan_forward(&plan, NULL, NULL, X + v * N, NULL, one, work, 1);
        wavelet_plan_forward(&plan, visit, &seen, Y, NULL, many, work, 4);
        ck_assert_mem_eq(one, many, N * sizeof *one);
        ck_assert_mem_eq(X + v * N, Y, N * sizeof *one);
        wavelet_plan_inverse(&plan, X + v * N, one, NULL, NULL, work, 1);
        wavelet_plan_inverse(&plan, X + v * N, many, NULL, NULL, work, 4);
        ck_assert_mem_eq(one, many, N * sizeof *one);
        seen.from = many;
        wavelet_plan_inverse(&plan, X + v * N, many, visit, &seen, work, 4);
        ck_assert_mem_eq(one, Y, N * sizeof *one);
        ck_assert_uint_eq(seen.positions, 2 * N);
    }
    check_lanes(&plan, X, 1);
    check_lanes(&plan, X, 4);
    wavelet_plan_free(&plan);
    wavelets_free(&w);
    plane_tree_free(&tree);
    free(centre);
    free(area);
    free(normal);
    free(X);
    free(one);
    free(many);
    free(Y);
    free(work);
}
END_TEST

/* Without what is not in use: the other coefficients are the same, and come back as if those were 0. */
START_TEST(a_plan_leaves_out_what_is_not_used) {
    subject s = wavelet_subject_make(_i % SUBJECTS);
    const size_t n = s.m.n, every = _i / SUBJECTS == 0 ? 40 : n;
    wavelet_plan plan;
    bool *used = test_allocate(n, sizeof *used);
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c),
          *some = test_allocate(n, sizeof *some), *back = test_allocate(n, sizeof *back),
          *truth = test_allocate(n, sizeof *truth), *three = test_allocate(LANES * n, sizeof *three);
    uint64_t seed = 3;
    for (size_t k = 0; k < n; k++) {
        used[k] = k % every == every - 1;
        x[k] = (float)random_lcg_unit(&seed);
        for (size_t v = 0; v < LANES; v++) three[v * n + k] = k % (v + 2) == 0 ? x[k] : 0;
    }
    ck_ok(wavelet_plan_create(&s.basis, used, &plan, &error));
    ck_assert_uint_lt(plan.n_used, every == n ? 4 : n / 2);
    ck_assert_uint_lt(plan.n_steps, s.plan.n_steps);
    float *work = test_allocate(wavelet_plan_work(&plan), sizeof *work);
    transform(&s, false, x, c);
    for (size_t p = 0; p < n; p++) back[p] = NAN;
    wavelet_plan_forward(&plan, NULL, NULL, x, NULL, some, work, 1);
    wavelet_plan_inverse(&plan, some, back, NULL, NULL, work, 1);
    check_lanes(&plan, three, 2);
    for (size_t k = 0; k < plan.n_used; k++) {
        const uint32_t at = plan.coefficient[k];
        ck_assert(k == 0 || at > plan.coefficient[k - 1]);
        ck_assert(fabs((double)some[k] - (double)c[at]) <= sqrt((double)n) * TRANSFORM_U);
        truth[at] = c[at];
        used[at] = false;
    }
    for (size_t k = 0; k < n; k++) ck_assert(!used[k]);
    transform(&s, true, truth, c);
    for (size_t p = 0; p < n; p++)
        ck_assert(fabs((double)back[p] - (double)c[p]) <= sqrt((double)n) * 2 * TRANSFORM_U);
    wavelet_plan_free(&plan);
    free(work);
    free(three);
    free(used);
    free(x);
    free(c);
    free(some);
    free(back);
    free(truth);
    wavelet_subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelets");
    TCase *tests = tcase_create("wavelets");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, every_element_is_in_one_leaf_of_one_plane, 0, SUBJECTS);
    tcase_add_loop_test(tests, parts_are_kept_apart, 0, SUBJECTS);
    tcase_add_loop_test(tests, the_basis_is_orthonormal, 0, SUBJECTS_AND_PARTED);
    tcase_add_loop_test(tests, smooth_functions_are_few_numbers, 0, SUBJECTS);
    tcase_add_test(tests, grids_have_few_shapes);
    tcase_add_test(tests, bits_do_not_depend_on_threads);
    tcase_add_loop_test(tests, a_plan_leaves_out_what_is_not_used, 0, 2 * SUBJECTS);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
