/* The laws of error that --time chooses by: e = e_0 (epsilon / .05)^.6 of blocks and of pairs, to which pairs
 * add their own error in squares, and e = 9 rays^-1/2 of rays. Among recipes in time the least error wins. */
#include "solver/precompute/budget.h"

#include "solver/formfactor/recipe.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* Epsilon of an operator from blocks or pairs, whose errors follow it. */
static const char *const epsilons[] = {"0.8",   "0.4",   "0.2",   "0.1",  "0.05",
                                       "0.025", "0.012", "0.006", "0.003"};
enum { EPSILONS = sizeof epsilons / sizeof *epsilons, PAIRS_FROM = 2 };

/* Errors of single elements: of the operator at epsilon .05 from blocks, and from pairs, whose form factors
 * have hardly any; their power of epsilon; of one ray. */
static const double error_of_blocks = .022, error_of_operator = .018, power = .6, error_of_ray = 9;
/* The error that pairs add, and its power of their accuracy. */
static const struct {
    factor_quality quality;
    double error;
} qualities[] = {{QUALITY_NORMAL, 1e-3}, {QUALITY_HIGH, 1e-4}};
enum { QUALITIES = sizeof qualities / sizeof *qualities };
static const double power_of_pairs = .65;

enum { RAYS_LEAST = 32, RAYS_MOST = 1 << 16 };
/* Of the noise of rays, sqrt(2 / rays): the operator's threshold is then that of the noise. */
static const double epsilon_of_noise = 2.7, epsilon_least = .003, epsilon_most = 1;

static double value_of(const char *epsilon) {
    double x = 0;
    (void)sscanf(epsilon, "%lf", &x);
    return x;
}

static double error_at(double error, const char *epsilon) {
    return error * pow(value_of(epsilon) / .05, power);
}

size_t budget_list(bool blocks, bool rays, bool pairs, uint64_t probes,
                   budget_recipe out[BUDGET_RECIPES_MOST]) {
    size_t count = 0;
    for (size_t k = 0; blocks && k < EPSILONS; k++) {
        budget_recipe *r = &out[count++];
        *r = (budget_recipe){.kind = BUDGET_BLOCKS, .probes = probes, .seconds = -1};
        snprintf(r->epsilon, sizeof r->epsilon, "%s", epsilons[k]);
        r->error = error_at(error_of_blocks, epsilons[k]);
    }
    for (uint64_t n = RAYS_LEAST; rays && n <= RAYS_MOST; n *= 2) {
        budget_recipe *r = &out[count++];
        const double noise = sqrt(2 / (double)n), epsilon = epsilon_of_noise * noise;
        *r = (budget_recipe){.kind = BUDGET_RAYS, .rays = n, .probes = probes, .seconds = -1};
        snprintf(r->epsilon, sizeof r->epsilon, "%.2g", fmin(fmax(epsilon, epsilon_least), epsilon_most));
        r->error = error_of_ray / sqrt((double)n);
    }
    for (size_t q = 0; pairs && q < QUALITIES; q++)
        for (size_t k = PAIRS_FROM; k < EPSILONS; k++) {
            budget_recipe *r = &out[count++];
            *r = (budget_recipe){
                .kind = BUDGET_PAIRS, .quality = qualities[q].quality, .probes = probes, .seconds = -1};
            snprintf(r->epsilon, sizeof r->epsilon, "%s", epsilons[k]);
            const double coarser = recipe_coarser(value_of(epsilons[k]));
            r->error = hypot(error_at(error_of_operator, epsilons[k]),
                             qualities[q].error * pow(coarser, power_of_pairs));
        }
    return count;
}

size_t budget_pick(const budget_recipe *list, size_t count, double seconds) {
    size_t best = count;
    for (size_t k = 0; k < count; k++) {
        if (list[k].seconds < 0 || list[k].seconds > seconds) continue;
        if (best == count || list[k].error < list[best].error ||
            (!(list[k].error > list[best].error) && list[k].probes > list[best].probes))
            best = k;
    }
    return best;
}

size_t budget_cheapest(const budget_recipe *list, size_t count) {
    size_t best = count;
    for (size_t k = 0; k < count; k++)
        if (list[k].seconds >= 0 && (best == count || list[k].seconds < list[best].seconds)) best = k;
    return best;
}

void budget_options(const budget_recipe *r, const char *method, bool probes, char text[BUDGET_TEXT]) {
    char of_rays[32] = "", quality[OPTION_WORD_BYTES + 16] = "", of_probes[32] = "", word[OPTION_WORD_BYTES];
    if (r->rays > 0) snprintf(of_rays, sizeof of_rays, " --rays %" PRIu64, r->rays);
    if (r->kind == BUDGET_PAIRS) {
        option_word(r->quality, precompute_quality_words, word);
        snprintf(quality, sizeof quality, " --quality %s", word);
    }
    if (probes) snprintf(of_probes, sizeof of_probes, " --probes %" PRIu64, r->probes);
    snprintf(text, BUDGET_TEXT, "--form-factors %s%s%s --method %s --epsilon %s --trials 1%s",
             r->kind == BUDGET_BLOCKS ? "blocks" : "rays", of_rays, quality, method, r->epsilon, of_probes);
}
