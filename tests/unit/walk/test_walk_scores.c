/* Refusals, cancellation and scores of walks. */
#include "solver/walk/walk.h"
#include "support/box.h"
#include "support/suite.h"

#include <math.h>

typedef lam_status walk_way(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                            lam_error *error);
static walk_way *const ways[] = {walk_gather, walk_shoot};

static bool at_once(void *context) {
    (void)context;
    return true;
}

START_TEST(refused_cancelled_and_dark) {
    mesh m = box_mesh((double[]){1, 1, 1}, 1, .5f);
    lam_error error = {0};
    walk_scene *s = NULL;
    ck_ok(walk_scene_create(&m, CLOSURE_MEASURED, &s, &error));
    float E[6] = {0};
    uint32_t target[6] = {0, 0, 2, 2, WALK_NO_TARGET, WALK_NO_TARGET};
    const progress stop = {.cancelled = at_once};
    for (size_t w = 0; w < 2; w++) {
        walk_problem p = {.n_rhs = 1, .E = E, .n_targets = 3, .target = target, .walks = 64};
        walk_estimates e = {.walks = 7};
        ck_ok(ways[w](s, &p, &e, &error));
        for (size_t t = 0; t < 3; t++) {
            ck_assert(e.mean[t] == 0 && e.error[t] == 0 && e.visits[t] == 0);
            ck_assert_double_eq(walk_score(&e, t, 0, 0), 0);
        }
        walk_estimates_free(&e);
        p.progress = &stop;
        ck_assert_int_eq(ways[w](s, &p, &e, &error), LAM_ERR_CANCELLED);
        p.progress = NULL;
        p.walks = 0;
        ck_assert_int_eq(ways[w](s, &p, &e, &error), LAM_ERR_ARGUMENT);
        p.walks = 1;
        E[3] = -1;
        ck_assert_int_eq(ways[w](s, &p, &e, &error), LAM_ERR_ARGUMENT);
        ck_assert_str_eq(error.message, "emission[0][3] = -1, must be at least 0");
        E[3] = NAN;
        ck_assert_int_eq(ways[w](s, &p, &e, &error), LAM_ERR_ARGUMENT);
        E[3] = 0;
        target[1] = 3;
        ck_assert_int_eq(ways[w](s, &p, &e, &error), LAM_ERR_ARGUMENT);
        ck_assert_str_eq(error.message, "target[1] = 3, must be below 3");
        target[1] = 0;
        ck_assert_uint_eq(e.walks, 0); /* untouched since it was freed */
    }
    walk_scene_free(s);
    mesh_free(&m);
}
END_TEST

/* Light that no walk found: a value of few visits is possible, one of many is not. */
START_TEST(scores_of_rare_visits) {
    double mean = 0, deviation = 0, largest = 1;
    uint64_t visits = 0;
    walk_estimates e = {.n_rhs = 1,
                        .n_channels = 1,
                        .n_targets = 1,
                        .walks = 1000,
                        .mean = &mean,
                        .error = &deviation,
                        .largest = &largest,
                        .visits = &visits};
    ck_assert_double_eq_tol(walk_score(&e, 0, .002, 0), 2 / sqrt(2 + 1), 1e-12); /* 2 visits expected */
    ck_assert_double_eq_tol(walk_score(&e, 0, .4, 0), 400 / sqrt(400 + 1), 1e-12);
    mean = .1;
    deviation = .01;
    visits = 1000;
    ck_assert_double_eq_tol(walk_score(&e, 0, .13, 0), .03 / sqrt(1e-4 + 1e-6), 1e-12);
    ck_assert_double_eq_tol(walk_score(&e, 0, .13, .02), .03 / sqrt(5e-4 + 1e-6), 1e-12);
}
END_TEST

/* Quantiles of Student's distribution with 31 degrees of freedom. */
START_TEST(chances) {
    ck_assert_double_eq_tol(walk_chance(2.03951345, 1), .05, 1e-8);
    ck_assert_double_eq_tol(walk_chance(-2.74404192, 1), .01, 1e-8);
    ck_assert_double_eq_tol(walk_chance(2.03951345, 10), 1 - pow(.95, 10), 1e-7);
    ck_assert_double_eq(walk_chance(0, 3), 1);
    ck_assert_double_lt(walk_chance(12, 1000), 1e-8);
}
END_TEST

int main(void) {
    Suite *s = suite_create("walk scores");
    TCase *c = tcase_create("all");
    tcase_add_test(c, refused_cancelled_and_dark);
    tcase_add_test(c, scores_of_rare_visits);
    tcase_add_test(c, chances);
    suite_add_tcase(s, c);
    return suite_run(s);
}
