/* Closed grey Cornell boxes of growing size: time and memory of a hierarchical operator beside one of low
 * rank. */
#include "solver/base/clock.h"
#include "solver/bench/lowrank.h"
#include "solver/bench/scenes.h"
#include "solver/formfactor/rays/ray_rows.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

enum { SIZES = 4, SOLVES = 31, SOLVES_OF_LARGE = 7, LARGE_SOLVE = 1 << 28 };

/* The recipe of large scenes at defaults serves all sizes, so that time grows at an equal number of rays. */
enum { RAYS = 512 };
static const double accuracy = 7e-5, epsilon = .05, reflectance = .6;

/* Largest number of elements at which errors are measured, and the probes of that. */
enum { JUDGED_MOST = 200000, PROBES = 16, PROBES_QUICK = 4 };

/* The rank of HF at 163,840 elements and epsilon .05, which grows like the square root of n: the thesis needs
 * 3,981 for that box (table 3.5). */
static const double rank_known = 3981, rank_known_at = 163840;

/* Largest share of the free memory for the low-rank operator. */
static const double memory_share = .5;

static const table_column columns[] = {
    {"elements", "", "n"},
    {"near_pairs_s", "s", "time of near pairs"},
    {"wavelets_s", "s", "time of 512 rays per element and of their wavelet transform"},
    {"inverse_s", "s", "time of the inverse and its checks"},
    {"build_s", "s", "sum of these times"},
    {"peak_mb", "MB", "peak of memory during the build"},
    {"exponent", "", "p of build time ~ n^p since the size before"},
    {"numbers", "", "stored coefficients of K per element"},
    {"stored_mb", "MB", "size of the operator in a store"},
    {"query_ms", "ms", "time of one radiosity, median, all threads"},
    {"rank", "",
     "rank of a low-rank operator: that of HF, 3,981 at n = 163,840, growing with the square root of n"},
    {"low_rank_ms", "ms", "time of one radiosity by that operator, median, all threads"},
    {"ratio", "", "low_rank_ms over query_ms"},
    {"single", "", "total indirect error, one bright element, mean of 16"},
    {"lights", "", "the scene's light"},
    {"random", "", "random emission of all elements"},
    {"uniform", "", "|B~ - 1| / |1| where E = 1 - rho s"},
};

/* Times a folded operator of arbitrary numbers, on which its speed does not depend; NaN where memory is too
 * small. */
static lam_status time_low_rank(const bench_run *run, const mesh *m, size_t k, double *median,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const double numbers = (double)m->n * (double)k;
    float *factors[2] = {NULL, NULL};
    lam_operator *op = NULL;
    *median = NAN;
    if (run->memory > 0 && 2 * sizeof(float) * numbers > memory_share / 2 * (double)run->memory) goto done;
    for (int f = 0; f < 2; f++) {
        factors[f] = memory_allocate(m->n, k * sizeof(float), "a low-rank operator", error);
        if (factors[f] == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for
        for (size_t i = 0; i < m->n; i++)
            for (size_t p = 0; p < k; p++)
                factors[f][i * k + p] = (float)((i * 31 + p * 17) % 64) / (float)m->n;
    }
    float *const Y = factors[0], *const V = factors[1];
    factors[0] = factors[1] = NULL;
    TRY(operator_low_rank_create_folded(m->n, k, m->reflectance, Y, V, &op, error));
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    TRY(lowrank_time_answer(op, numbers > LARGE_SOLVE ? SOLVES_OF_LARGE : SOLVES, median, error));
done:
    lam_operator_close(op);
    free(factors[0]);
    free(factors[1]);
    return status;
}

/* Errors of the operator against form factors of another seed; its own form factors are computed once more.
 */
static lam_status judge(const bench_run *run, lowrank_scene *s, const recipe *own, lam_operator *op,
                        error_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors independent = {.row_sums = NULL};
    first_light *first = NULL;
    const form_factor_options how = {.recipe = {.method = RECIPE_NEAR_PAIRS,
                                                .rays = 4 * RAYS,
                                                .accuracy = accuracy,
                                                .seed = run->seed + 1000},
                                     .progress = run->progress,
                                     .stage = "independent form factors"};
    TRY(lowrank_trace(run, s, own, error));
    const build_problem problem = lowrank_problem(s);
    TRY(form_factors_make(&s->m, s->z_order, &how, &independent, error));
    TRY(form_factors_expand(&independent, s->m.area, error));
    TRY(first_light_create(&s->m, run->seed, &first, error));
    const judge_input input = {.problem = &problem,
                               .row_sums = s->f.row_sums,
                               .emission = s->m.emission,
                               .own = factor_product_of_rows(problem.F),
                               .independent = factor_product_of_rows(&independent.F),
                               .first_light = first_light_for_judge,
                               .first_light_context = first,
                               .probes = run->scale == BENCH_QUICK ? PROBES_QUICK : PROBES,
                               .seed = run->seed,
                               .progress = run->progress};
    TRY(judge_operator(op, &input, out, error));
done:
    first_light_destroy(first);
    form_factors_free(&independent);
    return status;
}

typedef struct grown {
    double n, build_s;
} grown;

static lam_status add_size(const bench_run *run, size_t elements, grown *before, table *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const generate_options box = {
        .kind = "cornell", .closed = true, .elements = elements, .reflectance = reflectance, .seed = 1};
    const recipe how = {.method = RECIPE_NEAR_PAIRS, .rays = RAYS, .accuracy = accuracy, .seed = run->seed};
    build_options options = build_presets("hierarchical");
    mesh m = {0};
    lowrank_scene s = {.name = NULL};
    lam_operator *op = NULL;
    build_report built;
    error_report judgement = {.has_total = false}, *const e = &judgement;
    double query, low_rank, stored;
    operator_description about = {.density = -1};
    ray_rows *rays = NULL;
    row_stream stream;
    TRY(bench_check(run, error));
    TRY(scene_generated(&box, &m, error));
    TRY(lowrank_open(run, "closed cornell", &m, NULL, &s, error));
    const form_factor_options rays_only = {.recipe = how, .progress = run->progress, .stage = "near pairs"};
    const double before_it = lowrank_begin_peak(), started = clock_seconds();
    TRY(ray_rows_create(&s.m, &rays_only, &rays, error));
    const double near = clock_seconds() - started;
    ray_rows_stream(rays, run->seed + 2000, &stream);
    build_problem problem = lowrank_problem(&s);
    problem.F = NULL;
    problem.stream = &stream;
    problem.noise = recipe_noise(&how);
    const double n = (double)s.m.n;
    options.seed = run->seed;
    options.progress = run->progress;
    TRY(build_set_number(&options, "epsilon", epsilon, error));
    TRY(build_operator(&problem, &options, &op, &built, error));
    const double peak = lowrank_peak(before_it);
    ray_rows_destroy(rays);
    rays = NULL;
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    TRY(lowrank_time_answer(op, SOLVES, &query, error));
    TRY(lowrank_stored_bytes(op, &stored, error));
    operator_describe(op, &about);
    const size_t rank = (size_t)(rank_known * sqrt(n / rank_known_at));
    const bool judged = s.m.n <= JUDGED_MOST;
    if (judged) TRY(judge(run, &s, &how, op, &judgement, error));
    lam_operator_close(op);
    op = NULL;
    form_factors_free(&s.f);
    s.f = (form_factors){.row_sums = NULL};
    TRY(time_low_rank(run, &s.m, rank, &low_rank, error));
    const double build = near + report_seconds(&built);
    table_number(out, n);
    table_number(out, near);
    table_number(out, built.steps[0].seconds);
    table_number(out, built.steps[1].seconds);
    table_number(out, build);
    table_number(out, 1e-6 * peak);
    table_number(out, before->n > 0 ? log(build / before->build_s) / log(n / before->n) : NAN);
    table_number(out, .5 * about.density * n);
    table_number(out, 1e-6 * stored);
    table_number(out, 1e3 * query);
    table_number(out, (double)rank);
    table_number(out, 1e3 * low_rank);
    table_number(out, low_rank / query);
    table_number(out, judged ? e->single.total_indirect.mean : NAN);
    table_number(out, judged ? e->lights.total_indirect.mean : NAN);
    table_number(out, judged ? e->random.total_indirect.mean : NAN);
    table_number(out, report_get(&built, "uniform_error", NAN));
    *before = (grown){.n = n, .build_s = build};
done:
    lam_operator_close(op);
    ray_rows_destroy(rays);
    lowrank_scene_free(&s);
    mesh_free(&m);
    return status;
}

lam_status hierarchical_growth(const bench_run *run, lam_error *error) {
    static const size_t sizes[3][SIZES] = {
        {320, 640, 0, 0}, {10240, 40960, 163840, 0}, {10240, 40960, 163840, 655360}};
    lam_status status = LAM_OK;
    grown before = {.n = 0};
    table out = {.name = "growth",
                 .title = "Growth: closed grey Cornell boxes at epsilon .05",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < SIZES && sizes[run->scale][k] > 0; k++)
        TRY(add_size(run, sizes[run->scale][k], &before, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
