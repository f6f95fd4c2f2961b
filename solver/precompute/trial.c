/* The laws by which a trial turns its knobs: the squares of compression C and form factors F add up to that
 * of the whole error; C falls as epsilon^.6, or as measured, and F as the source of the form factors says. */
#include "solver/precompute/trial.h"

#include "solver/formfactor/source.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Of the error asked for: the laws are no exact ones. */
static const double aimed_share = .9;
static const double power_of_epsilon = .6, power_least = .2;

const error_group *trial_group(const error_report *errors) {
    return errors->lights.probes > 0 ? &errors->lights : &errors->random;
}

static trial_errors parts_of(double total, double compression, bool by_noise) {
    return (trial_errors){.total = total,
                          .compression = compression,
                          .factors = sqrt(fmax(total * total - compression * compression, 0)),
                          .by_noise = by_noise};
}

trial_errors trial_errors_of(const error_group *g, bool by_noise) {
    return parts_of(judge_total(g), judge_of_operator(g), by_noise);
}

trial_goal trial_goal_of_group(double asked, const worst_group *worst, bool by_noise) {
    return (trial_goal){.asked = asked, .errors = parts_of(worst->total, worst->of_operator, by_noise)};
}

double trial_power(double epsilon, double compression, double epsilon_before, double compression_before) {
    if (!(epsilon < epsilon_before) || !(compression > 0) || !(compression_before > 0)) return 0;
    const double power = log(compression / compression_before) / log(epsilon / epsilon_before);
    return fmin(fmax(power, power_least), power_of_epsilon);
}

double trial_excess(const trial_goal *g) {
    return g->asked > 0 ? g->errors.total / g->asked : 0;
}

void trial_describe_worst(const worst_group *worst, const char *name, char text[TRIAL_WORST_TEXT]) {
    const char *light = worst->figure == GROUP_UNIFORM ? "random emission"
                        : worst->figure == GROUP_NEAR  ? "single elements that light it most"
                                                       : "single elements that light it little";
    snprintf(text, TRIAL_WORST_TEXT, "the mean of %.60s by %s", name, light);
}

static bool finer_recipe(const trial_limits *limits, double error, double wanted, recipe *r) {
    const recipe before = *r;
    const factor_knobs knobs = {.rays = limits->rays, .accuracy = limits->accuracy, .finest = limits->finest};
    if (!(wanted < error)) return false;
    recipe_source(r)->finer(r, error, wanted, &knobs);
    return recipes_differ(&before, r);
}

static bool finer_epsilon(const trial_limits *limits, double error, double wanted, double *epsilon) {
    if (limits->fixed_epsilon || !(wanted < error)) return false;
    *epsilon *= source_turn(error, wanted, limits->power > 0 ? limits->power : power_of_epsilon);
    return true;
}

/* The size that one part of the error may have where the other one is `other` and stays. */
static double rest_of(double wanted, double other) {
    return fmax(sqrt(fmax(wanted * wanted - other * other, 0)), other / 2);
}

bool trial_turn(double asked, const trial_errors *errors, const trial_limits *limits, const trial_knobs *from,
                trial_knobs *next) {
    const double aimed = limits->aimed_share > 0 ? limits->aimed_share : aimed_share;
    const double wanted = aimed * asked, half = wanted * sqrt(.5);
    const double C = errors->compression, F = errors->factors;
    *next = *from;
    /* Compression then follows the rays. */
    if (errors->by_noise) return finer_recipe(limits, errors->total, wanted, &next->recipe);
    const bool both = fmin(C, F) > half;
    const double wanted_F = both ? half : C > F ? F : rest_of(wanted, C);
    const bool turned = finer_recipe(limits, F, wanted_F, &next->recipe);
    const double wanted_C = both && turned ? half : F >= C && turned ? C : rest_of(wanted, F);
    return finer_epsilon(limits, C, wanted_C, &next->epsilon) || turned;
}

void trial_describe(const trial_knobs *from, const trial_knobs *to, char text[TRIAL_TEXT]) {
    char epsilon[64] = "", rays[48] = "", accuracy[64] = "";
    const bool turned = to->epsilon != from->epsilon;
    if (turned)
        snprintf(epsilon, sizeof epsilon, "coefficients for --epsilon %.2g in place of %.2g", to->epsilon,
                 from->epsilon);
    if (to->recipe.rays != from->recipe.rays)
        snprintf(rays, sizeof rays, "%s%zu rays in place of %zu", turned ? ", " : "", to->recipe.rays,
                 from->recipe.rays);
    if (to->recipe.accuracy != from->recipe.accuracy)
        snprintf(accuracy, sizeof accuracy, "%s%s to %.2g in place of %.2g", turned ? ", " : "",
                 recipe_can(&to->recipe, SOURCE_BLOCKS) ? "blocks" : "pairs", to->recipe.accuracy,
                 from->recipe.accuracy);
    snprintf(text, TRIAL_TEXT, "%s%s%s", epsilon, rays, accuracy);
}
