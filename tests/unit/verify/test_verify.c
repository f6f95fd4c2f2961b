/* `lambert verify` on stores whose checksums are right and whose content is not. */
#include "solver/method/judge/judge.h"
#include "solver/verify/verify.h"
#include "solver/walk/walk.h"
#include "support/box.h"
#include "support/scene.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { RAYS = 256, SEED = 5, PROBES = 8 };

typedef struct sample {
    mesh m;
    form_factors f;
    lam_operator *op;
    error_report errors;
} sample;

#define MUST(call)                                                                                           \
    do {                                                                                                     \
        lam_error must_error = {0};                                                                          \
        lam_error *error = &must_error;                                                                      \
        ck_assert_msg((call) == LAM_OK, "%s", must_error.message);                                           \
    } while (0)

static build_problem problem_of(const sample *s, const uint32_t *order) {
    return (build_problem){.n = s->m.n,
                           .n_channels = 1,
                           .area = s->m.area,
                           .reflectance = s->m.reflectance,
                           .F = &s->f.F,
                           .order = order};
}

static void trace(const mesh *m, const uint32_t *order, uint64_t seed, form_factors *out) {
    const form_factor_options how = {
        .recipe = {.rays = RAYS, .seed = seed}, .stage = "rays", .sky = "grid:3x2", .ground_albedo = .5};
    MUST(form_factors_make(m, order, &how, out, error));
}

static void build(sample *s, const uint32_t *order) {
    const build_options how = build_presets("exact");
    const build_problem problem = problem_of(s, order);
    build_report report;
    MUST(build_operator(&problem, &how, &s->op, &report, error));
}

/* A box with a glowing face, its exact operator, and the errors of that. */
static sample make_sample(void) {
    static char lamp[] = "lamp";
    sample s = {.m = box_mesh((double[]){1, 1, 1}, 3, .5f)};
    s.m.n_groups = 1;
    s.m.group_names = malloc(sizeof(char *));
    ck_assert_ptr_nonnull(s.m.group_names);
    s.m.group_names[0] = lamp;
    for (size_t i = 0; i < 9; i++) s.m.emission[i] = 1;
    uint32_t order[54];
    ck_assert_uint_eq(s.m.n, 54);
    MUST(mesh_z_order(&s.m, order, error));
    form_factors half[2] = {{.row_sums = NULL}, {.row_sums = NULL}};
    trace(&s.m, order, SEED, &s.f);
    for (uint64_t h = 0; h < 2; h++) trace(&s.m, order, SEED + 1 + h, &half[h]);
    build(&s, order);
    const build_problem problem = problem_of(&s, order);
    const judge_input input = {.problem = &problem,
                               .row_sums = s.f.row_sums,
                               .emission = s.m.emission,
                               .own = factor_product_of_rows(problem.F),
                               .independent = factor_product_of_rows(&half[0].F),
                               .other = factor_product_of_rows(&half[1].F),
                               .relation = REFERENCE_TWIN,
                               .probes = PROBES,
                               .seed = 1};
    MUST(judge_operator(s.op, &input, &s.errors, error));
    form_factors_free(&half[0]);
    form_factors_free(&half[1]);
    return s;
}

static void free_sample(sample *s) {
    lam_operator_close(s->op);
    form_factors_free(&s->f);
    mesh_free(&s->m);
}

/* An operator that no builder would make. */
static void save_not_finite(size_t n, store *out) {
    float *M = calloc(n * n, sizeof *M);
    ck_assert_ptr_nonnull(M);
    M[7 * n + 11] = NAN;
    MUST(store_set_text(out, "/operator", "kind", "exact", error));
    MUST(store_set_text(out, "/operator", "layout", "rows", error));
    MUST(store_write(out, "/operator/M", STORE_F32, 3, (size_t[]){1, n, n}, M, error));
    free(M);
}

/* Saves what a sample holds now. */
static void save(const sample *s, const char *path) {
    store *out = NULL;
    MUST(store_create(path, &out, error));
    MUST(store_set_text(out, "/", "name", "box", error));
    MUST(mesh_save(&s->m, s->f.row_sums, out, error));
    MUST(form_factors_save(&s->f, out, error));
    MUST(sky_bounce_save(&s->f.sky, out, error));
    if (s->op != NULL)
        MUST(operator_save(s->op, out, error));
    else
        save_not_finite(s->m.n, out);
    MUST(stated_figures_save(&(stated_figures){.report = s->errors}, out, error));
    MUST(store_seal(out, error));
}

static verify_check *const checks[] = {verify_checksums, verify_mesh,     verify_form_factors,
                                       verify_sky,       verify_operator, verify_linearity,
                                       verify_energy,    verify_error,    verify_walks};
enum { CHECKSUMS, MESH, FORM_FACTORS, SKY, OPERATOR, LINEARITY, ENERGY, ERROR, WALKS, N_CHECKS };

/* Saves, opens and examines a sample. */
static void examine(const sample *s, check done[N_CHECKS]) {
    char folder[64], path[128];
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.h5", folder);
    save(s, path);
    examination e = {.probes = PROBES, .walks = 1000};
    MUST(store_open(path, &e.s, error));
    memset(done, 0, N_CHECKS * sizeof *done);
    for (size_t i = 0; i < N_CHECKS; i++) MUST(checks[i](&e, &done[i], error));
    examination_free(&e);
    folder_remove(folder);
    ck_assert_int_eq(done[CHECKSUMS].verdict, VERDICT_OK);
}

START_TEST(test_a_good_store) {
    sample s = make_sample();
    check done[N_CHECKS];
    examine(&s, done);
    for (size_t i = 0; i < N_CHECKS; i++)
        ck_assert_msg(done[i].verdict == VERDICT_OK, "check %zu: %s", i, done[i].detail);
    free_sample(&s);
}
END_TEST

START_TEST(test_an_operator_that_loses_light) {
    sample s = make_sample();
    check done[N_CHECKS];
    uint32_t order[54];
    MUST(mesh_z_order(&s.m, order, error));
    const size_t nnz = s.f.F.indptr[s.m.n];
    float *kept = malloc(nnz * sizeof *kept);
    ck_assert_ptr_nonnull(kept);
    memcpy(kept, s.f.F.data, nnz * sizeof *kept);
    for (size_t p = 0; p < nnz; p++) s.f.F.data[p] *= .97f;
    lam_operator_close(s.op);
    build(&s, order);
    memcpy(s.f.F.data, kept, nnz * sizeof *kept);
    free(kept);
    examine(&s, done);
    ck_assert_int_eq(done[LINEARITY].verdict, VERDICT_OK);
    ck_assert_int_eq(done[ENERGY].verdict, VERDICT_BROKEN);
    ck_assert_int_eq(done[ERROR].verdict, VERDICT_BROKEN);
    free_sample(&s);
}
END_TEST

START_TEST(test_an_operator_that_is_not_finite) {
    sample s = make_sample();
    check done[N_CHECKS];
    lam_operator_close(s.op);
    s.op = NULL;
    examine(&s, done);
    ck_assert_int_eq(done[OPERATOR].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[OPERATOR].detail, "finite"));
    free_sample(&s);
}
END_TEST

START_TEST(test_form_factors_without_reciprocity) {
    sample s = make_sample();
    check done[N_CHECKS];
    /* Both changes leave the sum of the row as it was. */
    s.f.F.data[0] *= 1.001f;
    s.f.F.data[1] -= s.f.F.data[0] * (1 - 1 / 1.001f);
    examine(&s, done);
    ck_assert_int_eq(done[FORM_FACTORS].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[FORM_FACTORS].detail, "reciprocity"));
    s.f.F.data[0] *= .99f;
    examine(&s, done);
    ck_assert_int_eq(done[FORM_FACTORS].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[FORM_FACTORS].detail, "row 0 sums"));
    free_sample(&s);
}
END_TEST

/* The box is closed: no light of the sky comes in but what single precision may hide. */
START_TEST(test_a_sky_that_shines_through_walls) {
    sample s = make_sample();
    check done[N_CHECKS];
    s.f.sky.first_bounce[3 * s.m.n + 11] = 1e-6f;
    examine(&s, done);
    ck_assert_int_eq(done[SKY].verdict, VERDICT_OK);
    s.f.sky.first_bounce[3 * s.m.n + 11] = 1e-5f;
    examine(&s, done);
    ck_assert_int_eq(done[SKY].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[SKY].detail, "element 11"));
    s.f.sky.first_bounce[3 * s.m.n + 11] = -1;
    examine(&s, done);
    ck_assert_int_eq(done[SKY].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[SKY].detail, "first_bounce[3][11]"));
    s.f.sky.first_bounce[3 * s.m.n + 11] = 0;
    s.m.up = 'y';
    examine(&s, done);
    ck_assert_int_eq(done[SKY].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[SKY].detail, "z is up in the sky, y in the mesh"));
    free_sample(&s);
}
END_TEST

START_TEST(test_a_mesh_that_is_not_its_vertices) {
    sample s = make_sample();
    check done[N_CHECKS];
    s.m.area[3] *= 1.01;
    examine(&s, done);
    ck_assert_int_eq(done[MESH].verdict, VERDICT_BROKEN);
    s.m.area[3] /= 1.01;
    for (int k = 0; k < 3; k++) s.m.normal[4][k] *= -1;
    examine(&s, done);
    ck_assert_int_eq(done[MESH].verdict, VERDICT_BROKEN);
    for (int k = 0; k < 3; k++) s.m.normal[4][k] *= -1;
    s.f.row_sums[5] = 1.5;
    examine(&s, done);
    ck_assert_int_eq(done[MESH].verdict, VERDICT_BROKEN);
    free_sample(&s);
}
END_TEST

/* Patches of 20 and 34 equal elements by hand: weights are 1/20 and 1/34, or absent with those in Y. */
static void give_patches(sample *s, const float *weight) {
    two_mesh_arrays arrays = {.left = calloc(54 * 2, sizeof(float)), .begin = calloc(3, sizeof(uint64_t))};
    ck_assert(arrays.left != NULL && arrays.begin != NULL);
    arrays.begin[1] = 20;
    arrays.begin[2] = 54;
    if (weight != NULL) {
        arrays.weight = malloc(54 * sizeof *weight);
        ck_assert_ptr_nonnull(arrays.weight);
        memcpy(arrays.weight, weight, 54 * sizeof *weight);
    }
    lam_operator_close(s->op);
    MUST(operator_two_mesh_create(54, 2, 1, s->m.reflectance, &arrays, &s->op, error));
}

START_TEST(test_patches_that_weigh_wrong) {
    sample s = make_sample();
    check done[N_CHECKS];
    float weight[54];
    for (size_t i = 0; i < 54; i++) weight[i] = 1.f / (i < 20 ? 20 : 34);
    give_patches(&s, weight);
    examine(&s, done);
    ck_assert_int_eq(done[OPERATOR].verdict, VERDICT_OK);
    weight[21] *= 1.0001f;
    give_patches(&s, weight);
    examine(&s, done);
    ck_assert_int_eq(done[OPERATOR].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[OPERATOR].detail, "element 21 weighs 0.029"));
    give_patches(&s, NULL);
    examine(&s, done);
    ck_assert_int_eq(done[OPERATOR].verdict, VERDICT_OK);
    free_sample(&s);
    /* Elements of unlike area need weights. */
    sample room = make_sample();
    for (size_t i = 0; i < room.m.n_vertices; i++) room.m.vertices[i][2] *= 3;
    MUST(mesh_measure(&room.m, error));
    give_patches(&room, NULL);
    examine(&room, done);
    ck_assert_int_eq(done[OPERATOR].verdict, VERDICT_BROKEN);
    ck_assert_ptr_nonnull(strstr(done[OPERATOR].detail, "in patch 1"));
    free_sample(&room);
}
END_TEST

/* Saves a sample with an operator of the form factors F, which it takes, and compares that with walks. The
 * caller frees e. */
static void compare_walks(sample *s, csr F, examination *e, check *found) {
    char folder[64], file[128];
    uint32_t order[54];
    csr_free(&s->f.F);
    s->f.F = F;
    MUST(mesh_z_order(&s->m, order, error));
    lam_operator_close(s->op);
    build(s, order);
    folder_make(folder);
    snprintf(file, sizeof file, "%s/a.h5", folder);
    save(s, file);
    *e = (examination){.walks = 100000};
    MUST(store_open(file, &e->s, error));
    MUST(verify_mesh(e, found, error));
    MUST(verify_operator(e, found, error));
    MUST(verify_walks(e, found, error));
    folder_remove(folder);
}

/* Walks against an operator of exact form factors, with the rows of one wall scaled: the check, and the
 * chance of its largest score. */
static double walk_beside(float scale, check *found) {
    sample s = make_sample();
    examination e;
    double worst = 0;
    csr F = box_form_factors((double[]){1, 1, 1}, 3, s.m.area);
    for (uint64_t p = 0; p < F.indptr[9]; p++) F.data[p] *= scale;
    compare_walks(&s, F, &e, found);
    /* Uniform, the one group that emits, a mixture; the group, and elements 3, 10, ... 50. */
    ck_assert_uint_eq(e.n_compared, 3 * (1 + 8));
    for (size_t k = 0; k < e.n_compared; k++) worst = fmax(worst, fabs(e.compared[k].score));
    ck_assert_str_eq(e.compared[0].emission, "uniform");
    ck_assert_str_eq(e.compared[1].group, "lamp");
    ck_assert_uint_eq(e.compared[3].element, 3);
    const double chance = walk_chance(worst, e.n_compared);
    examination_free(&e);
    free_sample(&s);
    return chance;
}

/* The store states the errors of sampled form factors: 2 % for one wall is less, and yet seen; a half is
 * more.
 */
START_TEST(test_walks_beside_an_operator) {
    check found;
    ck_assert_double_gt(walk_beside(1, &found), 1e-3);
    ck_assert_msg(found.verdict == VERDICT_OK, "%s", found.detail);
    ck_assert_double_lt(walk_beside(1.02f, &found), 1e-6);
    ck_assert_msg(found.verdict == VERDICT_OK, "%s", found.detail);
    ck_assert_ptr_nonnull(strstr(found.detail, "element 3 under"));
    ck_assert_double_lt(walk_beside(1.5f, &found), 1e-6);
    ck_assert_msg(found.verdict == VERDICT_BROKEN, "%s", found.detail);
}
END_TEST

/* Raises the box; elements from ... to - 1 look outward: they see nothing, and swallow what comes to their
 * backs. The exact form factors, but for a share of those between them and the other ones, which leaks. */
static csr turn_outward(sample *s, double height, size_t from, size_t to, float leak) {
    for (size_t v = 0; v < s->m.n_vertices; v++) s->m.vertices[v][2] *= height;
    MUST(mesh_measure(&s->m, error));
    csr F = box_form_factors((double[]){1, 1, height}, 3, s->m.area);
    for (size_t i = from; i < to; i++) {
        const uint32_t second = s->m.elements[i][1];
        s->m.elements[i][1] = s->m.elements[i][3];
        s->m.elements[i][3] = second;
    }
    MUST(mesh_measure(&s->m, error));
    for (size_t i = 0; i < F.n; i++)
        for (uint64_t p = F.indptr[i]; p < F.indptr[i + 1]; p++)
            if ((i >= from && i < to) || (F.indices[p] >= from && F.indices[p] < to)) F.data[p] *= leak;
    return F;
}

/* Gives element i the group of[i]; all names must outlive the sample. */
static void give_groups(sample *s, size_t n_groups, char *const *names, const uint32_t of[54]) {
    free(s->m.group_names);
    s->m.group_names = malloc(n_groups * sizeof *s->m.group_names);
    ck_assert_ptr_nonnull(s->m.group_names);
    memcpy(s->m.group_names, names, n_groups * sizeof *names);
    memcpy(s->m.group, of, 54 * sizeof *of);
    s->m.n_groups = n_groups;
}

/* The lamp looks outward, so that its light reaches nothing: the stated relative error of 1 % allows a mean
 * over the five other walls of 2 * 1.1 * .01 / sqrt(5) = .0098. A leak l gives them l / 5 and, since four
 * fifths of what they reflect come to them again, 1 / (1 - .5 * .8) as much by all bounces: l / 3. */
static void check_leak(float leak, verdict expected, const char *say) {
    static char lamp[] = "lamp", room[] = "room";
    sample s = make_sample();
    examination e;
    check found;
    uint32_t of[54];
    for (size_t i = 0; i < 54; i++) of[i] = i >= 9;
    give_groups(&s, 2, (char *[]){lamp, room}, of);
    error_group *const stated[] = {&s.errors.single, &s.errors.lights, &s.errors.random};
    for (size_t k = 0; k < 3; k++) {
        stated[k]->total_relative.max = .01;
        stated[k]->total_indirect.max = .05;
    }
    compare_walks(&s, turn_outward(&s, 1, 0, 9, leak), &e, &found);
    ck_assert_uint_eq(e.n_compared, 3 * (2 + 8));
    for (size_t k = 0; k < e.n_compared; k++)
        ck_assert_int_eq(e.compared[k].dark, strcmp(e.compared[k].emission, "lamp") == 0);
    ck_assert_msg(found.verdict == expected, "leak %g: %s", (double)leak, found.detail);
    ck_assert_msg(strstr(found.detail, say) != NULL, "leak %g: %s", (double)leak, found.detail);
    examination_free(&e);
    free_sample(&s);
}

/* The largest |z| is that of another mean, which the error of what it receives allows. */
START_TEST(test_a_lamp_that_shines_on_nothing) {
    check_leak(0, VERDICT_OK, "within the stated error");
    check_leak(.02f, VERDICT_OK, "within the stated error");
    check_leak(.05f, VERDICT_BROKEN, "; room under lamp differs by more than the stated error");
}
END_TEST

/* The light of the floor reaches only the black ceiling, whose nine groups are smaller than those of the
 * walls and none of the 32 that are compared. */
START_TEST(test_a_lamp_that_shines_on_small_groups) {
    static char names[46][4];
    char *name[46];
    sample s = make_sample();
    examination e;
    check found;
    uint32_t of[54];
    for (size_t g = 0; g < 46; g++) {
        name[g] = names[g];
        snprintf(names[g], sizeof names[g], "g%zu", g);
    }
    for (uint32_t i = 0; i < 54; i++) {
        of[i] = i < 36 ? i : i < 45 ? 36 : i - 8;
        s.m.emission[i] = of[i] == 36;
        if (i >= 45) s.m.reflectance[i] = 0;
    }
    give_groups(&s, 46, name, of);
    compare_walks(&s, turn_outward(&s, 3, 0, 36, 0), &e, &found);
    ck_assert_uint_eq(e.n_compared, 3 * (32 + 8));
    for (size_t k = 0; k < e.n_compared; k++) {
        ck_assert(e.compared[k].group == NULL || atoi(e.compared[k].group + 1) <= 36);
        ck_assert(!e.compared[k].dark);
    }
    ck_assert_msg(found.verdict == VERDICT_OK, "%s", found.detail);
    examination_free(&e);
    free_sample(&s);
}
END_TEST

int main(void) {
    Suite *s = suite_create("verify");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_test(c, test_a_good_store);
    tcase_add_test(c, test_an_operator_that_loses_light);
    tcase_add_test(c, test_an_operator_that_is_not_finite);
    tcase_add_test(c, test_form_factors_without_reciprocity);
    tcase_add_test(c, test_a_sky_that_shines_through_walls);
    tcase_add_test(c, test_a_mesh_that_is_not_its_vertices);
    tcase_add_test(c, test_patches_that_weigh_wrong);
    tcase_add_test(c, test_walks_beside_an_operator);
    tcase_add_test(c, test_a_lamp_that_shines_on_nothing);
    tcase_add_test(c, test_a_lamp_that_shines_on_small_groups);
    suite_add_tcase(s, c);
    return suite_run(s);
}
