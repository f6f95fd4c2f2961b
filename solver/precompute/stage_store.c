/* The store that a precompute writes, and its seal. */
#include "solver/precompute/stages.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static lam_status save_report(const precompute_job *job, const precompute_factors *factors,
                              const made_operator *made, const walked_light *walked, store *s,
                              lam_error *error) {
    lam_status status = LAM_OK;
    operator_description about;
    operator_describe(made->op, &about);
    TRY(store_set_text(s, STORE_OPERATOR, "method", made->built.method, error));
    TRY(store_set_text(s, STORE_OPERATOR, "reason", made->built.reason, error));
    TRY(report_save(&made->built, s, error));
    if (about.density >= 0) TRY(store_set_number(s, STORE_OPERATOR, "density", about.density, error));
    if (walked->light.n > 0) { /* there are no form factors */
        TRY(recipe_save_closure(job->options->closed, recipe_of_operator.group, s, error));
        goto done;
    }
    /* The recipe of the form factors, so that they can be made again where they are not kept. */
    TRY(recipe_save(&factors->f.recipe, &recipe_of_operator, s, error));
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

static lam_status save_importance(const precompute_job *job, const precompute_scene *scene, store *s,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    char *option = NULL, *sources = NULL;
    if (o->receivers != NULL) TRY(name_option("--receivers", o->receivers, &option, error));
    if (o->importance != NULL) TRY(name_option("--importance", o->importance, &option, error));
    if (o->sources != NULL) TRY(name_option("--sources", o->sources, &sources, error));
    TRY(importance_save(&scene->importance, option, sources, s, error));
done:
    free(option);
    free(sources);
    return status;
}

/* Without probes nothing was judged, but walks state their own errors. */
static lam_status save_errors(const precompute_scene *scene, const precompute_plan *plan,
                              const made_operator *made, const walked_light *walked, store *s,
                              lam_error *error) {
    const reuse_estimates *e = &walked->paths;
    stated_figures all = {.mesh = made->errors_of_mesh, .own = made->own};
    if (walked->light.n > 0)
        all.emitters = (emitter_figures){.s = e->n_positions,
                                         .n_groups = scene->m.n_groups,
                                         .covariance = e->covariance,
                                         .of_groups = e->of_groups,
                                         .of_means = e->of_means,
                                         .relative = walked->position_errors,
                                         .indirect = walked->position_errors + e->n_positions};
    if (plan->probes > 0 || walked->light.n > 0) {
        all.report = made->errors;
        all.repair = made->repair;
    }
    if (plan->probes > 0) all.by_group = made->by_group;
    return stated_figures_save(&all, s, error);
}

lam_status stage_store(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                       precompute_factors *factors, const made_operator *made, const walked_light *walked,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    store *s = NULL;
    TRY(store_create(o->output, &s, error));
    TRY(store_set_text(s, "/", "name", scene->m.name, error));
    TRY(store_set_text(s, "/", "tool", "lambert " LAMBERT_VERSION, error));
    TRY(store_set_text(s, "/", "command", o->command, error));
    TRY(store_set_integer(s, "/", "seed", (int64_t)o->seed, error));
    TRY(store_set_number(s, "/", "unit", scene->m.unit, error));
    TRY(mesh_save(&scene->m, factors->f.row_sums, s, error));
    if (o->reflectance >= 0) TRY(store_set_number(s, STORE_MESH, "reflectance_given", o->reflectance, error));
    TRY(terminal_check(error));
    if (o->keep_form_factors && factors->blocks.n > 0) {
        TRY(form_factors_save_blocks(&factors->f, &factors->blocks, s, error));
    } else if (o->keep_form_factors) {
        if (scene->m.n > FORM_FACTORS_ROWS_MOST) TRY(form_factors_gather(&factors->f, scene->m.area, error));
        TRY(form_factors_save(&factors->f, s, error));
    }
    if (!isnan(o->north)) factors->f.sky.north = o->north;
    if (factors->f.sky.first_bounce != NULL) TRY(sky_bounce_save(&factors->f.sky, s, error));
    TRY(luminaires_save(&scene->luminaires, &scene->m, s, error));
    TRY(scene_sensors_save(scene, s, error));
    TRY(terminal_check(error));
    TRY(operator_save(made->op, s, error));
    if (scene->importance.n > 0) TRY(save_importance(job, scene, s, error));
    TRY(save_report(job, factors, made, walked, s, error));
    TRY(walked_save(walked, s, error));
    TRY(save_errors(scene, plan, made, walked, s, error));
    TRY(terminal_check(error));
    store *sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}
