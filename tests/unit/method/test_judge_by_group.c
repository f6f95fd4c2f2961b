/* The errors of groups against the same by plain sums over three elements of two
 * groups, two channels, with the noise of twins; and the law of the effective number of emitters on errors
 * that are independent. */
#include "solver/base/random.h"
#include "solver/method/judge/judge_by_group.h"
#include "support/suite.h"

#include "store/status.h"

#include <math.h>
#include <string.h>

enum { N = 3, C = 2, GROUPS = 2, VECTOR = C * N };
static const double area[N] = {1, 2, 4};
static const float reflectance[VECTOR] = {.5f, .5f, .5f, .5f, .5f, .5f};
static const uint32_t group[N] = {0, 0, 1};

static const build_problem problem = {.n = N, .n_channels = C, .area = area, .reflectance = reflectance};

static judge_input input_of(void) {
    return (judge_input){.problem = &problem, .group = group, .n_groups = GROUPS};
}

static void free_figures(double **of, int count) {
    for (int f = 0; f < count; f++) free(of[f]);
}

/* The figures [GROUP_FIGURES] of one single element, freed by free_figures. */
static void judge_single(const float *E, const float *B, const double *x, const double *y, double **of) {
    const figure_probe one = {
        .problem = &problem, .E = E, .B = B, .x = x, .y = y, .relation = REFERENCE_TWIN};
    const judge_input input = input_of();
    by_group_sums sums = {.n = 0};
    lam_error error = {.message = ""};
    ck_ok(by_group_begin(&input, 1, &sums, &error));
    by_group_add(&one, JUDGE_SINGLE, &sums);
    ck_ok(by_group_finish(&sums, of, &error));
    by_group_free(&sums);
}

START_TEST(a_single_element_counts_by_its_power) {
    /* Channel 0 of element 1 emits 3, channel 1 of it 1: P^2 = 4 (9 + 1), N = 1. */
    const float E[VECTOR] = {0, 3, 0, 0, 1, 0}, B[VECTOR] = {1, 4, 1, 1, 2, 1};
    const double x[VECTOR] = {.3, .1, .2, .1, .1, .1}, y[VECTOR] = {.1, .1, .2, .1, .1, .1};
    double *of[GROUP_FIGURES] = {NULL};
    judge_single(E, B, x, y, of);
    /* Means of x: group 0 (1 * .2 + 2 * .1) / 3 and .1, group 1 .2 and .1; the noise of the mean of
     * group 0 is .1 / 3 in channel 0, its square less than a ninth of the rest; that of its elements is more,
     * and stays. */
    const double mean0 = (.4 / 3) * (.4 / 3) + .01 - (.1 / 3) * (.1 / 3), mean1 = .04 + .01;
    const double rms0 = (.04 + 2 * .01) / 3 + .01, P2 = 40;
    ck_assert_double_eq_tol(of[GROUP_MEAN_ONE][0], sqrt(mean0 / P2), 1e-12);
    ck_assert_double_eq_tol(of[GROUP_MEAN_ONE][1], sqrt(mean1 / P2), 1e-12);
    ck_assert_double_eq_tol(of[GROUP_RMS_ONE][0], sqrt(rms0 / P2), 1e-12);
    ck_assert_double_eq_tol(of[GROUP_RMS_ONE][1], sqrt(mean1 / P2), 1e-12);
    /* Of one probe all elements are alike. */
    ck_assert_double_eq_tol(of[GROUP_RMS_MANY][1], sqrt(mean1 / P2), 1e-12);
    ck_assert(of[GROUP_RMS_EVEN][1] == 0);
    /* Light: group 0 has 1.2 and 2 (1.1) in channel 0, group 1 has 1.2: less than the mean of all. */
    const double light1 = 1.2 * 1.2 + 1.1 * 1.1;
    ck_assert_double_eq_tol(of[GROUP_NEAR][1], sqrt(mean1 / light1), 1e-7);
    ck_assert(isnan(of[GROUP_FAR][1]) && isnan(of[GROUP_UNIFORM][1]));
    free_figures(of, GROUP_FIGURES);
}
END_TEST

/* There are two groups: figures that are not known do not count, nor do the largest of single probes. */
START_TEST(the_worst_group) {
    double uniform[] = {.1, NAN}, near[] = {NAN, .3}, far[] = {.2, NAN}, one[] = {9, 9}, own[] = {NAN, .1};
    group_errors e = {.n_groups = GROUPS, .n_rows = 1};
    worst_group worst = judge_worst_group(&e);
    ck_assert_uint_eq(worst.group, GROUPS);
    ck_assert_double_eq(worst.total, 0);
    e.of[GROUP_UNIFORM] = uniform;
    e.of[GROUP_NEAR] = near;
    e.of[GROUP_FAR] = far;
    e.of[GROUP_MEAN_ONE] = e.of[GROUP_FAR_LARGEST] = one;
    e.of_operator[GROUP_NEAR] = e.of_operator[GROUP_FAR] = own;
    worst = judge_worst_group(&e);
    ck_assert_uint_eq(worst.group, 1);
    ck_assert_int_eq(worst.figure, GROUP_NEAR);
    ck_assert_double_eq(worst.total, .3);
    ck_assert_double_eq(worst.of_operator, .1);
    near[1] = .15; /* group 0, of whose operator nothing is known */
    worst = judge_worst_group(&e);
    ck_assert_uint_eq(worst.group, 0);
    ck_assert_int_eq(worst.figure, GROUP_FAR);
    ck_assert_double_eq_tol(worst.of_operator, .2 * sqrt(.5), 1e-15);
}
END_TEST

START_TEST(noise_that_is_large_stays) {
    const float E[VECTOR] = {0, 1, 0, 0, 1, 0}, B[VECTOR] = {1, 1, 1, 1, 1, 1};
    const double x[VECTOR] = {0, 0, .3, 0, 0, .3}, y[VECTOR] = {0, 0, .1, 0, 0, .1};
    double *of[GROUP_FIGURES] = {NULL};
    judge_single(E, B, x, y, of);
    /* The error is .2, its noise .1: more than a third. */
    ck_assert_double_eq_tol(of[GROUP_MEAN_ONE][1], sqrt(2 * .04 / (4 + 4)), 1e-12);
    free_figures(of, GROUP_FIGURES);
}
END_TEST

/* Errors of single elements are drawn, those of whole groups are their sums, and nothing else: the law then
 * holds without an even part. With a part that all emissions share, that part is the even one. */
START_TEST(whole_groups_show_what_does_not_average_out) {
    enum { MANY = 400 };
    static double areas[MANY], off[MANY][MANY];
    static float rho[MANY], E[MANY], B[MANY];
    static uint32_t groups[MANY];
    const double shared = _i == 0 ? 0 : .5;
    uint64_t state = 7;
    for (size_t i = 0; i < MANY; i++) {
        areas[i] = 1;
        rho[i] = .5f;
        groups[i] = i < MANY / 2;
        B[i] = 1;
        for (size_t j = 0; j < MANY; j++) off[j][i] = random_unit(&state) - .5 + shared;
    }
    const build_problem many = {.n = MANY, .n_channels = 1, .area = areas, .reflectance = rho};
    const judge_input input = {.problem = &many, .group = groups, .n_groups = GROUPS};
    by_group_sums sums = {.n = 0};
    double *of[GROUP_FIGURES] = {NULL};
    lam_error error = {.message = ""};
    ck_ok(by_group_begin(&input, 1, &sums, &error));
    for (size_t j = 0; j < MANY; j++) {
        memset(E, 0, sizeof E);
        E[j] = 1;
        const figure_probe one = {.problem = &many, .E = E, .B = B, .x = off[j], .relation = REFERENCE_TWIN};
        by_group_add(&one, JUDGE_SINGLE, &sums);
    }
    double *x = memory_allocate(MANY, sizeof *x, "errors", &error);
    ck_assert_ptr_nonnull(x);
    for (size_t i = 0; i < MANY; i++) E[i] = groups[i] == 0;
    for (size_t i = 0; i < MANY; i++) {
        for (size_t j = 0; j < MANY; j++) x[i] += E[j] > 0 ? off[j][i] : 0;
    }
    const figure_probe whole = {.problem = &many, .E = E, .B = B, .x = x, .relation = REFERENCE_TWIN};
    by_group_add(&whole, JUDGE_WHOLE, &sums);
    ck_ok(by_group_finish(&sums, of, &error));
    const double one = sqrt(1. / 12 + shared * shared);
    for (int g = 0; g < GROUPS; g++) {
        ck_assert_double_eq_tol(of[GROUP_RMS_ONE][g], one, .01);
        ck_assert_double_eq_tol(of[GROUP_RMS_MANY][g], one, .01);
        /* The mean square of 200 elements is within three tenths, three standard errors, of what 200 emitters
         * add up to, 1 / 12 / 200. */
        ck_assert_double_eq_tol(of[GROUP_RMS_EVEN][g], shared, sqrt(.3 / 12 / 200));
    }
    free(x);
    free_figures(of, GROUP_FIGURES);
    by_group_free(&sums);
}
END_TEST

START_TEST(receivers_have_a_row_of_their_own) {
    const float E[VECTOR] = {0, 1, 0, 0, 1, 0}, B[VECTOR] = {1, 1, 1, 1, 1, 1}, read[N] = {1, 0, 0};
    const double x[VECTOR] = {.1, .3, .2, .1, .3, .2};
    const figure_probe one = {.problem = &problem, .E = E, .B = B, .x = x, .relation = REFERENCE_TWIN};
    judge_input input = input_of();
    by_group_sums sums = {.n = 0};
    double *of[GROUP_FIGURES] = {NULL};
    lam_error error = {.message = ""};
    input.read = read;
    ck_ok(by_group_begin(&input, 1, &sums, &error));
    ck_assert_uint_eq(sums.n_rows, 2);
    by_group_add(&one, JUDGE_SINGLE, &sums);
    ck_ok(by_group_finish(&sums, of, &error));
    ck_assert_double_eq_tol(of[GROUP_RMS_ONE][0], sqrt(.02 / 8), 1e-12);
    ck_assert_double_eq_tol(of[GROUP_RMS_ONE][GROUPS], sqrt(.18 / 8), 1e-12);
    ck_assert(of[GROUP_RMS_ONE][1] == 0); /* group 1 has no receiver */
    ck_assert_double_eq_tol(of[GROUP_RMS_ONE][GROUPS + 1], sqrt(.08 / 8), 1e-12);
    free_figures(of, GROUP_FIGURES);
    by_group_free(&sums);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge_by_group");
    TCase *cases = tcase_create("judge_by_group");
    tcase_add_test(cases, a_single_element_counts_by_its_power);
    tcase_add_test(cases, the_worst_group);
    tcase_add_test(cases, noise_that_is_large_stays);
    tcase_add_loop_test(cases, whole_groups_show_what_does_not_average_out, 0, 2);
    tcase_add_test(cases, receivers_have_a_row_of_their_own);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
