#include "solver/bench/bench.h"

#include <stdarg.h>

const bench_suite bench_suites[] = {
    {"formfactors", bench_formfactors},
    {"lowrank", bench_lowrank},
    {"stability", bench_stability},
    {"cities", bench_cities},
    {"service", bench_service},
    {"hierarchical", bench_hierarchical},
    {NULL, NULL},
};

const char *bench_scale_name(bench_scale scale) {
    static const char *const names[] = {"quick", "default", "full"};
    return names[scale];
}

void bench_say(const bench_run *run, const char *format, ...) {
    char line[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    run->sink->say(run->sink->context, line);
}

lam_status bench_table(const bench_run *run, const table *t, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(table_check(t, error));
    TRY(run->sink->table(run->sink->context, t, error));
done:
    return status;
}

lam_status bench_check(const bench_run *run, lam_error *error) {
    if (progress_cancelled(run->progress)) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    return LAM_OK;
}
