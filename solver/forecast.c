#include "solver/forecast.h"

#include <math.h>
#include <stdio.h>

/* Below this many rays a forecast is not worth making cheaper. */
enum { FEWEST_RAYS = 256 };

/* Bytes of the rows of one merged sample: a pair is seen from either end, so a row has at most twice as many
 * entries as rays, an index and a value each. */
static double sample_bytes(double n, double rays) {
    return n * fmin(n, 2 * rays) * 8;
}

double forecast_bytes(const forecast *f) {
    const double n = (double)f->n, n_channels = (double)f->n_channels, rays = (double)f->rays;
    const double mesh = 400 * n, sample = sample_bytes(n, rays);
    /* While it is traced, a sample exists as counts, as rows, and as the merged rows. */
    const double trace = 2 * sample;
    /* The inverse in double and the operator; else leaf blocks and both factors of two nodes. */
    const double rank = f->rank > 0 ? fmin((double)f->rank, n) : fmin(1024, n);
    const double build = f->exact ? n * n * (8 + 4 * n_channels) : 4 * n * (2 * fmin(1024, n) + 6 * rank);
    const double kept = f->exact ? 4 * n * n * n_channels : 8 * n * rank;
    double peak = sample + fmax(trace, build);
    if (f->probes > 0) {
        /* Two more samples and their mean; emissions, answers and the vectors of the iteration per probe. */
        const double probes = (double)f->probes + 9;
        const double references = 2 * sample + sample_bytes(n, 2 * rays);
        const double judge = probes * n * (12 * n_channels + 72) + (n <= 8192 ? 8 * n * n : 0);
        peak = fmax(peak, sample + kept + fmax(references + judge, 2 * sample + trace));
    }
    return mesh + peak;
}

static void format_bytes(double bytes, char text[32]) {
    if (bytes < 0x1p30)
        snprintf(text, 32, "%.0fM", ceil(bytes * 0x1p-20));
    else
        snprintf(text, 32, "%.1fG", ceil(bytes * 0x1p-30 * 10) / 10);
}

lam_status forecast_check(const forecast *f, double limit, lam_error *error) {
    lam_status status = LAM_OK;
    const double bytes = forecast_bytes(f);
    char needs[32], allows[32], advice[128];
    if (bytes <= limit) return LAM_OK;
    format_bytes(bytes, needs);
    format_bytes(limit, allows);
    const char *method = f->exact ? "--method low-rank" : "";
    forecast cheaper = *f;
    cheaper.exact = false;
    while (cheaper.rays > FEWEST_RAYS && forecast_bytes(&cheaper) > limit) cheaper.rays /= 2;
    if (forecast_bytes(&cheaper) > limit) {
        /* Every term grows with n: halve until it fits. */
        while (cheaper.n > 1 && forecast_bytes(&cheaper) > limit) cheaper.n /= 2;
        snprintf(advice, sizeof advice, "about %zu elements at %zu rays, or --memory %s", cheaper.n,
                 cheaper.rays, needs);
    } else if (cheaper.rays < f->rays) {
        snprintf(advice, sizeof advice, "%s%s--rays %zu", method, f->exact ? " " : "", cheaper.rays);
    } else {
        snprintf(advice, sizeof advice, "%s", method);
    }
    FAIL(error, LAM_ERR_MEMORY,
         "%zu elements at %zu rays need about %s of memory, --memory allows %s; fits: %s", f->n, f->rays,
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
