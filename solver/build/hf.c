/* The hierarchical factorization (Aguerre and Fernandez 2016; thesis chapter 3, algorithm 4). */
#include "solver/build/hf.h"

#include "solver/matrix/dense.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* At the root the rank goes up to a multiple of ROOT_ROUND where the spectrum still has something to give:
 * the online kernels work in vectors and panels of that width, and the tail of the spectrum is steep (on the
 * Cornell box 6 % more columns take 20 % off the error). */
enum { ROOT_ROUND = 64 };

typedef struct hf_run {
    const scaled_matrix *S;
    const factorizer_options *options;
    int levels;
    double p[BUDGET_LEVELS_MOST + 1];
    const hf_forecast *forecast; /* or NULL */
    size_t columns_done;
    size_t given[BUDGET_LEVELS_MOST + 1], kept[BUDGET_LEVELS_MOST + 1]; /* columns, by level */
    lam_status status;                                                  /* the first failure of a task */
    lam_error error;
} hf_run;

static truncation truncation_of(const hf_run *run, int level) {
    return (truncation){.norm = budget_norm(run->options->budget.rule),
                        .epsilon = run->p[level],
                        .rank = run->options->rank,
                        .round = level == 0 ? ROOT_ROUND : 1};
}

static void count(hf_run *run, int level, size_t given, size_t kept) {
    __atomic_fetch_add(&run->given[level], given, __ATOMIC_RELAXED);
    __atomic_fetch_add(&run->kept[level], kept, __ATOMIC_RELAXED);
}

/* (Q1 | Q2) = Q_r V_r^T and V = (V1 V_r1 ; V2 V_r2), eqs. 3.3, 3.5, 3.6. Takes one and two over. */
static lam_status combine(tall_factors *one, tall_factors *two, const truncation *keep, tall_factors *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k1 = one->rank, k2 = two->rank, m = one->m + two->m;
    tall_factors joint = {0};
    float *V = NULL;
    TRY(tsvd_pair(one->n, k1, one->Q, k2, two->Q, keep, &joint, error));
    free(one->Q);
    free(two->Q);
    one->Q = two->Q = NULL;
    const size_t r = joint.rank;
    V = memory_allocate(m, r * sizeof *V, "factorization", error);
    if (V == NULL) TRY(LAM_ERR_MEMORY);
    dense_multiply(one->m, k1, r, one->V, joint.V, false, V);
    dense_multiply(two->m, k2, r, two->V, joint.V + k1 * r, false, V + one->m * r);
    free(joint.V);
    joint.V = V;
    joint.m = m;
    V = NULL;
    *out = joint;
    joint = (tall_factors){0};
done:
    free(V);
    tall_factors_free(&joint);
    tall_factors_free(one);
    tall_factors_free(two);
    return status;
}

/* A node of a level from its halves, which it takes over. */
static lam_status parent(hf_run *run, int level, tall_factors *one, tall_factors *two, tall_factors *out,
                         lam_error *error) {
    const truncation keep = truncation_of(run, level);
    const size_t given = one->rank + two->rank;
    const lam_status status = combine(one, two, &keep, out, error);
    if (status == LAM_OK) count(run, level, given, out->rank);
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
    count(run, level, last - first, out->rank);
#pragma omp critical(hf_progress)
    {
        run->columns_done += last - first;
        progress_report(run->options->progress, "factorize", (double)run->columns_done / (double)run->S->n);
    }
done:
    sparse_block_free(&block);
    return status;
}

static lam_status node(hf_run *run, size_t first, size_t last, int level, tall_factors *out,
                       lam_error *error);

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

/* Both halves, as two tasks where there is a team and memory for both at once, else one after the other. */
static lam_status children(hf_run *run, size_t first, size_t last, int level, tall_factors *one,
                           tall_factors *two, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t middle = first + (last - first) / 2;
    if (!omp_in_parallel()) {
        TRY(node(run, first, middle, level + 1, one, error));
        TRY(node(run, middle, last, level + 1, two, error));
        goto done;
    }
#pragma omp task
    {
        lam_error why = {0};
        const lam_status mine = node(run, first, middle, level + 1, one, &why);
        if (mine != LAM_OK) fail(run, mine, &why);
    }
    {
        lam_error why = {0};
        const lam_status mine = node(run, middle, last, level + 1, two, &why);
        if (mine != LAM_OK) fail(run, mine, &why);
    }
#pragma omp taskwait
    status = failure(run, error);
done:
    return status;
}

/* Columns first ... last-1 (algorithm 4, HF). */
static lam_status node(hf_run *run, size_t first, size_t last, int level, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors one = {0}, two = {0};
    if (progress_cancelled(run->options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    if (level >= run->levels || last - first < 2) {
        TRY(leaf(run, level, first, last, out, error));
    } else {
        TRY(children(run, first, last, level, &one, &two, error));
        TRY(parent(run, level, &one, &two, out, error));
    }
done:
    tall_factors_free(&one);
    tall_factors_free(&two);
    return status;
}

/* A node's columns in a team of its own. */
static lam_status team(hf_run *run, size_t first, size_t last, int level, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
#pragma omp parallel
#pragma omp single
    status = node(run, first, last, level, out, error);
    return status;
}

/* Above the level where all subtrees fit into memory at once nodes are made one after the other, each by all
 * threads; below, siblings side by side. */
static lam_status tree(hf_run *run, size_t first, size_t last, int level, int alone, tall_factors *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors one = {0}, two = {0};
    if (level >= alone) return team(run, first, last, level, out, error);
    const size_t middle = first + (last - first) / 2;
    TRY(tree(run, first, middle, level + 1, alone, &one, error));
    TRY(tree(run, middle, last, level + 1, alone, &two, error));
    TRY(parent(run, level, &one, &two, out, error));
done:
    tall_factors_free(&one);
    tall_factors_free(&two);
    return status;
}

/* Levels that are made one node after the other: in a team each thread holds the joined factors of a node and
 * its result, of at most half of the columns each has. */
static int levels_alone(const hf_run *run) {
    const double n = (double)run->S->n, threads = omp_get_max_threads();
    int level = 0;
    if (run->options->memory == 0) return 0;
    while (level < run->levels &&
           threads * 2 * n * ldexp(n, -level) * sizeof(float) * .5 > (double)run->options->memory)
        level++;
    return level;
}

static lam_status hf_factorize(const scaled_matrix *S, const factorizer_options *options, tall_factors *out,
                               factorizer_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    hf_run run = {.S = S, .options = options};
    hf_forecast *forecast = NULL;
    hf_plan plan = {.levels = options->levels, .ratio = options->budget.ratio, .leaf = options->budget.leaf};
    if (plan.levels < 0 || (plan.ratio <= 0 && options->budget.rule != BUDGET_SUMS)) {
        TRY(hf_forecast_create(S, &forecast, error));
        plan = hf_forecast_plan(forecast, S->n, options);
    }
    run.forecast = forecast;
    run.levels = plan.levels < BUDGET_LEVELS_MOST ? plan.levels : BUDGET_LEVELS_MOST;
    budget shared = options->budget;
    shared.ratio = plan.ratio;
    shared.leaf = plan.leaf;
    budget_share(&shared, options->epsilon, run.levels, run.p);
    TRY(tree(&run, 0, S->n, 0, levels_alone(&run), out, error));
    report->shared = shared;
    report->levels = run.levels;
    for (int l = 0; l <= run.levels; l++)
        report->compression[l] = run.given[l] > 0 ? (double)run.kept[l] / (double)run.given[l] : 1;
done:
    hf_forecast_free(forecast);
    return status;
}

const factorizer factorizer_hf = {"hf", hf_factorize};
