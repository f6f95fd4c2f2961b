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

double forecast_bytes(const forecast *f) {
    const double n = (double)f->n, n_channels = (double)f->n_channels, rays = (double)f->rays;
    /* A hemicube is a ray for each of its pixels. */
    const double pixels = 3 * (double)f->resolution * (double)f->resolution;
    const double mesh = 400 * n;
    const double sample = f->pairs ? sample_bytes(n, n) : sample_bytes(n, pixels > 0 ? pixels : rays);
    /* While it is traced, a sample exists as counts, as rows, and as the merged rows; of pairs as magnitudes,
     * first looks and rows. */
    const double trace = f->pairs ? sample + 2.5 * n * n : 2 * sample;
    /* The inverse in double and the operator; else leaf blocks and both factors of two nodes. */
    const double rank = f->rank > 0 ? fmin((double)f->rank, n) : fmin(1024, n);
    const double build = f->exact ? n * n * (8 + 4 * n_channels) : 4 * n * (2 * fmin(1024, n) + 6 * rank);
    const double kept = f->exact ? 4 * n * n * n_channels : 8 * n * rank;
    double peak = sample + fmax(trace, build);
    if (f->probes > 0) {
        /* Two more samples and their mean; emissions, answers and the vectors of the iteration per probe. */
        const double probes = (double)f->probes + 9;
        const double reference = f->pairs ? sample : sample_bytes(n, rays);
        const double references = 2 * reference + (f->pairs ? sample : sample_bytes(n, 2 * rays));
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
static bool sample_less(forecast *f) {
    const bool hemicubes = f->resolution > 0;
    if (f->pairs) {
        f->pairs = false;
        return true;
    }
    if (hemicubes ? f->resolution / 2 < LOWEST_RESOLUTION : f->rays <= FEWEST_RAYS) return false;
    if (hemicubes)
        f->resolution = f->resolution / 4 * 2; /* even */
    else
        f->rays /= 2;
    return true;
}

/* "1024 rays" or "--resolution 512" */
static void format_sampling(const forecast *f, char text[40]) {
    if (f->pairs)
        snprintf(text, 40, "--quality high");
    else if (f->resolution > 0)
        snprintf(text, 40, "--resolution %zu", f->resolution);
    else
        snprintf(text, 40, "%zu rays", f->rays);
}

lam_status forecast_check(const forecast *f, double limit, lam_error *error) {
    lam_status status = LAM_OK;
    const double bytes = forecast_bytes(f);
    char needs[32], allows[32], asked[40], fits[40], advice[160];
    if (bytes <= limit) return LAM_OK;
    format_bytes(bytes, needs);
    format_bytes(limit, allows);
    const char *method = f->exact ? "--method low-rank" : "";
    forecast cheaper = *f;
    cheaper.exact = false;
    while (forecast_bytes(&cheaper) > limit && sample_less(&cheaper)) continue;
    format_sampling(f, asked);
    format_sampling(&cheaper, fits);
    if (forecast_bytes(&cheaper) > limit) {
        /* Every term grows with n: halve until it fits. */
        while (cheaper.n > 1 && forecast_bytes(&cheaper) > limit) cheaper.n /= 2;
        snprintf(advice, sizeof advice, "about %zu elements at %s, or --memory %s", cheaper.n, fits, needs);
    } else if (cheaper.rays < f->rays || cheaper.pairs != f->pairs) {
        snprintf(advice, sizeof advice, "%s%s--rays %zu", method, f->exact ? " " : "", cheaper.rays);
    } else if (cheaper.resolution < f->resolution) {
        snprintf(advice, sizeof advice, "%s%s%s", method, f->exact ? " " : "", fits);
    } else {
        snprintf(advice, sizeof advice, "%s", method);
    }
    FAIL(error, LAM_ERR_MEMORY, "%zu elements at %s need about %s of memory, --memory allows %s; fits: %s",
         f->n, asked, needs, allows, advice);
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
