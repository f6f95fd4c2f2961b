/* Estimates by walks against closed forms and dense solves, their standard errors, and what they must notice.
 */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"
#include "solver/walk/walk.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/plates.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>

/* The chance by which a correct estimate may fail a comparison; seeds are fixed. */
static const double least_chance = 1e-3;

typedef lam_status walk_way(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                            lam_error *error);
static walk_way *const ways[] = {walk_gather, walk_shoot};
static const char *const names[] = {"gathered", "shot"};

/* Each element a target of its own. */
static uint32_t *alone(const mesh *m) {
    uint32_t *target = test_allocate(m->n, sizeof *target);
    for (size_t i = 0; i < m->n; i++) target[i] = (uint32_t)i;
    return target;
}

static walk_scene *open_scene(const mesh *m) {
    walk_scene *s = NULL;
    lam_error error = {0};
    ck_ok(walk_scene_create(m, CLOSURE_MEASURED, &s, &error));
    return s;
}

/* H [C][n] = (I - F R)^-1 F E in double, F dense. */
static double *irradiance(const mesh *m, const double *F, const float *E) {
    const size_t n = m->n;
    double *P = test_allocate(n * n, sizeof *P), *H = test_allocate(m->n_channels * n, sizeof *H);
    for (size_t c = 0; c < m->n_channels; c++) {
        bounced_light(n, F, m->reflectance + c * n, P);
        for (size_t i = 0; i < n; i++) {
            for (size_t j = 0; j < n; j++) H[c * n + i] += P[i * n + j] * (double)E[c * n + j];
            H[c * n + i] /= rho_or_one(m->reflectance[c * n + i]);
        }
    }
    free(P);
    return H;
}

/* The quantity [C][n] of which walks estimate area means. */
static double *quantity_of(const mesh *m, lam_quantity q, const double *H, const float *E) {
    double *x = test_allocate(m->n_channels * m->n, sizeof *x);
    for (size_t k = 0; k < m->n_channels * m->n; k++)
        x[k] = q == LAM_IRRADIANCE
                   ? H[k]
                   : (double)m->reflectance[k] * H[k] + (q == LAM_RADIOSITY ? (double)E[k] : 0);
    return x;
}

static double target_mean(const mesh *m, const uint32_t *target, size_t t, const double *x) {
    double sum = 0, area = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (target[i] != t) continue;
        sum += m->area[i] * x[i];
        area += m->area[i];
    }
    return area > 0 ? sum / area : 0;
}

/* The largest |score| of the estimates of emission r against x [C][n]; error [C][n] is that of x, or NULL. */
static double worst_score(const mesh *m, const walk_problem *p, const walk_estimates *e, size_t r,
                          const double *x, const double *error) {
    double worst = 0;
    for (size_t c = 0; c < m->n_channels; c++)
        for (size_t t = 0; t < p->n_targets; t++) {
            const double own = error == NULL ? 0 : target_mean(m, p->target, t, error + c * m->n);
            const size_t k = (r * m->n_channels + c) * p->n_targets + t;
            const double value = target_mean(m, p->target, t, x + c * m->n);
            worst = fmax(worst, fabs(walk_score(e, k, value, fabs(own) + 1e-7 * fabs(value))));
        }
    return worst;
}

/* Both ways to walk agree with x. */
static void check_both(const mesh *m, const walk_problem *p, const double *x, const double *own) {
    lam_error error = {0};
    walk_scene *s = open_scene(m);
    for (size_t w = 0; w < 2; w++) {
        walk_estimates e;
        ck_ok(ways[w](s, p, &e, &error));
        const double worst = worst_score(m, p, &e, 0, x, own);
        const size_t count = m->n_channels * p->n_targets;
        ck_assert_msg(walk_chance(worst, count) > least_chance, "%s: score %g of %zu", names[w], worst,
                      count);
        walk_estimates_free(&e);
    }
    walk_scene_free(s);
}

/* Closed, one reflectance, one emission: B = E / (1 - rho) everywhere. */
START_TEST(furnace) {
    const double size[3] = {2, 1, 1};
    const float rho[] = {.3f, .7f, .95f};
    mesh m = box_mesh(size, 3, rho[_i]);
    uint32_t *target = alone(&m);
    float E[54];
    double B[54];
    for (size_t i = 0; i < m.n; i++) E[i] = 2;
    for (size_t i = 0; i < m.n; i++) B[i] = 2 / (1 - (double)rho[_i]);
    const walk_problem p = {.n_rhs = 1, .E = E, .n_targets = m.n, .target = target, .walks = 2000, .seed = 1};
    check_both(&m, &p, B, NULL);
    free(target);
    mesh_free(&m);
}
END_TEST

/* Any reflectances with E = 1 - rho: B = 1. */
START_TEST(white_furnace_of_many_colours) {
    mesh m = box_mesh((double[]){10, 6, 3}, 2, .5f);
    float E[3 * 24];
    double B[3 * 24];
    uint64_t state = 5;
    uint32_t target[24];
    free(m.reflectance);
    m.n_channels = 3;
    m.reflectance = random_reflectance(m.n, 3, &state);
    for (size_t k = 0; k < 72; k++) E[k] = 1 - m.reflectance[k];
    for (size_t k = 0; k < 72; k++) B[k] = 1;
    for (uint32_t i = 0; i < 24; i++) target[i] = i / 4;
    const walk_problem p = {.n_rhs = 1, .E = E, .n_targets = 6, .target = target, .walks = 50000, .seed = 2};
    check_both(&m, &p, B, NULL);
    mesh_free(&m);
}
END_TEST

/* truths.md, infinite bounces, 5. */
START_TEST(room_of_six_faces) {
    mesh m = box_mesh((double[]){10, 6, 3}, 1, .5f);
    uint32_t *target = alone(&m);
    m.reflectance[4] = .2f;
    m.reflectance[5] = .7f;
    const float E[6] = {0, 0, 0, 0, 0, 1};
    const double B[6] = {.244787308, .244787308, .249787404, .249787404, .136329470, 1.135385436};
    const walk_problem p = {.n_rhs = 1, .E = E, .n_targets = 6, .target = target, .walks = 100000, .seed = 3};
    check_both(&m, &p, B, NULL);
    free(target);
    mesh_free(&m);
}
END_TEST

/* truths.md, infinite bounces, 6: means over faces of 4 x 4 elements, which one element a face would miss. */
START_TEST(cube_with_a_bright_face) {
    mesh m = box_mesh((double[]){1, 1, 1}, 4, .5f);
    float E[96] = {0};
    double B[96];
    uint32_t target[96];
    for (uint32_t i = 0; i < 96; i++) target[i] = i / 16;
    for (size_t i = 0; i < 96; i++) {
        E[i] = i < 16;
        B[i] = i < 16 ? 1.102645712 : i < 32 ? .171829422 : .181381216;
    }
    const walk_problem p = {.n_rhs = 1, .E = E, .n_targets = 6, .target = target, .walks = 100000, .seed = 4};
    check_both(&m, &p, B, NULL);
    mesh_free(&m);
}
END_TEST

/* Two plates with reflectance rho, a black occluder between: B1 = E / (1 - (rho F)^2), B2 = rho F B1. The
 * rest of the rays leaves. */
START_TEST(plates_with_an_occluder) {
    for (size_t c = 0; c < sizeof plates_cases / sizeof *plates_cases; c++) {
        mesh m = plates(c == 0 ? NULL : plates_cases[c].occluder);
        plates_move(&m, plates_places[_i][0], plates_places[_i][1]);
        for (size_t i = 0; i < m.n; i++) m.reflectance[i] = i < 2 ? .8f : 0;
        const float E[4] = {1, 0, 0, 0};
        const double F = plates_cases[c].F, rho = (double).8f;
        const double B[4] = {1 / (1 - rho * F * rho * F), rho * F / (1 - rho * F * rho * F)};
        const uint32_t target[4] = {0, 1, WALK_NO_TARGET, WALK_NO_TARGET};
        const walk_problem p = {
            .n_rhs = 1, .E = E, .n_targets = 2, .target = target, .walks = 100000, .seed = 5};
        check_both(&m, &p, B, NULL);
        mesh_free(&m);
    }
}
END_TEST

/* A ceiling that is too short by a gap: below 10^-4 of all area it is a crack, whose rays are cast again, and
 * B = E / (1 - rho). A wider gap g lets B = E / (1 - rho (1 - g)) of the light out, nearly: rays that come to
 * the gap are evenly spread after so many bounces. */
START_TEST(cracks_and_gaps) {
    const double gap = (double[]){6e-5, 4e-4}[_i], rho = (double).9995f;
    mesh m = box_mesh((double[]){1, 1, 1}, 1, .9995f);
    lam_error error = {0};
    for (size_t v = 4 * 5; v < 4 * 6; v++)
        if (m.vertices[v][0] > .5) m.vertices[v][0] -= 6 * gap;
    ck_ok(mesh_measure(&m, &error));
    const float E[6] = {1, 1, 1, 1, 1, 1};
    const uint32_t target[6] = {0};
    const walk_problem p = {.n_rhs = 1, .E = E, .n_targets = 1, .target = target, .walks = 4800, .seed = 12};
    walk_scene *s = open_scene(&m);
    walk_estimates e;
    ck_ok(walk_gather(s, &p, &e, &error));
    const double B = 1 / (1 - rho * (_i == 0 ? 1 : 1 - gap));
    ck_assert_double_le(fabs(walk_score(&e, 0, B, 0)), 4);
    walk_estimates_free(&e);
    walk_scene_free(s);
    mesh_free(&m);
}
END_TEST

/* A coloured box with uneven reflectances, one in six of them 0, lit by a few elements. */
typedef struct lit_box {
    mesh m;
    double *F; /* dense */
    float *E;
    double *H;
} lit_box;

static lit_box lit_box_make(void) {
    const double size[3] = {2, 3, 1};
    lit_box b = {.m = box_mesh(size, 3, .5f)};
    uint64_t state = 11;
    const size_t n = b.m.n;
    csr F = box_form_factors(size, 3, b.m.area);
    free(b.m.reflectance);
    b.m.n_channels = 3;
    b.m.reflectance = random_reflectance(n, 3, &state);
    b.F = test_allocate(n * n, sizeof *b.F);
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = F.indptr[i]; p < F.indptr[i + 1]; p++)
            b.F[i * n + F.indices[p]] = (double)F.data[p];
    csr_free(&F);
    b.E = test_allocate(3 * n, sizeof *b.E);
    for (size_t c = 0; c < 3; c++)
        for (size_t i = c; i < n; i += 7) b.E[c * n + i] = (float)(1 + i % 3);
    b.H = irradiance(&b.m, b.F, b.E);
    return b;
}

static void lit_box_free(lit_box *b) {
    mesh_free(&b->m);
    free(b->F);
    free(b->E);
    free(b->H);
}

START_TEST(every_element_of_a_coloured_box) {
    const lam_quantity q = (lam_quantity)_i;
    lit_box b = lit_box_make();
    uint32_t *target = alone(&b.m);
    double *x = quantity_of(&b.m, q, b.H, b.E);
    const walk_problem p = {
        .n_rhs = 1, .E = b.E, .quantity = q, .n_targets = b.m.n, .target = target, .walks = 20000, .seed = 6};
    check_both(&b.m, &p, x, NULL);
    free(x);
    free(target);
    lit_box_free(&b);
}
END_TEST

/* Pair by pair: a partly occluded factor has a standard error of 1e-4. */
static double *precise_form_factors(const mesh *m, uint64_t seed) {
    lam_error error = {0};
    form_factors f = {.row_sums = NULL};
    uint32_t *order = test_allocate(m->n, sizeof *order);
    double *F = test_allocate(m->n * m->n, sizeof *F);
    const form_factor_options how = {
        .recipe = {.source = &source_pairs, .rays = 1024, .accuracy = 1e-4, .seed = seed}};
    ck_ok(mesh_z_order(m, order, &error));
    ck_ok(form_factors_make(m, order, &how, &f, &error));
    for (size_t i = 0; i < m->n; i++)
        for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++)
            F[i * m->n + f.F.indices[p]] = (double)f.F.data[p];
    form_factors_free(&f);
    free(order);
    return F;
}

/* Open scenes with blocks, colours, backs and black floors, group by group. Two samples of the form factors
 * say how well the dense solve is known. */
START_TEST(scenes_with_occlusion) {
    generate_options how = {
        .kind = "cornell", .variant = 1, .terrain = "flat", .elements = 150, .reflectance = -1, .seed = 1};
    if (_i > 0) how.kind = "city";
    lam_error error = {0};
    mesh m = generate_good(&how);
    if (_i == 2) ck_ok(mesh_make_two_sided(&m, &error));
    if (_i == 3)
        for (size_t i = 0; i + 1 < m.n; i += 2) /* every other face turned: its back swallows light */
            for (size_t c = 0, last = mesh_corners(&m, i) - 1; c < last - c; c++) {
                const uint32_t corner = m.elements[i][c];
                m.elements[i][c] = m.elements[i][last - c];
                m.elements[i][last - c] = corner;
            }
    ck_ok(mesh_measure(&m, &error));
    const size_t count = m.n_channels * m.n;
    float *E = test_allocate(count, sizeof *E);
    for (size_t k = 0; k < count; k++) E[k] = (k % m.n) % 5 == 0 ? 1 : m.emission[k];
    double *H[2], *own = test_allocate(count, sizeof *own);
    for (uint64_t seed = 0; seed < 2; seed++) {
        double *F = precise_form_factors(&m, seed + 1);
        H[seed] = irradiance(&m, F, E);
        free(F);
    }
    for (size_t k = 0; k < count; k++) {
        own[k] = .5 * fabs(H[0][k] - H[1][k]);
        H[0][k] = .5 * (H[0][k] + H[1][k]);
    }
    const walk_problem p = {.n_rhs = 1,
                            .E = E,
                            .quantity = LAM_IRRADIANCE,
                            .n_targets = m.n_groups,
                            .target = m.group,
                            .walks = 40000,
                            .seed = 7};
    check_both(&m, &p, H[0], own);
    free(H[0]);
    free(H[1]);
    free(own);
    free(E);
    mesh_free(&m);
}
END_TEST

/* The scores of many seeds have the mean 0 and the variance v = 31/29 of Student's distribution with 31
 * degrees of freedom, their squares the variance 3 * 31^2 / (29 * 27) - v^2 = 2.54: means of many of them are
 * within four standard errors. A sanitizer watches the same code with each seed. */
START_TEST(standard_errors_are_right) {
#ifdef LAMBERT_FEW_CASES
    enum { SEEDS = 60 };
#else
    enum { SEEDS = 400 };
#endif
    lit_box b = lit_box_make();
    lam_error error = {0};
    walk_scene *s = open_scene(&b.m);
    uint32_t target[54];
    for (uint32_t i = 0; i < 54; i++) target[i] = i / 9;
    double sum[18] = {0}, squares[18] = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const walk_problem p = {.n_rhs = 1,
                                .E = b.E,
                                .quantity = LAM_IRRADIANCE,
                                .n_targets = 6,
                                .target = target,
                                .walks = 1600,
                                .seed = seed};
        walk_estimates e;
        ck_ok(ways[_i](s, &p, &e, &error));
        for (size_t k = 0; k < 18; k++) {
            const double mean = target_mean(&b.m, target, k % 6, b.H + k / 6 * b.m.n);
            const double score = (mean - e.mean[k]) / e.error[k];
            sum[k] += score / SEEDS;
            squares[k] += score * score / SEEDS;
        }
        walk_estimates_free(&e);
    }
    const double expected = 31. / 29;
    for (size_t k = 0; k < 18; k++) {
        ck_assert_msg(fabs(sum[k]) < 4 * sqrt(expected / SEEDS), "%s: mean score %g", names[_i], sum[k]);
        ck_assert_msg(fabs(squares[k] - expected) < 4 * sqrt(2.54 / SEEDS), "%s: mean square of scores %g",
                      names[_i], squares[k]);
    }
    walk_scene_free(s);
    lit_box_free(&b);
}
END_TEST

/* Gathered by the same walks, the answers to E1, E2 and E1 + 2 E2 are linear but for rounding; shot from
 * other starts, by their standard errors. */
START_TEST(linear) {
    lit_box b = lit_box_make();
    lam_error error = {0};
    walk_scene *s = open_scene(&b.m);
    const size_t count = 3 * b.m.n;
    float *E = test_allocate(3 * count, sizeof *E);
    uint32_t target[54];
    for (uint32_t i = 0; i < 54; i++) target[i] = i / 9;
    for (size_t k = 0; k < count; k++) {
        E[k] = b.E[k];
        E[count + k] = (float)(k % 4);
        E[2 * count + k] = E[k] + 2 * E[count + k];
    }
    for (size_t w = 0; w < 2; w++) {
        const walk_problem p = {
            .n_rhs = 3, .E = E, .n_targets = 6, .target = target, .walks = 20000, .seed = 8};
        walk_estimates e;
        ck_ok(ways[w](s, &p, &e, &error));
        for (size_t k = 0; k < 18; k++) {
            const double sum = e.mean[k] + 2 * e.mean[18 + k];
            const double variance = e.error[k] * e.error[k] + 4 * e.error[18 + k] * e.error[18 + k] +
                                    e.error[36 + k] * e.error[36 + k];
            /* Sums of 10^5 terms in double. */
            ck_assert_double_le(fabs(e.mean[36 + k] - sum), w == 0 ? 1e-9 * sum : 4.5 * sqrt(variance));
        }
        walk_estimates_free(&e);
    }
    free(E);
    walk_scene_free(s);
    lit_box_free(&b);
}
END_TEST

/* The rows of one wall scaled by 1.02, as by an operator whose wall receives too much. */
START_TEST(a_wall_that_receives_too_much_is_noticed) {
    lit_box b = lit_box_make();
    lam_error error = {0};
    walk_scene *s = open_scene(&b.m);
    uint32_t target[54];
    for (uint32_t i = 0; i < 54; i++) target[i] = i / 9;
    for (size_t k = 0; k < 3 * b.m.n; k++) b.E[k] = 1;
    double *right = irradiance(&b.m, b.F, b.E);
    for (size_t k = 0; k < 9 * b.m.n; k++) b.F[k] *= 1.02;
    double *wrong = irradiance(&b.m, b.F, b.E);
    for (size_t w = 0; w < 2; w++) {
        const walk_problem p = {.n_rhs = 1,
                                .E = b.E,
                                .quantity = LAM_IRRADIANCE,
                                .n_targets = 6,
                                .target = target,
                                .walks = w == 0 ? 100000 : 1000000,
                                .seed = 9};
        walk_estimates e;
        ck_ok(ways[w](s, &p, &e, &error));
        ck_assert(walk_chance(worst_score(&b.m, &p, &e, 0, right, NULL), 18) > least_chance);
        ck_assert_msg(walk_chance(worst_score(&b.m, &p, &e, 0, wrong, NULL), 18) < 1e-6, "%s", names[w]);
        walk_estimates_free(&e);
    }
    free(right);
    free(wrong);
    walk_scene_free(s);
    lit_box_free(&b);
}
END_TEST

START_TEST(same_for_any_thread_count) {
    lit_box b = lit_box_make();
    lam_error error = {0};
    walk_scene *s = open_scene(&b.m);
    uint32_t target[54];
    for (uint32_t i = 0; i < 54; i++) target[i] = i / 9;
    walk_problem p = {.n_rhs = 1, .E = b.E, .n_targets = 6, .target = target, .walks = 5000, .seed = 10};
    for (size_t w = 0; w < 2; w++) {
        walk_estimates one, five, other;
        omp_set_num_threads(1);
        ck_ok(ways[w](s, &p, &one, &error));
        omp_set_num_threads(5);
        ck_ok(ways[w](s, &p, &five, &error));
        p.seed = 11;
        ck_ok(ways[w](s, &p, &other, &error));
        p.seed = 10;
        ck_assert_uint_eq(one.walks, 5024); /* a multiple of 32 */
        ck_assert_mem_eq(one.mean, five.mean, 18 * sizeof *one.mean);
        ck_assert_mem_eq(one.error, five.error, 18 * sizeof *one.error);
        ck_assert_mem_eq(one.visits, five.visits, 6 * sizeof *one.visits);
        for (size_t k = 0; k < 18; k++) ck_assert(one.mean[k] != other.mean[k]); /* the seed matters */
        walk_estimates_free(&one);
        walk_estimates_free(&five);
        walk_estimates_free(&other);
    }
    walk_scene_free(s);
    lit_box_free(&b);
}
END_TEST

int main(void) {
    Suite *s = suite_create("walk");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_loop_test(c, furnace, 0, 3);
    tcase_add_test(c, white_furnace_of_many_colours);
    tcase_add_test(c, room_of_six_faces);
    tcase_add_test(c, cube_with_a_bright_face);
    tcase_add_loop_test(c, plates_with_an_occluder, 0, 4);
    tcase_add_loop_test(c, cracks_and_gaps, 0, 2);
    tcase_add_loop_test(c, every_element_of_a_coloured_box, 0, 3);
    tcase_add_loop_test(c, scenes_with_occlusion, 0, 4);
    tcase_add_loop_test(c, standard_errors_are_right, 0, 2);
    tcase_add_test(c, linear);
    tcase_add_test(c, a_wall_that_receives_too_much_is_noticed);
    tcase_add_test(c, same_for_any_thread_count);
    suite_add_tcase(s, c);
    return suite_run(s);
}
