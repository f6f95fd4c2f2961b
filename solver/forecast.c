#include "solver/forecast.h"

#include <math.h>
#include <stdio.h>

/* Below this many rays or pixels a forecast is not worth making cheaper. */
enum { FEWEST_RAYS = 256, LOWEST_RESOLUTION = 32 };

/* Bytes of the rows of one merged sample: a pair is seen from either end, so rows have on average at most
 * twice as many entries as an element has rays, an index and a value each. */
static double sample_bytes(double n, double rays) {
    return n * fmin(n, 2 * rays) * 8;
}

/* Bytes of one tile of a sky: what each element receives of it, and where it is. */
static double tile_bytes(double n) {
    return 4 * n + 100;
}

/* Bytes of one merged sample. */
static double recipe_bytes(double n, const recipe *r) {
    switch (r->method) {
    case RECIPE_PAIRS:
        return sample_bytes(n, n);
    /* A hemicube is a ray for each of its pixels. */
    case RECIPE_HEMICUBE:
        return sample_bytes(n, 3 * (double)r->resolution * (double)r->resolution);
    case RECIPE_RAYS:
    case RECIPE_NEAR_PAIRS:
        break;
    }
    return sample_bytes(n, (double)r->rays);
}

double forecast_bytes(const forecast *f) {
    const double n = (double)f->n, n_channels = (double)f->n_channels;
    const double mesh = 400 * n + tile_bytes(n) * (double)f->sky_tiles;
    const double sample = recipe_bytes(n, &f->recipe);
    /* While it is traced, a sample exists as counts, as rows, and as the merged rows; of pairs as one
     * triangle with what is known of each, with room to grow, and as rows. */
    const double trace = f->recipe.method == RECIPE_PAIRS        ? sample + 6.8 * n * n
                         : f->recipe.method == RECIPE_NEAR_PAIRS ? 3 * sample
                                                                 : 2 * sample;
    /* The inverse in double and the operator; else leaf blocks and both factors of two nodes. */
    const double rank = f->rank > 0 ? fmin((double)f->rank, n) : fmin(1024, n);
    const double build = f->exact ? n * n * (8 + 4 * n_channels) : 4 * n * (2 * fmin(1024, n) + 6 * rank);
    const double kept = f->exact ? 4 * n * n * n_channels : 8 * n * rank;
    double peak = sample + fmax(trace, build);
    if (f->probes > 0) {
        /* Two more samples and their mean; emissions, answers and the vectors of the iteration per probe. */
        const double probes = (double)f->probes + 9;
        const double reference = recipe_bytes(n, &f->judge_recipe);
        const bool dense = f->judge_recipe.method == RECIPE_PAIRS;
        const double references =
            2 * reference + (dense ? reference : sample_bytes(n, 2 * (double)f->judge_recipe.rays));
        const double judge = probes * n * (12 * n_channels + 72) + (n <= 8192 ? 8 * n * n : 0);
        peak = fmax(peak, sample + kept + fmax(references + judge, 4 * reference));
    }
    return mesh + peak;
}

static void format_bytes(double bytes, char text[32]) {
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
    format_bytes(bytes, needs);
    format_bytes(limit, allows);
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
         "%zu elements with %s%s need about %s of memory, --memory allows %s; fits: %s", f->n, asked, sky,
         needs, allows, advice);
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
