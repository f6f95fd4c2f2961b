/* Seconds that form factors and the judge take. Bytes as text. */
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

forecast_times forecast_seconds(const forecast *f, double rays_per_second, int n_threads) {
    const double n = (double)f->n;
    forecast_times times = {0};
    const double once = sample_seconds(n, &f->recipe, rays_per_second, n_threads);
    if (!f->from_store)
        times.form_factors = f->streamed ? n * forecast_rays(n, &f->recipe) / rays_per_second : once;
    if (f->probes > 0)
        times.judge =
            2 * sample_seconds(n, &f->judge_recipe, rays_per_second, n_threads) + (f->streamed ? once : 0);
    return times;
}

void forecast_format_bytes(double bytes, char text[32]) {
    if (bytes < 0x1p30)
        snprintf(text, 32, "%.0fM", ceil(bytes * 0x1p-20));
    else
        snprintf(text, 32, "%.1fG", ceil(bytes * 0x1p-30 * 10) / 10);
}
