/* All pairs, near pairs and rays, or rays alone: a choice by what each would cost. */
#include "solver/base/clock.h"
#include "solver/precompute/precompute_state.h"

#include <string.h>

/* Seconds of one thread that all pairs may take whatever the alternative takes; at high quality they are
 * worth more, as rays are far less accurate. Beyond, they may take this many times as long as the
 * alternative. A canopy of 4,000 elements, forecast at 18 s, is off by .063 and .0054 by all pairs in 81
 * processor s, judge included, and by .058 and .0071 by rays in 19, as the operator errs more than either.
 * Pairs that are no finer than the operator needs are worth less: a city of 7,999 elements, forecast at 15 s,
 * is off by .0254 and .0025 by them in 51 s and by .0286 and .0023 by rays in 14. */
static const double seconds_enough = 16, seconds_enough_high = 600, times_most = 2;
static const double seconds_enough_coarse = 8, times_most_coarse = 1.25;

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
static lam_status find_cheaper(precompute_state *state, size_t more_rays, recipe *other, factor_cost *cost,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const recipe plain = {.source = &source_rays, .rays = more_rays * other->rays, .seed = other->seed};
    factor_cost more;
    TRY(state_sample(state, other, cost, error));
    TRY(state_sample(state, &plain, &more, error));
    if (more.seconds >= cost->seconds) goto done;
    *other = plain;
    *cost = more;
done:
    return status;
}

static bool fits(precompute_state *state, const recipe *r) {
    const recipe before = state->recipe;
    state->recipe = *r;
    const forecast f = state_forecast(state, (double)state->m.n);
    state->recipe = before;
    return forecast_bytes(&f) <= state->memory;
}

/* Twice or four times the rays, while they cost little. */
static lam_status spend_more(precompute_state *state, recipe *other, factor_cost *cost, lam_error *error) {
    lam_status status = LAM_OK;
    for (int k = 0; k < DOUBLED_MOST; k++) {
        factor_cost more;
        recipe finer = *other;
        finer.rays *= 2;
        TRY(state_sample(state, &finer, &more, error));
        if (more.seconds > seconds_spent || !fits(state, &finer)) break;
        *other = finer;
        *cost = more;
    }
done:
    return status;
}

/* Near pairs, which are the recipe so far, against rays alone. */
static lam_status weigh_near_pairs(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe near = state->recipe;
    const recipe plain = {.source = &source_rays, .rays = MORE_RAYS_OF_MANY * near.rays, .seed = near.seed};
    factor_cost of_plain;
    char near_time[32], plain_time[32], what[64];
    TRY(state_sample(state, &near, &state->cost, error));
    TRY(state_sample(state, &plain, &of_plain, error));
    if (of_plain.seconds >= state->cost.seconds || !fits(state, &plain)) goto done;
    clock_format_seconds(state->cost.seconds, near_time);
    clock_format_seconds(of_plain.seconds, plain_time);
    recipe_describe(&plain, what);
    terminal_log(
        state->t,
        "near pairs are not taken: they and %zu rays need about %s of one thread, by a sample of them, "
        "and %s %s",
        near.rays, near_time, what, plain_time);
    state->cost = of_plain;
    state->dear = state->plain = true;
    state->least_rays = plain.rays;
done:
    return status;
}

lam_status state_weigh_pairs(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const bool high = state->options->quality == QUALITY_HIGH;
    const bool coarse = state_pairs_follow_epsilon(state, state->expected);
    const double enough = high ? seconds_enough_high : coarse ? seconds_enough_coarse : seconds_enough;
    recipe other = state_near_recipe(state);
    factor_cost all, some;
    char all_time[32], other_time[32], what[64];
    if (state->options->from_store) return LAM_OK;
    if (recipe_source(&state->recipe) == &source_near_pairs) return weigh_near_pairs(state, error);
    if (recipe_source(&state->recipe) != &source_pairs) return LAM_OK;
    TRY(state_sample(state, &state->recipe, &all, error));
    clock_format_seconds(all.seconds, all_time);
    state->cost = all;
    if (all.seconds <= enough || state->m.n <= other.rays) {
        terminal_log(state->t, "all pairs are taken: about %s of one thread, by a sample of them", all_time);
        goto done;
    }
    TRY(find_cheaper(state, MORE_RAYS, &other, &some, error));
    TRY(spend_more(state, &other, &some, error));
    state->dear = all.seconds > (coarse ? times_most_coarse : times_most) * some.seconds;
    clock_format_seconds(some.seconds, other_time);
    recipe_describe(&other, what);
    terminal_log(state->t, "%s taken: all pairs need about %s of one thread, by a sample of them, and %s %s",
                 state->dear ? "not all pairs are" : "all pairs are", all_time, what, other_time);
    if (state->dear) {
        state->cost = some;
        state->plain = recipe_source(&other) == &source_rays;
        state->least_rays = other.rays;
    }
done:
    return status;
}
