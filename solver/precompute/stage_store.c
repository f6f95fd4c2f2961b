/* The store that a precompute writes, and its seal. */
#include "solver/precompute/precompute_state.h"
#include "store/groups.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static lam_status save_report(const precompute_state *state, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    operator_description about;
    operator_describe(state->op, &about);
    TRY(store_set_text(s, STORE_OPERATOR, "method", state->built.method, error));
    TRY(store_set_text(s, STORE_OPERATOR, "reason", state->built.reason, error));
    TRY(report_save(&state->built, s, error));
    if (about.density >= 0) TRY(store_set_number(s, STORE_OPERATOR, "density", about.density, error));
    if (state->light.n > 0) { /* there are no form factors */
        TRY(recipe_save_closure(state->options->closed, recipe_of_operator.group, s, error));
        goto done;
    }
    /* The recipe of the form factors, so that they can be made again where they are not kept. */
    TRY(recipe_save(&state->f.recipe, &recipe_of_operator, s, error));
done:
    return status;
}

/* *out: "OPTION VALUE", freed with free(). */
static lam_status name_option(const char *name, const char *value, char **out, lam_error *error) {
    const size_t length = strlen(name) + strlen(value) + 2;
    *out = memory_allocate(length, 1, "store", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    snprintf(*out, length, "%s %s", name, value);
    return LAM_OK;
}

static lam_status save_importance(const precompute_state *state, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    char *option = NULL, *sources = NULL;
    if (o->receivers != NULL) TRY(name_option("--receivers", o->receivers, &option, error));
    if (o->importance != NULL) TRY(name_option("--importance", o->importance, &option, error));
    if (o->sources != NULL) TRY(name_option("--sources", o->sources, &sources, error));
    TRY(importance_save(&state->importance, option, sources, s, error));
done:
    free(option);
    free(sources);
    return status;
}

/* Without probes nothing was judged, but walks state their own errors. */
static lam_status save_errors(const precompute_state *state, store *s, lam_error *error) {
    const reuse_estimates *e = &state->paths;
    stated_figures all = {.mesh = state->errors_of_mesh};
    if (state->light.n > 0)
        all.emitters = (emitter_figures){.s = e->n_positions,
                                         .n_groups = state->m.n_groups,
                                         .covariance = e->covariance,
                                         .of_groups = e->of_groups,
                                         .of_means = e->of_means,
                                         .relative = state->position_errors,
                                         .indirect = state->position_errors + e->n_positions};
    if (state->probes > 0 || state->light.n > 0) {
        all.report = state->errors;
        all.repair = state->repair;
    }
    if (state->probes > 0) all.by_group = state->by_group;
    return stated_figures_save(&all, s, error);
}

lam_status stage_store(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    store *s = NULL;
    TRY(store_create(o->output, &s, error));
    TRY(store_set_text(s, "/", "name", state->m.name, error));
    TRY(store_set_text(s, "/", "tool", "lambert " LAMBERT_VERSION, error));
    TRY(store_set_text(s, "/", "command", o->command, error));
    TRY(store_set_integer(s, "/", "seed", (int64_t)o->seed, error));
    TRY(store_set_number(s, "/", "unit", state->m.unit, error));
    TRY(mesh_save(&state->m, state->f.row_sums, s, error));
    if (o->reflectance >= 0) TRY(store_set_number(s, STORE_MESH, "reflectance_given", o->reflectance, error));
    TRY(terminal_check(error));
    if (state_keeps(o) && state->blocks.n > 0) {
        TRY(form_factors_save_blocks(&state->f, &state->blocks, s, error));
    } else if (state_keeps(o)) {
        if (state->m.n > FORM_FACTORS_ROWS_MOST) TRY(form_factors_gather(&state->f, state->m.area, error));
        TRY(form_factors_save(&state->f, s, error));
    }
    if (state->f.sky.first_bounce != NULL) TRY(sky_bounce_save(&state->f.sky, s, error));
    TRY(terminal_check(error));
    TRY(operator_save(state->op, s, error));
    if (state->importance.n > 0) TRY(save_importance(state, s, error));
    TRY(save_report(state, s, error));
    TRY(state_save_positions(state, s, error));
    TRY(save_errors(state, s, error));
    TRY(terminal_check(error));
    store *sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}
