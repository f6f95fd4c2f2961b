/* Bytes of memory that a precompute takes, and options that would make it fit. */
#include "solver/base/machine.h"
#include "solver/formfactor/source.h"
#include "solver/method/judge/guided_reference.h"
#include "solver/method/judge/judge.h"
#include "solver/precompute/forecast/forecast.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Bytes of one tile of a sky: the irradiance of each element, and the tile itself. */
double forecast_tile_bytes(double n) {
    return 4 * n + 100;
}

/* The part of a sample's rows that lies in memory; rows by pairs always do. */
static double held_bytes(const forecast *f, double bytes, const recipe *r) {
    return f->large && recipe_can(r, SOURCE_LARGE) ? 0 : bytes;
}

/* Bytes of the judge's two samples, or its blocks. */
double forecast_reference_bytes(const forecast *f) {
    const double one = recipe_source(&f->judge_recipe)->bytes((double)f->n, &f->judge_recipe);
    return recipe_can(&f->judge_recipe, SOURCE_BLOCKS) ? one : 2 * one;
}

/* The share of the method; nothing where no operator is built. */
static method_forecast method_bytes(const forecast *f) {
    method_forecast made = {.building = 0};
    if (f->method == NULL) return made;
    const factor_source *const own = recipe_source(&f->recipe);
    const method_scale scale = {.n = (double)f->n,
                                .n_channels = (double)f->n_channels,
                                .n_own_channels = (double)f->n_own_channels,
                                .noise = recipe_noise(&f->recipe),
                                .n_emitters = (double)f->emitters,
                                .n_planes = (double)f->n_planes,
                                .n_blocks = own->blocks != NULL ? own->blocks((double)f->n, &f->recipe) : 0};
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

/* Memory holds of each probe of a round its emission, an answer, its first light with its spread, and
 * corrections by two references; the vectors of the solutions that are found at once; an LU, which takes all
 * probes in one round; and the walk of first light, whose nodes are those of blocks. */
static const double walk_bytes = 460;

static double judge_bytes(const forecast *f) {
    const double n = (double)f->n, n_channels = (double)f->n_channels, others = JUDGE_RANDOM_PROBES + 1;
    const double whole =
        fmin((double)f->n_groups, (double)judge_whole_most(f->n, f->n_channels, f->n_groups));
    const bool blocks = recipe_can(&f->judge_recipe, SOURCE_BLOCKS),
               dense = f->n <= REFERENCE_DENSE_ELEMENTS && !blocks;
    const double all = (double)f->probes + others + whole,
                 round = dense ? all : fmin(all, (double)judge_at_once(f->n) + 5 + whole);
    const double columns = (double)guided_reference_columns(f->n, f->n_channels);
    const double walk = blocks ? walk_bytes : 0;
    return n * (32 * round * n_channels + 72 * fmin(round * n_channels, columns) + walk) +
           (dense ? 8 * n * n : 0);
}

/* Both samples of the judge's pairs are found together: of each pair its state, both triangles, and two more
 * that are made of them, 9 + 2 * 8 + 2 * 8 bytes. */
static bool shares_pairs(const forecast *f) {
    return recipe_can(&f->judge_recipe, SOURCE_TWICE) && !f->scratch;
}

double forecast_bytes(const forecast *f) {
    const double n = (double)f->n;
    const method_forecast op = method_bytes(f);
    const double of_mesh = 400 * n + forecast_tile_bytes(n) * (double)f->sky_tiles;
    const factor_source *const own = recipe_source(&f->recipe), *const other =
                                                                    recipe_source(&f->judge_recipe);
    const factor_place place = f->large     ? FACTORS_ON_DISK
                               : f->scratch ? FACTORS_FOUND_ON_DISK
                                            : FACTORS_IN_MEMORY;
    const double sample = held_bytes(f, own->bytes(n, &f->recipe), &f->recipe);
    const double trace = f->from_store ? 0 : own->making_bytes(n, &f->recipe, place);
    const double streamed = own->stream_bytes != NULL ? own->stream_bytes(n, &f->recipe) : 0;
    const double held = f->streamed ? streamed : sample;
    double peak = fmax(f->streamed ? held : trace, held + fmax(op.building, op.loaded));
    if (f->probes > 0) {
        const recipe *r = &f->judge_recipe;
        const double references = held_bytes(f, forecast_reference_bytes(f), r);
        const double judge = judge_bytes(f);
        const double second = shares_pairs(f)
                                  ? 20.5 * n * n
                                  : held_bytes(f, other->bytes(n, r), r) + other->making_bytes(n, r, place);
        peak = fmax(peak, sample + op.loaded + fmax(references + judge, second));
    }
    return of_mesh + peak;
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
    while (forecast_bytes(&cheaper) > limit && recipe_source(&cheaper.recipe)->less(&cheaper.recipe)) {
        less = true;
        cheaper.judge_recipe = recipe_of_judge(&cheaper.recipe, f->judge_recipe.rays, 0);
    }
    recipe_source(&f->recipe)->option(&f->recipe, asked);
    recipe_source(&cheaper.recipe)->option(&cheaper.recipe, fits);
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
