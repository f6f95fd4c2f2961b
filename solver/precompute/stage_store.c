/* What a precompute writes: all of it, then the seal. */
#include "solver/precompute/precompute_state.h"

#include <string.h>

static lam_status describe_operator(const work *w, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const build_report *r = &w->built;
    const bool factorized = r->factorizer != NULL;
    operator_description about = {.density = -1};
    operator_describe(w->op, &about);
    TRY(store_set_text(s, "/operator", "method", r->method, error));
    TRY(store_set_text(s, "/operator", "factorizer", factorized ? r->factorizer : "none", error));
    TRY(store_set_text(s, "/operator", "reason", r->reason, error));
    if (r->epsilon >= 0) TRY(store_set_number(s, "/operator", "epsilon", r->epsilon, error));
    TRY(store_set_number(s, "/operator", "rcond", r->rcond, error));
    if (factorized && r->levels > 0 && w->options->rank == 0) {
        TRY(store_set_text(s, "/operator", "budget", w->options->budget, error));
        TRY(store_set_number(s, "/operator", "alpha", w->options->alpha, error));
    }
    if (factorized && r->levels >= 0) {
        TRY(store_set_integer(s, "/operator", "levels", r->levels, error));
        TRY(store_set_number(s, "/operator", "passes", r->factorized.passes, error));
    }
    if (r->threshold > 0) {
        TRY(store_set_number(s, "/operator", "threshold", r->threshold, error));
        if (strcmp(r->method, "sparse") == 0)
            TRY(store_set_text(s, "/operator", "correction", sparse_correction_name(r->correction), error));
    }
    if (r->uniform_error >= 0) {
        TRY(store_set_number(s, "/operator", "probe_residual", r->probe_residual, error));
        TRY(store_set_number(s, "/operator", "uniform_error", r->uniform_error, error));
    }
    if (r->residual >= 0) {
        TRY(store_set_number(s, "/operator", "residual", r->residual, error));
        TRY(store_set_integer(s, "/operator", "sweeps", (int64_t)r->sweeps, error));
    }
    if (r->coherence >= 0) {
        TRY(store_set_text(s, "/operator", "assign", w->options->proximity ? "proximity" : "inclusion",
                           error));
        TRY(store_set_number(s, "/operator", "coherence_min", r->coherence, error));
        TRY(store_set_number(s, "/operator", "patch_area_min", r->patch_area, error));
    }
    if (factorized || r->coherence >= 0) {
        TRY(store_set_integer(s, "/operator", "rank", (int64_t)r->rank, error));
        TRY(store_set_number(s, "/operator", "measured_norm_error", r->measured_norm_error, error));
        TRY(store_set_text(s, "/operator", "norm", r->norm == TRUNCATION_FROBENIUS ? "frobenius" : "2",
                           error));
    } else if (about.density >= 0) {
        TRY(store_set_number(s, "/operator", "density", about.density, error));
    }
    /* What the form factors were made with, so that they can be made again where they are not kept. */
    TRY(recipe_save(&w->f.recipe, &recipe_of_operator, s, error));
done:
    return status;
}

lam_status work_save(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    store *s = NULL;
    TRY(store_create(o->output, &s, error));
    TRY(store_set_text(s, "/", "name", w->m.name, error));
    TRY(store_set_text(s, "/", "tool", "lambert " LAMBERT_VERSION, error));
    TRY(store_set_text(s, "/", "command", o->command, error));
    TRY(store_set_integer(s, "/", "seed", (int64_t)o->form_factors.seed, error));
    TRY(store_set_number(s, "/", "unit", w->m.unit, error));
    TRY(mesh_save(&w->m, w->f.row_sums, s, error));
    if (o->reflectance >= 0) TRY(store_set_number(s, "/mesh", "reflectance_given", o->reflectance, error));
    TRY(terminal_check(error));
    if (w->compressed.n > 0) {
        TRY(compressed_save(&w->compressed, s, error));
        TRY(form_factors_save_about(&w->f, "compressed", s, error));
    } else if (o->keep_form_factors) {
        if (w->m.n > FORM_FACTORS_ROWS_MOST) TRY(form_factors_gather(&w->f, w->m.area, error));
        TRY(form_factors_save(&w->f, s, error));
    }
    if (w->f.sky.first_bounce != NULL) TRY(sky_bounce_save(&w->f.sky, s, error));
    TRY(terminal_check(error));
    TRY(operator_save(w->op, s, error));
    TRY(describe_operator(w, s, error));
    if (w->probes > 0) TRY(judge_save(&w->errors, s, error));
    TRY(terminal_check(error));
    store *sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}
