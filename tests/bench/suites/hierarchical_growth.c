/* Closed grey Cornell boxes of growing size: time, memory and errors of a hierarchical operator, of blocks
 * and of rays, beside one of low rank. */
#include "solver/base/clock.h"
#include "solver/formfactor/pairs/ray_rows.h"
#include "solver/formfactor/source.h"
#include "solver/precompute/judging.h"
#include "tests/bench/suites/hierarchical.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

enum { SIZES = 5, SOLVES = 31, SOLVES_OF_LARGE = 7, LARGE_SOLVE = 1 << 28 };

/* Rays of near pairs at all sizes, so that time grows at an equal number of them; beyond NEAR_MOST elements
 * their rows take more memory than they are worth. The bound of blocks is the one at defaults. */
enum { RAYS = 512, NEAR_MOST = 200000 };
static const double accuracy = 7e-5, block_accuracy = 2.4e-4, epsilon = .05, reflectance = .6;

enum { PROBES = 16, PROBES_QUICK = 4 };

/* The rank of HF at 163,840 elements and epsilon .05, which grows like the square root of n: the thesis needs
 * 3,981 for that box (table 3.5). */
static const double rank_known = 3981, rank_known_at = 163840;

/* Largest share of the free memory for the low-rank operator. */
static const double memory_share = .5;

static const table_column columns[] = {
    {"elements", "", "n"},
    {"form_factors", NULL, "blocks: of clusters; near-pairs: beside 512 rays per element"},
    {"form_factors_s", "s", "time of blocks with their tree, or of near pairs"},
    {"wavelets_s", "s", "time of their wavelet transform, with the rays beside near pairs"},
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
    {"noise", "", "noise of the reference for one bright element"},
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

/* A box, and its blocks, which one operator is built from and both are judged beside. */
typedef struct box {
    lowrank_scene s;
    plane_tree tree;
    block_factors blocks;
    form_factors about; /* the blocks; no rows */
    double low_rank_ms;
    size_t rank;
} box;

static void box_free(box *b) {
    block_factors_free(&b->blocks);
    form_factors_free(&b->about);
    plane_tree_free(&b->tree);
    lowrank_scene_free(&b->s);
}

static build_problem problem_of_blocks(const box *b) {
    build_problem problem = lowrank_problem(&b->s);
    problem.F = NULL;
    problem.blocks = &b->blocks;
    problem.noise = recipe_noise(&b->about.recipe);
    return problem;
}

/* Errors against blocks of half the bound, for either operator. */
static lam_status judge(const bench_run *run, const box *b, const lam_operator *op, error_report *out,
                        lam_error *error) {
    const build_problem problem = problem_of_blocks(b);
    judging j = {.m = &b->s.m,
                 .order = b->s.z_order,
                 .problem = &problem,
                 .f = &b->about,
                 .stages = {"blocks for the judge", ""},
                 .probes_seed = run->seed,
                 .probes = run->scale == BENCH_QUICK ? PROBES_QUICK : PROBES,
                 .progress = run->progress};
    for (uint64_t h = 0; h < 2; h++) j.halves[h] = recipe_of_judge(&b->about.recipe, 0, run->seed + 1000 + h);
    return judging_run(&j, op, out, error);
}

typedef struct grown {
    double n, build_s;
} grown;

/* Time and memory of a build. */
typedef struct cost {
    double form_factors_s, peak;
    build_report built;
} cost;

static lam_status add_row(const bench_run *run, const box *b, const char *name, lam_operator *op,
                          const cost *c, grown *before, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)b->s.m.n, build = c->form_factors_s + report_seconds(&c->built);
    operator_description about = {.density = -1};
    error_report e = {.has_total = false};
    double query, stored;
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    TRY(lowrank_time_answer(op, SOLVES, &query, error));
    TRY(lowrank_stored_bytes(op, &stored, error));
    operator_describe(op, &about);
    TRY(judge(run, b, op, &e, error));
    table_number(out, n);
    table_text(out, name);
    table_number(out, c->form_factors_s);
    table_number(out, c->built.steps[0].seconds);
    table_number(out, c->built.steps[1].seconds);
    table_number(out, build);
    table_number(out, 1e-6 * c->peak);
    table_number(out, before->n > 0 ? log(build / before->build_s) / log(n / before->n) : NAN);
    table_number(out, .5 * about.density * n);
    table_number(out, 1e-6 * stored);
    table_number(out, 1e3 * query);
    table_number(out, (double)b->rank);
    table_number(out, b->low_rank_ms);
    table_number(out, b->low_rank_ms / (1e3 * query));
    table_number(out, e.single.total_indirect.mean);
    table_number(out, e.lights.total_indirect.mean);
    table_number(out, e.random.total_indirect.mean);
    table_number(out, e.single.reference_noise);
    table_number(out, report_get(&c->built, "uniform_error", NAN));
    *before = (grown){.n = n, .build_s = build};
done:
    return status;
}

static lam_status build(const bench_run *run, const build_problem *problem, lam_operator **op,
                        build_report *built, lam_error *error) {
    lam_status status = LAM_OK;
    build_options options = build_presets("hierarchical");
    options.seed = run->seed;
    options.progress = run->progress;
    TRY(build_set_number(&options, "epsilon", epsilon, error));
    TRY(build_operator(problem, &options, op, built, error));
done:
    return status;
}

static lam_status add_blocks(const bench_run *run, box *b, grown *before, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    cost c = {.peak = 0};
    const form_factor_options how = {.recipe = {.source = &source_blocks,
                                                .rays = recipe_rays_beside_blocks(b->s.m.n),
                                                .accuracy = block_accuracy,
                                                .seed = run->seed},
                                     .progress = run->progress,
                                     .stage = "blocks"};
    const double before_it = lowrank_begin_peak(), started = clock_seconds();
    TRY(form_factors_tree(&b->s.m, &b->tree, error));
    TRY(form_factors_make_blocks(&b->s.m, b->s.z_order, &b->tree, NULL, &how, &b->about, &b->blocks, error));
    c.form_factors_s = clock_seconds() - started;
    const build_problem problem = problem_of_blocks(b);
    TRY(build(run, &problem, &op, &c.built, error));
    c.peak = lowrank_peak(before_it);
    TRY(add_row(run, b, "blocks", op, &c, before, out, error));
done:
    lam_operator_close(op);
    return status;
}

static lam_status add_near_pairs(const bench_run *run, const box *b, grown *before, table *out,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    cost c = {.peak = 0};
    ray_rows *rays = NULL;
    row_stream stream;
    const form_factor_options how = {
        .recipe = {.source = &source_near_pairs, .rays = RAYS, .accuracy = accuracy, .seed = run->seed},
        .progress = run->progress,
        .stage = "near pairs"};
    const double before_it = lowrank_begin_peak(), started = clock_seconds();
    TRY(ray_rows_create(&b->s.m, &how, &rays, error));
    c.form_factors_s = clock_seconds() - started;
    ray_rows_stream(rays, run->seed + 2000, &stream);
    build_problem problem = lowrank_problem(&b->s);
    problem.F = NULL;
    problem.stream = &stream;
    problem.noise = recipe_noise(&how.recipe);
    TRY(build(run, &problem, &op, &c.built, error));
    c.peak = lowrank_peak(before_it);
    TRY(add_row(run, b, "near-pairs", op, &c, before, out, error));
done:
    lam_operator_close(op);
    ray_rows_destroy(rays);
    return status;
}

/* before: of either recipe */
static lam_status add_size(const bench_run *run, size_t elements, grown before[2], table *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const generate_options walls = {
        .kind = "cornell", .closed = true, .elements = elements, .reflectance = reflectance, .seed = 1};
    mesh m = {0};
    box b = {.s = {.name = NULL}};
    TRY(bench_check(run, error));
    TRY(scene_generated(&walls, &m, error));
    TRY(lowrank_open(run, "closed cornell", &m, NULL, &b.s, error));
    b.rank = (size_t)(rank_known * sqrt((double)b.s.m.n / rank_known_at));
    TRY(time_low_rank(run, &b.s.m, b.rank, &b.low_rank_ms, error));
    b.low_rank_ms *= 1e3;
    TRY(add_blocks(run, &b, &before[0], out, error));
    if (b.s.m.n <= NEAR_MOST) TRY(add_near_pairs(run, &b, &before[1], out, error));
done:
    box_free(&b);
    mesh_free(&m);
    return status;
}

lam_status hierarchical_growth(const bench_run *run, lam_error *error) {
    static const size_t sizes[3][SIZES] = {
        {320, 640}, {10240, 40960, 163840, 655360}, {10240, 40960, 163840, 655360, 2621440}};
    lam_status status = LAM_OK;
    grown before[2] = {{.n = 0}, {.n = 0}};
    table out = {.name = "growth",
                 .title = "Growth: closed grey Cornell boxes at epsilon .05",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < SIZES && sizes[run->scale][k] > 0; k++)
        TRY(add_size(run, sizes[run->scale][k], before, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
