/* All pairs, near pairs and rays, or rays alone: a choice by what each would cost. */
#include "solver/base/clock.h"
#include "solver/precompute/plan.h"

/* Seconds of one thread that all pairs may take whatever the alternative takes; at high quality they are
 * worth more, as rays are far less accurate. Beyond, they may take this many times as long as the
 * alternative. A canopy of 4,000 elements, forecast at 18 s, is off by .063 and .0054 by all pairs in 81
 * processor s, judge included, and by .058 and .0071 by rays in 19, as the operator errs more than either.
 * Pairs that are no finer than the operator needs are worth less, as rays then leave no more error, and as
 * the judge takes twice as long again for pairs but half for rays: a canopy of 2,500 elements is off by .0574
 * of single elements, .0063 of random emission and .0112 of groups by 8,192 rays in 14 s of a processor,
 * judge included, and by .0708, .0066 and .0126 by pairs in 53, forecast at 7.6. */
static const double seconds_enough = 16, seconds_enough_high = 600, times_most = 2;
static const double seconds_enough_coarse = 2, times_most_coarse = 1.25, times_most_rays = .5;

/* In a soup of triangles even near pairs stand in a crowd. Then rays alone are taken, MORE_RAYS times as
 * many, where these take less time: in a part of a town (12,541 triangles) 512 rays and near pairs left
 * indirect errors of .36 and .018 (single elements and random emission) after 13 s of one thread for one
 * sample, 2,048 rays alone as much after 9. */
enum { MORE_RAYS = 4 };

/* Where that takes less than these seconds of one thread, there are twice or four times as many rays: noise
 * falls with the root of them. */
static const double seconds_spent = 12;
enum { DOUBLED_MOST = 2 };

/* Where there are too many elements for all pairs anyway: 1,024 rays alone leave a bright triangle no more
 * error than near pairs beside 512 (in a part of a town .21 and .23); random emission is then off by .017 in
 * a town of 36,267 triangles. */
enum { MORE_RAYS_OF_MANY = 2 };

/* Rays alone in place of near pairs beside fewer rays, where they cost less. */
static lam_status find_cheaper(const precompute_job *job, precompute_scene *scene, recipe *other,
                               factor_cost *cost, lam_error *error) {
    lam_status status = LAM_OK;
    recipe many = *other;
    factor_cost more;
    many.source = &source_rays;
    many.rays *= MORE_RAYS;
    many.accuracy = 0;
    TRY(plan_sample(job, scene, other, cost, error));
    TRY(plan_sample(job, scene, &many, &more, error));
    if (more.seconds >= cost->seconds) goto done;
    *other = many;
    *cost = more;
done:
    return status;
}

static bool fits(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                 const recipe *r) {
    precompute_plan other = *plan;
    other.recipe = *r;
    return plan_fits(job, scene, &other, (double)scene->m.n);
}

/* Twice or four times the rays, while they cost little. */
static lam_status spend_more(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                             recipe *other, factor_cost *cost, lam_error *error) {
    lam_status status = LAM_OK;
    for (int k = 0; k < DOUBLED_MOST; k++) {
        factor_cost more;
        recipe finer = *other;
        finer.rays *= 2;
        TRY(plan_sample(job, scene, &finer, &more, error));
        if (more.seconds > seconds_spent || !fits(job, scene, plan, &finer)) break;
        *other = finer;
        *cost = more;
    }
done:
    return status;
}

/* Near pairs, which are the plan so far, against rays alone. */
static lam_status weigh_near_pairs(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    const recipe near = plan->recipe;
    recipe many = near;
    factor_cost of_many;
    char near_time[32], many_time[32], what[64];
    many.source = &source_rays;
    many.rays *= MORE_RAYS_OF_MANY;
    many.accuracy = 0;
    TRY(plan_sample(job, scene, &near, &plan->cost, error));
    TRY(plan_sample(job, scene, &many, &of_many, error));
    if (of_many.seconds >= plan->cost.seconds || !fits(job, scene, plan, &many)) goto done;
    clock_format_seconds(plan->cost.seconds, near_time);
    clock_format_seconds(of_many.seconds, many_time);
    recipe_describe(&many, what);
    plan_explain(plan,
                 "near pairs are not taken: they and %zu rays need about %s of one thread, by a sample of "
                 "them, and %s %s",
                 near.rays, near_time, what, many_time);
    plan->cost = of_many;
    plan->weighed = (pairs_weighed){.too_slow = true, .rays_alone = true, .least_rays = many.rays};
done:
    return status;
}

/* All pairs, which are the plan so far, against the cheapest of the others. */
static lam_status weigh_all_pairs(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const bool high = job->options->quality == QUALITY_HIGH;
    const bool coarse = plan_pairs_follow_epsilon(job, plan->method);
    const double enough = high ? seconds_enough_high : coarse ? seconds_enough_coarse : seconds_enough;
    recipe other = plan_near_recipe(job, plan);
    factor_cost all, some;
    char all_time[32], other_time[32], what[64];
    TRY(plan_sample(job, scene, &plan->recipe, &all, error));
    clock_format_seconds(all.seconds, all_time);
    plan->cost = all;
    if (all.seconds <= enough || scene->m.n <= other.rays) {
        plan_explain(plan, "all pairs are taken: about %s of one thread, by a sample of them", all_time);
        goto done;
    }
    TRY(find_cheaper(job, scene, &other, &some, error));
    TRY(spend_more(job, scene, plan, &other, &some, error));
    const bool rays = recipe_source(&other) == &source_rays;
    const double most = !coarse ? times_most : rays ? times_most_rays : times_most_coarse;
    const bool too_slow = all.seconds > most * some.seconds;
    clock_format_seconds(some.seconds, other_time);
    recipe_describe(&other, what);
    plan_explain(plan, "%s taken: all pairs need about %s of one thread, by a sample of them, and %s %s",
                 too_slow ? "not all pairs are" : "all pairs are", all_time, what, other_time);
    if (!too_slow) goto done;
    plan->cost = some;
    plan->weighed = (pairs_weighed){
        .too_slow = true, .rays_alone = recipe_source(&other) == &source_rays, .least_rays = other.rays};
done:
    return status;
}

lam_status plan_weigh_pairs(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                            lam_error *error) {
    const factor_source *const source = recipe_source(&plan->recipe);
    if (job->options->from_store) return LAM_OK;
    if (source == &source_near_pairs) return weigh_near_pairs(job, scene, plan, error);
    if (source == &source_pairs) return weigh_all_pairs(job, scene, plan, error);
    return LAM_OK;
}

lam_status plan_weigh_rows(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                           lam_error *error) {
    lam_status status = LAM_OK;
    if (plan->cost.seconds > 0) return LAM_OK;
    TRY(plan_weigh_pairs(job, scene, plan, error));
    if (plan->weighed.too_slow) TRY(plan_rows(job, scene, (double)scene->m.n, plan, error));
done:
    return status;
}
