/* The forecast of a precompute, and how it came true. */
#include "solver/base/clock.h"
#include "solver/precompute/machine_pace.h"
#include "solver/precompute/precompute_state.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>

/* Of a ray beside blocks, of which no row is made, on a machine of slowness 1: rooms, a maze and a patio of
 * 8,000 elements. */
static const double bare_ray_seconds = 1.2e-7;

lam_status state_measure_rates(precompute_state *state, bool cast, lam_error *error) {
    lam_status status = LAM_OK;
    ray_trial rays = {.rays = 0};
    double slowness;
    if (state->rates.processors > 0) return LAM_OK;
    if (cast) TRY(form_factors_try_rays(&state->m, state->order, &rays, error));
    TRY(machine_slowness_measure(&slowness, error));
    state->rates = (forecast_rates){.ray_seconds = cast ? rays.processor_seconds / rays.rays
                                                        : slowness * bare_ray_seconds,
                                    .slowness = slowness,
                                    .processors = omp_get_max_threads()};
done:
    return status;
}

/* The share of its time that a thread has computed so far: import, mesh and samples are of one thread. On a
 * busy machine a trial of some hundredths of a second alone would tell little. */
void state_update_processors(precompute_state *state) {
    static const double least = .05;
    const double used = clock_processor_seconds() - state->started_used;
    const double share = used / fmax(clock_seconds() - state->started, 1e-6);
    state->rates.processors = omp_get_max_threads() * fmin(fmax(share, least), 1);
}

/* A sample of a recipe that was asked for, and not weighed against others. A hemicube has none. */
static lam_status find_cost(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe *r = &state->recipe;
    if (state->options->from_store || state->cost.measured > 0 || recipe_source(r)->sample == NULL)
        return LAM_OK;
    TRY(state_sample(state, r, &state->cost, error));
done:
    return status;
}

lam_status state_count_entries(precompute_state *state, lam_error *error) {
    enum { ONE_OF = 64, LEAST = 4, MOST = 64, RAYS_ENOUGH = 1 << 16 };
    lam_status status = LAM_OK;
    const size_t n = state->m.n;
    size_t count = n / ONE_OF, seen[MOST];
    uint32_t elements[MOST] = {0};
    double sum = 0;
    recipe twice = {.source = &source_rays, .rays = 2 * state->recipe.rays, .seed = state->recipe.seed};
    if (recipe_source(&state->recipe) != &source_rays) return LAM_OK;
    if (state->options->from_store) {
        if (state->f.F.n > 0) state->cost.entries = (double)state->f.F.indptr[n];
        return LAM_OK;
    }
    if (twice.rays > RAYS_ENOUGH) twice.rays = RAYS_ENOUGH; /* more rays hardly find more */
    if (count < LEAST) count = LEAST;
    if (count > MOST) count = MOST;
    if (count > n) count = n;
    for (size_t k = 0; k < count; k++) elements[k] = (uint32_t)((2 * k + 1) * n / (2 * count));
    TRY(form_factors_count_seen(&state->m, &twice, elements, count, NULL, NULL, seen, error));
    for (size_t k = 0; k < count; k++) sum += (double)seen[k];
    state->cost.entries = fmax(1, (double)n * sum / (double)count);
done:
    return status;
}

lam_status stage_forecast(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    forecast f = state_forecast(state, (double)state->m.n);
    char memory[32], stored[32], seconds[32], building[32], probing[32], scratch_room[32];
    char made[64] = "", built[64] = "", judged[64] = "", kept[64] = "", rate[64] = "";
    TRY(forecast_check_disk(&f, o->output, state->scratch, o->scratch, error));
    if (state->t->quiet || (o->from_store && state->probes == 0)) goto done;
    TRY(find_cost(state, error));
    TRY(state_count_entries(state, error));
    /* Beside blocks few rays are cast, unless there is a sky: a tree of all elements for a trial takes
     * longer. */
    const bool cast = recipe_source(&state->recipe) != &source_blocks || o->sky != NULL;
    TRY(state_measure_rates(state, cast, error));
    state_update_processors(state);
    f = state_forecast(state, (double)state->m.n);
    const forecast_rates *rates = &state->rates;
    const forecast_times times = state->expected_times = forecast_seconds(&f, rates);
    forecast_format_bytes(forecast_bytes(&f), memory);
    forecast_format_bytes(forecast_store_bytes(&f), stored);
    forecast_format_bytes(forecast_scratch_bytes(&f), scratch_room);
    clock_format_seconds(forecast_wall_seconds(times.form_factors, rates), seconds);
    clock_format_seconds(forecast_wall_seconds(times.operate, rates), building);
    clock_format_seconds(forecast_wall_seconds(times.judge + times.solves, rates), probing);
    if (!o->from_store) snprintf(made, sizeof made, " form factors %s,", seconds);
    if (times.operate > 0) snprintf(built, sizeof built, " the operator %s,", building);
    if (state->probes > 0) snprintf(judged, sizeof judged, " the judge %s,", probing);
    if (state->scratch != NULL) snprintf(kept, sizeof kept, ", scratch up to %s", scratch_room);
    if (cast)
        snprintf(rate, sizeof rate, " at %.3g Mray/s of", 1e-6 * rates->processors / rates->ray_seconds);
    terminal_log(state->t, "forecast:%s%s%s%s %.2g processors; memory up to %s, store up to %s%s", made,
                 built, judged, cast ? rate : " on", rates->processors, memory, stored, kept);
    if (state->large)
        terminal_log(state->t, "rows are kept in %s, as memory is too small for them", o->scratch);
done:
    return status;
}

void state_log_times(const precompute_state *state) {
    const forecast_times *f = &state->expected_times, *t = &state->spent;
    if (!(f->form_factors + f->judge + f->solves > 0)) return;
    terminal_log(state->t,
                 "processor seconds, forecast and taken: form factors %.2g %.2g, operator %.2g %.2g, judge "
                 "%.2g %.2g",
                 f->form_factors, t->form_factors, f->operate, t->operate, f->judge + f->solves, t->judge);
}
