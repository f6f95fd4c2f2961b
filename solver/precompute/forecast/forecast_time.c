/* Seconds that form factors, the operator and the judge take. Bytes as text. */
#include "solver/formfactor/source.h"
#include "solver/method/judge/judge.h"
#include "solver/method/reference.h"
#include "solver/precompute/forecast/forecast.h"

#include <math.h>
#include <stdio.h>

static bool has_blocks(const forecast *f) {
    return recipe_can(&f->recipe, SOURCE_BLOCKS);
}

/* Of its rows. */
static double entries_of(double n, const recipe *r) {
    return recipe_source(r)->bytes(n, r) / 8;
}

static bool is_counted(const forecast *f) {
    return f->cost.measured > 0;
}

/* Of one sample by a recipe. entries: of the triangle, of f->recipe by its sample, or 0. */
static double sample_seconds(double n, const recipe *r, double entries, const forecast_rates *rates) {
    return recipe_source(r)->seconds(n, r, entries, rates->ray_seconds, rates->slowness);
}

/* Blocks that a sample found, or those of a law. */
static double blocks_of(const forecast *f, const recipe *r) {
    const double n = (double)f->n;
    const factor_source *const own = recipe_source(&f->recipe), *const source = recipe_source(r);
    const double law = source->blocks != NULL ? source->blocks(n, r) : 0;
    if (!is_counted(f) || own->blocks == NULL) return law;
    return f->cost.entries / 2 * law / own->blocks(n, &f->recipe);
}

static method_forecast forecast_of_method(const forecast *f) {
    method_forecast made = {.building = 0};
    const double n = (double)f->n;
    if (f->method == NULL) return made;
    const method_scale scale = {.n = n,
                                .n_channels = (double)f->n_channels,
                                .n_own_channels = (double)f->n_own_channels,
                                .noise = recipe_noise(&f->recipe),
                                .n_emitters = (double)f->emitters,
                                .n_planes = (double)f->n_planes,
                                .n_blocks = has_blocks(f) ? blocks_of(f, &f->recipe) : 0,
                                .hits = f->cost.hits,
                                .entries = f->cost.entries > 0 ? f->cost.entries : entries_of(n, &f->recipe)};
    f->method->forecast(&scale, method_own_const(f->build, f->method), &made);
    return made;
}

/* Single elements that defaults take on average. */
static const double probes_expected = 48;
/* Processor seconds of a probe, per block and per element, with its direct light: of three Cornell boxes
 * (10,249 to 163,811 elements), rooms, a maze and a patio, what the judge takes beside finding its blocks. */
static const double probe_block_seconds = 9e-9, probe_element_seconds = 3e-7;
/* The numbers of more elements than these lie in memory, not in caches: what a judge by blocks takes more for
 * an element, each time that they are twice as many (Cornell boxes of 655,418 and 2,620,549 elements). */
static const double cached_elements = 163811, uncached_seconds = 3.5e-6;

/* A guide of two solutions gives some eight answers, with vectors and direct light; seconds of an element for
 * all of them, where the method does not tell of its answers. */
static const double guided_answers = 8, guided_element_seconds = 7e-7;

/* Of a probe and channel beside the products with F. */
static double guide_seconds(const forecast *f) {
    if (f->n <= REFERENCE_DENSE_ELEMENTS) return 0;
    const double answer = forecast_of_method(f).answer;
    return answer > 0 ? guided_answers * answer : guided_element_seconds * (double)f->n;
}

/* Probes may always take these. */
static const double probes_enough = 1;

/* Of the probes beyond the least. */
static double probe_seconds(const forecast *f) {
    const double n = (double)f->n, C = (double)f->n_channels;
    const factor_source *const judge = recipe_source(&f->judge_recipe);
    if (has_blocks(f))
        return C * (probe_block_seconds * judge->blocks(n, &f->judge_recipe) + probe_element_seconds * n);
    const double entries = judge->bytes(n, &f->judge_recipe) / 8;
    const double least = (double)f->probes_least, most = (double)f->probes;
    const double more = reference_seconds(n, entries, most) - reference_seconds(n, entries, least);
    return C * (2 * more / (most - least) + guide_seconds(f));
}

size_t forecast_probes(const forecast *f) {
    const double n = (double)f->n;
    if (f->probes_least == 0 || f->probes <= f->probes_least) return f->probes;
    const forecast_rates fixed = {.ray_seconds = forecast_ray_seconds, .slowness = 1, .processors = 1};
    const double build = f->cost.seconds > 0 ? f->cost.seconds : sample_seconds(n, &f->recipe, 0, &fixed);
    const double count = fmax(build, probes_enough) / probe_seconds(f);
    if (!(count > (double)f->probes_least)) return f->probes_least;
    return count < (double)f->probes ? (size_t)count : f->probes;
}

/* Three references: the form factors of the operator, for the probes of the first round, and two others. */
static double solve_seconds(const forecast *f) {
    const double others = JUDGE_RANDOM_PROBES + 1, n = (double)f->n, most = (double)forecast_probes(f);
    const double probes = (f->probes_least > 0 ? fmin(most, probes_expected) : most) + others;
    if (has_blocks(f))
        return (double)f->n_channels * probes *
                   (probe_block_seconds * blocks_of(f, &f->judge_recipe) + probe_element_seconds * n) +
               uncached_seconds * n * fmax(0, log2(n / cached_elements));
    const double own = f->cost.entries > 0 ? f->cost.entries : entries_of(n, &f->recipe);
    const double entries = f->cost.entries > 0 ? own : entries_of(n, &f->judge_recipe);
    return (double)f->n_channels * (reference_seconds(n, own, fmin(probes, (double)judge_at_once(f->n))) +
                                    2 * reference_seconds(n, entries, probes) + probes * guide_seconds(f));
}

forecast_times forecast_seconds(const forecast *f, const forecast_rates *rates) {
    const double n = (double)f->n;
    const recipe *own = &f->recipe, *of_judge = &f->judge_recipe;
    forecast_times times = {0};
    /* Of rays alone the measured rate says more than the fixed cost of one. */
    const bool rays = recipe_can(own, SOURCE_TIMED), counted = is_counted(f) && !rays;
    const double entries = rays ? f->cost.entries / 2 : 0;
    const double once = counted ? f->cost.measured : sample_seconds(n, own, entries, rates);
    /* Of blocks, those that find how much light leaves the scene; the judge needs none. */
    const double beside = has_blocks(f) ? n * (double)own->rays * rates->ray_seconds : 0;
    const bool finer = has_blocks(f); /* the judge's blocks */
    const double more = finer ? blocks_of(f, of_judge) / blocks_of(f, own) : 1;
    const double half = f->cost.finer > 0 ? f->cost.finer
                        : counted         ? once * more
                                          : sample_seconds(n, of_judge, entries / 2, rates);
    if (!f->from_store)
        times.form_factors = f->streamed && !counted
                                 ? n * recipe_source(own)->rays(n, own) * rates->ray_seconds
                                 : once + beside;
    times.operate = forecast_of_method(f).seconds * rates->slowness;
    /* Both samples of pairs share what is projected, and the number of segments of one, but each finds links
     * and tests pairs: 1.2 of one sample where all is projected, 1.7 where segments are most of the work. */
    const bool shared = recipe_can(of_judge, SOURCE_TWICE) && !f->scratch;
    if (f->probes > 0) times.judge = (finer ? 1 : shared ? 1.5 : 2) * half + (f->streamed ? once : 0);
    if (f->probes > 0) times.solves = solve_seconds(f) * rates->slowness;
    return times;
}

double forecast_wall_seconds(double processor_seconds, const forecast_rates *rates) {
    return processor_seconds / rates->processors;
}

void forecast_format_bytes(double bytes, char text[32]) {
    if (bytes < 0x1p30)
        snprintf(text, 32, "%.0fM", ceil(bytes * 0x1p-20));
    else
        snprintf(text, 32, "%.1fG", ceil(bytes * 0x1p-30 * 10) / 10);
}
