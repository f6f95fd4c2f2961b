/* Form factors by blocks of clusters: the choice of them by what they cost, and the stage that finds them. */
#include "solver/base/clock.h"
#include "solver/precompute/precompute_state.h"

#include <string.h>

/* Blocks may take this many times as long as rays: in rooms they leave a third of the error of rays, or less.
 * All pairs have as small an error. */
static const double times_rays = 1.5;
/* Seconds of one thread that blocks take without asking what all pairs do, which is dear to tell: in eight
 * scenes of 1,498 to 2,030 elements programs took .3 to .8 of their time by pairs, for .3 to 1.2 times the
 * error of single elements. */
static const double seconds_enough = 2;
/* With fewer elements all methods are weighed by rows that cost little. */
enum { ELEMENTS_LEAST = 1025 };

bool state_may_have_blocks(const precompute_state *state, double n) {
    const precompute_options *o = state->options;
    const bool asked = o->form_factors == FACTORS_BLOCKS;
    if (o->from_store || state->holds || !(asked || o->form_factors == FACTORS_AUTO)) return false;
    if (asked) return true;
    return o->scratch == NULL && o->emitters == NULL && o->rays == OPTION_AUTO &&
           o->quality != QUALITY_DRAFT && n >= ELEMENTS_LEAST;
}

static lam_status make_tree(precompute_state *state, lam_error *error) {
    return state->tree.n > 0 ? LAM_OK : form_factors_tree(&state->m, &state->tree, error);
}

/* Blocks of large planes, or of clusters of several planes where nothing hides anything. */
static bool is_possible(const precompute_state *state) {
    return blocks_are_planar(&state->tree) || state->tree.view == PLANE_VIEW_UNHIDDEN;
}

/* Refuses options that --form-factors blocks cannot be given together with. */
static lam_status check_asked(const precompute_state *state, const build_method *method, bool final,
                              bool possible, lam_error *error) {
    const precompute_options *o = state->options;
    const char *other = NULL;
    if (o->scratch != NULL) other = "--scratch";
    if (o->emitters != NULL) other = "--emitters";
    if (other != NULL)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--form-factors blocks: cannot be given together with %s, which needs rows; give "
                           "--form-factors rays",
                           other);
    if (final && strcmp(o->build.method, "auto") != 0 && !(method->flags & METHOD_BLOCKS))
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--form-factors blocks: --method %s needs rows; give --form-factors rays",
                           method->name);
    if (!possible && state->tree.n_frames > BLOCK_PLANES_MOST)
        return status_fail(
            error, LAM_ERR_ARGUMENT,
            "--form-factors blocks: the elements lie in %zu planes, at most %d are possible; give "
            "--form-factors rays",
            state->tree.n_frames, BLOCK_PLANES_MOST);
    return LAM_OK;
}

const build_method *state_method_of_blocks(void) {
    size_t k = 0;
    while (method_at(k) != NULL && !(method_at(k)->flags & METHOD_BLOCKS)) k++;
    return method_at(k);
}

lam_status state_blocks_possible(precompute_state *state, const build_method *method, bool *possible,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    const bool asked = o->form_factors == FACTORS_BLOCKS;
    *possible = false;
    if (!asked && state->m.n < ELEMENTS_LEAST) goto done;
    TRY(make_tree(state, error));
    *possible = is_possible(state);
    if (!asked) goto done;
    TRY(check_asked(state, method, true, *possible, error));
    *possible = true;
done:
    return status;
}

/* The cost of the recipe so far, which is not blocks. Rays alone are enough to know where these cost more
 * than blocks. */
static lam_status find_other_cost(precompute_state *state, const factor_cost *blocks, factor_cost *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const recipe rays = {.source = &source_rays, .rays = state->recipe.rays};
    *out = state->cost;
    if (out->seconds > 0) return LAM_OK;
    if (recipe_source(&state->recipe) != &source_pairs) TRY(state_sample(state, &rays, out, error));
    if (out->seconds < blocks->seconds) TRY(state_sample(state, &state->recipe, out, error));
done:
    return status;
}

/* The rays that a sky takes beside blocks; a forecast counts those of any blocks. */
static lam_status add_sky(precompute_state *state, const recipe *blocks, factor_cost *cost,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const recipe rays = {.source = &source_rays, .rays = blocks->rays};
    factor_cost of_rays;
    if (state->options->sky == NULL) return LAM_OK;
    TRY(state_sample(state, &rays, &of_rays, error));
    cost->seconds += of_rays.seconds;
done:
    return status;
}

lam_status state_sample(precompute_state *state, const recipe *r, factor_cost *cost, lam_error *error) {
    const factor_work work = {.m = &state->m,
                              .progress = &state->progress,
                              .tree = &state->tree,
                              .ready = &state->ready,
                              .importance = &state->importance};
    return recipe_source(r)->sample(&work, r, cost, error);
}

void state_forget_ready(precompute_state *state) {
    block_scene_destroy(state->ready);
    state->ready = NULL;
}

/* Weighs blocks, which take `cost`, against the recipe so far, by samples of both; logs why. */
static lam_status weigh_against_rows(precompute_state *state, const factor_cost *cost, bool *taken,
                                     lam_error *error) {
    lam_status status = LAM_OK;
    const recipe *other = &state->recipe;
    factor_cost least;
    char time[32], other_time[32], what[64];
    if (recipe_source(other) == &source_pairs) TRY(state_weigh_rows(state, error));
    TRY(find_other_cost(state, cost, &least, error));
    *taken = cost->seconds <= (recipe_source(other) == &source_pairs ? 1 : times_rays) * least.seconds;
    clock_format_seconds(cost->seconds, time);
    clock_format_seconds(least.seconds, other_time);
    recipe_describe(other, what);
    terminal_log(state->t, "blocks of clusters are %s: about %s of one thread, by a sample of them; %s: %s",
                 *taken ? "taken instead" : "not taken", time, what, other_time);
done:
    return status;
}

/* Weighs blocks against the recipe so far, unless they take next to nothing. */
static lam_status weigh(precompute_state *state, const recipe *blocks, bool *taken, lam_error *error) {
    lam_status status = LAM_OK;
    const bool high = state->options->quality == QUALITY_HIGH;
    factor_cost cost;
    char time[32];
    TRY(state_sample(state, blocks, &cost, error));
    TRY(add_sky(state, blocks, &cost, error));
    *taken = recipe_source(&state->recipe) == &source_pairs && !high && cost.seconds <= seconds_enough;
    clock_format_seconds(cost.seconds, time);
    if (*taken)
        terminal_log(state->t, "blocks of clusters are taken: about %s of one thread, by a sample of them",
                     time);
    else
        TRY(weigh_against_rows(state, &cost, taken, error));
    if (*taken)
        state->cost = cost;
    else
        state_forget_ready(state);
done:
    return status;
}

lam_status state_choose_blocks(precompute_state *state, const build_method *method, bool final,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    const bool asked = o->form_factors == FACTORS_BLOCKS, able = (method->flags & METHOD_BLOCKS) != 0;
    const build_method *built = able ? method : state_method_of_blocks();
    if (!state_may_have_blocks(state, (double)state->m.n) || built == NULL) return LAM_OK;
    if (final && !able && !asked) return LAM_OK;
    TRY(make_tree(state, error));
    const bool possible = is_possible(state);
    if (asked) TRY(check_asked(state, method, final, possible, error));
    if (!asked && !possible) goto done;
    /* The rays of a sky are those that find its share beside pairs, too. */
    recipe blocks = {.source = &source_blocks,
                     .rays = o->sky != NULL ? state->recipe.rays : recipe_rays_beside_blocks(state->m.n),
                     .accuracy = built->block_accuracy(method_own_const(&o->build, built)),
                     .seed = o->seed};
    if (o->quality == QUALITY_HIGH) blocks.accuracy /= 4;
    bool taken = asked;
    const forecast f = state_forecast(state, (double)state->m.n);
    taken = taken || forecast_bytes(&f) > state->memory;
    if (!taken) TRY(weigh(state, &blocks, &taken, error));
    if (!taken) goto done;
    state->recipe = blocks;
    state->expected = built;
    state->streamed = state->large = false;
done:
    return status;
}

lam_status state_load_blocks(precompute_state *state, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    const bool named = strcmp(o->build.method, "auto") != 0;
    const char *asked = NULL;
    if (o->emitters != NULL) asked = "--emitters";
    if (named && !(state->expected->flags & METHOD_BLOCKS)) asked = state->expected->name;
    if (asked != NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: its form factors are blocks of clusters, and %s%s needs rows; precompute the scene with "
             "--form-factors rays",
             o->input, asked == state->expected->name ? "--method " : "", asked);
    if (!(state->expected->flags & METHOD_BLOCKS)) state->expected = state_method_of_blocks();
    TRY(form_factors_load_blocks(s, &state->m, &state->tree, &state->blocks, &state->f, error));
done:
    return status;
}

lam_status stage_blocks(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(make_tree(state, error));
    state->recipe.closure = state->options->closed;
    const form_factor_options how = {.recipe = state->recipe,
                                     .progress = &state->progress,
                                     .stage = "form factors",
                                     .ready = state->ready,
                                     .importance = state->importance.n > 0 ? &state->importance : NULL,
                                     .sky = state->options->sky,
                                     .openings = state->openings,
                                     .ground_albedo = state->options->ground_albedo};
    TRY(form_factors_make_blocks(&state->m, state->order, &state->tree, NULL, &how, &state->f, &state->blocks,
                                 error));
done:
    state_forget_ready(state);
    return status;
}

void state_log_blocks(const precompute_state *state) {
    const block_report *b = &state->f.blocks;
    const double all = .5 * (double)state->m.n * (double)(state->m.n - 1);
    if (state->blocks.n == 0) return;
    if (b->visits == 0) { /* of a store */
        terminal_log(state->t, "%zu blocks of %zu planes", state->blocks.n_blocks, state->tree.n_frames);
        return;
    }
    terminal_log(state->t,
                 "%zu blocks of %zu planes: %.3g linear, %.3g even, %.3g partly hidden, "
                 "%.3g pairs of elements, by %.3g segments and %.3g lines; "
                 "%.1f %% of all pairs face away, %.1f %% are plainly hidden",
                 state->blocks.n_blocks, state->tree.n_frames, (double)b->linear, b->even, (double)b->shaded,
                 (double)(b->pairs + b->shaded_pairs), b->segments, b->lines, 100 * b->elements_away / all,
                 100 * b->elements_hidden / all);
}
