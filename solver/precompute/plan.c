/* The choice of form factors for a scene, of rows first and then by samples, and what it takes. */
#include "solver/precompute/plan.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Single elements by which an operator is judged at most, unless --probes gives their number. */
enum { PROBES = 200 };

/* Channels whose reflectances no earlier one has. */
static size_t count_own_channels(const mesh *m) {
    size_t own = 0;
    for (size_t c = 0; c < m->n_channels; c++) own += operator_like_channel(m->n, m->reflectance, c) == c;
    return own;
}

forecast plan_forecast(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                       double n) {
    const precompute_options *o = job->options;
    panel_precision precision = PANEL_F32;
    (void)panel_precision_find(o->build.precision, &precision); /* one of the choices of the row */
    return (forecast){.n = (size_t)n,
                      .n_planes = scene->tree.n_frames,
                      .n_channels = scene->m.n_channels,
                      .n_groups = scene->m.n_groups,
                      .n_own_channels = count_own_channels(&scene->m),
                      .sky_tiles = scene->sky_tiles,
                      .recipe = plan->recipe,
                      .judge_recipe = plan_judge_recipe(job, plan, n, 0),
                      .cost = plan->cost,
                      .probes = o->probes == OPTION_AUTO ? PROBES : o->probes,
                      .probes_least = o->probes == OPTION_AUTO ? PROBES_LEAST : 0,
                      .from_store = o->from_store,
                      .scratch = o->scratch != NULL,
                      .large = plan->large,
                      .keep = o->keep_form_factors,
                      .streamed = plan->streamed,
                      .emitters = emitter_list_count(&scene->emitters),
                      .method = plan->method,
                      .build = &o->build,
                      .precision = precision};
}

bool plan_fits(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
               double n) {
    const forecast f = plan_forecast(job, scene, plan, n);
    return forecast_bytes(&f) <= job->memory;
}

lam_status plan_sample(const precompute_job *job, precompute_scene *scene, const recipe *r, factor_cost *cost,
                       lam_error *error) {
    const factor_work work = {.m = &scene->m,
                              .progress = &job->progress,
                              .tree = &scene->tree,
                              .ready = &scene->ready,
                              .importance = &scene->importance};
    return recipe_source(r)->sample(&work, r, cost, error);
}

void plan_explain(precompute_plan *plan, const char *format, ...) {
    const size_t used = strlen(plan->reason);
    va_list values;
    va_start(values, format);
    (void)vsnprintf(plan->reason + used, sizeof plan->reason - used, format, values);
    va_end(values);
    const size_t end = strlen(plan->reason);
    if (end + 1 < sizeof plan->reason) plan->reason[end] = '\n';
}

lam_status plan_check_rows(const precompute_job *job, const precompute_scene *scene, precompute_plan *plan,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)scene->m.n;
    TRY(plan_rows(job, scene, n, plan, error));
    const forecast f = plan_forecast(job, scene, plan, n);
    TRY(forecast_check(&f, job->memory, error));
done:
    return status;
}

/* Blocks take less memory than rows. Where they may come, only that memory is checked which the coarsest of
 * them need. */
lam_status plan_check_mesh(const precompute_job *job, const precompute_scene *scene, double n,
                           precompute_plan *plan, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(plan_rows(job, scene, n, plan, error));
    forecast f = plan_forecast(job, scene, plan, n);
    if (forecast_bytes(&f) > job->memory && plan_may_have_blocks(job, n))
        f.recipe = f.judge_recipe = (recipe){.source = &source_blocks, .rays = 1, .accuracy = 1};
    TRY(forecast_check(&f, job->memory, error));
done:
    return status;
}

/* Blocks come first: to weigh all pairs or near ones costs more than blocks do in most rooms. */
lam_status plan_choose(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)scene->m.n;
    const build_method *method;
    bool final;
    TRY(plan_rows(job, scene, n, plan, error));
    TRY(plan_expect_method(job, scene, n, 0, &method, &final, error));
    TRY(plan_weigh_blocks(job, scene, method, final, plan, error));
    TRY(plan_weigh_rows(job, scene, plan, error));
    forecast f = plan_forecast(job, scene, plan, n);
    TRY(forecast_check(&f, job->memory, error));
    plan->probes = forecast_probes(&f);
    if (plan->probes > scene->m.n) plan->probes = scene->m.n;
done:
    return status;
}
