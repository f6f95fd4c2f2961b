/* Multiwavelets of a mesh, F in them and its inverse in them, against dense matrices in double. */
#include "solver/bench/scenes.h"
#include "solver/build/plane_tree.h"
#include "solver/build/wavelet_basis.h"
#include "solver/build/wavelet_inverse.h"
#include "solver/build/wavelet_pass.h"
#include "solver/formfactor/formfactor.h"
#include "solver/operator/wavelet_plan.h"
#include "support/box_problem.h"
#include "support/dense.h"
#include "support/scene.h"

#include <float.h>
#include <math.h>

static lam_error error;

#define ck_ok(call) ck_assert_msg((call) == LAM_OK, "%s", error.message)

/* A mesh with form factors, its tree and basis. */
typedef struct subject {
    mesh m;
    csr F;
    uint32_t *order; /* of form_factors_make */
    double (*centre)[3];
    plane_tree tree;
    wavelets basis;
    wavelet_plan plan; /* of all coefficients */
    double *W;         /* [n][n], by its columns' positions; NULL until asked for */
} subject;

enum { BOX, ROOM, CITY, MAZE, SUBJECTS };

static void scene(subject *s, const char *kind, size_t elements) {
    const generate_options how = {
        .kind = kind, .variant = 1, .terrain = "flat", .elements = elements, .reflectance = -1, .seed = 1};
    const form_factor_options options = {.recipe = {.method = RECIPE_RAYS, .rays = 256, .seed = 3}};
    form_factors f;
    ck_ok(scene_generated(&how, &s->m, &error));
    s->order = test_allocate(s->m.n, sizeof *s->order);
    ck_ok(mesh_z_order(&s->m, s->order, &error));
    ck_ok(form_factors_make(&s->m, s->order, &options, &f, &error));
    s->F = f.F;
    f.F = (csr){.n = 0};
    form_factors_free(&f);
}

static wavelet_plan plan_of_all(const wavelets *basis) {
    wavelet_plan plan;
    bool *used = test_allocate(basis->n, sizeof *used);
    memset(used, true, basis->n * sizeof *used);
    ck_ok(wavelet_plan_create(basis, used, &plan, &error));
    ck_assert_uint_eq(plan.n_used, basis->n);
    free(used);
    return plan;
}

static subject subject_make(int which) {
    subject s = {.W = NULL};
    if (which == BOX || which == ROOM) {
        fixture f = fixture_box(which == BOX ? unit_cube : room, which == BOX ? 3 : 7, .5f);
        s.m = f.m;
        s.F = f.F;
        s.order = f.order;
    } else {
        scene(&s, which == CITY ? "city" : "maze", 300);
    }
    const size_t n = s.m.n;
    s.centre = test_allocate(n, sizeof *s.centre);
    for (size_t i = 0; i < n; i++) mesh_centroid(&s.m, i, s.centre[i]);
    ck_ok(
        plane_tree_make(n, (const double(*)[3])s.centre, (const float(*)[3])s.m.normal, 6, &s.tree, &error));
    ck_ok(wavelet_basis_make(&s.tree, s.m.area, (const double(*)[3])s.centre, &s.basis, &error));
    s.plan = plan_of_all(&s.basis);
    return s;
}

static void subject_free(subject *s) {
    mesh_free(&s->m);
    csr_free(&s->F);
    free(s->order);
    free(s->centre);
    free(s->W);
    plane_tree_free(&s->tree);
    wavelet_plan_free(&s->plan);
    wavelets_free(&s->basis);
}

static void transform(const subject *s, bool back, const float *from, float *to) {
    float *work = test_allocate(wavelet_plan_work(&s->plan), sizeof *work);
    if (back)
        wavelet_plan_inverse(&s->plan, 1, from, to, work, 1);
    else
        wavelet_plan_forward(&s->plan, 1, from, to, work, 1);
    free(work);
}

/* Column by column. */
static const double *dense_W(subject *s) {
    const size_t n = s->m.n;
    if (s->W != NULL) return s->W;
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c);
    s->W = test_allocate(n * n, sizeof *s->W);
    for (size_t p = 0; p < n; p++) {
        memset(x, 0, n * sizeof *x);
        x[p] = 1;
        transform(s, false, x, c);
        for (size_t k = 0; k < n; k++) s->W[k * n + p] = (double)c[k];
    }
    free(x);
    free(c);
    return s->W;
}

/* W A W^T of a dense A by positions. */
static double *in_basis(subject *s, const double *A) {
    const size_t n = s->m.n;
    const double *W = dense_W(s);
    double *half = test_allocate(n * n, sizeof *half), *out = test_allocate(n * n, sizeof *out);
    for (size_t i = 0; i < n; i++)
        for (size_t p = 0; p < n; p++) {
            const double w = W[i * n + p];
            for (size_t q = 0; w != 0 && q < n; q++) half[i * n + q] += w * A[p * n + q];
        }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (size_t q = 0; q < n; q++) out[i * n + j] += half[i * n + q] * W[j * n + q];
    free(half);
    return out;
}

/* S by positions. */
static double *dense_S(const subject *s) {
    const size_t n = s->m.n;
    double *S = test_allocate(n * n, sizeof *S);
    uint32_t *position = test_allocate(n, sizeof *position);
    for (size_t p = 0; p < n; p++) position[s->tree.order[p]] = (uint32_t)p;
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = s->F.indptr[i]; e < s->F.indptr[i + 1]; e++) {
            const uint32_t j = s->F.indices[e];
            S[position[i] * n + position[j]] = sqrt(s->m.area[i] / s->m.area[j]) * (double)s->F.data[e];
        }
    free(position);
    return S;
}

static float *ones(const wavelets *w) {
    float *made = test_allocate(w->n_nodes, sizeof *made);
    for (size_t t = 0; t < w->n_nodes; t++) made[t] = 1;
    return made;
}

static csr pass_within(const subject *s, double reach, float threshold, const float *weight,
                       size_t n_threads) {
    row_source rows;
    csr S = {.n = 0};
    row_source_of_csr(&rows, &s->F);
    const wavelet_pass_input input = {.basis = &s->basis,
                                      .rows = &rows,
                                      .area = s->m.area,
                                      .order = s->tree.order,
                                      .threshold = threshold,
                                      .weight = weight,
                                      .centre = (const double(*)[3])s->centre,
                                      .reach = reach,
                                      .n_threads = n_threads};
    ck_ok(wavelet_pass(&input, &S, &error));
    return S;
}

static csr pass(const subject *s, float threshold, const float *weight, size_t n_threads) {
    return pass_within(s, INFINITY, threshold, weight, n_threads);
}

/* An upper triangle, its rows ascending, as a whole matrix. */
static double *whole(const csr *upper) {
    const size_t n = upper->n;
    double *A = test_allocate(n * n, sizeof *A);
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = upper->indptr[i]; e < upper->indptr[i + 1]; e++) {
            const uint32_t j = upper->indices[e];
            ck_each(j >= i && (e == upper->indptr[i] || j > upper->indices[e - 1]));
            A[i * n + j] = A[j * n + i] = (double)upper->data[e];
        }
    return A;
}

static double largest_difference(size_t count, const double *A, const double *B) {
    double most = 0;
    for (size_t k = 0; k < count; k++) most = fmax(most, fabs(A[k] - B[k]));
    return most;
}

/* A transform rounds each number at most nine times a level, of at most 20: norms are 1. */
#define TRANSFORM_U (200 * FLT_EPSILON / 2)

/* --- the tree ------------------------------------------------------------------------------------------ */

START_TEST(every_element_is_in_one_leaf_of_one_plane) {
    subject s = subject_make(_i);
    const plane_tree *t = &s.tree;
    bool *seen = test_allocate(s.m.n, sizeof *seen);
    uint32_t at = 0;
    for (size_t p = 0; p < s.m.n; p++) {
        ck_each(t->order[p] < s.m.n && !seen[t->order[p]]);
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
    subject_free(&s);
}
END_TEST

/* --- the basis ----------------------------------------------------------------------------------------- */

START_TEST(the_basis_is_orthonormal) {
    subject s = subject_make(_i);
    const size_t n = s.m.n;
    const double *W = dense_W(&s);
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c);
    uint64_t seed = 4;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= i; j++) {
            double sum = 0;
            for (size_t p = 0; p < n; p++) sum += W[i * n + p] * W[j * n + p];
            ck_each(fabs(sum - (i == j ? 1 : 0)) <= 2 * TRANSFORM_U);
        }
    for (size_t p = 0; p < n; p++) x[p] = (float)random_unit(&seed);
    transform(&s, false, x, c);
    float *back = test_allocate(n, sizeof *back);
    transform(&s, true, c, back);
    for (size_t p = 0; p < n; p++)
        ck_each(fabs((double)back[p] - (double)x[p]) <= sqrt((double)n) * 2 * TRANSFORM_U);
    free(x);
    free(c);
    free(back);
    subject_free(&s);
}
END_TEST

/* What is the same everywhere is one number; what is linear on a plane is none within it. */
START_TEST(smooth_functions_are_few_numbers) {
    subject s = subject_make(_i);
    const size_t n = s.m.n;
    const wavelets *w = &s.basis;
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c);
    double norm = 0;
    for (size_t p = 0; p < n; p++) {
        x[p] = (float)sqrt(s.m.area[s.tree.order[p]]);
        norm += s.m.area[s.tree.order[p]];
    }
    transform(&s, false, x, c);
    for (size_t k = 0; k + 1 < n; k++) ck_each(fabs((double)c[k]) <= TRANSFORM_U * sqrt(norm));
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
            ck_each(fabs((double)c[w->nodes[t].first + k]) <= 4 * TRANSFORM_U * sqrt(norm));
    free(x);
    free(c);
    subject_free(&s);
}
END_TEST

/* Congruent nodes share a matrix. */
START_TEST(grids_have_few_shapes) {
    subject s = subject_make(ROOM);
    ck_assert_uint_lt(s.basis.n_shapes, s.basis.n_nodes / 2);
    subject_free(&s);
}
END_TEST

/* Pieces for threads, several vectors, and any number of threads: the same bits. */
START_TEST(bits_do_not_depend_on_threads) {
    enum { SIDE = 120, N = SIDE * SIDE, VECTORS = 3 };
    double(*centre)[3] = test_allocate(N, sizeof *centre), *area = test_allocate(N, sizeof *area);
    float(*normal)[3] = test_allocate(N, sizeof *normal);
    float *X = test_allocate(VECTORS * N, sizeof *X), *one = test_allocate(VECTORS * N, sizeof *one),
          *many = test_allocate(VECTORS * N, sizeof *many);
    plane_tree tree;
    wavelets w;
    uint64_t seed = 9;
    for (size_t i = 0; i < N; i++) {
        centre[i][0] = (double)(i % SIDE);
        centre[i][1] = (double)(i / SIDE);
        normal[i][2] = 1;
        area[i] = 1;
    }
    ck_ok(plane_tree_make(N, (const double(*)[3])centre, (const float(*)[3])normal, 6, &tree, &error));
    ck_ok(wavelet_basis_make(&tree, area, (const double(*)[3])centre, &w, &error));
    wavelet_plan plan = plan_of_all(&w);
    ck_assert_uint_gt(plan.n_pieces, 2);
    ck_assert_uint_gt(plan.n_above, 2);
    float *work = test_allocate(VECTORS * wavelet_plan_work(&plan), sizeof *work);
    for (size_t k = 0; k < VECTORS * N; k++) X[k] = (float)random_unit(&seed);
    for (int back = 0; back < 2; back++) {
        for (size_t v = 0; v < VECTORS; v++)
            (back ? wavelet_plan_inverse : wavelet_plan_forward)(&plan, 1, X + v * N, one + v * N, work, 1);
        (back ? wavelet_plan_inverse : wavelet_plan_forward)(&plan, VECTORS, X, many, work, 4);
        ck_assert_mem_eq(one, many, VECTORS * N * sizeof *one);
    }
    wavelet_plan_free(&plan);
    wavelets_free(&w);
    plane_tree_free(&tree);
    free(centre);
    free(area);
    free(normal);
    free(X);
    free(one);
    free(many);
    free(work);
}
END_TEST

/* Without what is not in use: the other coefficients are the same, and come back as if those were 0. */
START_TEST(a_plan_leaves_out_what_is_not_used) {
    subject s = subject_make(_i % SUBJECTS);
    const size_t n = s.m.n, every = _i / SUBJECTS == 0 ? 40 : n;
    wavelet_plan plan;
    bool *used = test_allocate(n, sizeof *used);
    float *x = test_allocate(n, sizeof *x), *c = test_allocate(n, sizeof *c),
          *some = test_allocate(n, sizeof *some), *back = test_allocate(n, sizeof *back),
          *truth = test_allocate(n, sizeof *truth);
    uint64_t seed = 3;
    for (size_t k = 0; k < n; k++) {
        used[k] = k % every == every - 1;
        x[k] = (float)random_unit(&seed);
    }
    ck_ok(wavelet_plan_create(&s.basis, used, &plan, &error));
    ck_assert_uint_lt(plan.n_used, every == n ? 4 : n / 2);
    ck_assert_uint_lt(plan.n_steps, s.plan.n_steps);
    float *work = test_allocate(wavelet_plan_work(&plan), sizeof *work);
    transform(&s, false, x, c);
    for (size_t p = 0; p < n; p++) back[p] = NAN;
    wavelet_plan_forward(&plan, 1, x, some, work, 1);
    wavelet_plan_inverse(&plan, 1, some, back, work, 1);
    for (size_t k = 0; k < plan.n_used; k++) {
        const uint32_t at = plan.coefficient[k];
        ck_each(k == 0 || at > plan.coefficient[k - 1]);
        ck_each(fabs((double)some[k] - (double)c[at]) <= sqrt((double)n) * TRANSFORM_U);
        truth[at] = c[at];
        used[at] = false;
    }
    for (size_t k = 0; k < n; k++) ck_each(!used[k]);
    transform(&s, true, truth, c);
    for (size_t p = 0; p < n; p++)
        ck_each(fabs((double)back[p] - (double)c[p]) <= sqrt((double)n) * 2 * TRANSFORM_U);
    wavelet_plan_free(&plan);
    free(work);
    free(used);
    free(x);
    free(c);
    free(some);
    free(back);
    free(truth);
    subject_free(&s);
}
END_TEST

/* --- the pass ------------------------------------------------------------------------------------------ */

START_TEST(a_pass_finds_every_coefficient) {
    subject s = subject_make(_i);
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
    /* What is above a threshold, and nothing else. */
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
                    ck_each((some[i * n + j] != 0) == (size > limit));
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
    subject_free(&s);
}
END_TEST

/* A finite reach leaves out coefficients, and of coarse ones parts, that are small together. */
START_TEST(a_pass_within_reach) {
    subject s = subject_make(ROOM);
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
    subject_free(&s);
}
END_TEST

/* --- the inverse --------------------------------------------------------------------------------------- */

enum { ONE_FOR_ALL, BLACK_IN_PARTS, EACH_ITS_OWN, REFLECTANCES };

static float *reflectance(const subject *s, int which) {
    float *rho = test_allocate(s->m.n, sizeof *rho);
    uint64_t seed = 17;
    for (size_t p = 0; p < s->m.n; p++) {
        const uint32_t i = s->tree.order[p];
        rho[p] = which == ONE_FOR_ALL                     ? .8f
                 : which == EACH_ITS_OWN                  ? (float)(.95 * random_unit(&seed))
                 : s->m.normal[i][2] > .5f || i % 50 == 0 ? 0
                                                          : .6f;
    }
    return rho;
}

START_TEST(reflectances_in_the_basis) {
    subject s = subject_make(_i % SUBJECTS);
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
    subject_free(&s);
}
END_TEST

START_TEST(doubling_inverts) {
    subject s = subject_make(_i % SUBJECTS);
    const size_t n = s.m.n;
    float *rho = reflectance(&s, _i / SUBJECTS), *weight = ones(&s.basis);
    double *S = dense_S(&s), *A = test_allocate(n * n, sizeof *A), *K = test_allocate(n * n, sizeof *K);
    csr in = pass(&s, 0, weight, 2), found, again;
    wavelet_inverse_report report;
    wavelet_inverse_input input = {.basis = &s.basis,
                                   .S = &in,
                                   .rho = rho,
                                   .weight = weight,
                                   .threshold = 1e-6f,
                                   .inner = .01f,
                                   .skipped = .001f,
                                   .n_threads = 1};
    ck_ok(wavelet_inverse(&input, &found, &report, &error));
    /* K = S (I - R S)^-1 */
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) A[p * n + q] = (p == q ? 1 : 0) - (double)rho[p] * S[p * n + q];
    invert(n, A);
    for (size_t p = 0; p < n; p++)
        for (size_t k = 0; k < n; k++)
            for (size_t q = 0; q < n; q++) K[p * n + q] += S[p * n + k] * A[k * n + q];
    double *truth = in_basis(&s, K), *all = whole(&found);
    /* What is left out is below 1e-6 an entry; of single precision |A|^-1 and its square is at most 25 times.
     */
    ck_assert_double_le(largest_difference(n * n, all, truth), 1e-4);
    input.n_threads = 3;
    ck_ok(wavelet_inverse(&input, &again, &report, &error));
    ck_assert_mem_eq(found.indptr, again.indptr, (n + 1) * sizeof *found.indptr);
    ck_assert_mem_eq(found.data, again.data, found.indptr[n] * sizeof *found.data);
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
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelets");
    TCase *tests = tcase_create("wavelets");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, every_element_is_in_one_leaf_of_one_plane, 0, SUBJECTS);
    tcase_add_loop_test(tests, the_basis_is_orthonormal, 0, SUBJECTS);
    tcase_add_loop_test(tests, smooth_functions_are_few_numbers, 0, SUBJECTS);
    tcase_add_test(tests, grids_have_few_shapes);
    tcase_add_test(tests, bits_do_not_depend_on_threads);
    tcase_add_loop_test(tests, a_plan_leaves_out_what_is_not_used, 0, 2 * SUBJECTS);
    tcase_add_loop_test(tests, a_pass_finds_every_coefficient, 0, SUBJECTS);
    tcase_add_test(tests, a_pass_within_reach);
    tcase_add_loop_test(tests, reflectances_in_the_basis, 0, SUBJECTS * REFLECTANCES);
    tcase_add_loop_test(tests, doubling_inverts, 0, SUBJECTS * REFLECTANCES);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
