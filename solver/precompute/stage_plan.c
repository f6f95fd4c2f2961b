/* The stage that settles how form factors are found, and what then is known of the run. */
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"

#include <string.h>

static void log_reason(terminal *t, const char *reason) {
    while (*reason != '\0') {
        const size_t length = strcspn(reason, "\n");
        terminal_log(t, "%.*s", (int)length, reason);
        reason += length + (reason[length] == '\n');
    }
}

lam_status stage_choose_plan(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    status = plan_choose(job, scene, plan, error);
    log_reason(job->t, plan->reason);
    TRY(status);
    if (recipe_can(&plan->recipe, SOURCE_BLOCKS) && scene->importance.n > 0 && o->keep_form_factors)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--keep-form-factors: blocks that are found for %s serve nothing else; leave out one of "
             "both, or give --form-factors rays",
             scene->importance.read != NULL ? "receivers" : "sources");
    if (o->emitters != NULL) {
        TRY(emitter_list_read(o->emitters, &scene->m, scene->sky_tiles, &scene->luminaires.placed,
                              &scene->emitters, error));
        TRY(plan_check_rows(job, scene, plan, error));
    }
    scene_log_mesh(job, scene);
done:
    return status;
}
