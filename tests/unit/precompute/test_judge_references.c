/* References of a judge that stay for another operator of the same scene: figures are those of new
 * references, bit by bit, of samples of rays, of pairs with the same disturbed, and of finer blocks; and they
 * are made anew for another recipe. The scene has two lights, in channels of their own. */
#include "solver/formfactor/source.h"
#include "solver/precompute/judging.h"
#include "support/building.h"
#include "support/scene.h"
#include "support/suite.h"

#include <stdlib.h>
#include <string.h>

enum { RAYS = 64, PROBES = 12, OPERATORS = 2 };

typedef struct subject {
    mesh m;
    uint32_t *order;
    plane_tree tree;
    form_factors f;
    block_factors blocks;
    build_problem problem;
    lam_operator *op[OPERATORS];
} subject;

/* Two operators of the same form factors. */
static void subject_make(subject *s, const recipe *r) {
    lam_error error = {.message = ""};
    const generate_options how = {
        .kind = "cornell", .elements = 500, .seed = 1, .reflectance = -1, .closed = true, .terrain = "flat"};
    const form_factor_options of = {.recipe = *r, .stage = ""};
    const bool blocks = recipe_source(r) == &source_blocks;
    build_report report;
    *s = (subject){.m = generate_good(&how)};
    s->order = malloc(s->m.n * sizeof *s->order);
    ck_assert_ptr_nonnull(s->order);
    ck_ok(mesh_z_order(&s->m, s->order, &error));
    ck_assert_uint_eq(s->m.n_channels, 3);
    for (size_t i = s->m.n; i < 2 * s->m.n; i++) s->m.emission[i] = i % 50 < 7 ? 1 : 0;
    if (blocks) {
        ck_ok(form_factors_tree(&s->m, &s->tree, &error));
        ck_ok(form_factors_make_blocks(&s->m, s->order, &s->tree, NULL, &of, &s->f, &s->blocks, &error));
    } else {
        ck_ok(form_factors_make(&s->m, s->order, &of, &s->f, &error));
    }
    s->problem = (build_problem){.n = s->m.n,
                                 .n_channels = s->m.n_channels,
                                 .area = s->m.area,
                                 .reflectance = s->m.reflectance,
                                 .F = blocks ? NULL : &s->f.F,
                                 .blocks = blocks ? &s->blocks : NULL,
                                 .order = s->order,
                                 .noise = recipe_noise(r)};
    for (int k = 0; k < OPERATORS; k++) {
        const build_options options = options_with(blocks ? "hierarchical" : "low-rank", k == 0 ? .2 : .02);
        double(*centre)[3] = malloc(s->m.n * sizeof *centre);
        element_corners corners = {(const double(*)[3])s->m.vertices, (const uint32_t(*)[4])s->m.elements};
        for (size_t i = 0; i < s->m.n; i++) mesh_centroid(&s->m, i, centre[i]);
        build_problem problem = s->problem;
        problem.centre = (const double(*)[3])centre;
        problem.normal = (const float(*)[3])s->m.normal;
        problem.corners = &corners;
        ck_ok(build_operator(&problem, &options, &s->op[k], &report, &error));
        free(centre);
    }
}

static void subject_free(subject *s) {
    for (int k = 0; k < OPERATORS; k++) lam_operator_close(s->op[k]);
    form_factors_free(&s->f);
    block_factors_free(&s->blocks);
    plane_tree_free(&s->tree);
    free(s->order);
    mesh_free(&s->m);
}

static void count_samples(void *context, const char *stage, double share) {
    size_t *count = context;
    if (share == 1 && strcmp(stage, "sample") == 0) ++*count;
}

/* made: the samples that were made. */
static error_report judge(const subject *s, int k, const recipe halves[2], judge_references **kept,
                          size_t *made) {
    lam_error error = {.message = ""};
    error_report report;
    size_t count = 0;
    const progress p = {.report = count_samples, .context = &count};
    const judging j = {.m = &s->m,
                       .order = s->order,
                       .problem = &s->problem,
                       .f = &s->f,
                       .halves = {halves[0], halves[1]},
                       .stages = {"sample", "sample"},
                       .probes_seed = 1,
                       .first_light_seed = 2,
                       .probes = PROBES,
                       .progress = &p,
                       .kept = kept};
    ck_ok(judging_run(&j, s->op[k], &report, &error));
    report.seconds = 0;
    *made = count;
    return report;
}

static void assert_same(const error_group *a, const error_group *b) {
    const double x[] = {a->total_relative.mean,    a->total_indirect.mean, a->total_indirect.max,
                        a->operator_indirect.mean, a->reference_noise,     a->probes_noise},
                 y[] = {b->total_relative.mean,    b->total_indirect.mean, b->total_indirect.max,
                        b->operator_indirect.mean, b->reference_noise,     b->probes_noise};
    ck_assert_uint_eq(a->probes, b->probes);
    for (size_t k = 0; k < sizeof x / sizeof *x; k++) ck_assert(x[k] == y[k]);
    ck_assert_double_gt(x[1], 0);
}

static const struct {
    const char *name;
    recipe of;
} cases[] = {{"rays", {.source = &source_rays, .rays = RAYS, .seed = 7}},
             {"pairs", {.source = &source_pairs, .rays = RAYS, .accuracy = 1e-2, .seed = 7}},
             {"blocks", {.source = &source_blocks, .rays = RAYS, .accuracy = 4e-3, .seed = 7}}};

START_TEST(references_serve_the_next_operator) {
    subject *s = malloc(sizeof *s);
    judge_references *kept = NULL, *alone = NULL;
    size_t at_first, then, anew;
    const recipe halves[2] = {recipe_of_judge(&cases[_i].of, 0, 11), recipe_of_judge(&cases[_i].of, 0, 12)};
    const recipe other[2] = {recipe_of_judge(&cases[_i].of, 0, 13), halves[1]};
    ck_assert_ptr_nonnull(s);
    subject_make(s, &cases[_i].of);
    const error_report first = judge(s, 0, halves, &kept, &at_first);
    ck_assert_ptr_nonnull(kept);
    ck_assert_uint_ge(at_first, 1);
    ck_assert_double_gt(judge_references_bytes(kept), 8. * (double)s->m.n);
    const error_report second = judge(s, 1, halves, &kept, &then), fresh = judge(s, 1, halves, NULL, &anew);
    ck_assert_uint_eq(then, 0);
    ck_assert_uint_eq(anew, at_first);
    ck_assert(first.lights.total_indirect.mean != second.lights.total_indirect.mean);
    assert_same(&second.single, &fresh.single);
    assert_same(&second.lights, &fresh.lights);
    assert_same(&second.random, &fresh.random);
    /* Of another seed, and where the form factors were given back. */
    const error_report third = judge(s, 1, other, &kept, &then);
    const error_report known = judge(s, 1, other, &alone, &anew);
    ck_assert_uint_eq(then, at_first);
    assert_same(&third.single, &known.single);
    assert_same(&third.lights, &known.lights);
    ck_assert(third.single.total_indirect.mean != second.single.total_indirect.mean);
    judge_references_free_samples(kept);
    const error_report fourth = judge(s, 1, other, &kept, &then);
    ck_assert_uint_eq(then, at_first);
    assert_same(&fourth.lights, &known.lights);
    judge_references_free(kept);
    judge_references_free(alone);
    subject_free(s);
    free(s);
}
END_TEST

START_TEST(nothing_is_freed_of_nothing) {
    judge_references_free(NULL);
    judge_references_free_samples(NULL);
    ck_assert_double_eq(judge_references_bytes(NULL), 0);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge references");
    TCase *tests = tcase_create("judge references");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, references_serve_the_next_operator, 0, sizeof cases / sizeof *cases);
    tcase_add_test(tests, nothing_is_freed_of_nothing);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
