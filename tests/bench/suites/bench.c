/* Tables of measurements as CSV, as JSON and for a terminal; the list of suites. */
#include "tests/bench/suites/bench.h"

#include "solver/base/csv_text.h"

#include "solver/base/array_grow.h"

#include <assert.h>
#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static void add(table *t, table_cell cell) {
    if (array_grow(&t->cells, &t->capacity, t->used + 1, sizeof *t->cells, "table", NULL) != LAM_OK) {
        free(cell.text);
        t->out_of_memory = true;
        return;
    }
    t->cells[t->used++] = cell;
}

void table_text(table *t, const char *text) {
    assert(t->out_of_memory || t->columns[t->used % t->n_columns].unit == NULL);
    char *copy = strdup(text);
    if (copy == NULL)
        t->out_of_memory = true;
    else
        add(t, (table_cell){.number = NAN, .text = copy});
}

void table_number(table *t, double number) {
    assert(t->out_of_memory || t->columns[t->used % t->n_columns].unit != NULL);
    add(t, (table_cell){.number = isfinite(number) ? number : NAN});
}

void table_free(table *t) {
    for (size_t i = 0; i < t->used; i++) free(t->cells[i].text);
    free(t->cells);
    t->cells = NULL;
    t->used = t->capacity = 0;
}

lam_status table_check(const table *t, lam_error *error) {
    if (t->out_of_memory) return status_fail(error, LAM_ERR_MEMORY, "table %s: not enough memory", t->name);
    return LAM_OK;
}

size_t table_rows(const table *t) {
    return t->used / t->n_columns;
}

void table_csv(const table *t, FILE *stream) {
    for (size_t c = 0; c < t->n_columns; c++)
        fprintf(stream, "%s%s", t->columns[c].name, c + 1 < t->n_columns ? "," : "\r\n");
    for (size_t i = 0; i < table_rows(t) * t->n_columns; i++) {
        const table_cell *cell = &t->cells[i];
        if (cell->text != NULL)
            csv_text(cell->text, stream);
        else if (isfinite(cell->number))
            fprintf(stream, "%.12g", cell->number);
        fputs((i + 1) % t->n_columns != 0 ? "," : "\r\n", stream);
    }
}

static json_t *json_row(const table *t, size_t row) {
    json_t *object = json_object();
    for (size_t c = 0; c < t->n_columns; c++) {
        const table_cell *cell = &t->cells[row * t->n_columns + c];
        json_t *value = cell->text != NULL       ? json_string(cell->text)
                        : isfinite(cell->number) ? json_real(cell->number)
                                                 : json_null();
        if (json_object_set_new(object, t->columns[c].name, value) != 0) {
            json_decref(object);
            return NULL;
        }
    }
    return object;
}

lam_status table_json(const table *t, const table_run *run, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *columns = json_array(), *rows = json_array(), *root = NULL;
    for (size_t c = 0; c < t->n_columns; c++) {
        const table_column *column = &t->columns[c];
        /* s? makes a column of texts null */
        if (json_array_append_new(columns, json_pack("{s:s, s:s?, s:s}", "name", column->name, "unit",
                                                     column->unit, "doc", column->doc)) != 0)
            FAIL(error, LAM_ERR_MEMORY, "table %s: not enough memory", t->name);
    }
    for (size_t r = 0; r < table_rows(t); r++)
        if (json_array_append_new(rows, json_row(t, r)) != 0)
            FAIL(error, LAM_ERR_MEMORY, "table %s: not enough memory", t->name);
    root = json_pack("{s:s, s:{s:s, s:s, s:s, s:I, s:i}, s:O, s:O}", "title", t->title, "run", "tool",
                     run->tool, "scale", run->scale, "time", run->time, "seed", (json_int_t)run->seed,
                     "threads", run->threads, "columns", columns, "rows", rows);
    if (root == NULL) FAIL(error, LAM_ERR_MEMORY, "table %s: not enough memory", t->name);
    json_dumpf(root, stream, JSON_INDENT(1) | JSON_REAL_PRECISION(12));
    fputc('\n', stream);
done:
    json_decref(columns);
    json_decref(rows);
    json_decref(root);
    return status;
}

enum { CELL_MOST = 64 };

static void format_cell(const table_column *column, const table_cell *cell, char text[CELL_MOST]) {
    const double x = cell->number;
    if (column->unit == NULL)
        snprintf(text, CELL_MOST, "%s", cell->text);
    else if (!isfinite(x))
        snprintf(text, CELL_MOST, "-");
    else if (x == floor(x) && fabs(x) < 1e9)
        snprintf(text, CELL_MOST, "%.0f", x);
    else
        snprintf(text, CELL_MOST, "%.3g", x);
}

void table_print(const table *t, FILE *stream) {
    char text[CELL_MOST];
    fprintf(stream, "%s\n", t->title);
    for (size_t row = 0; row <= table_rows(t); row++) {
        for (size_t c = 0; c < t->n_columns; c++) {
            const bool left = t->columns[c].unit == NULL;
            int width = (int)strlen(t->columns[c].name);
            for (size_t r = 0; r < table_rows(t); r++) {
                format_cell(&t->columns[c], &t->cells[r * t->n_columns + c], text);
                if ((int)strlen(text) > width) width = (int)strlen(text);
            }
            if (row == 0)
                snprintf(text, sizeof text, "%s", t->columns[c].name);
            else
                format_cell(&t->columns[c], &t->cells[(row - 1) * t->n_columns + c], text);
            /* the last column of texts needs no spaces after it */
            fprintf(stream, "%s%*s", c > 0 ? "  " : "",
                    left && c + 1 == t->n_columns ? 0
                    : left                        ? -width
                                                  : width,
                    text);
        }
        fputc('\n', stream);
    }
    fputc('\n', stream);
}

const bench_suite bench_suites[] = {
    {.name = "formfactors", .run = bench_formfactors},
    {.name = "lowrank", .run = bench_lowrank},
    {.name = "stability", .run = bench_stability},
    {.name = "cities", .run = bench_cities},
    {.name = "service", .script = "service.py"},
    {.name = "hierarchical", .run = bench_hierarchical},
    {.name = "mesh", .run = bench_mesh},
    {.name = "reuse", .run = bench_reuse},
    {.name = "honesty", .script = "honesty.py"},
    {.name = "cie171", .script = "cie171.py"},
    {.name = NULL},
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
