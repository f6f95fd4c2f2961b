/* Stated errors of small scenes by references of many seeds: their spread against the noise that they state,
 * and bounds against the truth, by a reference of many rays. Rooms, a soup, a city, and a scene in which some
 * elements see next to nothing, so that their references are all noise. */
#include "solver/base/random.h"
#include "solver/formfactor/source.h"
#include "solver/precompute/judging.h"
#include "support/building.h"
#include "support/scene.h"
#include "support/suite.h"

enum { SEEDS = 12, RAYS = 512, RAYS_OF_TRUTH = 1 << 15 };

/* A tray, and two plates far outside of it, of which each is a millionth of what the other one sees. */
static const char dark_scene[] = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
                                 "v 0 0 1\nv 2 0 1\nv 2 2 1\nv 0 2 1\n"
                                 "v 30 0 0\nv 31 0 0\nv 31 1 0\nv 30 1 0\n"
                                 "v 30 0 9\nv 31 0 9\nv 31 1 9\nv 30 1 9\n"
                                 "f 1 2 3 4\nf 2 1 5 6\nf 3 2 6 7\nf 4 3 7 8\nf 1 4 8 5\n"
                                 "f 9 10 11 12\nf 16 15 14 13\n";

static mesh make_scene(const char *kind) {
    lam_error error = {.message = ""};
    if (strcmp(kind, "dark") == 0) {
        char folder[64], path[256];
        import_report report;
        const mesh_refinement refinement = {.elements = 36};
        folder_make(folder);
        file_write(folder, "dark.obj", dark_scene, path);
        mesh m = import_good(path, &report);
        folder_remove(folder);
        ck_ok(mesh_refine(&m, &refinement, &error));
        return m;
    }
    const generate_options how = {.kind = kind,
                                  .elements = 36,
                                  .seed = 1,
                                  .reflectance = -1,
                                  .closed = strcmp(kind, "cornell") == 0,
                                  .variant = 1,
                                  .terrain = "flat"};
    return generate_good(&how);
}

typedef struct subject {
    mesh m;
    uint32_t *order;
    recipe recipe;
    form_factors f;
    build_problem problem;
    lam_operator *op;
} subject;

/* The exact operator of form factors by this recipe. */
static void subject_make(subject *s, const char *kind, const recipe *r) {
    lam_error error = {.message = ""};
    const build_options how = options_with("exact", .05);
    const form_factor_options of = {.recipe = *r, .stage = ""};
    build_report report;
    *s = (subject){.m = make_scene(kind), .recipe = *r};
    s->order = malloc(s->m.n * sizeof *s->order);
    ck_ok(mesh_z_order(&s->m, s->order, &error));
    ck_ok(form_factors_make(&s->m, s->order, &of, &s->f, &error));
    s->problem = (build_problem){.n = s->m.n,
                                 .n_channels = s->m.n_channels,
                                 .area = s->m.area,
                                 .reflectance = s->m.reflectance,
                                 .F = &s->f.F,
                                 .order = s->order,
                                 .noise = recipe_noise(r)};
    ck_ok(build_operator(&s->problem, &how, &s->op, &report, &error));
}

static void subject_free(subject *s) {
    lam_operator_close(s->op);
    form_factors_free(&s->f);
    free(s->order);
    mesh_free(&s->m);
}

static error_report judge(const subject *s, const recipe *of, uint64_t seed) {
    lam_error error = {.message = ""};
    error_report report;
    const judging j = {.m = &s->m,
                       .order = s->order,
                       .problem = &s->problem,
                       .f = &s->f,
                       .halves = {recipe_of_judge(of, 0, random_hash(3 * seed)),
                                  recipe_of_judge(of, 0, random_hash(3 * seed + 1))},
                       .stages = {"", ""},
                       .probes_seed = 1,
                       .first_light_seed = random_hash(3 * seed + 2),
                       .probes = s->m.n};
    ck_ok(judging_run(&j, s->op, &report, &error));
    return report;
}

/* Of one group, over all seeds. */
typedef struct spread {
    double sum, square, noise2;
    size_t count, bounds, below;
} spread;

static void spread_add(spread *s, const error_group *g, double truth) {
    const double stated = g->total_indirect.mean, noise = g->reference_noise;
    if (g->probes == 0) return;
    /* A bound has the figure with the noise in it, and twice its standard error. */
    const double figure = g->is_bound ? stated - 2 * noise : stated;
    ck_assert_double_ge(stated, noise);
    s->count++;
    s->sum += figure;
    s->square += figure * figure;
    s->noise2 += noise * noise;
    s->bounds += g->is_bound;
    s->below += g->is_bound && stated < truth;
}

/* The spread of 12 figures is known to 1 / sqrt(24), or 20 %: a factor of 2 is five times as much. */
static void spread_check(const spread *s, const char *scene, const char *group) {
    if (s->count == 0) return;
    const double m = (double)s->count, variance = (s->square - s->sum * s->sum / m) / (m - 1),
                 noise2 = s->noise2 / m;
    ck_assert_msg(noise2 < 4 * variance && variance < 4 * noise2,
                  "%s, %s: the noise is stated as %g, figures %g spread by %g", scene, group, sqrt(noise2),
                  s->sum / m, sqrt(variance));
    ck_assert_msg(s->below <= 1, "%s, %s: %zu of %zu bounds are below the truth", scene, group, s->below,
                  s->bounds);
}

static void check_scene(const char *kind, const recipe *r, const recipe *of_truth) {
    subject s;
    spread single = {0}, lights = {0};
    subject_make(&s, kind, r);
    const error_report truth = judge(&s, of_truth, 99);
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        const error_report one = judge(&s, r, seed);
        ck_assert_uint_eq(one.single.probes, s.m.n);
        spread_add(&single, &one.single, truth.single.total_indirect.mean);
        spread_add(&lights, &one.lights, truth.lights.total_indirect.mean);
    }
    ck_assert_uint_eq(single.count, SEEDS);
    spread_check(&single, kind, "single elements");
    spread_check(&lights, kind, "lights");
    subject_free(&s);
}

START_TEST(noise_by_rays_is_the_spread_of_seeds) {
    static const char *const kinds[] = {"cornell", "rooms", "canopy", "city", "dark"};
    const recipe r = {.source = &source_rays, .rays = RAYS, .seed = 1};
    const recipe of_truth = {.source = &source_rays, .rays = RAYS_OF_TRUTH, .seed = 1};
    check_scene(kinds[_i], &r, &of_truth);
}
END_TEST

/* Both samples share the pairs that are projected. */
START_TEST(noise_by_pairs_is_the_spread_of_seeds) {
    const recipe r = {.source = &source_pairs, .rays = RAYS_BESIDE_PAIRS, .accuracy = 2e-3, .seed = 1};
    recipe of_truth = r;
    of_truth.accuracy = 2e-5;
    check_scene("cornell", &r, &of_truth);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judged_scenes");
    TCase *cases = tcase_create("judged_scenes");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, noise_by_rays_is_the_spread_of_seeds, 0, 5);
    tcase_add_test(cases, noise_by_pairs_is_the_spread_of_seeds);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
