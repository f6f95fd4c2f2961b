/* Skies by which a first bounce is judged, against closed forms of two elements: plates under the open sky,
 * a plate with a wall beside it, references with noise of the first bounce, of F, and of both. */
#include "solver/method/judge_sky.h"
#include "support/suite.h"

#include <math.h>

enum { N = 2, TILES = 7, SKIES = JUDGE_EVEN_SKIES + JUDGE_SUNS };
static const double area[N] = {1, 3};
static const float reflectance[N] = {.5f, .8f};
static const uint32_t group[N] = {0, 1};
/* H0 of the elements under each tile is this times the tile's weight, so that all skies err alike. */
static const double seen[N] = {1, .25};

/* F_01 of the operator and of two references; A_0 F_01 = A_1 F_10. */
typedef struct two_elements {
    double F[3];
    float first[3][TILES * N]; /* the operator's first bounce, both samples */
} two_elements;

static lam_status multiply(const void *context, size_t m, const double *x, double *y, lam_error *error) {
    const double F = *(const double *)context;
    (void)error;
    for (size_t k = 0; k < m; k++) {
        y[k] = F * x[m + k];
        y[m + k] = F * area[0] / area[1] * x[k];
    }
    return LAM_OK;
}

/* B_0 = (E_0 + rho_0 F E_1) / (1 - rho_0 rho_1 F F'), B_1 likewise, F' = F A_0 / A_1. */
static void exact(double F, const double E[N], double B[N]) {
    const double back = F * area[0] / area[1], rho[N] = {(double)reflectance[0], (double)reflectance[1]};
    const double all = 1 - rho[0] * rho[1] * F * back;
    B[0] = (E[0] + rho[0] * F * E[1]) / all;
    B[1] = (E[1] + rho[1] * back * E[0]) / all;
}

/* first [TILES][N], element i off by off[i]. */
static void fill(const double off[N], float *first) {
    for (size_t t = 0; t < TILES; t++)
        for (size_t i = 0; i < N; i++) first[t * N + i] = (float)((1. + (double)t) * seen[i] * (1 + off[i]));
}

static lam_operator *make_operator(double F) {
    lam_operator *op = NULL;
    lam_error error = {.message = ""};
    float *P = malloc(N * N * sizeof *P);
    ck_assert_ptr_nonnull(P);
    for (size_t j = 0; j < N; j++) {
        const double E[N] = {j == 0, j == 1};
        double B[N];
        exact(F, E, B);
        for (size_t i = 0; i < N; i++) P[i * N + j] = (float)(B[i] - E[i]);
    }
    ck_ok(operator_exact_create(N, 1, reflectance, P, &op, &error));
    return op;
}

/* The figures of skies, and sqrt of the sum of squared errors of the second group, all over all. */
static size_t judge(const two_elements *s, reference_relation relation, figure_group *figures,
                    double *rms_of_wall) {
    static const build_problem problem = {.n = N, .n_channels = 1, .area = area, .reflectance = reflectance};
    const judged_sky sky = {.n_tiles = TILES, .own = s->first[0], .samples = {s->first[1], s->first[2]}};
    const judge_input input = {.problem = &problem,
                               .group = group,
                               .n_groups = N,
                               .sky = &sky,
                               .own = {.n = N, .multiply = multiply, .context = &s->F[0]},
                               .independent = {.n = N, .multiply = multiply, .context = &s->F[1]},
                               .other = {.n = N, .multiply = multiply, .context = &s->F[2]},
                               .relation = relation,
                               .other_share = .5,
                               .seed = 9};
    by_group_sums sums = {.n = 0};
    double *of[GROUP_FIGURES] = {NULL};
    lam_error error = {.message = ""};
    size_t done = 0;
    lam_operator *op = make_operator(s->F[0]);
    *figures = (figure_group){.relative = {.tried = 0}};
    ck_ok(by_group_begin(&input, &sums, &error));
    ck_ok(judge_sky_add(op, &input, figures, &sums, &done, &error));
    ck_ok(by_group_finish(&sums, GROUP_SKY_FIGURES, of, &error));
    if (rms_of_wall != NULL) *rms_of_wall = of[GROUP_RMS_ONE][1];
    for (int f = 0; f < GROUP_FIGURES; f++) free(of[f]);
    by_group_free(&sums);
    lam_operator_close(op);
    return done;
}

/* |x|_A / |b|_A. */
static double ratio(const double x[N], const double b[N]) {
    return sqrt((area[0] * x[0] * x[0] + area[1] * x[1] * x[1]) /
                (area[0] * b[0] * b[0] + area[1] * b[1] * b[1]));
}

/* B of the light rho H0 whose element i is off by off[i]. */
static void lit(double F, const double off[N], double B[N]) {
    double E[N];
    for (size_t i = 0; i < N; i++) E[i] = (double)reflectance[i] * seen[i] * (1 + off[i]);
    exact(F, E, B);
}

static const double none[N] = {0, 0};

/* Emissions are in single precision, corrections are converged to .002 of themselves. */
static const double converged = .002, rounded = 1e-6;

/* In the open nothing bounces: B = E, and a first bounce that is 3 % too large makes an error of 3 %, of
 * light that is all direct. */
START_TEST(open_hemisphere) {
    two_elements s = {.F = {0, 0, 0}};
    const double off[N] = {.03, .03};
    figure_group figures;
    fill(off, s.first[0]);
    fill(none, s.first[1]);
    fill(none, s.first[2]);
    ck_assert_uint_eq(judge(&s, REFERENCE_TWIN, &figures, NULL), SKIES);
    ck_assert_uint_eq(figures.relative.count, SKIES);
    ck_assert_double_eq_tol(figures.relative.less.f / SKIES, .03, .03 * converged + rounded);
    ck_assert_double_eq_tol(figures.relative.less.most, .03, .03 * converged + rounded);
    ck_assert_uint_eq(figures.indirect.count, 0);
}
END_TEST

/* A wall beside: what the plate has too little bounces on to it. */
START_TEST(wall_beside) {
    two_elements s = {.F = {.4, .4, .4}};
    const double off[N] = {-.05, 0};
    double B[N], own[N], x[N], bounced[N], of_wall;
    figure_group figures;
    fill(off, s.first[0]);
    fill(none, s.first[1]);
    fill(none, s.first[2]);
    ck_assert_uint_eq(judge(&s, (reference_relation)_i, &figures, &of_wall), SKIES);
    lit(.4, none, B);
    lit(.4, off, own);
    for (size_t i = 0; i < N; i++) {
        x[i] = B[i] - own[i];
        bounced[i] = B[i] - (double)reflectance[i] * seen[i];
    }
    const double relative = ratio(x, B), indirect = ratio(x, bounced);
    ck_assert_double_eq_tol(figures.relative.less.f / SKIES, relative, relative * converged + rounded);
    ck_assert_double_eq_tol(figures.indirect.less.f / SKIES, indirect, indirect * converged + 10 * rounded);
    /* Of suns the power is that of a tile: P = sum A rho H0. */
    double power = 0;
    for (size_t i = 0; i < N; i++) power += area[i] * (double)reflectance[i] * seen[i];
    ck_assert_double_eq_tol(of_wall, fabs(x[1]) / power, fabs(x[1]) / power * .01);
}
END_TEST

/* Samples of the first bounce that are off by as much up as down, references of F that are: the figure is
 * that of their mean, and the noise is what each of them, and both, make of it. Twins are
 * off together (x_1 - x_2) / 2; of a disturbed reference the noise of F is a whole distance; of a coarser one
 * a share of it stands apart. */
START_TEST(noise_of_both_is_known) {
    two_elements s = {.F = {.4, .42, .36}};
    const double off[N] = {-.05, .02}, up[N] = {.01, -.004}, down[N] = {-.01, .004};
    double own[N], x[2][N], y[2][N], mean[N], t[N], b[N], light[N], apart[N];
    figure_group figures;
    const reference_relation relation = (reference_relation)_i;
    fill(off, s.first[0]);
    fill(up, s.first[1]);
    fill(down, s.first[2]);
    ck_assert_uint_eq(judge(&s, relation, &figures, NULL), SKIES);
    lit(.4, off, own);
    for (int k = 0; k < 2; k++) {
        lit(.42, k == 0 ? up : down, x[k]);
        lit(.36, k == 0 ? up : down, y[k]);
    }
    for (size_t i = 0; i < N; i++) {
        const double mid_x = .5 * (x[0][i] + x[1][i]), mid_y = .5 * (y[0][i] + y[1][i]);
        b[i] = relation == REFERENCE_TWIN ? .5 * (x[0][i] + y[1][i]) : mid_x;
        mean[i] = b[i] - own[i];
        t[i] = relation == REFERENCE_TWIN        ? .5 * (x[0][i] - y[1][i])
               : relation == REFERENCE_DISTURBED ? mid_y - mid_x
                                                 : 0;
        light[i] = relation == REFERENCE_TWIN ? 0 : .5 * (x[0][i] - x[1][i]);
        apart[i] = relation == REFERENCE_COARSER ? .5 * (mid_x - mid_y) : 0;
    }
    const double plain = ratio(mean, b), noise = hypot(ratio(t, b), ratio(light, b));
    const double less = sqrt(plain * plain - noise * noise);
    ck_assert_double_gt(plain - less, 5 * plain * converged);
    ck_assert_double_eq_tol(figures.relative.plain.f / SKIES, plain, plain * converged + rounded);
    ck_assert_double_eq_tol(figures.relative.less.f / SKIES, less, 3 * plain * converged + rounded);
    ck_assert_double_eq_tol(figures.relative.coarse / SKIES, ratio(apart, b),
                            ratio(apart, b) * 10 * converged + rounded);
}
END_TEST

/* Q_t = sum A rho H0_t, and means over groups. A sky that reaches nothing judges nothing. */
START_TEST(powers_of_tiles) {
    two_elements s = {.F = {.4, .4, .4}};
    static const build_problem problem = {.n = N, .n_channels = 1, .area = area, .reflectance = reflectance};
    const judged_sky sky = {.n_tiles = TILES, .own = s.first[0], .samples = {s.first[1], s.first[2]}};
    const judge_input input = {.problem = &problem, .group = group, .n_groups = N, .sky = &sky};
    group_errors made = {.n_groups = N};
    figure_group figures;
    lam_error error = {.message = ""};
    ck_assert_uint_eq(judge(&s, REFERENCE_TWIN, &figures, NULL), 0);
    fill(none, s.first[0]);
    ck_ok(judge_sky_powers(&input, &made, &error));
    for (size_t t = 0; t < TILES; t++) {
        const double weight = 1. + (double)t;
        ck_assert_double_eq_tol(made.sky_power[t], weight * (1 * .5 * 1 + 3 * (double)reflectance[1] * .25),
                                1e-12);
        for (size_t g = 0; g < N; g++)
            ck_assert_double_eq_tol(made.sky_first[g * TILES + t], weight * seen[g], 1e-12);
    }
    group_errors_free(&made);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge_sky");
    TCase *tc = tcase_create("closed forms");
    tcase_add_test(tc, open_hemisphere);
    tcase_add_loop_test(tc, wall_beside, 0, REFERENCE_COARSER + 1);
    tcase_add_loop_test(tc, noise_of_both_is_known, 0, REFERENCE_COARSER + 1);
    tcase_add_test(tc, powers_of_tiles);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
