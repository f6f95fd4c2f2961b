/* All pairs, near pairs and rays, or rays: a choice by what both would cost. */
#include "solver/base/clock.h"
#include "solver/precompute/precompute_state.h"

#include <string.h>

/* Seconds of one thread that all pairs may take whatever the alternative takes; at high quality they are
 * worth more, as rays are far less accurate. Beyond, they may take this many times as long as the
 * alternative. */
static const double seconds_enough = 30, seconds_enough_high = 600, times_most = 3;

/* In a soup of triangles even near pairs stand in a crowd. Then rays alone are taken, MORE_RAYS times as
 * many, where these take less time: in a part of a town (12,541 triangles) 512 rays and near pairs left
 * indirect errors of .36 and .018 (single elements and random emission) after 13 s of one thread for one
 * sample, 2,048 rays alone as much after 9. */
enum { MORE_RAYS = 4 };

/* Where that takes less than these seconds of one thread, there are twice or four times as many rays: noise
 * falls with the root of them. */
static const double seconds_spent = 12;
enum { DOUBLED_MOST = 2 };

static lam_status cost_of(precompute_state *state, const recipe *r, pairs_cost *out, lam_error *error) {
    return pairs_forecast(&state->m, r, &state->progress, out, error);
}

/* The recipe in place of all pairs, and its cost. */
static lam_status find_other(precompute_state *state, recipe *other, pairs_cost *cost, lam_error *error) {
    lam_status status = LAM_OK;
    recipe plain = {.method = RECIPE_RAYS, .rays = MORE_RAYS * other->rays, .seed = other->seed};
    pairs_cost more;
    TRY(cost_of(state, other, cost, error));
    TRY(cost_of(state, &plain, &more, error));
    if (more.seconds < cost->seconds) {
        *other = plain;
        *cost = more;
    }
    for (int k = 0; k < DOUBLED_MOST; k++) {
        recipe finer = *other;
        finer.rays *= 2;
        TRY(cost_of(state, &finer, &more, error));
        if (more.seconds > seconds_spent) break;
        *other = finer;
        *cost = more;
    }
done:
    return status;
}

lam_status state_weigh_pairs(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const bool high = strcmp(state->options->quality, "high") == 0;
    const double enough = high ? seconds_enough_high : seconds_enough;
    recipe other = state_near_recipe(state);
    pairs_cost all, some;
    char all_time[32], other_time[32], what[64];
    if (state->options->from_store || state->recipe.method != RECIPE_PAIRS) return LAM_OK;
    TRY(cost_of(state, &state->recipe, &all, error));
    clock_format_seconds(all.seconds, all_time);
    state->cost = all;
    if (all.seconds <= enough || state->m.n <= other.rays) {
        terminal_log(state->t, "all pairs are taken: about %s of one thread, by a sample of them", all_time);
        goto done;
    }
    TRY(find_other(state, &other, &some, error));
    state->dear = all.seconds > times_most * some.seconds;
    clock_format_seconds(some.seconds, other_time);
    recipe_describe(&other, what);
    terminal_log(state->t, "%s taken: all pairs need about %s of one thread, by a sample of them, and %s %s",
                 state->dear ? "not all pairs are" : "all pairs are", all_time, what, other_time);
    if (state->dear) {
        state->cost = some;
        state->plain = other.method == RECIPE_RAYS;
        state->least_rays = other.rays;
    }
done:
    return status;
}
