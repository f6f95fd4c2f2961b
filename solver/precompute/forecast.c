#include "solver/precompute/forecast.h"

#include "solver/formfactor/formfactor.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>

/* Below this many rays or pixels a forecast is not worth making cheaper. */
enum { FEWEST_RAYS = 256, LOWEST_RESOLUTION = 32 };

/* Memory of a panel of rows that is merged or expanded. */
static const double merge_bytes = 128e6;

/* Rays that look for other elements from one; a hemicube is a ray for each of its pixels. */
static double recipe_rays(double n, const recipe *r) {
    switch (r->method) {
    case RECIPE_PAIRS:
        return n;
    case RECIPE_HEMICUBE:
        return 3 * (double)r->resolution * (double)r->resolution;
    case RECIPE_RAYS:
    case RECIPE_NEAR_PAIRS:
        break;
    }
    return (double)r->rays;
}

/* Bytes of one tile of a sky: what each element receives of it, and where it is. */
static double tile_bytes(double n) {
    return 4 * n + 100;
}

/* Bytes of the rows of one merged sample: a pair is seen from either end, so rows have on average at most
 * twice as many entries as an element has rays, an index and a value each. */
static double sample_bytes(double n, double rays) {
    return n * fmin(n, 2 * rays) * 8;
}

static double recipe_bytes(double n, const recipe *r) {
    return sample_bytes(n, recipe_rays(n, r));
}

/* Bytes of packed rows: a gap in groups of seven bits, of which one bit tells of a count above 1, or a
 * weight; the row's own figures. */
static double found_bytes(double n, const recipe *r) {
    if (r->method == RECIPE_PAIRS) return 2 * 4.5 * n * n; /* as found, and as seen */
    const double rays = recipe_rays(n, r), entries = fmin(n, rays), gap = n / fmax(1, entries);
    const bool weights = r->method == RECIPE_HEMICUBE;
    const double bytes = 1 + floor(log2(fmax(1, gap)) / 7 + 2. / 7) + (weights ? 4 : rays > n / 4 ? 1 : 0);
    return n * (entries * bytes + 24);
}

/* The peak while one sample is found: packed rows and the triangle they are merged into, or that and the rows
 * in its place; of pairs one triangle with what is known of each, and again as such. */
static double trace_bytes(double n, const recipe *r, bool to_disk, bool large) {
    const double sample = recipe_bytes(n, r);
    if (r->method == RECIPE_PAIRS) return fmax(sample, 9 * n * n);
    /* Near pairs are as many as rays at most, and stand in a triangle of their own. */
    const double near = r->method == RECIPE_NEAR_PAIRS ? sample : 0, some = fmin(merge_bytes, sample);
    if (large) return near + some;
    const double merging = (to_disk ? 0 : found_bytes(n, r)) + near + sample / (near > 0 ? 1 : 2);
    return fmax(sample, merging) + some;
}

/* Near pairs alone, where nothing else is held: measured 7 (a Cornell box of 163,687 elements) to 33 (a city
 * of 39,999) an element at 512 rays; as found and in rows. */
static const double near_share = .25, near_bytes = 17;

static double stream_bytes(double n, const recipe *r) {
    return r->method == RECIPE_NEAR_PAIRS ? n * fmin(n, near_share * (double)r->rays) * near_bytes : 0;
}

/* Of the rows of a sample, what lies in memory; those of pairs always do. */
static double held_bytes(const forecast *f, double bytes, const recipe *r) {
    return f->large && r->method != RECIPE_PAIRS ? 0 : bytes;
}

/* Bytes of the judge's two samples and their mean. */
static double reference_bytes(const forecast *f) {
    const double n = (double)f->n, one = recipe_bytes(n, &f->judge_recipe);
    const bool dense = f->judge_recipe.method == RECIPE_PAIRS;
    return 2 * one + (dense ? one : sample_bytes(n, 2 * (double)f->judge_recipe.rays));
}

/* About as many columns as a factorization will have. */
static double likely_rank(const forecast *f) {
    const double n = (double)f->n;
    return f->rank > 0 ? fmin((double)f->rank, n) : fmin(1024, n);
}

/* Light, emissions and what the sky gives of every emitter, and the vectors of a block that iterates. */
static double emitter_bytes(const forecast *f) {
    const double n = (double)f->n, s = (double)f->emitters, C = (double)f->n_channels;
    return 4 * n * (s * (3 * C + 2) + 7 * 32);
}

/* Numbers an element of a hierarchical operator, at most: measured 26 to 66 at epsilon .05 where F is known
 * well (a Cornell box of 10,249 elements, a canopy of 2,500), fewer of larger scenes, and 114 at .003 in that
 * box. Where the noise of rays is what bounds them (as an epsilon of nearly three times that) 40 of a city
 * and 26 of Delft by 1,024 rays. */
static const double noise_share = 2.7;

static double hierarchical_numbers(const forecast *f) {
    const double noise = recipe_noise(&f->recipe);
    return 66 * sqrt(.05 / fmax(f->epsilon, noise_share * noise));
}

/* A number in memory: both triangles, as rows and as slices; in a store; and while it is built, beside two
 * kilobytes an element for the tree (measured: 5.7 kB an element at 27 numbers, 16 kB at 114). */
static const double number_bytes = 32, number_store_bytes = 4, number_build_bytes = 130,
                    element_build_bytes = 2000;

/* Numbers an element of compressed form factors, at most: measured 255 (a Cornell box of 10,249 elements) to
 * 885 (an atrium of 6,000) at epsilon .05, 902 at .0025 (a box of 40,978); where they were as many as F has
 * they are not kept. Bytes of a number and of an element while they are found. */
static const double compressed_most = 900, compressed_number_bytes = 26, compressed_element_bytes = 2500;

static double compress_bytes(const forecast *f) {
    const double n = (double)f->n;
    if (!f->compress || recipe_noise(&f->recipe) > 0) return 0;
    const double numbers = fmin(compressed_most * pow(.05 / f->epsilon, .25), n / 2);
    return n * (compressed_element_bytes + compressed_number_bytes * numbers);
}

static double operator_bytes(const forecast *f) {
    const double n = (double)f->n;
    if (f->sparse) return 0;
    if (f->hierarchical) return number_bytes * hierarchical_numbers(f) * n * (double)f->n_channels;
    if (f->emitters > 0) return 4 * n * (double)f->emitters * (double)f->n_channels;
    return f->exact ? 4 * n * n * (double)f->n_channels
                    : 2 * n * likely_rank(f) * (double)panel_value_size(f->precision);
}

double forecast_bytes(const forecast *f) {
    const double n = (double)f->n, n_channels = (double)f->n_channels;
    const double of_mesh = 400 * n + tile_bytes(n) * (double)f->sky_tiles;
    const double sample = held_bytes(f, recipe_bytes(n, &f->recipe), &f->recipe);
    const double trace = f->from_store ? 0 : trace_bytes(n, &f->recipe, f->scratch, f->large);
    /* The inverse in double and the operator; else leaf blocks and both factors of two nodes. */
    const double build =
        f->exact ? n * n * (8 + 4 * n_channels) : 4 * n * (2 * fmin(1024, n) + 6 * likely_rank(f));
    const double made = f->emitters > 0 ? emitter_bytes(f)
                        : f->sparse     ? 0
                        : f->hierarchical
                            ? (element_build_bytes + number_build_bytes * hierarchical_numbers(f)) * n
                            : build;
    const double held = f->streamed ? stream_bytes(n, &f->recipe) : sample;
    double peak = fmax(f->streamed ? held : trace, held + fmax(made, operator_bytes(f) + compress_bytes(f)));
    if (f->probes > 0) {
        /* Two more samples and their mean, beside the first; emissions, answers and the vectors of the
         * iteration per probe. */
        const double probes = (double)f->probes + 9;
        const recipe *r = &f->judge_recipe;
        const double references = held_bytes(f, reference_bytes(f), r);
        const double judge = probes * n * (12 * n_channels + 72) + (n <= 8192 ? 8 * n * n : 0);
        const double second = held_bytes(f, recipe_bytes(n, r), r) + trace_bytes(n, r, f->scratch, f->large);
        peak = fmax(peak, sample + operator_bytes(f) + fmax(references + judge, second));
    }
    return of_mesh + peak;
}

/* --- time --------------------------------------------------------------------------------------------------
 */

/* Processor seconds a pair, beside rays: packing, merging, some 30 sweeps, expanding; and of pair by pair. */
static const double merge_seconds = 1.2e-7, pair_seconds = 4e-7;

static double sample_seconds(double n, const recipe *r, double rays_per_second, double n_threads) {
    const double pairs = n * n / 2;
    if (r->method == RECIPE_PAIRS) return pairs * pair_seconds / n_threads;
    const double rays = recipe_rays(n, r), entries = fmin(pairs, n * rays);
    return n * rays / rays_per_second + entries * merge_seconds / n_threads;
}

forecast_times forecast_seconds(const forecast *f, double rays_per_second, int n_threads) {
    const double n = (double)f->n;
    forecast_times times = {0};
    const double once = sample_seconds(n, &f->recipe, rays_per_second, n_threads);
    if (!f->from_store)
        times.form_factors = f->streamed ? n * recipe_rays(n, &f->recipe) / rays_per_second : once;
    if (f->probes > 0)
        times.judge =
            2 * sample_seconds(n, &f->judge_recipe, rays_per_second, n_threads) + (f->streamed ? once : 0);
    return times;
}

/* --- disk --------------------------------------------------------------------------------------------------
 */

double forecast_store_bytes(const forecast *f) {
    const double n = (double)f->n, rows = recipe_bytes(n, &f->recipe);
    const double kept = !f->keep ? 0 : f->n > FORM_FACTORS_ROWS_MOST ? rows / 2 : rows;
    const double stored = f->hierarchical
                              ? number_store_bytes * hierarchical_numbers(f) * n * (double)f->n_channels
                              : operator_bytes(f);
    return stored + kept + tile_bytes(n) * (double)f->sky_tiles + 300 * n;
}

double forecast_scratch_bytes(const forecast *f) {
    const double n = (double)f->n;
    if (!f->scratch) return 0;
    const double found = (f->from_store ? 0 : found_bytes(n, &f->recipe) + 4 * n * (double)f->sky_tiles) +
                         (f->probes > 0 ? 2 * found_bytes(n, &f->judge_recipe) : 0);
    if (!f->large) return found;
    return found + recipe_bytes(n, &f->recipe) + (f->probes > 0 ? reference_bytes(f) : 0);
}

lam_status forecast_check_disk(const forecast *f, const char *output, const scratch *rows,
                               const char *scratch_folder, lam_error *error) {
    lam_status status = LAM_OK;
    char folder[4096] = ".", needs[32], has[32];
    struct statvfs about;
    struct stat here, there;
    const char *slash = strrchr(output, '/');
    double in_store = forecast_store_bytes(f);
    if (slash != NULL)
        snprintf(folder, sizeof folder, "%.*s", slash == output ? 1 : (int)(slash - output), output);
    if (rows != NULL) {
        const double in_scratch = forecast_scratch_bytes(f), free_there = (double)scratch_free_bytes(rows);
        if (in_scratch > free_there) {
            forecast_format_bytes(in_scratch, needs);
            forecast_format_bytes(free_there, has);
            FAIL(error, LAM_ERR_IO,
                 "--scratch %s: rows of form factors need about %s, %s are free there; use another folder or "
                 "fewer --rays",
                 scratch_folder, needs, has);
        }
        if (stat(scratch_folder, &there) == 0 && stat(folder, &here) == 0 && here.st_dev == there.st_dev)
            in_store += in_scratch - fmin(in_scratch, scratch_used_bytes(rows));
    }
    if (statvfs(folder, &about) != 0) return LAM_OK; /* whoever writes there will say why */
    const double free_here = (double)about.f_bavail * (double)about.f_frsize;
    if (in_store > free_here) {
        forecast_format_bytes(in_store, needs);
        forecast_format_bytes(free_here, has);
        FAIL(error, LAM_ERR_IO, "%s: needs about %s of the disk, %s are free; %s", output, needs, has,
             f->keep    ? "leave out --keep-form-factors or write to another disk"
             : f->exact ? "use --method low-rank or write to another disk"
                        : "write to another disk");
    }
done:
    return status;
}

/* --- words -------------------------------------------------------------------------------------------------
 */

void forecast_format_bytes(double bytes, char text[32]) {
    if (bytes < 0x1p30)
        snprintf(text, 32, "%.0fM", ceil(bytes * 0x1p-20));
    else
        snprintf(text, 32, "%.1fG", ceil(bytes * 0x1p-30 * 10) / 10);
}

/* Halves what the rows are found with; false when that is little already. */
static bool sample_less(recipe *r) {
    switch (r->method) {
    case RECIPE_PAIRS:
    case RECIPE_NEAR_PAIRS:
        *r = (recipe){.method = RECIPE_RAYS, .rays = RECIPE_RAYS_MOST};
        break;
    case RECIPE_HEMICUBE:
        if (r->resolution / 2 < LOWEST_RESOLUTION) return false;
        r->resolution = r->resolution / 4 * 2; /* even */
        break;
    case RECIPE_RAYS:
        if (r->rays <= FEWEST_RAYS) return false;
        r->rays /= 2;
        break;
    }
    return true;
}

/* "--rays 1024" or "--resolution 512" */
static void format_recipe(const recipe *r, char text[40]) {
    if (r->method == RECIPE_PAIRS || r->method == RECIPE_NEAR_PAIRS)
        snprintf(text, 40, "%s", recipe_name(r->method));
    else if (r->method == RECIPE_HEMICUBE)
        snprintf(text, 40, "--resolution %zu", r->resolution);
    else
        snprintf(text, 40, "--rays %zu", r->rays);
}

lam_status forecast_check(const forecast *f, double limit, lam_error *error) {
    lam_status status = LAM_OK;
    const double bytes = forecast_bytes(f);
    char needs[32], allows[32], asked[40], fits[40], advice[160], sky[48] = "";
    if (bytes <= limit) return LAM_OK;
    forecast_format_bytes(bytes, needs);
    forecast_format_bytes(limit, allows);
    const char *method = f->exact ? "--method low-rank" : "";
    forecast cheaper = *f;
    bool less = false;
    if (f->sky_tiles > 0) snprintf(sky, sizeof sky, " and %zu sky tiles", f->sky_tiles);
    cheaper.sky_tiles = 0;
    const double spare = limit - forecast_bytes(&cheaper);
    if (f->sky_tiles > 0 && spare >= tile_bytes((double)f->n)) {
        snprintf(advice, sizeof advice, "a --sky of at most %.0f tiles, or --memory %s",
                 floor(spare / tile_bytes((double)f->n)), needs);
        FAIL(error, LAM_ERR_MEMORY, "%zu elements%s need about %s of memory, --memory allows %s; fits: %s",
             f->n, sky, needs, allows, advice);
    }
    cheaper = *f;
    cheaper.scratch = cheaper.large = true;
    const char *disk = forecast_bytes(&cheaper) <= limit ? "--scratch DIR, or " : "";
    cheaper.scratch = f->scratch;
    cheaper.large = f->large;
    cheaper.probes = 0;
    const char *unjudged = forecast_bytes(&cheaper) <= limit ? "--probes 0, or " : "";
    cheaper.probes = f->probes;
    cheaper.exact = false;
    while (forecast_bytes(&cheaper) > limit && sample_less(&cheaper.recipe)) {
        less = true;
        cheaper.judge_recipe = recipe_of_judge(&cheaper.recipe, f->judge_recipe.rays, 0);
    }
    format_recipe(&f->recipe, asked);
    format_recipe(&cheaper.recipe, fits);
    if (forecast_bytes(&cheaper) > limit) {
        /* Every term grows with n: halve until it fits. */
        while (cheaper.n > 1 && forecast_bytes(&cheaper) > limit) cheaper.n /= 2;
        snprintf(advice, sizeof advice, "about %zu elements with %s, or --memory %s", cheaper.n, fits, needs);
    } else if (less) {
        snprintf(advice, sizeof advice, "%s%s%s", method, f->exact ? " " : "", fits);
    } else {
        snprintf(advice, sizeof advice, "%s", method);
    }
    FAIL(error, LAM_ERR_MEMORY,
         "%zu elements with %s%s need about %s of memory, --memory allows %s; fits: %s%s%s", f->n, asked, sky,
         needs, allows, disk, unjudged, advice);
done:
    return status;
}

static bool read_number(const char *path, const char *format, unsigned long long *value) {
    char line[128];
    bool found = false;
    FILE *stream = fopen(path, "r");
    if (stream == NULL) return false;
    while (!found && fgets(line, sizeof line, stream) != NULL) found = sscanf(line, format, value) == 1;
    fclose(stream);
    return found;
}

uint64_t memory_available(void) {
    unsigned long long kilobytes = 0, allowed = 0, used = 0;
    if (!read_number("/proc/meminfo", "MemAvailable: %llu kB", &kilobytes)) return 0;
    uint64_t bytes = (uint64_t)kilobytes * 1024;
    if (read_number("/sys/fs/cgroup/memory.max", "%llu", &allowed) &&
        read_number("/sys/fs/cgroup/memory.current", "%llu", &used)) {
        const uint64_t left = allowed > used ? allowed - used : 0;
        if (left < bytes) bytes = left;
    }
    return bytes;
}
