#include "solver/method/report.h"

#include "store/status.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

static report_figure *place_of(build_report *report, const char *name) {
    size_t k = 0;
    while (k < report->n_figures && strcmp(report->figures[k].name, name) != 0) k++;
    assert(k < REPORT_FIGURES);
    if (k == report->n_figures) report->n_figures++;
    return &report->figures[k];
}

void report_number(build_report *report, const char *name, double value) {
    *place_of(report, name) = (report_figure){.name = name, .number = value};
}

void report_count(build_report *report, const char *name, double value) {
    *place_of(report, name) = (report_figure){.name = name, .number = value, .whole = true};
}

void report_text(build_report *report, const char *name, const char *text) {
    *place_of(report, name) = (report_figure){.name = name, .text = text};
}

double report_get(const build_report *report, const char *name, double otherwise) {
    for (size_t k = 0; k < report->n_figures; k++)
        if (strcmp(report->figures[k].name, name) == 0) return report->figures[k].number;
    return otherwise;
}

bool report_is(const build_report *report, const char *name, const char *text) {
    for (size_t k = 0; k < report->n_figures; k++)
        if (strcmp(report->figures[k].name, name) == 0)
            return report->figures[k].text != NULL && strcmp(report->figures[k].text, text) == 0;
    return false;
}

void report_step_add(build_report *report, const char *name, double seconds) {
    assert(report->n_steps < REPORT_STEPS);
    report->steps[report->n_steps++] = (report_step){name, seconds};
}

double report_seconds(const build_report *report) {
    double sum = 0;
    for (size_t k = 0; k < report->n_steps; k++) sum += report->steps[k].seconds;
    return sum;
}

void report_line(const build_report *report, char *line, size_t size) {
    size_t length = 0;
    line[0] = '\0';
    for (size_t k = 0; k < report->n_figures && length < size; k++) {
        const report_figure *f = &report->figures[k];
        const char *comma = k > 0 ? ", " : "";
        const int n = f->text != NULL
                          ? snprintf(line + length, size - length, "%s%s %s", comma, f->name, f->text)
                          : snprintf(line + length, size - length, "%s%s %.3g", comma, f->name, f->number);
        length += n > 0 ? (size_t)n : 0;
    }
}

lam_status report_save(const build_report *report, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < report->n_figures; k++) {
        const report_figure *f = &report->figures[k];
        if (f->text != NULL)
            TRY(store_set_text(s, "/operator", f->name, f->text, error));
        else if (f->whole)
            TRY(store_set_integer(s, "/operator", f->name, (int64_t)f->number, error));
        else
            TRY(store_set_number(s, "/operator", f->name, f->number, error));
    }
done:
    return status;
}
