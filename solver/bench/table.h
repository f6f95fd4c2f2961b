/* Tables of measurements and the forms they are written in: CSV, JSON, and columns for a terminal. */
#ifndef LAMBERT_BENCH_TABLE_H
#define LAMBERT_BENCH_TABLE_H

#include "store/status.h"

#include <stdint.h>
#include <stdio.h>

/* A column holds texts, or numbers in one unit ("" for a ratio). All static texts. */
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
    const char *name;  /* of its files, static */
    const char *title; /* static */
    const table_column *columns;
    size_t n_columns;
    bool printed;      /* short enough for the terminal */
    table_cell *cells; /* [rows][n_columns]; the last row may be incomplete */
    size_t used, capacity;
    bool out_of_memory; /* a cell was lost; table_check says so */
} table;

/* Cells are added one after the other, row by row, in the order and of the kind of the columns. */
void table_text(table *t, const char *text);
void table_number(table *t, double number); /* not finite: not measured */
void table_free(table *t);

/* LAM_ERR_MEMORY when a cell was lost. */
lam_status table_check(const table *t, lam_error *error);
size_t table_rows(const table *t);

/* Where and how a table was measured. */
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

#endif
