/* Suites of measurements. A suite measures and hands finished tables on; it knows neither files nor terminal.
 */
#ifndef LAMBERT_BENCH_BENCH_H
#define LAMBERT_BENCH_BENCH_H

#include "solver/base/progress.h"

#include <stdint.h>
#include <stdio.h>

/* A column holds texts, or numbers in one unit ("" for a ratio). Its texts outlive its table. */
typedef struct table_column {
    const char *name; /* of a CSV column and a JSON member: snake_case */
    const char *unit; /* NULL: texts */
    const char *doc;  /* one line */
} table_column;

typedef struct table_cell {
    double number; /* NaN: not measured */
    char *text;    /* of a column of texts */
} table_cell;

typedef struct table {
    const char *name; /* of its files */
    const char *title;
    const table_column *columns;
    size_t n_columns;
    bool printed;      /* short enough for the terminal */
    table_cell *cells; /* [rows][n_columns]; the last row may be incomplete */
    size_t used, capacity;
    bool out_of_memory; /* a cell was lost; table_check says so */
} table;

/* Cells are added row by row, in the order of the columns and of their kind. */
void table_text(table *t, const char *text);
void table_number(table *t, double number); /* not finite: not measured */
void table_free(table *t);

/* LAM_ERR_MEMORY when a cell was lost. */
lam_status table_check(const table *t, lam_error *error);
size_t table_rows(const table *t);

/* The run that a table belongs to. */
typedef struct table_run {
    const char *tool, *scale, *time; /* time: ISO 8601 */
    uint64_t seed;
    int threads;
} table_run;

/* RFC 4180: a line of column names, a line a row; what was not measured is empty. A failed write is seen by
 * ferror(stream). */
void table_csv(const table *t, FILE *stream);

/* An object with title, run, columns and rows (objects; null where nothing was measured).
 * Errors: LAM_ERR_MEMORY. */
lam_status table_json(const table *t, const table_run *run, FILE *stream, lam_error *error);

/* The title and aligned columns, numbers to three digits. */
void table_print(const table *t, FILE *stream);

/* The receiver of results, table by table. */
typedef struct bench_sink {
    lam_status (*table)(void *context, const table *t, lam_error *error);
    void (*say)(void *context, const char *line); /* for the log */
    void *context;
} bench_sink;

typedef enum bench_scale { BENCH_QUICK, BENCH_DEFAULT, BENCH_FULL } bench_scale;

/* "quick", "default" or "full" */
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

bench_suite_run bench_formfactors, bench_lowrank, bench_stability, bench_cities, bench_hierarchical,
    bench_mesh, bench_reuse;

/* A suite is a function, or a script that writes its results as JSON (main.c). */
typedef struct bench_suite {
    const char *name;
    bench_suite_run *run;
    const char *script;
} bench_suite;

/* The suites of the contract; the last has no name. */
extern const bench_suite bench_suites[];

/* The process in which the suite service solves: commands on standard input, numbers on standard output.
 * Works in the current folder. Returns its exit status. */
int service_solver(void);

#endif
