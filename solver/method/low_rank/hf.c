/* The hierarchical factorization (Aguerre 2016, algorithm 4; Aguerre and Fernández 2016): columns are split
 * in a binary tree, leaves are truncated SVDs, and a node truncates (Q1 | Q2) of its children. */
#include "solver/method/low_rank/hf.h"

#include "solver/linalg/dense.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* The rank at the root is rounded up to a multiple of ROOT_ROUND, as far as singular values are at least
 * epsilon / 2: the kernels of the online phase work in panels of that width, and the tail of the spectrum is
 * steep (on the Cornell box 6 % more columns reduce the error by 20 %). */
enum { ROOT_ROUND = 64 };

typedef struct hf_run {
    const scaled_matrix *S;
    const factorizer_options *options;
    hf_plan plan;
    const hf_forecast *forecast; /* or NULL */
    int alone;                   /* levels whose nodes are computed one after the other */
    size_t columns_done;
    size_t given[BUDGET_LEVELS_MOST + 1], kept[BUDGET_LEVELS_MOST + 1]; /* columns, by level */
    lam_status status;                                                  /* the first failure of a task */
    lam_error error;
} hf_run;

static truncation truncation_of(const hf_run *run, int level) {
    return (truncation){
        .epsilon = run->plan.left[level], .rank = run->options->rank, .round = level == 0 ? ROOT_ROUND : 1};
}

static void count_columns(hf_run *run, int level, size_t given, size_t kept) {
    __atomic_fetch_add(&run->given[level], given, __ATOMIC_RELAXED);
    __atomic_fetch_add(&run->kept[level], kept, __ATOMIC_RELAXED);
}

/* (Q1 | Q2 | ...) ~ Q_r V_r^T and V = (V1 V_r1 ; V2 V_r2 ; ...), Aguerre 2016, eqs. 3.3, 3.5, 3.6, for two or
 * more parts, whose arrays are freed as they are used. */
static lam_status combine(size_t count, tall_factors *parts, const truncation *keep, tall_factors *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    size_t m = 0, row = 0, column = 0;
    tall_factors joint = {0};
    float *V = NULL;
    TRY(tsvd_joined(count, parts, keep, &joint, error));
    const size_t r = joint.rank;
    for (size_t k = 0; k < count; k++) m += parts[k].m;
    V = memory_allocate(m, r * sizeof *V, "factorization", error);
    if (V == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) {
        dense_multiply(parts[k].m, parts[k].rank, r, parts[k].V, joint.V + column * r, false, V + row * r);
        row += parts[k].m;
        column += parts[k].rank;
        tall_factors_free(&parts[k]);
    }
    free(joint.V);
    joint.V = V;
    joint.m = m;
    V = NULL;
    *out = joint;
    joint = (tall_factors){0};
done:
    free(V);
    tall_factors_free(&joint);
    return status;
}

/* The same inside a parallel region, where BLAS and LAPACK use one thread each, so that the bits do not
 * depend on the number of threads. */
static lam_status combine_in_team(size_t count, tall_factors *parts, const truncation *keep,
                                  tall_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    if (omp_get_level() > 0) return combine(count, parts, keep, out, error);
#pragma omp parallel
#pragma omp single
    status = combine(count, parts, keep, out, error);
    return status;
}

static lam_status leaf(hf_run *run, int level, size_t first, size_t last, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    sparse_block block = {0};
    truncation keep = truncation_of(run, level);
    if (run->forecast != NULL)
        keep.guess = (size_t)hf_forecast_rank(run->forecast, (double)(last - first), keep.epsilon);
    TRY(scaled_block(run->S, first, last, &block, error));
    TRY(tsvd_sparse(&block, &keep, out, error));
    count_columns(run, level, last - first, out->rank);
#pragma omp critical(hf_progress)
    {
        run->columns_done += last - first;
        progress_report(run->options->progress, "factorize", (double)run->columns_done / (double)run->S->n);
    }
done:
    sparse_block_free(&block);
    return status;
}

static void fail(hf_run *run, lam_status status, const lam_error *error) {
#pragma omp critical(hf_failure)
    if (run->status == LAM_OK) {
        run->status = status;
        run->error = *error;
    }
}

/* The first failure of any task so far. */
static lam_status failure(hf_run *run, lam_error *error) {
    lam_status status;
#pragma omp critical(hf_failure)
    {
        status = run->status;
        if (status != LAM_OK && error != NULL) *error = run->error;
    }
    return status;
}

static lam_status factorize_below(hf_run *run, size_t first, size_t last, int level, int below,
                                  tall_factors *parts, lam_error *error);

/* Factorizes columns first ... last-1 (algorithm 4, HF). */
static lam_status node(hf_run *run, size_t first, size_t last, int level, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors *parts = NULL;
    size_t count = 0, given = 0;
    if (progress_cancelled(run->options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    if (level >= run->plan.levels || last - first < 2) {
        TRY(leaf(run, level, first, last, out, error));
        goto done;
    }
    const int below = hf_plan_below(&run->plan, level);
    const truncation keep = truncation_of(run, level);
    count = (size_t)1 << (below - level);
    parts = memory_allocate(count, sizeof *parts, "factorization", error);
    if (parts == NULL) TRY(LAM_ERR_MEMORY);
    TRY(factorize_below(run, first, last, level, below, parts, error));
    for (size_t k = 0; k < count; k++) given += parts[k].rank;
    TRY(combine_in_team(count, parts, &keep, out, error));
    count_columns(run, level, given, out->rank);
done:
    for (size_t k = 0; parts != NULL && k < count; k++) tall_factors_free(&parts[k]);
    free(parts);
    return status;
}

/* The same as an OpenMP task, which reports failure in run. */
static void factorize_below_task(hf_run *run, size_t first, size_t last, int level, int below,
                                 tall_factors *parts) {
    lam_error why = {0};
    const lam_status mine = factorize_below(run, first, last, level, below, parts, &why);
    if (mine != LAM_OK) fail(run, mine, &why);
}

/* Factorizes the descendants at level `below` into parts [2^(below - level)]; of a range too short for so
 * many some stay empty. Above level run->alone, where memory does not hold a subtree for each thread, nodes
 * are computed one after the other, each by all threads; from there on siblings are tasks. */
static lam_status factorize_below(hf_run *run, size_t first, size_t last, int level, int below,
                                  tall_factors *parts, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t middle = first + (last - first) / 2;
    const bool in_team = omp_get_level() > 0;
    if (!in_team && level >= run->alone) {
#pragma omp parallel
#pragma omp single
        status = factorize_below(run, first, last, level, below, parts, error);
        return status;
    }
    if (level == below || last - first < 2) return node(run, first, last, below, parts, error);
    tall_factors *others = parts + ((size_t)1 << (below - level - 1));
    if (!in_team) {
        TRY(factorize_below(run, first, middle, level + 1, below, parts, error));
        TRY(factorize_below(run, middle, last, level + 1, below, others, error));
        goto done;
    }
#pragma omp task
    factorize_below_task(run, first, middle, level + 1, below, parts);
    factorize_below_task(run, middle, last, level + 1, below, others);
#pragma omp taskwait
    status = failure(run, error);
done:
    return status;
}

/* The number of levels above which nodes are computed one after the other: the smallest that memory holds. */
static int levels_alone(const hf_run *run) {
    const double n = (double)run->S->n;
    hf_walk walk = {.n = run->S->n, .entries = n * run->S->rows->density, .threads = omp_get_max_threads()};
    if (run->options->memory == 0) return 0;
    while (walk.alone < run->plan.levels &&
           hf_plan_bytes(&run->plan, &walk, 0) > (double)run->options->memory)
        walk.alone++;
    return walk.alone;
}

static lam_status hf_factorize(const scaled_matrix *S, const factorizer_options *options, tall_factors *out,
                               factorizer_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    hf_run run = {.S = S, .options = options};
    hf_forecast *forecast = NULL;
    const budget *shares = &options->budget;
    const bool shared = budget_divided(shares) || options->levels == 0;
    if (options->levels >= 0 && shared) {
        run.plan.every = options->rank > 0;
        run.plan.levels = options->levels < BUDGET_LEVELS_MOST ? options->levels : BUDGET_LEVELS_MOST;
        budget_share(shares, options->epsilon, run.plan.levels, run.plan.left);
        for (int l = 0; l <= run.plan.levels; l++) run.plan.kept[l] = ldexp((double)S->n, -l - 1);
    } else {
        TRY(hf_forecast_create(S, &forecast, error));
        run.plan = hf_forecast_plan(forecast, options);
    }
    run.forecast = forecast;
    run.alone = levels_alone(&run);
    TRY(node(&run, 0, S->n, 0, out, error));
    report->levels = run.plan.levels;
    for (int l = 0; l <= run.plan.levels; l++) {
        report->left[l] = run.plan.left[l];
        report->compression[l] = run.given[l] > 0 ? (double)run.kept[l] / (double)run.given[l] : 1;
    }
done:
    hf_forecast_free(forecast);
    return status;
}

const factorizer factorizer_hf = {"hf", hf_factorize};
