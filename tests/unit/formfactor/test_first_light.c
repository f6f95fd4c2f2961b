/* Direct illumination by few elements, against exact form factors without occlusion and those of pairs with
 * it. */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/first_light.h"
#include "solver/formfactor/source.h"
#include "support/box_problem.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>

/* A sanitizer watches fewer elements, whose form factors are larger by as much as their accuracy is. */
#ifdef LAMBERT_FEW_CASES
enum { ELEMENTS = 500, BRIGHT = 105, SEEDS = 4 };
#else
enum { ELEMENTS = 2000, BRIGHT = 300, SEEDS = 8 };
#endif

static lam_error error;

/* |H - F E| and |D| over |F E|, by area. */
typedef struct distance {
    double off, noise;
} distance;

static distance find_distance(const mesh *m, const csr *F, const float *E, uint64_t seed) {
    first_light *l = NULL;
    double *H = test_allocate(m->n, sizeof *H), *D = test_allocate(m->n, sizeof *D), wrong = 0, all = 0,
           noise = 0;
    bool known = false;
    ck_ok(first_light_create(m, seed, &l, &error));
    ck_ok(first_light_of(l, E, H, D, &known, &error));
    ck_assert(known);
    for (size_t i = 0; i < m->n; i++) {
        double truth = 0;
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
            truth += (double)F->data[e] * (double)E[F->indices[e]];
        wrong += m->area[i] * (H[i] - truth) * (H[i] - truth);
        all += m->area[i] * truth * truth;
        noise += m->area[i] * D[i] * D[i];
    }
    first_light_destroy(l);
    free(H);
    free(D);
    return (distance){sqrt(wrong / all), sqrt(noise / all)};
}

static double off(const mesh *m, const csr *F, const float *E) {
    const distance d = find_distance(m, F, E, 1);
    return d.off;
}

/* One element; a patch of 100; a whole wall, in which some are brighter. */
START_TEST(a_box) {
    fixture f = fixture_box(room, 12, .5f);
    float *E = test_allocate(f.m.n, sizeof *E);
    E[200] = 3;
    /* A relative tolerance of 1e-5 a pair, single precision in F. */
    ck_assert_double_lt(off(&f.m, &f.F, E), 2e-5);
    for (size_t i = 150; i < 250; i++) E[i] = 1 + (float)(i % 3);
    ck_assert_double_lt(off(&f.m, &f.F, E), .003);
    for (size_t i = 0; i < 280; i++) E[i] = 1 + (float)(i % 7);
    ck_assert_double_lt(off(&f.m, &f.F, E), .003);
    free(E);
    fixture_free(&f);
}
END_TEST

START_TEST(shadows) {
    const generate_options how = {.kind = "cornell", .elements = ELEMENTS, .reflectance = .5, .seed = 1};
    const form_factor_options options = {
        .recipe = {.source = &source_pairs, .rays = 256, .accuracy = 7e-6 * 2000 / ELEMENTS, .seed = 3}};
    mesh m;
    form_factors f;
    ck_ok(scene_generated(&how, &m, &error));
    uint32_t *order = test_allocate(m.n, sizeof *order);
    float *E = test_allocate(m.n, sizeof *E);
    ck_ok(mesh_z_order(&m, order, &error));
    ck_ok(form_factors_make(&m, order, &options, &f, &error));
    for (int emission = 0; emission < 2; emission++) {
        double off2 = 0, noise2 = 0;
        if (emission == 0) E[order[m.n / 3]] = 1;
        for (size_t k = 0; emission == 1 && k < BRIGHT; k++) E[order[m.n / 2 + k]] = 1;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            const distance d = find_distance(&m, &f.F, E, seed);
            off2 += d.off * d.off / SEEDS;
            noise2 += d.noise * d.noise / SEEDS;
        }
        ck_assert_double_lt(sqrt(off2), emission == 0 ? .01 : .02);
        /* A tenth of the receivers has most of the noise, whose squares over all seeds are known to
         * sqrt(2 / 1600); that of the form factors is a quarter of it at most. */
        /* Pairs in the open agree to 1e-4: their factors are in single precision, and small. */
        ck_assert_double_gt(noise2, .8 * off2 - 1e-8);
        ck_assert_double_lt(noise2, 1.25 * off2);
    }
    form_factors_free(&f);
    mesh_free(&m);
    free(order);
    free(E);
}
END_TEST

/* For too many bright elements nothing is known, and H stays unchanged. */
START_TEST(too_many) {
    mesh m = box_mesh(unit_cube, 53, .5f); /* 16,854 elements */
    first_light *l = NULL;
    float *E = test_allocate(m.n, sizeof *E);
    double *H = test_allocate(m.n, sizeof *H), *D = test_allocate(m.n, sizeof *D);
    bool known = true;
    for (size_t i = 0; i < m.n; i++) {
        E[i] = 1;
        H[i] = D[i] = 77;
    }
    ck_ok(first_light_create(&m, 1, &l, &error));
    ck_ok(first_light_of(l, E, H, D, &known, &error));
    ck_assert(!known);
    for (size_t i = 0; i < m.n; i++) ck_assert(H[i] == 77 && D[i] == 77);
    first_light_destroy(l);
    free(E);
    free(H);
    free(D);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("the light of few");
    TCase *tests = tcase_create("light");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, a_box);
    tcase_add_test(tests, shadows);
    tcase_add_test(tests, too_many);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
