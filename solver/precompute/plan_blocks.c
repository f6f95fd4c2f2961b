/* Form factors by blocks of clusters: whether they are possible, and cost less than rows. */
#include "solver/base/clock.h"
#include "solver/precompute/plan.h"

#include <string.h>

/* Blocks may take this many times as long as rays: in rooms they leave a third of the error of rays, or less.
 * All pairs have as small an error. */
static const double times_rays = 1.5;
/* Seconds of one thread that blocks take without asking what all pairs do, as a sample of these costs much:
 * in eight scenes of 1,498 to 2,030 elements programs took .3 to .8 of their time by pairs, for .3 to 1.2
 * times the error of single elements. */
static const double seconds_enough = 2;
/* With fewer elements all methods are weighed by rows that cost little. */
enum { ELEMENTS_LEAST = 1025 };

bool plan_may_have_blocks(const precompute_job *job, double n) {
    const precompute_options *o = job->options;
    const factor_source *const asked = source_asked(o->form_factors);
    if (o->from_store || job->holds || !(asked == NULL || asked == &source_blocks)) return false;
    if (asked != NULL) return true;
    return o->scratch == NULL && o->emitters == NULL && o->rays == OPTION_AUTO &&
           o->quality != QUALITY_DRAFT && n >= ELEMENTS_LEAST;
}

/* Blocks of large planes, or of clusters of several planes where nothing hides anything. */
static bool is_possible(const precompute_scene *scene) {
    const plane_tree *tree = &scene->tree;
    return blocks_are_planar(tree) || tree->view == PLANE_VIEW_UNHIDDEN;
}

/* Refuses options that --form-factors blocks cannot be given together with. */
static lam_status check_asked(const precompute_options *o, const build_method *method, bool final,
                              const precompute_scene *scene, lam_error *error) {
    const plane_tree *const tree = &scene->tree;
    const char *other = NULL;
    if (o->scratch != NULL) other = "--scratch";
    if (o->emitters != NULL) other = "--emitters";
    if (other != NULL)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--form-factors blocks: cannot be given together with %s, which needs rows; give "
                           "--form-factors rays",
                           other);
    if (final && method_find(o->build.method) != NULL && !(method->flags & METHOD_BLOCKS))
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--form-factors blocks: --method %s needs rows; give --form-factors rays",
                           method->name);
    if (!is_possible(scene) && tree->n_frames > BLOCK_PLANES_MOST)
        return status_fail(
            error, LAM_ERR_ARGUMENT,
            "--form-factors blocks: the elements lie in %zu planes, at most %d are possible; give "
            "--form-factors rays",
            tree->n_frames, BLOCK_PLANES_MOST);
    return LAM_OK;
}

const build_method *plan_method_of_blocks(void) {
    size_t k = 0;
    while (method_at(k) != NULL && !(method_at(k)->flags & METHOD_BLOCKS)) k++;
    return method_at(k);
}

lam_status plan_blocks_possible(const precompute_job *job, precompute_scene *scene,
                                const build_method *method, bool *possible, lam_error *error) {
    lam_status status = LAM_OK;
    const bool asked = source_asked(job->options->form_factors) == &source_blocks;
    *possible = false;
    if (!asked && scene->m.n < ELEMENTS_LEAST) goto done;
    TRY(scene_make_tree(scene, error));
    *possible = asked || is_possible(scene);
    if (asked) TRY(check_asked(job->options, method, true, scene, error));
done:
    return status;
}

/* The cost of the plan so far, which is not blocks. Rays alone are enough to know where these cost more than
 * blocks. */
static lam_status find_other_cost(const precompute_job *job, precompute_scene *scene,
                                  const precompute_plan *plan, const factor_cost *blocks, factor_cost *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const recipe rays = {.source = &source_rays, .rays = plan->recipe.rays};
    *out = plan->cost;
    if (out->seconds > 0) return LAM_OK;
    if (recipe_source(&plan->recipe) != &source_pairs) TRY(plan_sample(job, scene, &rays, out, error));
    if (out->seconds < blocks->seconds) TRY(plan_sample(job, scene, &plan->recipe, out, error));
done:
    return status;
}

/* The rays that a sky takes beside blocks; a forecast counts those of any blocks. */
static lam_status add_sky(const precompute_job *job, precompute_scene *scene, const recipe *blocks,
                          factor_cost *cost, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe rays = {.source = &source_rays, .rays = blocks->rays};
    factor_cost of_rays;
    if (job->options->sky == NULL) return LAM_OK;
    TRY(plan_sample(job, scene, &rays, &of_rays, error));
    cost->seconds += of_rays.seconds;
done:
    return status;
}

/* Weighs blocks, which take `cost`, against the plan so far, by samples of both. */
static lam_status weigh_against_rows(const precompute_job *job, precompute_scene *scene,
                                     const factor_cost *cost, precompute_plan *plan, bool *taken,
                                     lam_error *error) {
    lam_status status = LAM_OK;
    factor_cost least;
    char time[32], other_time[32], what[64];
    if (recipe_source(&plan->recipe) == &source_pairs) TRY(plan_weigh_rows(job, scene, plan, error));
    TRY(find_other_cost(job, scene, plan, cost, &least, error));
    const bool pairs = recipe_source(&plan->recipe) == &source_pairs;
    *taken = cost->seconds <= (pairs ? 1 : times_rays) * least.seconds;
    clock_format_seconds(cost->seconds, time);
    clock_format_seconds(least.seconds, other_time);
    recipe_describe(&plan->recipe, what);
    plan_explain(plan, "blocks of clusters are %s: about %s of one thread, by a sample of them; %s: %s",
                 *taken ? "taken instead" : "not taken", time, what, other_time);
done:
    return status;
}

/* Weighs blocks against the plan so far, unless they take next to nothing. */
static lam_status weigh(const precompute_job *job, precompute_scene *scene, const recipe *blocks,
                        precompute_plan *plan, factor_cost *cost, bool *taken, lam_error *error) {
    lam_status status = LAM_OK;
    const bool high = job->options->quality == QUALITY_HIGH;
    char time[32];
    TRY(plan_sample(job, scene, blocks, cost, error));
    TRY(add_sky(job, scene, blocks, cost, error));
    *taken = recipe_source(&plan->recipe) == &source_pairs && !high && cost->seconds <= seconds_enough;
    clock_format_seconds(cost->seconds, time);
    if (*taken)
        plan_explain(plan, "blocks of clusters are taken: about %s of one thread, by a sample of them", time);
    else
        TRY(weigh_against_rows(job, scene, cost, plan, taken, error));
    if (!*taken) scene_forget_ready(scene);
done:
    return status;
}

lam_status plan_weigh_blocks(const precompute_job *job, precompute_scene *scene, const build_method *method,
                             bool final, precompute_plan *plan, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const bool asked = source_asked(o->form_factors) == &source_blocks,
               able = (method->flags & METHOD_BLOCKS) != 0;
    const build_method *built = able ? method : plan_method_of_blocks();
    const double n = (double)scene->m.n;
    precompute_plan of_blocks;
    factor_cost cost = plan->cost;
    if (!plan_may_have_blocks(job, n) || built == NULL) return LAM_OK;
    if (final && !able && !asked) return LAM_OK;
    TRY(scene_make_tree(scene, error));
    if (asked) TRY(check_asked(o, method, final, scene, error));
    if (!asked && !is_possible(scene)) goto done;
    /* The rays of a sky are those that find its share beside pairs, too. */
    recipe blocks = {.source = &source_blocks,
                     .rays = o->sky != NULL ? plan->recipe.rays : recipe_rays_beside_blocks(scene->m.n),
                     .accuracy = built->block_accuracy(method_own_const(&o->build, built)),
                     .seed = o->seed,
                     .closure = o->closed};
    if (o->quality == QUALITY_HIGH) blocks.accuracy /= 4;
    const bool wanted = asked || !plan_fits(job, scene, plan, n);
    bool taken = wanted;
    if (!taken) TRY(weigh(job, scene, &blocks, plan, &cost, &taken, error));
    if (!taken) goto done;
    of_blocks = *plan;
    of_blocks.recipe = blocks;
    of_blocks.cost = cost;
    of_blocks.method = built;
    of_blocks.streamed = of_blocks.large = false;
    if (!wanted && !plan_fits(job, scene, &of_blocks, n)) {
        plan_explain(plan, "blocks of clusters are not taken: memory has room for rows alone");
        scene_forget_ready(scene);
    } else {
        *plan = of_blocks;
    }
done:
    return status;
}
