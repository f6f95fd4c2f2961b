/* The importance of elements: against a dense inverse, by its definition, by clusters, and in a store. */
#include "solver/base/random.h"
#include "solver/operator/blocks/importance.h"
#include "support/dense.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include "store/status.h"

#include <math.h>
#include <unistd.h>

static lam_error error;

enum { N = 60, C = 2, READ = 7 };

/* Elements of uneven areas, F_ij = G_ij / A_i with G symmetric, rows of .6 to .9; two channels. */
typedef struct subject {
    double area[N], F[N][N];
    float rho[C * N];
    importance read;
} subject;

static lam_status multiply(const void *context, size_t m, const double *x, double *y, lam_error *why) {
    const subject *s = context;
    (void)why;
    ck_assert_uint_eq(m, 1);
    for (size_t i = 0; i < N; i++) {
        y[i] = 0;
        for (size_t j = 0; j < N; j++) y[i] += s->F[i][j] * x[j];
    }
    return LAM_OK;
}

static factor_product product_of(const subject *s) {
    return (factor_product){.n = N, .multiply = multiply, .context = s};
}

static void subject_make(subject *s) {
    uint64_t seed = 3;
    *s = (subject){.read = {.n = N, .read = test_allocate(N, sizeof(float))}};
    for (size_t i = 0; i < N; i++) s->area[i] = .5 + random_lcg_unit(&seed);
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < i; j++) {
            const double G = random_lcg_unit(&seed) * s->area[i] * s->area[j] * (.02 + .0003 * (double)i);
            s->F[i][j] = G / s->area[i];
            s->F[j][i] = G / s->area[j];
        }
    for (size_t i = 0; i < N; i++) {
        s->rho[i] = .2f + .4f * (float)random_lcg_unit(&seed);
        s->rho[N + i] = i % 2 == 0 ? .8f : .1f;
    }
    for (size_t i = 0; i < READ; i++) s->read.read[5 * i] = .2f + .05f * (float)i;
}

/* (I - R F)^-1, R of the larger channel. */
static double *inverse_of(const subject *s) {
    double *M = test_allocate((size_t)N * N, sizeof *M);
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++)
            M[i * N + j] = (i == j) - (double)fmaxf(s->rho[i], s->rho[N + i]) * s->F[i][j];
    invert(N, M);
    return M;
}

/* An element whose radiosity is not between the bounds has the nearer one. The series ends where a bounce
 * adds no more than 1e-3; rows sum to less than .9 and rho is at most .8, so that less than 1e-3 .72 / .28 is
 * left.
 */
START_TEST(importance_is_the_radiosity_of_what_is_read) {
    subject s;
    subject_make(&s);
    double *M = inverse_of(&s);
    const factor_product F = product_of(&s);
    for (size_t i = 0; i < N; i++) ck_assert_double_lt(s.F[i][0] + s.F[i][N - 1], .9);
    s.read.read[5] = 1; /* more than 1 with what comes back */
    ck_ok(importance_find(&F, C, s.rho, s.area, &s.read, &error));
    for (size_t i = 0; i < N; i++) {
        double y = 0;
        for (size_t j = 0; j < N; j++) y += M[i * N + j] * (double)s.read.read[j];
        ck_assert_double_eq_tol((double)s.read.of[i], fmin(fmax(y, 1. / 16), 1), 2.6e-3);
    }
    ck_assert_double_eq(importance_least, 1. / 16);
    ck_assert_double_eq((double)s.read.of[5], 1);
    free(M);
    importance_free(&s.read);
    ck_assert_ptr_null(s.read.read);
}
END_TEST

/* 1.5 r within [.4, 1] and [.25, 1], r^2 = sum A y^2 / sum A by a dense inverse, where all is read, some
 * elements, and one. y is known to 2.6e-3, and so is r. */
START_TEST(shares_follow_the_mean_importance) {
    static const size_t steps[] = {1, 2, 9, N}; /* every which element is read */
    double last = 2;
    for (size_t c = 0; c < sizeof steps / sizeof steps[0]; c++) {
        subject s;
        subject_make(&s);
        double *M = inverse_of(&s), square = 0, area = 0;
        const factor_product F = product_of(&s);
        for (size_t i = 0; i < N; i++) s.read.read[i] = i % steps[c] == 0 ? 1 : 0;
        ck_ok(importance_find(&F, C, s.rho, s.area, &s.read, &error));
        for (size_t i = 0; i < N; i++) {
            double y = 0;
            for (size_t j = 0; j < N; j++) y += M[i * N + j] * (double)s.read.read[j];
            square += s.area[i] * pow(fmin(fmax(y, 1. / 16), 1), 2);
            area += s.area[i];
        }
        const double share = 1.5 * sqrt(square / area);
        ck_assert_double_lt(share, last);
        ck_assert_double_eq_tol(s.read.share_of_bounds, fmin(fmax(share, .4), 1), 1.5 * 2.6e-3);
        ck_assert_double_eq_tol(s.read.share_of_thresholds, fmin(fmax(share, .25), 1), 1.5 * 2.6e-3);
        last = share;
        free(M);
        importance_free(&s.read);
    }
    ck_assert_double_lt(last, .25);
}
END_TEST

/* With sources z is found as y is, from the elements that emit; shares are the products of those of either
 * alone. Without receivers y is nowhere. */
START_TEST(sources_have_an_importance_of_their_own) {
    subject s, other;
    subject_make(&s);
    subject_make(&other);
    const factor_product F = product_of(&s);
    importance emits = {.n = N, .emits = test_allocate(N, sizeof(float))};
    for (size_t i = 3; i < 12; i++) emits.emits[i] = other.read.read[i] = 1;
    for (size_t i = 0; i < N; i++) other.read.read[i] = emits.emits[i];
    ck_assert(!importance_is_found(&s.read));
    ck_assert(!importance_is_found(&emits));
    ck_ok(importance_find(&F, C, s.rho, s.area, &s.read, &error));
    ck_ok(importance_find(&F, C, s.rho, s.area, &other.read, &error));
    ck_ok(importance_find(&F, C, s.rho, s.area, &emits, &error));
    ck_assert(importance_is_found(&s.read));
    ck_assert(importance_is_found(&emits));
    ck_assert_ptr_null(emits.of);
    ck_assert_mem_eq(emits.lit, other.read.of, N * sizeof(float));
    ck_assert_double_eq(emits.share_of_bounds, other.read.share_of_bounds);
    ck_assert_double_eq(emits.share_of_thresholds, other.read.share_of_thresholds);
    importance both = {.n = N, .read = s.read.read, .emits = emits.emits};
    ck_ok(importance_find(&F, C, s.rho, s.area, &both, &error));
    ck_assert_mem_eq(both.of, s.read.of, N * sizeof(float));
    ck_assert_mem_eq(both.lit, emits.lit, N * sizeof(float));
    ck_assert_double_eq(both.share_of_bounds, s.read.share_of_bounds * emits.share_of_bounds);
    ck_assert_double_eq(both.share_of_thresholds, s.read.share_of_thresholds * emits.share_of_thresholds);
    both.read = both.emits = NULL;
    importance_free(&both);
    importance_free(&emits);
    importance_free(&s.read);
    importance_free(&other.read);
}
END_TEST

/* A change p of what elements give off, by an error of the light that they get, changes what is read by
 * sum A w (I - R F)^-1 p. Where all rho are equal that is sum A y p, as A_i F_ij = A_j F_ji. */
START_TEST(importance_weighs_what_changes) {
    subject s;
    uint64_t seed = 8;
    subject_make(&s);
    for (size_t i = 0; i < N; i++) s.rho[i] = s.rho[N + i] = .5f;
    double *M = inverse_of(&s), p[N], read = 0, weighed = 0, size = 0;
    const factor_product F = product_of(&s);
    ck_ok(importance_find(&F, C, s.rho, s.area, &s.read, &error));
    for (size_t i = 0; i < N; i++) p[i] = (double)s.read.of[i] > 1.001 / 16 ? random_lcg_unit(&seed) : 0;
    for (size_t i = 0; i < N; i++) {
        double B = 0;
        for (size_t j = 0; j < N; j++) B += M[i * N + j] * p[j];
        read += s.area[i] * (double)s.read.read[i] * B;
        weighed += s.area[i] * (double)s.read.of[i] * p[i];
        size += s.area[i] * p[i];
    }
    ck_assert_double_gt(read, 0);
    ck_assert_double_eq_tol(read, weighed, 2.6e-3 * size);
    free(M);
    importance_free(&s.read);
}
END_TEST

/* Two planes. */
static plane_tree tree_of(double (*centre)[3], float (*normal)[3]) {
    plane_tree tree;
    for (size_t i = 0; i < N; i++) {
        const size_t turn = i % 2;
        centre[i][0] = (double)(i / 2 % 6);
        centre[i][1 + turn] = (double)(i / 12);
        normal[i][2 - turn] = 1;
    }
    ck_ok(plane_tree_make(N, (const double(*)[3])centre, (const float(*)[3])normal, NULL, NULL, 4, &tree,
                          &error));
    return tree;
}

START_TEST(nodes_have_the_mean_square_of_their_elements) {
    subject s;
    double centre[N][3] = {{0}};
    float normal[N][3] = {{0}};
    importance_nodes nodes;
    importance found = {.n = N};
    subject_make(&s);
    plane_tree tree = tree_of(centre, normal);
    found.of = s.read.read;
    ck_ok(importance_nodes_make(&found, s.area, &tree, &nodes, &error));
    ck_assert_ptr_null(nodes.lit);
    ck_assert_uint_gt(tree.n_clusters, 8);
    for (size_t t = 0; t < tree.n_clusters; t++) {
        double square = 0, area = 0;
        for (uint32_t p = tree.clusters[t].begin; p < tree.clusters[t].end; p++) {
            const uint32_t i = tree.order[p];
            square += s.area[i] * (double)s.read.read[i] * (double)s.read.read[i];
            area += s.area[i];
        }
        ck_assert_double_eq_tol((double)nodes.of[t], sqrt(square / area), 1e-6);
    }
    for (size_t p = 0; p < N; p++)
        ck_assert_float_eq(nodes.of[tree.n_clusters + p], s.read.read[tree.order[p]]);
    importance_nodes_free(&nodes);
    plane_tree_free(&tree);
    importance_free(&s.read);
}
END_TEST

/* The light between two nodes goes both ways, and counts by the way that matters more; of one that is read
 * and one that emits it counts fully. */
START_TEST(importance_between_nodes_is_a_product) {
    subject s;
    double centre[N][3] = {{0}};
    float normal[N][3] = {{0}}, z[N];
    subject_make(&s);
    plane_tree tree = tree_of(centre, normal);
    for (size_t i = 0; i < N; i++) z[i] = .1f + .9f * (float)(i % 4) / 3;
    for (int k = 0; k < 3; k++) {
        const importance some = {.n = N, .of = k != 1 ? s.read.read : NULL, .lit = k != 0 ? z : NULL};
        importance_nodes nodes;
        ck_ok(importance_nodes_make(&some, s.area, &tree, &nodes, &error));
        for (size_t p = 0; p < N; p += 7)
            for (size_t q = 0; q < N; q += 3) {
                const size_t i = tree.order[p], j = tree.order[q], a = tree.n_clusters + p,
                             b = tree.n_clusters + q;
                const double yi = k != 1 ? (double)s.read.read[i] : 1,
                             yj = k != 1 ? (double)s.read.read[j] : 1;
                const double zi = k != 0 ? (double)z[i] : 1, zj = k != 0 ? (double)z[j] : 1;
                ck_assert_double_eq(importance_between(&nodes, a, b), fmax(yi * zj, yj * zi));
                ck_assert_double_eq(importance_between(&nodes, b, a), importance_between(&nodes, a, b));
                ck_assert_double_eq(importance_at(&nodes, a), yi * zi);
            }
        importance_nodes_free(&nodes);
        ck_assert_ptr_null(nodes.of);
    }
    plane_tree_free(&tree);
    importance_free(&s.read);
}
END_TEST

START_TEST(a_reference_is_more_even) {
    subject s;
    importance even;
    subject_make(&s);
    const factor_product F = product_of(&s);
    ck_ok(importance_find(&F, C, s.rho, s.area, &s.read, &error));
    ck_ok(importance_even_out(&s.read, &even, &error));
    ck_assert_uint_eq(even.n, N);
    ck_assert_mem_eq(even.read, s.read.read, N * sizeof *even.read);
    ck_assert_double_eq(even.share_of_bounds, fmax(s.read.share_of_bounds, .5));
    ck_assert_double_eq(even.share_of_thresholds, s.read.share_of_thresholds);
    ck_assert_double_lt(s.read.share_of_bounds, .5);
    s.read.share_of_bounds = .7;
    importance_free(&even);
    ck_ok(importance_even_out(&s.read, &even, &error));
    ck_assert_double_eq(even.share_of_bounds, .7);
    importance_free(&even);
    /* Of receivers and sources it keeps below its share of what it judges. */
    s.read.share_of_bounds = .16;
    s.read.emits = test_allocate(N, sizeof(float));
    s.read.lit = test_allocate(N, sizeof(float));
    s.read.emits[3] = s.read.lit[3] = 1;
    s.read.lit[4] = .25f;
    ck_ok(importance_even_out(&s.read, &even, &error));
    ck_assert_double_eq(even.share_of_bounds, 1.25 * .16);
    ck_assert_mem_eq(even.emits, s.read.emits, N * sizeof *even.emits);
    ck_assert_float_eq(even.lit[3], 1);
    ck_assert_float_eq(even.lit[4], .5f);
    for (size_t i = 0; i < N; i++)
        ck_assert_double_eq_tol(pow((double)even.of[i], 2), (double)s.read.of[i], 1e-6);
    importance_free(&even);
    importance_free(&s.read);
}
END_TEST

/* Writes a store with these two datasets. */
static void write_store(const char *path, uint32_t element, float weight) {
    store *s = NULL;
    const uint32_t elements[2] = {1, element};
    const float weights[2] = {.5f, weight};
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, "/importance/elements", STORE_U32, 1, (size_t[]){2}, elements, &error));
    ck_ok(store_write(s, "/importance/weights", STORE_F32, 1, (size_t[]){2}, weights, &error));
    ck_ok(store_seal(s, &error));
}

static lam_status read_store(const char *path, importance *out) {
    store *s = NULL;
    ck_ok(store_open(path, &s, &error));
    const lam_status status = importance_load(s, N, out, &error);
    store_close(s);
    return status;
}

START_TEST(stores_keep_the_weights) {
    char path[] = "/tmp/lambert-importance-XXXXXX";
    subject s;
    importance found;
    store *made = NULL;
    subject_make(&s);
    close(mkstemp(path));
    ck_ok(store_create(path, &made, &error));
    s.read.emits = test_allocate(N, sizeof(float));
    s.read.emits[2] = s.read.emits[50] = 1;
    ck_ok(importance_save(&s.read, "--receivers desk", "--sources lamp", made, &error));
    ck_ok(store_seal(made, &error));
    ck_ok(read_store(path, &found));
    ck_assert_uint_eq(found.n, N);
    ck_assert_ptr_null(found.lit);
    ck_assert_mem_eq(found.emits, s.read.emits, N * sizeof *found.emits);
    ck_assert_ptr_null(found.of);
    ck_assert_mem_eq(found.read, s.read.read, N * sizeof *found.read);
    importance_free(&found);
    /* Others are refused, by name and value. */
    static const struct {
        uint32_t element;
        float weight;
        const char *says;
    } wrong[] = {{N, 1, "/importance/elements[1] = 60, must be below 60"},
                 {2, 0, "/importance/weights[1] = 0, must be above 0 and at most 1"},
                 {2, 1.5f, "/importance/weights[1] = 1.5"},
                 {2, NAN, "/importance/weights[1] = nan"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        write_store(path, wrong[k].element, wrong[k].weight);
        ck_assert_int_eq(read_store(path, &found), LAM_ERR_FORMAT);
        ck_assert_ptr_nonnull(strstr(error.message, wrong[k].says));
        ck_assert_ptr_null(found.read);
    }
    /* Sources alone, and elements that no scene has. */
    for (uint32_t last = N - 1; last <= N; last++) {
        const uint32_t emit[2] = {1, last};
        ck_ok(store_create(path, &made, &error));
        ck_ok(store_write(made, "/sources/elements", STORE_U32, 1, (size_t[]){2}, emit, &error));
        ck_ok(store_seal(made, &error));
        ck_assert_int_eq(read_store(path, &found), last < N ? LAM_OK : LAM_ERR_FORMAT);
        if (last == N) ck_assert_ptr_nonnull(strstr(error.message, "/sources/elements[1] = 60"));
        if (last == N) continue;
        ck_assert_ptr_null(found.read);
        for (uint32_t i = 0; i < N; i++) ck_assert_float_eq(found.emits[i], i == 1 || i == last ? 1 : 0);
        importance_free(&found);
    }
    /* None is no error. */
    ck_ok(store_create(path, &made, &error));
    ck_ok(store_seal(made, &error));
    ck_ok(read_store(path, &found));
    ck_assert_uint_eq(found.n, 0);
    unlink(path);
    importance_free(&s.read);
}
END_TEST

START_TEST(memory_that_runs_out_leaves_nothing) {
    subject s;
    subject_make(&s);
    const factor_product F = product_of(&s);
    bool made = false;
    for (long k = 0; !made; k++) {
        ck_assert_int_lt(k, 16);
        allocations_left = k;
        const lam_status status = importance_find(&F, C, s.rho, s.area, &s.read, &error);
        allocations_left = -1;
        made = status == LAM_OK;
        ck_assert(made || (status == LAM_ERR_MEMORY && s.read.of == NULL));
    }
    importance_free(&s.read);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("importance");
    TCase *cases = tcase_create("importance");
    tcase_add_test(cases, importance_is_the_radiosity_of_what_is_read);
    tcase_add_test(cases, shares_follow_the_mean_importance);
    tcase_add_test(cases, sources_have_an_importance_of_their_own);
    tcase_add_test(cases, importance_between_nodes_is_a_product);
    tcase_add_test(cases, importance_weighs_what_changes);
    tcase_add_test(cases, nodes_have_the_mean_square_of_their_elements);
    tcase_add_test(cases, a_reference_is_more_even);
    tcase_add_test(cases, stores_keep_the_weights);
    tcase_add_test(cases, memory_that_runs_out_leaves_nothing);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
