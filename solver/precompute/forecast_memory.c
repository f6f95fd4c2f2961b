/* Bytes of memory that a precompute takes, and options that would make it fit. */
#include "solver/base/machine.h"
#include "solver/method/judge/guided_reference.h"
#include "solver/method/judge/judge.h"
#include "solver/precompute/forecast.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Fewer rays or pixels than these are not proposed. */
enum { FEWEST_RAYS = 256, LOWEST_RESOLUTION = 32 };

/* Memory of a panel of rows that is merged or expanded. */
static const double merge_bytes = 128e6;

/* Rays cast from one element; a hemicube is a ray for each of its pixels. */
double forecast_rays(double n, const recipe *r) {
    switch (r->method) {
    case RECIPE_PAIRS:
        return n;
    case RECIPE_HEMICUBE:
        return 3 * (double)r->resolution * (double)r->resolution;
    case RECIPE_RAYS:
    case RECIPE_NEAR_PAIRS:
    case RECIPE_BLOCKS:
        break;
    }
    return (double)r->rays;
}

/* Bytes of one tile of a sky: the irradiance of each element, and the tile itself. */
double forecast_tile_bytes(double n) {
    return 4 * n + 100;
}

/* Bytes of the rows of one merged sample: a pair is seen from either end, so rows have on average at most
 * twice as many entries as an element has rays, an index and a value each. */
static double sample_bytes(double n, double rays) {
    return n * fmin(n, 2 * rays) * 8;
}

/* Blocks in rooms of large planes: measured 7.6e5 (a Cornell box of 10,249 elements) and 2.0e6 (of 163,687)
 * at an accuracy of 3e-4, 3.3e5 and 9.3e5 at 1e-3; 6.1e6 (of 2,620,549) at 4e-4. */
double forecast_blocks(double n, const recipe *r) {
    return fmin(7.6e5 * pow(n / 1e4, .4) * pow(r->accuracy / 3e-4, -.7), n * n / 2);
}

/* Bytes of a block, its places in both orders, and the nodes of its trees per element. */
static const double block_bytes = 100, block_element_bytes = 400;

double forecast_rows_bytes(double n, const recipe *r) {
    if (r->method == RECIPE_BLOCKS) return block_element_bytes * n + block_bytes * forecast_blocks(n, r);
    return sample_bytes(n, forecast_rays(n, r));
}

/* Bytes of packed rows: a gap in groups of seven bits, of which one bit marks a count above 1, or a
 * weight; the row's own figures. */
double forecast_packed_bytes(double n, const recipe *r) {
    if (r->method == RECIPE_PAIRS) return 2 * 4.5 * n * n; /* as found, and as seen */
    const double rays = forecast_rays(n, r), entries = fmin(n, rays), gap = n / fmax(1, entries);
    const bool weights = r->method == RECIPE_HEMICUBE;
    const double bytes = 1 + floor(log2(fmax(1, gap)) / 7 + 2. / 7) + (weights ? 4 : rays > n / 4 ? 1 : 0);
    return n * (entries * bytes + 24);
}

/* The peak while one sample is found: packed rows and the triangle they are merged into, or the triangle and
 * the rows made of it; with pairs the triangle with the state of each pair, and the triangle of factors. */
static double trace_bytes(double n, const recipe *r, bool to_disk, bool large) {
    const double sample = forecast_rows_bytes(n, r);
    if (r->method == RECIPE_BLOCKS) return sample;
    if (r->method == RECIPE_PAIRS) return fmax(sample, 9 * n * n);
    /* Near pairs are as many as rays at most, and stand in a triangle of their own. */
    const double near = r->method == RECIPE_NEAR_PAIRS ? sample : 0, some = fmin(merge_bytes, sample);
    if (large) return near + some;
    const double merging = (to_disk ? 0 : forecast_packed_bytes(n, r)) + near + sample / (near > 0 ? 1 : 2);
    return fmax(sample, merging) + some;
}

/* Near pairs alone, where nothing else is held: measured 7 (a Cornell box of 163,687 elements) to 33 (a city
 * of 39,999) per element at 512 rays; as found and in rows. */
static const double near_share = .25, near_bytes = 17;

static double stream_bytes(double n, const recipe *r) {
    return r->method == RECIPE_NEAR_PAIRS ? n * fmin(n, near_share * (double)r->rays) * near_bytes : 0;
}

/* The part of a sample's rows that lies in memory; rows by pairs always do. */
static double held_bytes(const forecast *f, double bytes, const recipe *r) {
    return f->large && r->method != RECIPE_PAIRS && r->method != RECIPE_BLOCKS ? 0 : bytes;
}

/* Bytes of the judge's two samples, or its blocks. */
double forecast_reference_bytes(const forecast *f) {
    const double one = forecast_rows_bytes((double)f->n, &f->judge_recipe);
    return f->judge_recipe.method == RECIPE_BLOCKS ? one : 2 * one;
}

/* The share of the method; nothing where no operator is built. */
static method_forecast method_bytes(const forecast *f) {
    method_forecast made = {.building = 0};
    if (f->method == NULL) return made;
    const method_scale scale = {
        .n = (double)f->n,
        .n_channels = (double)f->n_channels,
        .n_own_channels = (double)f->n_own_channels,
        .noise = recipe_noise(&f->recipe),
        .n_emitters = (double)f->emitters,
        .n_planes = (double)f->n_planes,
        .n_blocks = f->recipe.method == RECIPE_BLOCKS ? forecast_blocks((double)f->n, &f->recipe) : 0};
    f->method->forecast(&scale, method_own_const(f->build, f->method), &made);
    if (f->method->kind->narrow != NULL) {
        const double share = (double)panel_value_size(f->precision) / (double)panel_value_size(PANEL_F32);
        made.loaded *= share;
        made.stored *= share;
    }
    return made;
}

double forecast_operator_bytes(const forecast *f) {
    return method_bytes(f).stored;
}

/* Stored coefficients per element of compressed form factors, at most: measured 255 (a Cornell box of 10,249
 * elements) to 885 (an atrium of 6,000) at epsilon .05, 902 at .0025 (a box of 40,978); where they were as
 * many as F has they are not kept. Bytes of a coefficient and of an element while they are found. */
static const double compressed_most = 900, compressed_number_bytes = 26, compressed_element_bytes = 2500;

static double compress_bytes(const forecast *f) {
    const double n = (double)f->n;
    if (!f->compress || recipe_noise(&f->recipe) > 0) return 0;
    const double numbers = fmin(compressed_most * pow(.05 / f->build->epsilon, .25), n / 2);
    return n * (compressed_element_bytes + compressed_number_bytes * numbers);
}

/* Of each probe of a round its emission, an answer, its first light with its spread, and corrections by two
 * references; the vectors of the solutions that are found at once; an LU, which takes all probes in one
 * round; and the walk of first light, whose nodes are those of blocks. */
static double judge_bytes(const forecast *f) {
    const double n = (double)f->n, n_channels = (double)f->n_channels, others = JUDGE_RANDOM_PROBES + 1;
    const bool dense = f->n <= REFERENCE_DENSE_ELEMENTS && f->judge_recipe.method != RECIPE_BLOCKS;
    const double all = (double)f->probes + others,
                 round = dense ? all : fmin(all, (double)judge_at_once(f->n) + 5);
    const double columns = (double)guided_reference_columns(f->n, f->n_channels);
    const double walk = f->judge_recipe.method == RECIPE_BLOCKS ? block_element_bytes + 60 : 0;
    return n * (32 * round * n_channels + 72 * fmin(round * n_channels, columns) + walk) +
           (dense ? 8 * n * n : 0);
}

/* Both samples of the judge's pairs are found together: of each pair its state, both triangles, and two more
 * that are made of them, 9 + 2 * 8 + 2 * 8 bytes. */
static bool shares_pairs(const forecast *f) {
    return f->judge_recipe.method == RECIPE_PAIRS && !f->scratch;
}

double forecast_bytes(const forecast *f) {
    const double n = (double)f->n;
    const method_forecast op = method_bytes(f);
    const double of_mesh = 400 * n + forecast_tile_bytes(n) * (double)f->sky_tiles;
    const double sample = held_bytes(f, forecast_rows_bytes(n, &f->recipe), &f->recipe);
    const double trace = f->from_store ? 0 : trace_bytes(n, &f->recipe, f->scratch, f->large);
    const double held = f->streamed ? stream_bytes(n, &f->recipe) : sample;
    double peak = fmax(f->streamed ? held : trace, held + fmax(op.building, op.loaded + compress_bytes(f)));
    if (f->probes > 0) {
        const recipe *r = &f->judge_recipe;
        const double references = held_bytes(f, forecast_reference_bytes(f), r);
        const double judge = judge_bytes(f);
        const double second = shares_pairs(f) ? 20.5 * n * n
                                              : held_bytes(f, forecast_rows_bytes(n, r), r) +
                                                    trace_bytes(n, r, f->scratch, f->large);
        peak = fmax(peak, sample + op.loaded + fmax(references + judge, second));
    }
    return of_mesh + peak;
}

/* Halves the rays or pixels; false when they are few already. */
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
    case RECIPE_BLOCKS:
        return false;
    }
    return true;
}

/* "--rays 1024" or "--resolution 512" */
static void format_recipe(const recipe *r, char text[40]) {
    if (r->method == RECIPE_PAIRS || r->method == RECIPE_NEAR_PAIRS || r->method == RECIPE_BLOCKS)
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
    const char *method = f->method != NULL && f->method->smaller != NULL ? f->method->smaller : "";
    forecast cheaper = *f;
    bool less = false;
    if (f->sky_tiles > 0) snprintf(sky, sizeof sky, " and %zu sky tiles", f->sky_tiles);
    cheaper.sky_tiles = 0;
    const double spare = limit - forecast_bytes(&cheaper);
    if (f->sky_tiles > 0 && spare >= forecast_tile_bytes((double)f->n)) {
        snprintf(advice, sizeof advice, "a --sky of at most %.0f tiles, or --memory %s",
                 floor(spare / forecast_tile_bytes((double)f->n)), needs);
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
    if (*method != '\0') cheaper.method = method_fallback();
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
        snprintf(advice, sizeof advice, "%s%s%s", method, *method != '\0' ? " " : "", fits);
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
    unsigned long long kilobytes = 0;
    machine limits;
    if (!read_number("/proc/meminfo", "MemAvailable: %llu kB", &kilobytes)) return 0;
    const uint64_t bytes = (uint64_t)kilobytes * 1024;
    machine_read("", &limits);
    return limits.memory_left < bytes ? limits.memory_left : bytes;
}
