/* Skies by which a first bounce is judged, against closed forms of two elements: plates under the open sky,
 * a plate with a wall beside it, references with noise of the first bounce, of F, and of both. */
#include "solver/method/judge/judge_sky.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { N = 2, TILES = 6, SKIES = JUDGE_EVEN_SKIES + JUDGE_SUNS };
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

/* The figures of skies, and the law of each group; law is freed with group_errors_free. */
static size_t judge(const two_elements *s, reference_relation relation, figure_group *figures,
                    group_errors *law) {
    static const build_problem problem = {.n = N, .n_channels = 1, .area = area, .reflectance = reflectance};
    const judged_sky sky = {
        .n_tiles = TILES, .own = s->first[0], .samples = {s->first[1], s->first[2]}, .own_share = .25};
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
    by_group_sums bins = {.n = 0};
    sky_law_sums sums = {.n_bins = 0};
    group_errors made = {.n_groups = N};
    lam_error error = {.message = ""};
    size_t done = 0;
    lam_operator *op = make_operator(s->F[0]);
    *figures = (figure_group){.relative = {.tried = 0}};
    ck_ok(by_group_begin(&input, 0, &bins, &error));
    ck_ok(judge_sky_powers(&input, &made, &error));
    ck_ok(sky_law_begin(&input, &made, &sums, &error));
    ck_ok(judge_sky_add(op, &input, figures, &bins, &sums, &done, &error));
    if (done > 0) ck_ok(sky_law_finish(&sums, &made, &error));
    sky_law_free(&sums);
    by_group_free(&bins);
    lam_operator_close(op);
    if (law != NULL)
        *law = made;
    else
        group_errors_free(&made);
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
    double B[N], own[N], x[N], bounced[N];
    figure_group figures;
    group_errors law;
    fill(off, s.first[0]);
    fill(none, s.first[1]);
    fill(none, s.first[2]);
    ck_assert_uint_eq(judge(&s, (reference_relation)_i, &figures, &law), SKIES);
    lit(.4, none, B);
    lit(.4, off, own);
    for (size_t i = 0; i < N; i++) {
        x[i] = B[i] - own[i];
        bounced[i] = B[i] - (double)reflectance[i] * seen[i];
    }
    const double relative = ratio(x, B), indirect = ratio(x, bounced);
    ck_assert_double_eq_tol(figures.relative.less.f / SKIES, relative, relative * converged + rounded);
    ck_assert_double_eq_tol(figures.indirect.less.f / SKIES, indirect, indirect * converged + 10 * rounded);
    /* All skies are off alike, by their power P = sum A rho H0 as the operator has it: nothing is left for
     * single tiles. */
    double power = 0;
    for (size_t i = 0; i < N; i++) power += area[i] * (double)reflectance[i] * seen[i] * (1 + off[i]);
    for (size_t g = 0; g < N; g++) {
        ck_assert_double_eq_tol(law.sky[SKY_RMS_EVEN][g], fabs(x[g]) / power, fabs(x[g]) / power * .01);
        ck_assert_double_eq_tol(law.sky[SKY_MEAN_EVEN][g], law.sky[SKY_RMS_EVEN][g], 1e-9);
        ck_assert_double_le(law.sky[SKY_RMS_TILES][g], .1 * fabs(x[g]) / power);
    }
    group_errors_free(&law);
}
END_TEST

/* Tiles w = 1 ... 6 that have too much and too little of the same light delta in turn, so that an even sky is
 * exact. All six are drawn. Nothing bounces: with q = sum A rho seen a tile k has M = w_k / 21,
 * sum_t w_t (L_t - M)^2 = w_k - w_k^2 / 21, together 21 - 91 / 21. */
START_TEST(single_tiles_have_errors_of_their_own) {
    two_elements s = {.F = {0, 0, 0}};
    const double delta = .05, spread = 21 - 91. / 21;
    double off = 0, off2 = 0, D = 0, q = 0;
    figure_group figures;
    group_errors law;
    fill(none, s.first[1]);
    fill(none, s.first[2]);
    for (size_t t = 0; t < TILES; t++)
        for (size_t i = 0; i < N; i++)
            s.first[0][t * N + i] = (float)(seen[i] * (1. + (double)t + (t % 2 == 0 ? delta : -delta)));
    ck_assert_uint_eq(judge(&s, REFERENCE_TWIN, &figures, &law), SKIES);
    for (size_t i = 0; i < N; i++) {
        const double rho = (double)reflectance[i], one = area[i] * pow(rho * seen[i] * delta, 2);
        off += one;
        off2 += one * one;
        D += area[i] * rho * rho * seen[i];
        q += area[i] * rho * seen[i];
    }
    double roots = 0, less = 0, less2 = 0;
    for (size_t t = 0; t < TILES; t++) {
        const double w = 1. + (double)t, of_tile = D * (w - w * w / 21);
        roots += sqrt(of_tile);
        less += off / sqrt(of_tile);
        less2 += off2 / of_tile;
    }
    /* Sizes are by the operator's own bounce, which is off by delta in w. */
    const double direct2 = (less + sqrt(less2)) / roots;
    ck_assert_double_eq_tol(law.sky_direct, sqrt(direct2), .02 * sqrt(direct2));
    for (size_t g = 0; g < N; g++) {
        const double rho2 = pow((double)reflectance[g], 2);
        const double left = TILES * rho2 * pow(seen[g] * delta, 2) - direct2 * rho2 * seen[g] * spread;
        const double tiles = sqrt(fmax(0, left) / (q * spread));
        ck_assert_double_le(law.sky[SKY_RMS_EVEN][g], 1e-5);
        ck_assert_double_eq_tol(law.sky[SKY_RMS_TILES][g], tiles, .02 * sqrt(direct2));
        ck_assert_double_eq_tol(law.sky[SKY_MEAN_TILES][g], law.sky[SKY_RMS_TILES][g], 1e-6);
    }
    group_errors_free(&law);
}
END_TEST

/* Of an error that is all noise the law has the part that the operator's own first bounce may have. */
START_TEST(noise_counts_by_the_own_share) {
    two_elements s = {.F = {0, 0, 0}};
    const double up[N] = {.02, .02}, down[N] = {-.02, -.02};
    figure_group figures;
    group_errors law;
    fill(none, s.first[0]);
    fill(up, s.first[1]);
    fill(down, s.first[2]);
    ck_assert_uint_eq(judge(&s, REFERENCE_TWIN, &figures, &law), SKIES);
    double power = 0;
    for (size_t i = 0; i < N; i++) power += area[i] * (double)reflectance[i] * seen[i];
    for (size_t g = 0; g < N; g++) {
        const double noise = .02 * (double)reflectance[g] * seen[g] / power, own = sqrt(.25) * noise;
        ck_assert_double_eq_tol(law.sky[SKY_RMS_EVEN][g], own, .01 * own);
        ck_assert_double_eq_tol(law.sky[SKY_MEAN_EVEN][g], own, .01 * own);
    }
    group_errors_free(&law);
}
END_TEST

/* Where closer rows of single tiles are known, suns are judged by these, and other skies by the samples. */
static lam_status half_of_tiles(void *context, int sample, size_t count, const size_t *tiles, float *first,
                                lam_error *error) {
    size_t *asked = context;
    (void)error;
    (void)sample;
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < N; i++) first[k * N + i] = (float)(.5 * (1. + (double)tiles[k]) * seen[i]);
    *asked += count;
    return LAM_OK;
}

START_TEST(tiles_are_judged_by_their_own_rows) {
    two_elements s = {.F = {0, 0, 0}};
    static const build_problem problem = {.n = N, .n_channels = 1, .area = area, .reflectance = reflectance};
    size_t asked = 0, done = 0;
    const judged_sky sky = {.n_tiles = TILES,
                            .own = s.first[0],
                            .samples = {s.first[1], s.first[2]},
                            .tiles = half_of_tiles,
                            .tiles_context = &asked};
    const judge_input input = {.problem = &problem,
                               .sky = &sky,
                               .own = {.n = N, .multiply = multiply, .context = &s.F[0]},
                               .independent = {.n = N, .multiply = multiply, .context = &s.F[1]},
                               .seed = 9};
    by_group_sums bins = {.n = 0};
    sky_law_sums law = {.n_bins = 0};
    figure_group figures = {.relative = {.tried = 0}};
    lam_error error = {.message = ""};
    lam_operator *op = make_operator(0);
    for (int k = 0; k < 3; k++) fill(none, s.first[k]);
    ck_ok(judge_sky_add(op, &input, &figures, &bins, &law, &done, &error));
    ck_assert_uint_eq(done, SKIES);
    ck_assert_uint_eq(asked, 2 * JUDGE_SUNS);
    /* Twice as bright as they should be: an error of 1 of all suns, none of the two others. */
    ck_assert_double_eq_tol(figures.relative.less.f, JUDGE_SUNS, JUDGE_SUNS * converged);
    lam_operator_close(op);
}
END_TEST

/* Element 1 is the larger one, and none of its own rays met tile 2, or none but those of the ground, or five
 * more than these. Rays that are aimed there find .02 and .04 sr: the distance from .03 sr is the error of
 * its group, and that of the power A rho times as much. The other tiles count by direct^2 times what is
 * seen. */
static lam_status missed_light(void *context, int sample, size_t count, const size_t *elements,
                               const size_t *tiles, float *first, lam_error *error) {
    size_t *asked = context;
    (void)error;
    for (size_t k = 0; k < count; k++) {
        ck_assert(elements[k] == 1 && tiles[k] == 2);
        first[k] = sample == 0 ? .02f : .04f;
    }
    *asked += count;
    return LAM_OK;
}

START_TEST(tiles_that_few_rays_met_are_looked_at) {
    two_elements s = {.F = {0, 0, 0}};
    static const build_problem problem = {.n = N, .n_channels = 1, .area = area, .reflectance = reflectance};
    static const double ground[N] = {.5, .25}, reflects[TILES] = {.1, .1, .1, .1, .1, .1};
    size_t asked = 0;
    const judged_sky sky = {.n_tiles = TILES,
                            .own = s.first[0],
                            .samples = {s.first[1], s.first[2]},
                            .pairs = missed_light,
                            .tiles_context = &asked,
                            .own_ray = .01,
                            .ground = ground,
                            .reflects = reflects};
    const judge_input input = {.problem = &problem, .group = group, .n_groups = N, .sky = &sky};
    static const float own[] = {0, .025f, .075f};
    const double off2 = pow(.03 - (double)own[_i], 2), direct2 = .01;
    tile_errors t;
    group_errors made = {.n_groups = N};
    lam_error error = {.message = ""};
    fill(none, s.first[0]);
    s.first[0][2 * N + 1] = own[_i];
    ck_ok(tile_errors_begin(&input, &t, &error));
    ck_ok(tile_errors_aim(&t, &error));
    ck_assert_uint_eq(asked, 2);
    ck_ok(tile_errors_finish(&t, direct2, &made, &error));
    for (size_t tile = 0; tile < TILES; tile++) {
        double power = 0;
        for (size_t i = 0; i < N; i++) {
            const double missed = tile == 2 && i == 1 ? off2 : 0;
            const double e = direct2 * (double)s.first[0][tile * N + i] + missed;
            ck_assert_double_eq_tol(made.sky_elements_off[i * TILES + tile], e, 1e-8);
            ck_assert_double_eq_tol(made.sky_means_off[i * TILES + tile], e, 1e-8);
            power += pow(area[i] * (double)reflectance[i], 2) * e;
        }
        ck_assert_double_eq_tol(made.sky_power_off[tile], power, 1e-8);
    }
    tile_errors_free(&t);
    group_errors_free(&made);
}
END_TEST

/* Both elements in one group of area 4: its mean has sum A^2 e / 16, and element 0 a sixteenth of e alone. */
START_TEST(means_of_tiles_add_up_by_area) {
    two_elements s = {.F = {0, 0, 0}};
    static const build_problem problem = {.n = N, .n_channels = 1, .area = area, .reflectance = reflectance};
    static const uint32_t together[N] = {0, 0};
    const judged_sky sky = {.n_tiles = TILES, .own = s.first[0], .samples = {s.first[1], s.first[2]}};
    const judge_input input = {.problem = &problem, .group = together, .n_groups = 1, .sky = &sky};
    tile_errors t;
    group_errors made = {.n_groups = 1};
    lam_error error = {.message = ""};
    fill(none, s.first[0]);
    s.first[0][2 * N + 1] = 0;
    ck_ok(tile_errors_begin(&input, &t, &error));
    ck_ok(tile_errors_finish(&t, 1, &made, &error));
    ck_assert_double_eq_tol(made.sky_elements_off[0], (1 + 3 * .25) / 4, 1e-6);
    ck_assert_double_eq_tol(made.sky_means_off[0], (1 + 9 * .25) / 16, 1e-6);
    ck_assert_double_eq_tol(made.sky_elements_off[2], 3. / 4, 1e-6);
    ck_assert_double_eq_tol(made.sky_means_off[2], 3. / 16, 1e-6);
    tile_errors_free(&t);
    group_errors_free(&made);
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

/* Of five groups one was right by chance, and one is off by more; what is all but dark weighs nothing, nor
 * does a group without light. */
START_TEST(even_errors_are_shared) {
    enum { GROUPS = 7 };
    static const double light[GROUPS] = {4, 1, 1, 9, 1, 1e-9, 0}, weight[GROUPS] = {2, 1, 1, 3, 1, 1e-4, 5};
    static const double before[GROUPS] = {4e-4, 1e-4, 1e-8, 9e-4, 25e-4, 1e-6, 1e-5};
    double even[GROUPS];
    lam_error error = {.message = ""};
    memcpy(even, before, sizeof even);
    ck_ok(sky_law_share_even(GROUPS, light, weight, even, &error));
    for (size_t k = 0; k < GROUPS; k++)
        ck_assert_double_eq_tol(even[k], k == 2 ? .5 * (1e-8 + 1e-4) : before[k], 1e-15);
    even[0] = before[0];
    ck_ok(sky_law_share_even(1, light + 6, weight, even, &error)); /* no light at all */
    ck_assert_double_eq(even[0], before[0]);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge_sky");
    TCase *tc = tcase_create("closed forms");
    tcase_add_test(tc, open_hemisphere);
    tcase_add_loop_test(tc, wall_beside, 0, REFERENCE_COARSER + 1);
    tcase_add_loop_test(tc, noise_of_both_is_known, 0, REFERENCE_COARSER + 1);
    tcase_add_test(tc, single_tiles_have_errors_of_their_own);
    tcase_add_test(tc, noise_counts_by_the_own_share);
    tcase_add_test(tc, tiles_are_judged_by_their_own_rows);
    tcase_add_test(tc, powers_of_tiles);
    tcase_add_loop_test(tc, tiles_that_few_rays_met_are_looked_at, 0, 3);
    tcase_add_test(tc, means_of_tiles_add_up_by_area);
    tcase_add_test(tc, even_errors_are_shared);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
