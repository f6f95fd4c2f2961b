#include "solver/precompute/precompute.h"

#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/precompute/precompute_state.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

void work_free(work *w) {
    mesh_free(&w->m);
    free(w->order);
    form_factors_free(&w->f);
    ray_rows_destroy(w->rays);
    compressed_free(&w->compressed);
    emitter_wish_free(&w->emitters);
    scratch_close(w->scratch, false);
    lam_operator_close(w->op);
}

double work_memory(const precompute_options *o) {
    const uint64_t available = memory_available();
    if (o->memory > 0) return (double)o->memory;
    return available > 0 ? .7 * (double)available : 0x1p60;
}

uint64_t precompute_seed(uint64_t seed, uint64_t purpose) {
    return random_mix(seed + purpose * RANDOM_STEP);
}

static void log_stage(work *w, const char *stage, double started) {
    terminal_log(w->t, "%-14s%8.2f s", stage, clock_seconds() - started);
}

static void log_form_factors(work *w) {
    const form_factors *f = &w->f;
    char how[64];
    recipe_describe(&f->recipe, how);
    terminal_log(w->t,
                 "%s: %.2f %% leave the scene%s, %.2f %% meet back faces; row sums repaired by "
                 "%.2g on average, at most %.2g",
                 how, 100 * f->leaving_share, f->closed ? " (closed)" : "", 100 * f->absorbed_share,
                 f->repair_mean, f->repair_max);
    if (f->pairs.accuracy > recipe_accuracy(&f->recipe))
        terminal_log(w->t,
                     "so much is partly hidden that it was found to a standard error of %.2g, not %.2g; "
                     "--quality high looks closer",
                     f->pairs.accuracy, recipe_accuracy(&f->recipe));
    if (f->pairs.facing > 0) {
        const double all = .5 * (double)w->m.n * (double)(w->m.n - 1), facing = f->pairs.facing;
        terminal_log(w->t,
                     "%.1f %% of all pairs taken one by one; of those %.1f %% have nothing between them, "
                     "%.1f %% are plainly open, %.1f %% plainly hidden",
                     100 * facing / all, 100 * f->pairs.certain / facing, 100 * f->pairs.open / facing,
                     100 * f->pairs.hidden / facing);
    }
    const sky_bounce *sky = &f->sky;
    if (sky->first_bounce != NULL)
        terminal_log(w->t, "sky: %s, %zu tiles, ground albedo %g", sky->tiling.name, sky->tiling.n_tiles,
                     sky->ground_albedo);
    if (sky->first_bounce != NULL && f->closed)
        terminal_warn(w->t, "the scene is closed: no element sees the sky");
    if (f->absorbed_share > .01 && !w->m.two_sided)
        terminal_warn(w->t,
                      "%.1f %% of the light meets back faces and is lost there: turn the faces, or give "
                      "--two-sided",
                      100 * f->absorbed_share);
}

/* One line of what is to come, and whether the disks can hold it. */
static lam_status announce(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    const forecast f = work_forecast(w, (double)w->m.n);
    char memory[32], stored[32], seconds[32], judging[32], scratch_room[32];
    char made[64] = "", judged[64] = "", kept[64] = "";
    double rate;
    TRY(forecast_check_disk(&f, o->output, w->scratch, o->scratch, error));
    if (w->t->quiet || (o->from_store && w->probes == 0)) goto done;
    TRY(form_factors_ray_rate(&w->m, w->order, &rate, error));
    const forecast_times times = forecast_seconds(&f, rate, omp_get_max_threads());
    forecast_format_bytes(forecast_bytes(&f), memory);
    forecast_format_bytes(forecast_store_bytes(&f), stored);
    forecast_format_bytes(forecast_scratch_bytes(&f), scratch_room);
    clock_format_seconds(times.form_factors, seconds);
    clock_format_seconds(times.judge, judging);
    /* How much is partly hidden is not known before. */
    const bool pairs = w->recipe.method == RECIPE_PAIRS || w->recipe.method == RECIPE_NEAR_PAIRS;
    if (!o->from_store) snprintf(made, sizeof made, " form factors %s%s,", seconds, pairs ? " or more" : "");
    if (w->probes > 0) snprintf(judged, sizeof judged, " the judge's %s,", judging);
    if (w->scratch != NULL) snprintf(kept, sizeof kept, ", scratch up to %s", scratch_room);
    terminal_log(w->t, "forecast:%s%s at %.3g Mray/s of a trial; memory up to %s, store up to %s%s", made,
                 judged, rate * 1e-6, memory, stored, kept);
    if (w->large) terminal_log(w->t, "rows are kept in %s, as memory is too small for them", o->scratch);
done:
    return status;
}

void work_log_kept(work *w, const form_factors *f) {
    if (f->rows_kept > 0)
        terminal_log(w->t, "%zu of %zu rows were in %s already", f->rows_kept, w->m.n, w->options->scratch);
}

lam_status work_trace(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = w->recipe,
                                     .progress = &w->progress,
                                     .stage = "form factors",
                                     .scratch = w->scratch,
                                     .scratch_name = "form-factors.rows",
                                     .large = work_large_place(w),
                                     .sky = w->options->sky,
                                     .ground_albedo = w->options->ground_albedo};
    TRY(form_factors_make(&w->m, w->order, &how, &w->f, error));
    work_log_kept(w, &w->f);
done:
    return status;
}

lam_status work_begin_stream(work *w, lam_error *error) {
    const form_factor_options how = {.recipe = w->recipe,
                                     .progress = &w->progress,
                                     .stage = "near pairs",
                                     .sky = w->options->sky,
                                     .ground_albedo = w->options->ground_albedo};
    const lam_status status = ray_rows_create(&w->m, &how, &w->rays, error);
    if (status == LAM_OK)
        ray_rows_stream(w->rays, precompute_seed(w->options->form_factors.seed, 6), &w->stream);
    w->f.recipe = w->recipe;
    return status;
}

lam_status precompute_run(const precompute_options *options, terminal *t, build_report *report,
                          lam_error *error) {
    lam_status status = LAM_OK;
    work w = {.options = options, .t = t, .progress = terminal_progress(t)};
    w.memory = work_memory(options);

    double started = clock_seconds();
    TRY(options->from_store ? work_load_store(&w, error) : work_load_scene(&w, error));
    log_stage(&w, "import", started);
    TRY(terminal_check(error));

    started = clock_seconds();
    TRY(work_prepare_mesh(&w, error));
    log_stage(&w, "mesh", started);
    TRY(terminal_check(error));

    TRY(work_take_scratch(&w, error));
    TRY(announce(&w, error));
    if (!options->from_store) {
        started = clock_seconds();
        TRY(w.streamed ? work_begin_stream(&w, error) : work_trace(&w, error));
        log_stage(&w, w.streamed ? "near pairs" : "form factors", started);
    }
    if (!w.streamed) log_form_factors(&w);

    TRY(work_build(&w, error));
    if (w.streamed) log_form_factors(&w);
    TRY(terminal_check(error));

    if (options->compress_form_factors) {
        started = clock_seconds();
        TRY(work_compress(&w, error));
        log_stage(&w, "compress", started);
        TRY(terminal_check(error));
    }

    if (w.probes > 0) {
        started = clock_seconds();
        TRY(work_judge(&w, error));
        log_stage(&w, "judge", started);
    }
    TRY(terminal_check(error));

    started = clock_seconds();
    TRY(work_save(&w, error));
    log_stage(&w, "store", started);
    scratch_close(w.scratch, true);
    w.scratch = NULL;
    *report = w.built;
done:
    work_free(&w);
    return status;
}
