/* A store with its form factors as the input, and the folder where rows lie. */
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"
#include "solver/scene/import/picture_files.h"
#include "store/groups.h"

#include <stdlib.h>
#include <string.h>

/* Rows go to the scratch folder as they are found, and whole samples where memory is too small for them. */
static lam_status open_scratch(const precompute_job *job, precompute_factors *factors, lam_error *error) {
    if (factors->scratch != NULL) return LAM_OK;
    job->t->nothing = job->options->continues;
    return scratch_open(job->options->scratch, &factors->scratch, error);
}

/* A store has its rows: it needs the folder for the judge's only, or where memory is too small. */
lam_status stage_open_scratch(const precompute_job *job, const precompute_plan *plan,
                              precompute_factors *factors, lam_error *error) {
    const precompute_options *o = job->options;
    if (o->scratch == NULL) return LAM_OK;
    if (plan->probes > 0 || !o->from_store || plan->large) return open_scratch(job, factors, error);
    terminal_log(job->t, "a store with form factors does not use --scratch");
    return LAM_OK;
}

/* The blocks that a store keeps; refuses options that need rows. */
static lam_status load_blocks(const precompute_job *job, precompute_scene *scene, const build_method *method,
                              store *s, precompute_factors *factors, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const bool named = method_find(o->build.method) != NULL; /* not auto */
    const char *asked = NULL;
    if (o->emitters != NULL) asked = "--emitters";
    if (named && !(method->flags & METHOD_BLOCKS)) asked = method->name;
    if (asked != NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: its form factors are blocks of clusters, and %s%s needs rows; precompute the scene with "
             "--form-factors rays",
             o->input, asked == method->name ? "--method " : "", asked);
    TRY(form_factors_load_blocks(s, &scene->m, &scene->tree, &factors->blocks, &factors->f, error));
done:
    return status;
}

lam_status stage_load_store(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                            precompute_factors *factors, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    double *row_sums = NULL;
    form_factor_storage how = STORAGE_ROWS;
    TRY(store_open(job->options->input, &s, error));
    TRY(mesh_load(s, &scene->m, &row_sums, error));
    scene_take_lights(job, &scene->m);
    TRY(scene_load_luminaires(job, s, scene, error));
    TRY(scene_load_sensors(job, s, scene, error));
    TRY(scene_find_buried(job, scene, error));
    if (store_has(s, STORE_FORM_FACTORS)) {
        TRY(form_factors_storage(s, &how, error));
        TRY(recipe_load(s, &recipe_of_form_factors, &plan->recipe, error));
        TRY(plan_check_rows(job, scene, plan, error));
    }
    if (plan->large) TRY(open_scratch(job, factors, error));
    if (how == STORAGE_BLOCKS && !job->holds) {
        TRY(load_blocks(job, scene, plan->method, s, factors, error));
    } else {
        TRY(form_factors_load(s, &scene->m, factors_place(plan, factors), &factors->f, error));
        TRY(form_factors_expand(&factors->f, scene->m.area, error));
    }
    plan->recipe = factors->f.recipe;
    if (store_has(s, STORE_SKY)) TRY(sky_bounce_load(s, scene->m.n, &factors->f.sky, error));
    scene->sky_tiles = factors->f.sky.tiling.n_tiles;
    if (job->options->reflectance >= 0) mesh_pictures_drop(&scene->m);
    if (job->options->reflectance >= 0)
        for (size_t i = 0; i < scene->m.n * scene->m.n_channels; i++)
            scene->m.reflectance[i] = (float)job->options->reflectance;
done:
    free(row_sums);
    store_close(s);
    return status;
}
