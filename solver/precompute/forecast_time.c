/* Seconds that form factors and the judge take. Bytes as text. */
#include "solver/method/judge.h"
#include "solver/method/reference.h"
#include "solver/precompute/forecast.h"

#include <math.h>
#include <stdio.h>

/* Processor seconds per pair, beside rays: packing, merging, some 30 sweeps, expanding; and of pair by pair.
 */
static const double merge_seconds = 1.2e-7, pair_seconds = 4e-7, block_seconds = 1.2e-6;

static double sample_seconds(double n, const recipe *r, double rays_per_second, double n_threads) {
    const double pairs = n * n / 2;
    if (r->method == RECIPE_PAIRS) return pairs * pair_seconds / n_threads;
    if (r->method == RECIPE_BLOCKS) return forecast_blocks(n, r) * block_seconds / n_threads;
    const double rays = forecast_rays(n, r), entries = fmin(pairs, n * rays);
    return n * rays / rays_per_second + entries * merge_seconds / n_threads;
}

/* Single elements that defaults take on average. */
static const double probes_expected = 48;
/* Processor seconds of a probe, per block and per element, with its direct light: of two Cornell boxes
 * (10,249 and 163,811 elements), what the judge takes beside finding its blocks. */
static const double probe_block_seconds = 2.2e-8, probe_element_seconds = 2e-8;

/* Three references: the form factors of the operator, for the probes of the first round, and two others. */
static double solve_seconds(const forecast *f) {
    const double others = JUDGE_RANDOM_PROBES + 1, n = (double)f->n, most = (double)f->probes;
    const double probes = (f->probes_least > 0 ? fmin(most, probes_expected) : most) + others;
    if (f->recipe.method == RECIPE_BLOCKS)
        return (double)f->n_channels * probes *
               (probe_block_seconds * forecast_blocks(n, &f->judge_recipe) + probe_element_seconds * n);
    const double own = f->cost.entries > 0 ? f->cost.entries : forecast_rows_bytes(n, &f->recipe) / 8;
    const double entries = forecast_rows_bytes(n, &f->judge_recipe) / 8;
    return (double)f->n_channels * (reference_seconds(n, own, fmin(probes, JUDGE_AT_ONCE)) +
                                    2 * reference_seconds(n, entries, probes));
}

forecast_times forecast_seconds(const forecast *f, double rays_per_second, int n_threads) {
    const double n = (double)f->n;
    forecast_times times = {0};
    /* Of rays alone the measured rate says more than the fixed cost of one. */
    const bool counted = f->cost.seconds > 0 && f->recipe.method != RECIPE_RAYS;
    const double once =
        counted ? f->cost.seconds / n_threads : sample_seconds(n, &f->recipe, rays_per_second, n_threads);
    const bool finer = f->recipe.method == RECIPE_BLOCKS; /* the judge's blocks */
    const double more = finer ? forecast_blocks(n, &f->judge_recipe) / forecast_blocks(n, &f->recipe) : 1;
    const double half =
        counted ? once * more : sample_seconds(n, &f->judge_recipe, rays_per_second, n_threads);
    if (!f->from_store)
        times.form_factors =
            f->streamed && !counted ? n * forecast_rays(n, &f->recipe) / rays_per_second : once;
    if (f->probes > 0) times.judge = (finer ? 1 : 2) * half + (f->streamed ? once : 0);
    if (f->probes > 0) times.solves = solve_seconds(f) / n_threads;
    return times;
}

void forecast_format_bytes(double bytes, char text[32]) {
    if (bytes < 0x1p30)
        snprintf(text, 32, "%.0fM", ceil(bytes * 0x1p-20));
    else
        snprintf(text, 32, "%.1fG", ceil(bytes * 0x1p-30 * 10) / 10);
}
