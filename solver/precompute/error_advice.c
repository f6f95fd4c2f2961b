/* One line names the stated error that is too large and the option that lowers it: --epsilon where
 * compression is more than half of the squared error, else what the source of the form factors advises. */
#include "solver/precompute/error_advice.h"

#include "solver/formfactor/source.h"
#include "solver/precompute/forecast/forecast.h"
#include "solver/precompute/trial.h"

#include <math.h>
#include <stdio.h>

const double error_advice_most = .03;
const double error_advice_sky_large = .1;

/* A scene of which more of the light leaves has no windows, or, where the error is large, is outdoors. */
#define WINDOWS_SHARE .1
#define OPEN_SHARE .5

/* Of the squared error, the share from which on compression is the larger part. */
static const double compression_share = .5;

/* The largest number of one digit that is not above x > 0. */
static double one_digit(double x) {
    const double unit = pow(10, floor(log10(x) + 1e-9));
    return floor(x / unit + 1e-9) * unit;
}

static bool is_compressed(double of_operator, double error) {
    return of_operator * of_operator > compression_share * error * error;
}

static void advise(const error_advice_input *input, double error, double of_operator, double most,
                   char option[64]) {
    const recipe *r = &input->recipe;
    const bool compressed = is_compressed(of_operator, error), follows = recipe_can(r, SOURCE_BY_EPSILON);
    char memory[32];
    forecast_format_bytes(input->lacking, memory);
    if (input->lacking > 0)
        snprintf(option, 64, "--memory %s", memory);
    else if (follows ? compressed || !input->spent : compressed && !input->by_noise)
        snprintf(option, 64, "--epsilon %g", one_digit(input->epsilon * most / error));
    else
        recipe_source(r)->advise(r, error, most, input->finest || input->spent, option);
}

/* True where --group-error is missed, and --epsilon by no more. */
static bool advise_group(const error_advice_input *input, double excess, char text[ERROR_ADVICE_BYTES]) {
    const worst_group *w = input->worst;
    char what[TRIAL_WORST_TEXT], option[64];
    if (!(input->group_asked > 0) || !(w->total > input->group_asked) ||
        excess > w->total / input->group_asked)
        return false;
    if (input->trials_left > 0)
        snprintf(option, sizeof option, "--trials %zu", input->trials_left);
    else if (input->other_method != NULL && is_compressed(w->of_operator, w->total))
        snprintf(option, sizeof option, "--method %s", input->other_method);
    else
        advise(input, w->total, w->of_operator, input->group_asked, option);
    trial_describe_worst(w, input->worst_name, what);
    snprintf(text, ERROR_ADVICE_BYTES,
             "the error of %s is stated as %.2g, above %g of --group-error; %s%s would lower it", what,
             w->total, input->group_asked, input->from_store ? "the scene precomputed with " : "", option);
    return true;
}

void error_advice(const error_advice_input *input, char text[ERROR_ADVICE_BYTES]) {
    const error_report *e = input->errors;
    const double most = input->asked > 0 ? input->asked : error_advice_most;
    const bool lights =
        e->lights.probes > 0 && (input->asked > 0 || !(judge_total(&e->lights) < judge_total(&e->random)));
    const error_group *g = lights ? &e->lights : &e->random;
    char option[64];
    text[0] = '\0';
    if (!e->has_total) return;
    if (!input->overlapping &&
        advise_group(input, input->asked > 0 ? judge_total(g) / input->asked : 0, text))
        return;
    if (!(judge_total(g) > most)) return;
    if (input->overlapping) {
        snprintf(
            text, ERROR_ADVICE_BYTES,
            "the indirect error of %s is stated as %.2g, above %g%s: most of it is that faces overlap or "
            "coincide, and no option lowers it; mend the scene",
            lights ? "the scene's own lights" : "random emission", judge_total(g), most,
            input->asked > 0 ? " of --epsilon" : "");
        return;
    }
    advise(input, judge_total(g), judge_of_operator(g), most, option);
    snprintf(text, ERROR_ADVICE_BYTES,
             "the indirect error of %s is stated as %.2g, above %g%s; %s%s would lower it",
             lights ? "the scene's own lights" : "random emission", judge_total(g), most,
             input->asked > 0 ? " of --epsilon" : "", input->from_store ? "the scene precomputed with " : "",
             option);
}

void error_advice_sky(const error_advice_input *input, double leaving_share, size_t n_aimed,
                      char text[ERROR_ADVICE_BYTES]) {
    const error_report *e = input->errors;
    const double error = e->sky.total_relative.mean;
    const bool large = error > error_advice_sky_large;
    char option[160] = "more --rays lower it";
    text[0] = '\0';
    if (!e->has_total || e->sky.probes == 0 || leaving_share > (large ? OPEN_SHARE : WINDOWS_SHARE)) return;
    if (!(error > error_advice_most)) return;
    if (n_aimed == 0)
        snprintf(option, sizeof option,
                 "no window was found: --portal GROUP names faces that stand in one; or take more --rays");
    else if (large)
        snprintf(option, sizeof option,
                 "%zu opening%s found: --portal GROUP names faces that stand in each; or take more --rays",
                 n_aimed, n_aimed == 1 ? " was" : "s were");
    snprintf(text, ERROR_ADVICE_BYTES, "the error of light from the sky is stated as %.2g, above %g; %s",
             error, large ? error_advice_sky_large : error_advice_most, option);
}
