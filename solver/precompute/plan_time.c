/* --time: forecasts of all recipes before the work begins, and the options of the one that is taken. From
 * there on the run is that of these options, and no clock has a part in it. */
#include "solver/base/clock.h"
#include "solver/precompute/budget.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Single elements of the judge, unless --probes gives their number, and in the cheapest recipe. */
enum { PROBES_OF_BUDGET = 32, PROBES_OF_CHEAPEST = 8 };
/* Of the budget, the share that the forecast may fill: importing, samples and the store take some, too, and
 * forecasts are right within half as much again. */
static const double share_filled = .8;
/* Pairs cost more than these seconds each. */
static const double pair_least_seconds = 1.5e-7;
/* A sample of pairs takes at most so many of them, each of these seconds where it is projected, and at high
 * quality this many times as long; it may take a quarter of the budget. */
static const double sampled_pairs = 40000, sampled_pair_seconds = 2e-5, high_times = 8, share_sampled = .25;
/* A finer sample of blocks is taken while all blocks of the one before are forecast to take at most this many
 * budgets. */
static const double finer_share = 1;

/* Costs of blocks at some accuracies, the coarsest first. */
enum { SAMPLES_MOST = 3 };
typedef struct block_costs {
    size_t count;
    double accuracy[SAMPLES_MOST];
    factor_cost cost[SAMPLES_MOST];
} block_costs;

static const double sampled_epsilons[SAMPLES_MOST] = {.4, .05, .012};
/* Blocks as a power of their accuracy where one sample alone tells (source_blocks). */
static const double power_of_accuracy = -.7;

/* Costs of all pairs at each quality that was weighed: beside an operator of an epsilon among those weighed,
 * as the accuracy of pairs follows it. */
static const char *const epsilon_of_pairs = "0.012";
enum { QUALITIES_MOST = 2 };
typedef struct quality_costs {
    size_t count;
    factor_quality quality[QUALITIES_MOST];
    double accuracy[QUALITIES_MOST];
    factor_cost cost[QUALITIES_MOST];
} quality_costs;

/* The part that all candidates share. */
typedef struct budget_run {
    const precompute_job *job;
    precompute_scene *scene;
    const precompute_plan *plan; /* so far: where rows lie */
    const forecast_rates *rates;
    const build_method *method;
    block_costs blocks;
    quality_costs pairs;
    factor_cost rays_cost; /* of RAYS_SAMPLED from each element */
} budget_run;
enum { RAYS_SAMPLED = 1024 };

static double accuracy_of(const budget_run *run, double epsilon) {
    build_options build = run->job->options->build;
    lam_error none;
    (void)build_set_number(&build, "epsilon", epsilon, &none);
    return run->method->block_accuracy(method_own_const(&build, run->method));
}

/* Of a law y = c x^p through the two samples nearest to an accuracy. */
static double along(const block_costs *c, double accuracy, double (*figure)(const factor_cost *)) {
    size_t k = 0;
    if (c->count == 1) return figure(&c->cost[0]) * pow(accuracy / c->accuracy[0], power_of_accuracy);
    while (k + 2 < c->count && accuracy < c->accuracy[k + 1]) k++;
    const double low = fmax(figure(&c->cost[k]), 1e-9), high = fmax(figure(&c->cost[k + 1]), 1e-9);
    const double p = log(high / low) / log(c->accuracy[k + 1] / c->accuracy[k]);
    return low * pow(accuracy / c->accuracy[k], p);
}

static double measured_of(const factor_cost *c) {
    return c->measured;
}

static double entries_of(const factor_cost *c) {
    return c->entries;
}

static double finer_of(const factor_cost *c) {
    return c->finer;
}

static lam_status sample_blocks(budget_run *run, double seconds, lam_error *error) {
    lam_status status = LAM_OK;
    block_costs *c = &run->blocks;
    for (size_t k = 0; k < SAMPLES_MOST; k++) {
        const recipe r = {.source = &source_blocks,
                          .rays = recipe_rays_beside_blocks(run->scene->m.n),
                          .accuracy = accuracy_of(run, sampled_epsilons[k]),
                          .seed = run->job->options->seed};
        TRY(plan_sample(run->job, run->scene, &r, &c->cost[k], error));
        c->accuracy[k] = r.accuracy;
        c->count = k + 1;
        if (forecast_wall_seconds(c->cost[k].measured, run->rates) > finer_share * seconds) break;
    }
done:
    return status;
}

/* The options of a candidate. */
static lam_status set_options(const budget_recipe *r, const build_method *method, precompute_options *o,
                              lam_error *error) {
    o->form_factors = source_place(r->kind == BUDGET_BLOCKS ? &source_blocks : &source_rays);
    if (r->rays > 0) o->rays = r->rays;
    if (r->kind == BUDGET_PAIRS) o->quality = r->quality;
    o->build.method = method->name;
    o->probes = r->probes;
    o->trials = 1;
    return build_set(&o->build, "epsilon", r->epsilon, error);
}

/* The plan of a candidate beside its options. */
static precompute_plan plan_of(const budget_run *run, const budget_recipe *r, const precompute_job *job) {
    const double n = (double)run->scene->m.n;
    precompute_plan plan = *run->plan;
    factor_cost *const cost = &plan.cost;
    plan.method = run->method;
    plan.recipe = (recipe){.source = &source_rays, .rays = r->rays, .seed = job->options->seed};
    if (r->kind == BUDGET_BLOCKS) {
        const double accuracy =
            run->method->block_accuracy(method_own_const(&job->options->build, run->method));
        plan.recipe.source = &source_blocks;
        plan.recipe.rays = recipe_rays_beside_blocks(run->scene->m.n);
        plan.recipe.accuracy = accuracy;
        *cost = (factor_cost){.measured = along(&run->blocks, accuracy, measured_of),
                              .finer = along(&run->blocks, accuracy, finer_of),
                              .entries = along(&run->blocks, accuracy, entries_of)};
    } else if (r->kind == BUDGET_PAIRS) {
        plan.recipe = plan_pairs_recipe(job, &plan);
        size_t k = 0;
        while (k + 1 < run->pairs.count && run->pairs.quality[k] != r->quality) k++;
        *cost = run->pairs.cost[k];
        cost->measured = pairs_cost_at(cost, run->pairs.accuracy[k], plan.recipe.accuracy);
    } else {
        *cost = run->rays_cost;
        cost->entries = fmin(run->rays_cost.entries * (double)r->rays / RAYS_SAMPLED, n * n);
    }
    cost->seconds = cost->measured;
    if (!ray_rows_can(&plan.recipe)) plan.streamed = false; /* as the rows so far may be */
    return plan;
}

/* Seconds of a candidate on the wall, or less than 0. */
static lam_status find_seconds(const budget_run *run, budget_recipe *r, lam_error *error) {
    lam_status status = LAM_OK;
    precompute_options options = *run->job->options;
    precompute_job job = *run->job;
    TRY(set_options(r, run->method, &options, error));
    job.options = &options;
    const precompute_plan plan = plan_of(run, r, &job);
    const forecast f = plan_forecast(&job, run->scene, &plan, (double)run->scene->m.n);
    if (forecast_bytes(&f) > job.memory) goto done;
    const forecast_times t = forecast_seconds(&f, run->rates);
    r->seconds = forecast_wall_seconds(t.form_factors + t.operate + t.judge + t.solves, run->rates);
done:
    return status;
}

/* The recipe of defaults at the next quality, where that is all pairs, and its cost. */
static lam_status weigh_pairs(budget_run *run, factor_quality quality, bool *taken, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = run->pairs.count;
    precompute_options options = *run->job->options;
    precompute_job job = *run->job;
    precompute_plan plan = *run->plan;
    options.form_factors = source_place(&source_rays);
    options.quality = quality;
    options.build.method = run->method->name;
    TRY(build_set(&options.build, "epsilon", epsilon_of_pairs, error));
    job.options = &options;
    plan.method = run->method;
    plan.recipe = plan_pairs_recipe(&job, &plan);
    TRY(plan_weigh_pairs(&job, run->scene, &plan, error));
    *taken = !plan.weighed.too_slow;
    run->pairs.quality[k] = quality;
    run->pairs.accuracy[k] = plan.recipe.accuracy;
    run->pairs.cost[k] = plan.cost;
    run->pairs.count++;
done:
    return status;
}

/* Seconds of all candidates. */
static lam_status find_all_seconds(budget_run *run, double seconds, budget_recipe *list, size_t count,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    quality_costs *const weighed = &run->pairs;
    bool pairs = false;
    double took = 0;
    const recipe rays = {.source = &source_rays, .rays = RAYS_SAMPLED};
    TRY(plan_sample(run->job, run->scene, &rays, &run->rays_cost, error));
    for (size_t k = 0; k < count; k++) {
        if (list[k].kind == BUDGET_PAIRS &&
            (weighed->count == 0 || list[k].quality != weighed->quality[weighed->count - 1])) {
            const double before = clock_seconds();
            if (weighed->count == QUALITIES_MOST) break;
            if (weighed->count > 0 && high_times * took > share_sampled * seconds) break;
            TRY(weigh_pairs(run, list[k].quality, &pairs, error));
            took = clock_seconds() - before;
            const factor_cost *cost = &weighed->cost[weighed->count - 1];
            if (forecast_wall_seconds(cost->measured - cost->segments, run->rates) > seconds) pairs = false;
            if (!pairs) break; /* a higher quality costs more */
        }
        TRY(find_seconds(run, &list[k], error));
    }
done:
    return status;
}

static void log_choice(const budget_run *run, const budget_recipe *r, bool probes) {
    char options[BUDGET_TEXT], seconds[32];
    budget_options(r, run->method->name, probes, options);
    clock_format_seconds(r->seconds, seconds);
    terminal_log(run->job->t,
                 "--time %g: forecast %s, indirect error of single elements about %.2g; the same store "
                 "without --time: %s",
                 run->job->options->time, seconds, r->error, options);
}

/* Seconds that are left of those that the forecast may fill. */
static double seconds_left(const precompute_job *job) {
    return share_filled * job->options->time - (clock_seconds() - job->started);
}

lam_status plan_within_time(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                            stage_times *times, precompute_options *chosen, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const double n = (double)scene->m.n;
    const factor_source *const asked = source_asked(o->form_factors);
    const bool given = o->probes != OPTION_AUTO;
    bool blocks = false;
    budget_run run = {
        .job = job, .scene = scene, .plan = plan, .rates = &times->rates, .method = plan_method_of_blocks()};
    budget_recipe list[BUDGET_RECIPES_MOST + 1];
    TRY(times_measure_rates(scene, times, true, error));
    times_update_processors(job, times);
    double seconds = seconds_left(job);
    if (asked != &source_rays) TRY(plan_blocks_possible(job, scene, run.method, &blocks, error));
    if (blocks) TRY(sample_blocks(&run, seconds, error));
    times_update_processors(job, times);
    const double all = n * n / 2, sampling = fmin(all, sampled_pairs) * sampled_pair_seconds;
    const bool pairs = n <= PLAN_PAIRS_ELEMENTS &&
                       forecast_wall_seconds(all * pair_least_seconds, run.rates) < seconds &&
                       forecast_wall_seconds(sampling, run.rates) < share_sampled * seconds;
    const bool rays = asked != &source_blocks;
    size_t count = budget_list(blocks, rays, rays && pairs, given ? o->probes : PROBES_OF_BUDGET, list);
    TRY(find_all_seconds(&run, seconds, list, count, error));
    seconds = seconds_left(job);
    const size_t cheapest = budget_cheapest(list, count);
    if (cheapest == count)
        FAIL(error, LAM_ERR_MEMORY, "--time: %zu elements do not fit into --memory by any recipe",
             scene->m.n);
    if (!given) {
        list[count] = list[cheapest];
        list[count].probes = PROBES_OF_CHEAPEST;
        TRY(find_seconds(&run, &list[count], error));
        count++;
    }
    size_t taken = budget_pick(list, count, seconds);
    if (taken == count) {
        char needs[32];
        taken = budget_cheapest(list, count);
        clock_format_seconds(list[taken].seconds + clock_seconds() - job->started, needs);
        terminal_warn(job->t, "--time %g: the cheapest recipe is forecast to take %s, and is taken", o->time,
                      needs);
    }
    *chosen = *o;
    TRY(set_options(&list[taken], run.method, chosen, error));
    log_choice(&run, &list[taken], !given);
done:
    return status;
}
