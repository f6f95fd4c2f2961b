/* Closed grey Cornell boxes of growing size: what a hierarchical operator takes, beside one of low rank. */
#include "solver/bench/hierarchical.h"
#include "solver/bench/scenes.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

enum { SIZES = 4, SOLVES = 31, SOLVES_OF_LARGE = 7, LARGE_SOLVE = 1 << 28 };

/* The recipe of large scenes at defaults, for all of them: how time grows is seen at equal rays. */
enum { RAYS = 512 };
static const double accuracy = 7e-5, epsilon = .05, reflectance = .6;

/* Elements up to which the reference is waited for, and its probes. */
enum { JUDGED_MOST = 200000, PROBES = 16, PROBES_QUICK = 4 };

/* The rank of HF at 163,840 elements and epsilon .05, which grows like the square root of n: the thesis needs
 * 3,981 for that box (table 3.5). */
static const double rank_known = 3981, rank_known_at = 163840;

/* Of an operator kept in memory beside the form factors, at most. */
static const double memory_share = .5;

static const table_column columns[] = {
    {"elements", "", "n"},
    {"form_factors_s", "s", "near pairs, 512 rays an element"},
    {"wavelets_s", "s", "pass over F"},
    {"inverse_s", "s", "inverse and self-checks"},
    {"build_s", "s", "all of these"},
    {"exponent", "", "p of build time ~ n^p since the size before"},
    {"numbers", "", "of K, upper triangle, an element"},
    {"stored_mb", "MB", "of the operator in a store"},
    {"query_ms", "ms", "of one radiosity, median, all threads"},
    {"rank", "", "of an operator of random numbers: as HF needs, 3,981 at 163,840, with the root of n"},
    {"low_rank_ms", "ms", "that one's radiosity, median, all threads"},
    {"ratio", "", "of the two"},
    {"single", "", "total indirect error, one bright element, mean of 16"},
    {"lights", "", "the scene's light"},
    {"all_over", "", "light all over"},
    {"uniform", "", "|B~ - 1| / |1| where E = 1 - rho s"},
};

/* A folded operator of random numbers, whose speed does not depend on them; NaN where memory is too small. */
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

/* The same box by form factors of another seed. */
static lam_status judge(const bench_run *run, const lowrank_scene *s, lowrank_verdict *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    form_factors independent = {.row_sums = NULL};
    first_light *first = NULL;
    const form_factor_options how = {.recipe = {.method = RECIPE_NEAR_PAIRS,
                                                .rays = 4 * RAYS,
                                                .accuracy = accuracy,
                                                .seed = run->seed + 1000},
                                     .progress = run->progress,
                                     .stage = "independent form factors"};
    TRY(form_factors_make(&s->m, s->z_order, &how, &independent, error));
    TRY(form_factors_expand(&independent, s->m.area, error));
    TRY(first_light_create(&s->m, run->seed, &first, error));
    const lowrank_case of = {.method = "hierarchical",
                             .factorizer = "auto",
                             .epsilon = epsilon,
                             .probes = run->scale == BENCH_QUICK ? PROBES_QUICK : PROBES,
                             .independent = &independent.F,
                             .first = first};
    TRY(lowrank_judge(run, s, &of, out, error));
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
    const build_options options = {.method = "hierarchical",
                                   .factorizer = "auto",
                                   .epsilon = epsilon,
                                   .budget = {.rule = BUDGET_SQUARES, .alpha = .5},
                                   .seed = run->seed,
                                   .progress = run->progress};
    mesh m = {0};
    lowrank_scene s = {.name = NULL};
    lam_operator *op = NULL;
    build_report built;
    lowrank_verdict verdict = {.bytes = 0};
    double query, low_rank, stored;
    operator_description about = {.density = -1};
    TRY(bench_check(run, error));
    TRY(scene_generated(&box, &m, error));
    TRY(lowrank_open(run, "closed cornell", &m, &how, &s, error));
    const build_problem problem = lowrank_problem(&s);
    const double n = (double)s.m.n;
    TRY(build_operator(&problem, &options, &op, &built, error));
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    TRY(lowrank_time_answer(op, SOLVES, &query, error));
    TRY(lowrank_stored_bytes(op, &stored, error));
    operator_describe(op, &about);
    lam_operator_close(op);
    op = NULL;
    const size_t rank = (size_t)(rank_known * sqrt(n / rank_known_at));
    const bool judged = s.m.n <= JUDGED_MOST;
    if (judged) TRY(judge(run, &s, &verdict, error));
    form_factors_free(&s.f);
    s.f = (form_factors){.row_sums = NULL};
    TRY(time_low_rank(run, &s.m, rank, &low_rank, error));
    const double build = s.seconds + built.factorize_seconds + built.invert_seconds;
    const error_report *e = &verdict.judged;
    table_number(out, n);
    table_number(out, s.seconds);
    table_number(out, built.factorize_seconds);
    table_number(out, built.invert_seconds);
    table_number(out, build);
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
    table_number(out, built.uniform_error);
    *before = (grown){.n = n, .build_s = build};
done:
    lam_operator_close(op);
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
