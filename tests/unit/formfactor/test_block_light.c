/* Direct illumination by a walk of the tree, against exact form factors without occlusion and those of pairs
 * with it: how far it is off, and that half the difference of its halves says so. */
#include "solver/formfactor/blocks/block_light.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/sight/occlusion.h"
#include "support/box_problem.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <omp.h>

/* A sanitizer watches fewer elements. */
#ifdef LAMBERT_FEW_CASES
enum { ELEMENTS = 500, SEEDS = 4, FINE = 40 };
#else
enum { ELEMENTS = 2000, SEEDS = 16, FINE = 60 };
#endif

static lam_error error;

/* A scene with its form factors, and the light of one emission by them. */
typedef struct lit {
    const mesh *m;
    const csr *F;
    plane_tree tree;
    float *E;
    double *truth, *H, *D, all; /* all: |truth|^2 by area */
} lit;

static void lit_make(const mesh *m, const csr *F, lit *s) {
    *s = (lit){.m = m, .F = F};
    ck_ok(form_factors_tree(m, &s->tree, &error));
    s->E = test_allocate(m->n, sizeof *s->E);
    s->truth = test_allocate(m->n, sizeof *s->truth);
    s->H = test_allocate(m->n, sizeof *s->H);
    s->D = test_allocate(m->n, sizeof *s->D);
}

static void lit_free(lit *s) {
    plane_tree_free(&s->tree);
    free(s->E);
    free(s->truth);
    free(s->H);
    free(s->D);
}

static void find_truth(lit *s) {
    s->all = 0;
    for (size_t i = 0; i < s->m->n; i++) {
        s->truth[i] = 0;
        for (uint64_t e = s->F->indptr[i]; e < s->F->indptr[i + 1]; e++)
            s->truth[i] += (double)s->F->data[e] * (double)s->E[s->F->indices[e]];
        s->all += s->m->area[i] * s->truth[i] * s->truth[i];
    }
}

/* The bound of blocks beside which 16 segments are taken. */
static const double bound_of_16 = 1.2e-4;

static void find_light(lit *s, double beside, uint64_t seed) {
    block_light *l = NULL;
    bool known = false;
    ck_ok(block_light_create(s->m, &s->tree, beside, seed, &l, &error));
    ck_ok(block_light_of(l, s->E, s->H, s->D, &known, &error));
    ck_assert(known);
    block_light_destroy(l);
}

/* |H - F E|^2 and |D|^2 over |F E|^2, by area. */
static void distances(const lit *s, double *off, double *noise) {
    *off = *noise = 0;
    for (size_t i = 0; i < s->m->n; i++) {
        const double by = s->m->area[i] / s->all, away = s->H[i] - s->truth[i];
        *off += by * away * away;
        *noise += by * s->D[i] * s->D[i];
    }
}

/* One element; a patch of 100 in an order that no tree has; a whole wall, in which some are brighter. */
START_TEST(a_box) {
    fixture f = fixture_box(room, 12, .5f);
    double off, noise;
    lit s;
    lit_make(&f.m, &f.F, &s);
    for (int emission = 0; emission < 3; emission++) {
        memset(s.E, 0, f.m.n * sizeof *s.E);
        if (emission == 0) s.E[200] = 3;
        for (size_t i = 150; emission == 1 && i < 250; i++) s.E[i] = 1 + (float)(i % 3);
        for (size_t i = 0; emission == 2 && i < 144; i++) s.E[i] = 1 + (float)(i % 7);
        find_truth(&s);
        find_light(&s, bound_of_16, 1);
        distances(&s, &off, &noise);
        /* Blocks are off by a tenth of their bound .003 at most; where nothing stands between nothing is
         * cast. */
        ck_assert_double_lt(sqrt(off), 3e-4);
        ck_assert(noise == 0);
    }
    lit_free(&s);
    fixture_free(&f);
}
END_TEST

/* H = F E pair by pair: by segments where an occlusion test is mixed, to this standard error of a factor. */
static const double accuracy = 3e-6;

static void find_truth_by_pairs(lit *s, const visibility *v, const polygon *polygons) {
    pair_factor_rules rules;
    pair_factor_rules_init(&rules);
    const occlusion o = {.v = v,
                         .area = s->m->area,
                         .polygons = polygons,
                         .rules = &rules,
                         .tolerance = 1e-6,
                         .accuracy = accuracy * 2000 / ELEMENTS,
                         .segments = 64,
                         .seed = 77};
    s->all = 0;
#pragma omp parallel for schedule(dynamic, 8)
    for (uint32_t i = 0; i < s->m->n; i++) {
        s->truth[i] = 0;
        for (uint32_t e = 0; e < s->m->n; e++) {
            const uint32_t low = i < e ? i : e, high = i < e ? e : i;
            double seen;
            if (e == i || s->E[e] == 0) continue;
            const double g = pair_factor_exchange(&rules, &polygons[e], &polygons[i], o.tolerance);
            if (!(g > 0)) continue;
            if (occlusion_test(&o, NULL, low, high, g, &seen) == OCCLUSION_PARTIAL)
                seen = occlusion_estimate(&o, NULL, low, high, g);
            s->truth[i] += (double)s->E[e] * seen / s->m->area[i];
        }
    }
    for (size_t i = 0; i < s->m->n; i++) s->all += s->m->area[i] * s->truth[i] * s->truth[i];
}

/* One element, a lamp, and lamps in two planes of which one shines unevenly. */
static void light_up(lit *s, const uint32_t *order, int emission) {
    const size_t n = s->m->n, count = n / 20;
    memset(s->E, 0, n * sizeof *s->E);
    if (emission == 0) s->E[order[n / 3]] = 1;
    for (size_t k = 0; emission >= 1 && k < count; k++) s->E[order[n / 2 + k]] = 1;
    for (size_t k = 0; emission == 2 && k < count; k++) s->E[order[n / 5 + k]] = 1 + (float)(k % 5);
}

/* One element far from clusters of many elements, whose light is linear in both coordinates. */
START_TEST(large_clusters) {
    mesh m = box_mesh(room, FINE, .5f);
    visibility *v = NULL;
    double off, noise;
    lit s;
    polygon *polygons = test_allocate(m.n, sizeof *polygons);
    for (size_t i = 0; i < m.n; i++) polygon_of_element(&m, i, &polygons[i]);
    ck_ok(visibility_create(&m, &v, &error));
    lit_make(&m, NULL, &s);
    s.E[m.n / 7] = 1;
    find_truth_by_pairs(&s, v, polygons);
    find_light(&s, bound_of_16, 1);
    distances(&s, &off, &noise);
    ck_assert_double_lt(sqrt(off), 3e-4);
    ck_assert(noise == 0);
    lit_free(&s);
    visibility_destroy(v);
    mesh_free(&m);
    free(polygons);
}
END_TEST

/* The distance to the truth is what half the difference of both halves says, and the mean over all seeds is
 * off by the root of their number less: nothing favours light or dark. */
START_TEST(shadows) {
    const generate_options how = {.kind = "cornell", .elements = ELEMENTS, .reflectance = .5, .seed = 1};
    mesh m;
    lit s;
    visibility *v = NULL;
    ck_ok(scene_generated(&how, &m, &error));
    uint32_t *order = test_allocate(m.n, sizeof *order);
    double *mean = test_allocate(m.n, sizeof *mean);
    polygon *polygons = test_allocate(m.n, sizeof *polygons);
    for (size_t i = 0; i < m.n; i++) polygon_of_element(&m, i, &polygons[i]);
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(mesh_z_order(&m, order, &error));
    lit_make(&m, NULL, &s);
    for (int emission = 0; emission < 3; emission++) {
        double all_off = 0, all_noise = 0, of_mean = 0, none;
        light_up(&s, order, emission);
        find_truth_by_pairs(&s, v, polygons);
        memset(mean, 0, m.n * sizeof *mean);
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            double off, noise;
            find_light(&s, bound_of_16, seed);
            distances(&s, &off, &noise);
            all_off += off / SEEDS;
            all_noise += noise / SEEDS;
            for (size_t i = 0; i < m.n; i++) mean[i] += s.H[i] / SEEDS;
        }
        memcpy(s.H, mean, m.n * sizeof *mean);
        distances(&s, &of_mean, &none);
        /* A tenth of the receivers has most of the noise, whose squares are known to sqrt(2 / (200 SEEDS)).
         * Open blocks are off by 3e-4, and the truth by up to two thirds of the noise of one element. */
        const double fixed2 = pow(3e-4, 2) + .45 * (emission == 0 ? all_noise : 0);
        ck_assert_double_lt(sqrt(all_off), .02);
        ck_assert_double_lt(all_noise, 1.25 * all_off);
        ck_assert_double_lt(all_off, 1.25 * all_noise + fixed2);
        ck_assert_double_lt(of_mean, 2 * all_noise / SEEDS + fixed2);
    }
    lit_free(&s);
    visibility_destroy(v);
    mesh_free(&m);
    free(order);
    free(mean);
    free(polygons);
}
END_TEST

/* For too many bright elements nothing is known, and H and D stay unchanged; the dark is dark. */
START_TEST(too_many_and_none) {
    fixture f = fixture_box(room, 4, .5f);
    lit s;
    block_light *l = NULL;
    bool known = true;
    lit_make(&f.m, &f.F, &s);
    ck_ok(block_light_create(s.m, &s.tree, bound_of_16, 1, &l, &error));
    for (size_t i = 0; i < f.m.n; i++) {
        s.E[i] = i % 3 == 0 ? 1 : 0;
        s.H[i] = s.D[i] = 77;
    }
    ck_ok(block_light_of(l, s.E, s.H, s.D, &known, &error));
    ck_assert(!known);
    for (size_t i = 0; i < f.m.n; i++) ck_assert(s.H[i] == 77 && s.D[i] == 77);
    memset(s.E, 0, f.m.n * sizeof *s.E);
    ck_ok(block_light_of(l, s.E, s.H, s.D, &known, &error));
    ck_assert(known);
    for (size_t i = 0; i < f.m.n; i++) ck_assert(s.H[i] == 0 && s.D[i] == 0);
    block_light_destroy(l);
    lit_free(&s);
    fixture_free(&f);
}
END_TEST

/* Noise falls by about N^-.7: .23 of it for eight times the segments, which a bound of a ninth and of less
 * has. */
START_TEST(segments_follow_the_blocks) {
    const double beside[] = {1, bound_of_16, bound_of_16 / 9, bound_of_16 / 1000};
    const generate_options how = {.kind = "cornell", .elements = 500, .reflectance = .5, .seed = 1};
    double off, noise[4];
    mesh m;
    lit s;
    ck_ok(scene_generated(&how, &m, &error));
    lit_make(&m, NULL, &s);
    s.all = 1;
    for (size_t i = 40; i < 60; i++) s.E[i] = 1;
    for (int k = 0; k < 4; k++) {
        find_light(&s, beside[k], 7);
        distances(&s, &off, &noise[k]);
    }
    ck_assert_double_eq(noise[0], noise[1]);
    ck_assert_double_gt(noise[2], 0);
    ck_assert_double_lt(sqrt(noise[2]), .4 * sqrt(noise[1]));
    ck_assert_double_eq(noise[3], noise[2]);
    lit_free(&s);
    mesh_free(&m);
}
END_TEST

START_TEST(bits_are_the_same_for_any_number_of_threads) {
    const generate_options how = {.kind = "cornell", .elements = 500, .reflectance = .5, .seed = 1};
    const int most = omp_get_max_threads();
    mesh m;
    lit s;
    ck_ok(scene_generated(&how, &m, &error));
    lit_make(&m, NULL, &s);
    double *H = test_allocate(m.n, sizeof *H), *D = test_allocate(m.n, sizeof *D);
    for (size_t i = 40; i < 60; i++) s.E[i] = 1 + (float)(i % 3);
    for (int threads = 1; threads <= 3; threads++) {
        omp_set_num_threads(threads);
        find_light(&s, bound_of_16, 5);
        if (threads == 1) {
            memcpy(H, s.H, m.n * sizeof *H);
            memcpy(D, s.D, m.n * sizeof *D);
        }
        ck_assert_mem_eq(s.H, H, m.n * sizeof *H);
        ck_assert_mem_eq(s.D, D, m.n * sizeof *D);
    }
    omp_set_num_threads(most);
    free(H);
    free(D);
    lit_free(&s);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("light by a walk");
    TCase *tests = tcase_create("light");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, a_box);
    tcase_add_test(tests, large_clusters);
    tcase_add_test(tests, shadows);
    tcase_add_test(tests, too_many_and_none);
    tcase_add_test(tests, segments_follow_the_blocks);
    tcase_add_test(tests, bits_are_the_same_for_any_number_of_threads);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
