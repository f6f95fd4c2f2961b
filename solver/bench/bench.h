/* Suites of measurements: each measures and hands tables and plots on; files and terminal are not theirs. */
#ifndef LAMBERT_BENCH_BENCH_H
#define LAMBERT_BENCH_BENCH_H

#include "solver/base/progress.h"
#include "solver/bench/plot.h"
#include "solver/bench/table.h"

/* Where results go, as soon as they are there. */
typedef struct bench_sink {
    lam_status (*table)(void *context, const table *t, lam_error *error);
    lam_status (*plot)(void *context, const plot *p, lam_error *error);
    void (*say)(void *context, const char *line); /* for the log */
    void *context;
} bench_sink;

typedef enum bench_scale { BENCH_QUICK, BENCH_DEFAULT, BENCH_FULL } bench_scale;

/* "quick", "default", "full" */
const char *bench_scale_name(bench_scale scale);

typedef struct bench_run {
    bench_scale scale;
    uint64_t seed;
    uint64_t memory;   /* bytes that are free; 0 when unknown */
    const char *scene; /* a file for the parts that take any scene; NULL: their own */
    const bench_sink *sink;
    const progress *progress;
} bench_run;

/* A printf-like line for the log. */
void bench_say(const bench_run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Hands a finished table on. Errors: LAM_ERR_MEMORY when a cell was lost, and the sink's. */
lam_status bench_table(const bench_run *run, const table *t, lam_error *error);

/* LAM_ERR_CANCELLED when a signal came: between measurements that do not poll. */
lam_status bench_check(const bench_run *run, lam_error *error);

typedef lam_status bench_suite_run(const bench_run *run, lam_error *error);

bench_suite_run bench_formfactors, bench_lowrank, bench_stability, bench_cities, bench_service,
    bench_hierarchical;

typedef struct bench_suite {
    const char *name;
    bench_suite_run *run;
} bench_suite;

/* The suites of the contract; the last has no name. */
extern const bench_suite bench_suites[];

#endif
