/* The stage that finds form factors by the plan: rows, a stream of them, or blocks; and what it says of them.
 */
#include "solver/formfactor/facing.h"
#include "solver/precompute/stages.h"

#include <stdio.h>

void factors_log_kept(const precompute_job *job, size_t n, const form_factors *f) {
    if (f->rows_kept > 0)
        terminal_log(job->t, "%zu of %zu rows were in %s already", f->rows_kept, n, job->options->scratch);
}

static lam_status find_rows(const precompute_job *job, const precompute_scene *scene,
                            const precompute_plan *plan, precompute_factors *factors, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = plan->recipe,
                                     .progress = &job->progress,
                                     .stage = "form factors",
                                     .scratch = factors->scratch,
                                     .scratch_name = "form-factors.rows",
                                     .large = factors_place(plan, factors),
                                     .sky = job->options->sky,
                                     .openings = scene->openings,
                                     .ground_albedo = job->options->ground_albedo};
    TRY(form_factors_make(&scene->m, scene->order, &how, &factors->f, error));
    factors_log_kept(job, scene->m.n, &factors->f);
done:
    return status;
}

static lam_status begin_stream(const precompute_job *job, const precompute_scene *scene,
                               const precompute_plan *plan, precompute_factors *factors, lam_error *error) {
    const form_factor_options how = {.recipe = plan->recipe,
                                     .progress = &job->progress,
                                     .stage = "near pairs",
                                     .sky = job->options->sky,
                                     .openings = scene->openings,
                                     .ground_albedo = job->options->ground_albedo};
    const lam_status status = ray_rows_create(&scene->m, &how, &factors->rays, error);
    if (status == LAM_OK)
        ray_rows_stream(factors->rays, precompute_seed(job->options->seed, SEED_OTHER_ROWS),
                        &factors->stream);
    factors->f.recipe = plan->recipe;
    return status;
}

static lam_status find_blocks(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                              precompute_factors *factors, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(scene_make_tree(scene, error));
    const form_factor_options how = {.recipe = plan->recipe,
                                     .progress = &job->progress,
                                     .stage = "form factors",
                                     .ready = scene->ready,
                                     .importance = scene->importance.n > 0 ? &scene->importance : NULL,
                                     .sky = job->options->sky,
                                     .openings = scene->openings,
                                     .ground_albedo = job->options->ground_albedo};
    TRY(form_factors_make_blocks(&scene->m, scene->order, &scene->tree, NULL, &how, &factors->f,
                                 &factors->blocks, error));
done:
    scene_forget_ready(scene);
    return status;
}

lam_status stage_factors(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                         precompute_factors *factors, lam_error *error) {
    if (recipe_can(&plan->recipe, SOURCE_BLOCKS)) return find_blocks(job, scene, plan, factors, error);
    scene_forget_ready(scene);
    return plan->streamed ? begin_stream(job, scene, plan, factors, error)
                          : find_rows(job, scene, plan, factors, error);
}

const large_place *factors_place(const precompute_plan *plan, const precompute_factors *factors) {
    return plan->large ? scratch_place(factors->scratch) : NULL;
}

/* Above this share of leaving light the faces of a room are likely to look outward: a city of 500 elements
 * loses .71. */
static const double outward_share = .9;

/* Says why the scene counts as closed or open. */
static void log_closure(const precompute_job *job, const precompute_factors *factors) {
    const form_factors *f = &factors->f;
    const bool panes = f->outlet.panes_only, closed = f->closed || panes;
    const char *const way = panes ? "closed but for its panes" : closed ? "closed" : "open";
    const char *const other = closed ? "=no" : "";
    char why[96];
    if (job->options->from_store) return; /* it was decided and said when the form factors were made */
    if (f->recipe.closure != CLOSURE_MEASURED)
        snprintf(why, sizeof why, "as --closed%s says", closed ? "" : "=no");
    else if (!(f->leaving_share > 0))
        snprintf(why, sizeof why, "no ray leaves it");
    else if (closed)
        snprintf(why, sizeof why, "light leaves through cracks narrower than %.2g m", f->outlet.crack_width);
    else
        snprintf(why, sizeof why, "%.0f %% of the light that leaves passes gaps wider than %.2g m",
                 100 * f->outlet.openings, f->outlet.crack_width);
    if (f->recipe.closure != CLOSURE_MEASURED || !(f->leaving_share > 0))
        terminal_log(job->t, "the scene is %s: %s", way, why);
    else
        terminal_log(job->t, "the scene is %s: %s; --closed%s overrules that", way, why, other);
}

/* Above this, the part of the repair that no samples make is warned of. */
static const double repair_warned = .01;

static void warn_of_repair(const precompute_job *job, const precompute_factors *factors) {
    const form_factors *f = &factors->f;
    const double off = form_factors_repair_error(f);
    const char *const why =
        f->recipe.closure == CLOSURE_CLOSED && f->leaving_share > repair_warned
            ? "--closed gives back light that leaves through gaps, or some faces may coincide and "
              "count twice"
            : "some faces may coincide and count twice, or cut through each other";
    if (off > repair_warned)
        terminal_warn(
            job->t,
            "the form factors of an element add up to %.2g %% too much or too little on average, before "
            "the repair: %s; stated errors contain it",
            100 * off, why);
}

static void log_blocks(const precompute_job *job, const precompute_scene *scene,
                       const precompute_factors *factors) {
    const block_report *b = &factors->f.blocks;
    const double all = .5 * (double)scene->m.n * (double)(scene->m.n - 1);
    if (factors->blocks.n == 0) return;
    if (b->visits == 0) { /* of a store */
        terminal_log(job->t, "%zu blocks of %zu planes", factors->blocks.n_blocks, scene->tree.n_frames);
        return;
    }
    terminal_log(job->t,
                 "%zu blocks of %zu planes: %.3g linear, %.3g even, %.3g partly hidden, "
                 "%.3g pairs of elements, by %.3g segments and %.3g lines; "
                 "%.1f %% of all pairs face away, %.1f %% are plainly hidden",
                 factors->blocks.n_blocks, scene->tree.n_frames, (double)b->linear, b->even,
                 (double)b->shaded, (double)(b->pairs + b->shaded_pairs), b->segments, b->lines,
                 100 * b->elements_away / all, 100 * b->elements_hidden / all);
}

void factors_log(const precompute_job *job, const precompute_scene *scene,
                 const precompute_factors *factors) {
    const form_factors *f = &factors->f;
    char how[64];
    recipe_describe(&f->recipe, how);
    terminal_log(job->t,
                 "%s: %.2f %% leave the scene%s, %.2f %% meet back faces; row sums repaired by "
                 "%.2g on average, at most %.2g",
                 how, 100 * f->leaving_share, f->closed ? " (closed)" : "", 100 * f->absorbed_share,
                 f->repair_mean, f->repair_max);
    log_closure(job, factors);
    if (f->leaving_share > outward_share && !scene->m.two_sided)
        terminal_log(job->t, "nearly all light leaves the scene; if this is a room, its faces look outward: "
                             "turn them, --fix does it, or "
                             "give --two-sided");
    if (f->pairs.accuracy > recipe_accuracy(&f->recipe))
        terminal_log(job->t,
                     "many pairs are partly hidden: their factors have a standard error of %.2g, not %.2g; "
                     "--quality high casts more rays for them",
                     f->pairs.accuracy, recipe_accuracy(&f->recipe));
    if (f->pairs.facing > 0) {
        const double all = .5 * (double)scene->m.n * (double)(scene->m.n - 1), facing = f->pairs.facing;
        terminal_log(
            job->t,
            "%.1f %% of all pairs taken one by one; of those %.1f %% have nothing between them, "
            "%.1f %% are plainly open, %.1f %% plainly hidden, %.1f %% have few occluders, which are "
            "projected",
            100 * facing / all, 100 * f->pairs.certain / facing, 100 * f->pairs.open / facing,
            100 * f->pairs.hidden / facing, 100 * f->pairs.projected / facing);
    }
    log_blocks(job, scene, factors);
    warn_of_repair(job, factors);
    const sky_bounce *sky = &f->sky;
    char aimed[64] = "";
    if (f->n_aimed > 0)
        snprintf(aimed, sizeof aimed, "; rays are aimed at %zu opening%s", f->n_aimed,
                 f->n_aimed == 1 ? "" : "s");
    if (sky->first_bounce != NULL)
        terminal_log(job->t, "sky: %s, %zu tiles, ground albedo %g%s", sky->tiling.name, sky->tiling.n_tiles,
                     sky->ground_albedo, aimed);
    if (sky->first_bounce != NULL && f->closed && scene->m.glass == NULL)
        terminal_warn(job->t,
                      "the scene is closed: no element sees the sky; --portal GROUP takes away faces that "
                      "stand in a window");
}

/* Above this share of light that meets backs, faces are likely to be turned. */
static const double backs_share = .01;

/* Names the groups whose backs take light. */
lam_status factors_warn_of_backs(const precompute_job *job, const precompute_scene *scene,
                                 const precompute_factors *factors, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factors *f = &factors->f;
    const mesh *m = &scene->m;
    facing_survey survey = {.share = 0};
    char groups[256] = "";
    size_t used = 0, left = 0;
    if (!(f->absorbed_share > backs_share) || m->two_sided) return LAM_OK;
    TRY(facing_survey_make(m, &survey, error));
    for (size_t g = 0; g < m->n_groups; g++) left += survey.group_shares[g] > 0;
    for (int k = 0; k < 3 && left > 0; k++, left--) { /* the largest first */
        size_t most = 0;
        for (size_t g = 1; g < m->n_groups; g++)
            if (survey.group_shares[g] > survey.group_shares[most]) most = g;
        used += (size_t)snprintf(groups + used, sizeof groups - used, "%s%.60s %.1f %%", k == 0 ? "" : ", ",
                                 m->group_names[most], 100 * survey.group_shares[most]);
        survey.group_shares[most] = 0;
    }
    if (left > 0) snprintf(groups + used, sizeof groups - used, ", %zu more", left);
    terminal_warn(
        job->t,
        "%.1f %% of the light meets the backs of %zu faces or more and is lost there (%s): --orient turns "
        "faces where rays can decide it, and with --two-sided both sides reflect",
        100 * survey.share, survey.faces, groups);
done:
    facing_survey_free(&survey);
    return status;
}
