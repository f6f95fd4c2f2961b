/* The forecast of a precompute, and how it came true. */
#include "solver/base/clock.h"
#include "solver/precompute/forecast/machine_pace.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>

/* Of a ray beside blocks, of which no row is made, on a machine of slowness 1: rooms, a maze and a patio of
 * 8,000 elements. */
static const double bare_ray_seconds = 1.2e-7;

lam_status times_measure_rates(const precompute_scene *scene, stage_times *times, bool cast,
                               lam_error *error) {
    lam_status status = LAM_OK;
    ray_trial rays = {.rays = 0};
    double slowness;
    if (times->rates.processors > 0) return LAM_OK;
    if (cast) TRY(form_factors_try_rays(&scene->m, scene->order, &rays, error));
    TRY(machine_slowness_measure(&slowness, error));
    times->rates = (forecast_rates){.ray_seconds = cast ? rays.processor_seconds / rays.rays
                                                        : slowness * bare_ray_seconds,
                                    .slowness = slowness,
                                    .processors = omp_get_max_threads()};
done:
    return status;
}

/* The share of its time that a thread has computed so far: import, mesh and samples are of one thread. On a
 * busy machine a trial of some hundredths of a second alone would tell little. */
void times_update_processors(const precompute_job *job, stage_times *times) {
    static const double least = .05;
    const double used = clock_processor_seconds() - job->started_used;
    const double share = used / fmax(clock_seconds() - job->started, 1e-6);
    times->rates.processors = omp_get_max_threads() * fmin(fmax(share, least), 1);
}

/* A sample of a recipe that was asked for, and not weighed against others. A hemicube has none. */
static lam_status find_cost(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const recipe *r = &plan->recipe;
    if (job->options->from_store || plan->cost.measured > 0 || recipe_source(r)->sample == NULL)
        return LAM_OK;
    TRY(plan_sample(job, scene, r, &plan->cost, error));
done:
    return status;
}

lam_status plan_count_entries(const precompute_job *job, const precompute_scene *scene, precompute_plan *plan,
                              precompute_factors *factors, lam_error *error) {
    enum { ONE_OF = 64, LEAST = 4, MOST = 64, RAYS_ENOUGH = 1 << 16 };
    lam_status status = LAM_OK;
    const size_t n = scene->m.n;
    size_t count = n / ONE_OF, seen[MOST];
    uint32_t elements[MOST] = {0};
    double sum = 0;
    recipe twice = {.rays = 2 * plan->recipe.rays, .seed = plan->recipe.seed};
    if (!recipe_can(&plan->recipe, SOURCE_TIMED)) return LAM_OK;
    if (job->options->from_store) {
        if (factors->f.F.n > 0) plan->cost.entries = (double)factors->f.F.indptr[n];
        return LAM_OK;
    }
    if (twice.rays > RAYS_ENOUGH) twice.rays = RAYS_ENOUGH; /* more rays hardly find more */
    if (count < LEAST) count = LEAST;
    if (count > MOST) count = MOST;
    if (count > n) count = n;
    for (size_t k = 0; k < count; k++) elements[k] = (uint32_t)((2 * k + 1) * n / (2 * count));
    TRY(form_factors_count_seen(&scene->m, &twice, elements, count, NULL, NULL, seen, error));
    for (size_t k = 0; k < count; k++) sum += (double)seen[k];
    plan->cost.entries = fmax(1, (double)n * sum / (double)count);
done:
    return status;
}

lam_status stage_forecast(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                          precompute_factors *factors, stage_times *times, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    forecast f = plan_forecast(job, scene, plan, (double)scene->m.n);
    char memory[32], stored[32], seconds[32], building[32], probing[32], scratch_room[32];
    char made[64] = "", built[64] = "", judged[64] = "", kept[64] = "", rate[64] = "";
    TRY(forecast_check_disk(&f, o->output, factors->scratch, o->scratch, error));
    if (job->t->quiet || (o->from_store && plan->probes == 0)) goto done;
    TRY(find_cost(job, scene, plan, error));
    TRY(plan_count_entries(job, scene, plan, factors, error));
    /* Beside blocks few rays are cast, unless there is a sky: a tree of all elements for a trial takes
     * longer. */
    const bool cast = !recipe_can(&plan->recipe, SOURCE_BLOCKS) || o->sky != NULL;
    TRY(times_measure_rates(scene, times, cast, error));
    times_update_processors(job, times);
    f = plan_forecast(job, scene, plan, (double)scene->m.n);
    const forecast_rates *rates = &times->rates;
    const forecast_times expected = times->expected = forecast_seconds(&f, rates);
    forecast_format_bytes(forecast_bytes(&f), memory);
    forecast_format_bytes(forecast_store_bytes(&f), stored);
    forecast_format_bytes(forecast_scratch_bytes(&f), scratch_room);
    clock_format_seconds(forecast_wall_seconds(expected.form_factors, rates), seconds);
    clock_format_seconds(forecast_wall_seconds(expected.operate, rates), building);
    clock_format_seconds(forecast_wall_seconds(expected.judge + expected.solves, rates), probing);
    if (!o->from_store) snprintf(made, sizeof made, " form factors %s,", seconds);
    if (expected.operate > 0) snprintf(built, sizeof built, " the operator %s,", building);
    if (plan->probes > 0) snprintf(judged, sizeof judged, " the judge %s,", probing);
    if (factors->scratch != NULL) snprintf(kept, sizeof kept, ", scratch up to %s", scratch_room);
    if (cast)
        snprintf(rate, sizeof rate, " at %.3g Mray/s of", 1e-6 * rates->processors / rates->ray_seconds);
    terminal_log(job->t, "forecast:%s%s%s%s %.2g processors; memory up to %s, store up to %s%s", made, built,
                 judged, cast ? rate : " on", rates->processors, memory, stored, kept);
    if (plan->large) terminal_log(job->t, "rows are kept in %s, as memory is too small for them", o->scratch);
done:
    return status;
}

void times_log(const precompute_job *job, const stage_times *times) {
    const forecast_times *f = &times->expected, *t = &times->spent;
    if (!(f->form_factors + f->judge + f->solves > 0)) return;
    terminal_log(job->t,
                 "processor seconds, forecast and taken: form factors %.2g %.2g, operator %.2g %.2g, judge "
                 "%.2g %.2g",
                 f->form_factors, t->form_factors, f->operate, t->operate, f->judge + f->solves, t->judge);
}
