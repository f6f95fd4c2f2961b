#include "solver/method/judge/judge_sky_law.h"

#include "solver/base/weighted.h"
#include "solver/method/judge/judge_black.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 10 };

static size_t group_of(const sky_law_sums *s, size_t bin) {
    return bin % s->input->n_groups;
}

/* Mean reflectances of the groups, and sum A^2 / (sum A)^2. */
static void find_means(sky_law_sums *s) {
    const build_problem *p = s->input->problem;
    const size_t n = p->n, G = s->input->n_groups;
    for (size_t i = 0; i < n; i++) {
        const size_t g = s->input->group[i];
        s->area[g] += p->area[i];
        s->square[g] += p->area[i] * p->area[i];
        for (size_t c = 0; c < p->n_channels; c++)
            s->reflectance[c * G + g] += p->area[i] * judge_reflectance(s->input, c, i);
    }
    for (size_t g = 0; g < G; g++) {
        if (!(s->area[g] > 0)) continue;
        s->square[g] /= s->area[g] * s->area[g];
        for (size_t c = 0; c < p->n_channels; c++) s->reflectance[c * G + g] /= s->area[g];
    }
}

lam_status sky_law_begin(const judge_input *input, const group_errors *errors, sky_law_sums *out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    const size_t G = input->n_groups, n_bins = G * (input->read != NULL ? 2 : 1);
    sky_law_sums s = {.input = input, .errors = errors, .n_bins = n_bins};
    const size_t n_skies = sizeof s.of / sizeof *s.of;
    s.numbers = memory_allocate(n_bins, n_skies * NUMBERS * sizeof *s.numbers, "errors of skies", error);
    s.reflectance =
        memory_allocate(G, input->problem->n_channels * sizeof *s.reflectance, "errors of skies", error);
    s.area = memory_allocate(G, sizeof *s.area, "errors of skies", error);
    s.square = memory_allocate(G, sizeof *s.square, "errors of skies", error);
    if (s.numbers == NULL || s.reflectance == NULL || s.area == NULL || s.square == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < n_skies; v++) {
        double *const first = s.numbers + v * NUMBERS * n_bins;
        s.of[v] = (sky_probe){.rms = first,
                              .rms_least = first + n_bins,
                              .mean = first + 2 * n_bins,
                              .mean_least = first + 3 * n_bins,
                              .light = first + 4 * n_bins,
                              .light_mean = first + 5 * n_bins,
                              .direct = first + 6 * n_bins,
                              .direct_mean = first + 7 * n_bins,
                              .rare = first + 8 * n_bins,
                              .rare_mean = first + 9 * n_bins};
    }
    find_means(&s);
    TRY(tile_errors_begin(input, &s.tiles, error));
    TRY(tile_errors_aim(&s.tiles, error));
    *out = s;
    s = (sky_law_sums){.n_bins = 0};
done:
    sky_law_free(&s);
    return status;
}

void sky_law_free(sky_law_sums *s) {
    free(s->numbers);
    free(s->reflectance);
    free(s->area);
    free(s->square);
    tile_errors_free(&s->tiles);
    *s = (sky_law_sums){.n_bins = 0};
}

/* D of all groups, W, P^2 and S of a sky L [m], the same in all channels. */
static void find_size(const sky_law_sums *s, const float *L, sky_probe *to) {
    const size_t m = s->errors->n_tiles, G = s->input->n_groups;
    for (size_t c = 0; c < s->input->problem->n_channels; c++) {
        const weighted_sums size = weighted_sums_of(m, s->errors->sky_power + c * m, L);
        to->power2 += size.sum * size.sum;
        to->spread += size.spread;
        const tile_spread power = tile_errors_of_power(&s->tiles, c, L, size.mean);
        to->power_off.seen += power.seen;
        to->power_off.rare += power.rare;
        for (size_t bin = 0; bin < s->n_bins; bin++) {
            const size_t g = group_of(s, bin);
            const double rho2 = pow(s->reflectance[c * G + g], 2);
            const tile_spread elements = tile_errors_of_group(&s->tiles, g, false, L, size.mean);
            const tile_spread mean = tile_errors_of_group(&s->tiles, g, true, L, size.mean);
            to->direct[bin] += rho2 * elements.seen;
            to->rare[bin] += rho2 * elements.rare;
            to->direct_mean[bin] += rho2 * mean.seen;
            to->rare_mean[bin] += rho2 * mean.rare;
        }
    }
}

void sky_law_add(sky_law_sums *s, const figure_probe *one, const float *L, double own_share,
                 by_group_sums *bins) {
    sky_probe *to = &s->of[s->count++];
    const double *numbers = by_group_numbers(one, bins);
    find_size(s, L, to);
    for (size_t bin = 0; bin < s->n_bins; bin++) {
        const double *at = numbers + BIN_NUMBERS * bin;
        /* One mean has its noise alone to tell how large that is; the noise of its elements does it better.
         */
        const double noise = fmax(at[BIN_MEAN_NOISE], at[BIN_MEAN_APART]);
        to->rms[bin] = at[BIN_RMS] - at[BIN_RMS_NOISE];
        to->rms_least[bin] = fmin(sqrt(at[BIN_RMS_SPREAD]), own_share * at[BIN_RMS_NOISE]);
        to->mean[bin] = at[BIN_MEAN] - noise;
        to->mean_least[bin] = own_share * noise;
        to->light[bin] = at[BIN_LIGHT_RMS];
        to->light_mean[bin] = at[BIN_LIGHT];
    }
}

/* sum A D of a single tile of radiance 1: sum_t f_t (L_t - M)^2 = f_tile (1 - 2 M) + M^2 sum_t f_t. */
static double direct_of_tile(const sky_law_sums *s, size_t tile) {
    const size_t m = s->errors->n_tiles, G = s->input->n_groups;
    double sum = 0;
    for (size_t c = 0; c < s->input->problem->n_channels && s->errors->sky_first != NULL; c++) {
        const double *Q = s->errors->sky_power + c * m;
        double all = 0;
        for (size_t t = 0; t < m; t++) all += Q[t];
        const double M = all > 0 ? Q[tile] / all : 0;
        for (size_t g = 0; g < G; g++) {
            const double *f = s->errors->sky_first + g * m, rho = s->reflectance[c * G + g];
            double seen = 0;
            for (size_t t = 0; t < m; t++) seen += f[t];
            sum += s->area[g] * rho * rho * (f[tile] * (1 - 2 * M) + M * M * seen);
        }
    }
    return sum;
}

void sky_law_add_direct(sky_law_sums *s, size_t tile, const float *one, const float *other) {
    const build_problem *p = s->input->problem;
    const float *own = s->input->sky->own + tile * p->n;
    const double D = direct_of_tile(s, tile);
    double off = 0, off2 = 0;
    for (size_t k = 0; k < p->n * p->n_channels; k++) {
        const size_t i = k % p->n;
        const double rho = judge_reflectance(s->input, k / p->n, i);
        const double x = (double)one[i] - (double)own[i], y = (double)other[i] - (double)own[i];
        const double at = p->area[i] * rho * rho * x * y;
        off += at;
        off2 += at * at;
    }
    if (!(D > 0)) return;
    s->direct.off += off / sqrt(D);
    s->direct.off2 += off2 / D;
    s->direct.direct += sqrt(D);
}

/* The square of the light that reaches a bin of a power of 1 that a single tile sends into the scene. */
static double bounced2_of(const sky_law_sums *s, size_t bin, bool of_mean) {
    double light2 = 0, power2 = 0;
    for (size_t v = JUDGE_EVEN_SKIES; v < s->count; v++) {
        light2 += (of_mean ? s->of[v].light_mean : s->of[v].light)[bin];
        power2 += s->of[v].power2;
    }
    return power2 > 0 ? light2 / power2 : 0;
}

/* D + bounced^2 W of a sky. */
static double known_of_tiles(const sky_probe *of, size_t bin, bool of_mean, double direct2, double bounced2) {
    const double direct = (of_mean ? of->direct_mean : of->direct)[bin];
    const double rare = (of_mean ? of->rare_mean : of->rare)[bin];
    return direct2 * (direct + bounced2 * of->power_off.seen) + rare + bounced2 * of->power_off.rare;
}

/* Squares of the figures of one bin, of elements or of the mean. */
typedef struct bin_figures {
    double tiles, even, bounced;
} bin_figures;

/* The error of an even sky; of single tiles the part that neither that nor their own direct light tells. */
static bin_figures finish_bin(const sky_law_sums *s, size_t bin, bool of_mean, double direct2) {
    double off = 0, least2 = 0, known = 0, spread = 0;
    bin_figures f = {.bounced = bounced2_of(s, bin, of_mean)};
    for (size_t v = 0; v < s->count; v++) {
        const sky_probe *of = &s->of[v];
        const double at = (of_mean ? of->mean : of->rms)[bin];
        const double least = (of_mean ? of->mean_least : of->rms_least)[bin];
        if (v == 0) {
            f.even = (fmax(at, 0) + least) / of->power2;
        } else if (v >= JUDGE_EVEN_SKIES) {
            off += at;
            least2 += least * least;
            known += known_of_tiles(of, bin, of_mean, direct2, f.bounced) + f.even * of->power2;
            spread += of->spread;
        }
    }
    f.tiles = spread > 0 ? (fmax(off - known, 0) + sqrt(least2)) / spread : 0;
    /* A mean may be right under one sky by chance: the cloudy one counts as much, less its own tiles. */
    if (s->count > 1) {
        const sky_probe *of = &s->of[1];
        const double at = (of_mean ? of->mean : of->rms)[bin];
        const double tiled = known_of_tiles(of, bin, of_mean, direct2, f.bounced) + f.tiles * of->spread;
        f.even = fmax(f.even, .5 * (f.even + (at - tiled) / of->power2));
    }
    return f;
}

typedef struct weighted_ratio {
    double ratio, weight;
} weighted_ratio;

static int compare_ratios(const void *a, const void *b) {
    const double x = ((const weighted_ratio *)a)->ratio, y = ((const weighted_ratio *)b)->ratio;
    return (x > y) - (x < y);
}

lam_status sky_law_share_even(size_t n, const double *light, const double *weight, double *even,
                              lam_error *error) {
    size_t count = 0;
    double left = 0;
    weighted_ratio *of = memory_allocate(n, sizeof *of, "errors of skies", error);
    if (of == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n; k++) {
        if (!(light[k] > 0)) continue;
        of[count++] = (weighted_ratio){even[k] / light[k], weight[k]};
        left += .5 * weight[k];
    }
    qsort(of, count, sizeof *of, compare_ratios);
    size_t at = 0;
    while (at + 1 < count && (left -= of[at].weight) > 0) at++;
    for (size_t k = 0; k < n && count > 0; k++)
        even[k] = fmax(even[k], .5 * (even[k] + of[at].ratio * light[k]));
    free(of);
    return LAM_OK;
}

/* The light of an even sky of power 1 in the bins, squared, and how much of it there is. */
static lam_status share_even(const sky_law_sums *s, double *even, lam_error *error) {
    lam_status status = LAM_OK;
    double *light = memory_allocate(s->n_bins, 2 * sizeof *light, "errors of skies", error);
    if (light == NULL) return LAM_ERR_MEMORY;
    for (size_t bin = 0; bin < s->n_bins; bin++) {
        light[bin] = s->of[0].light_mean[bin] / s->of[0].power2;
        light[s->n_bins + bin] = s->area[group_of(s, bin)] * sqrt(light[bin]);
    }
    TRY(sky_law_share_even(s->n_bins, light, light + s->n_bins, even, error));
done:
    free(light);
    return status;
}

lam_status sky_law_finish(const sky_law_sums *s, group_errors *errors, lam_error *error) {
    lam_status status = LAM_OK;
    double *made[SKY_FIGURES] = {NULL};
    const direct_sums *d = &s->direct;
    const double direct2 = d->direct > 0 ? (fmax(d->off, 0) + sqrt(d->off2)) / d->direct : 0;
    for (int f = 0; f < SKY_FIGURES; f++)
        if ((made[f] = memory_allocate(s->n_bins, sizeof *made[f], "errors of skies", error)) == NULL)
            TRY(LAM_ERR_MEMORY);
    for (size_t bin = 0; bin < s->n_bins; bin++) {
        const bin_figures mean = finish_bin(s, bin, true, direct2), rms = finish_bin(s, bin, false, direct2);
        /* No mean is known better than independent errors of the elements leave it. */
        const double least = s->square[group_of(s, bin)];
        made[SKY_RMS_TILES][bin] = sqrt(rms.tiles);
        made[SKY_RMS_EVEN][bin] = sqrt(rms.even);
        made[SKY_RMS_BOUNCED][bin] = sqrt(rms.bounced);
        made[SKY_MEAN_TILES][bin] = sqrt(fmax(mean.tiles, least * rms.tiles));
        made[SKY_MEAN_EVEN][bin] = fmax(mean.even, least * rms.even);
        made[SKY_MEAN_BOUNCED][bin] = sqrt(mean.bounced);
    }
    TRY(share_even(s, made[SKY_MEAN_EVEN], error));
    for (size_t bin = 0; bin < s->n_bins; bin++) made[SKY_MEAN_EVEN][bin] = sqrt(made[SKY_MEAN_EVEN][bin]);
    TRY(tile_errors_finish(&s->tiles, direct2, errors, error));
    errors->sky_direct = sqrt(direct2);
    memcpy(errors->sky, made, sizeof made);
    memset(made, 0, sizeof made);
done:
    for (int f = 0; f < SKY_FIGURES; f++) free(made[f]);
    return status;
}
