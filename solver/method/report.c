#include "solver/method/report.h"

#include "store/groups.h"
#include "store/status.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

/* The words of every figure that a method reports; the unit stands behind the value. */
static const report_words words[] = {
    {"factorizer", "factorizer", ""},
    {"rcond", "reciprocal condition number", ""},
    {"epsilon", "norm error at most", ""},
    {"epsilon_stated", "error that --epsilon is about, as stated", ""},
    {"group_error", "error of the worst group at most", ""},
    {"group_error_stated", "error of the worst group, as stated", ""},
    {"trials", "trials", ""},
    {"measured_norm_error", "measured norm error", ""},
    {"norm", "order of the norm", ""},
    {"relative_bound", "bound of the relative error", ""},
    {"rank", "rank", ""},
    {"levels", "levels of the tree", ""},
    {"passes", "passes over the form factors", ""},
    {"budget", "errors of the steps add up by", ""},
    {"alpha", "share of the last step in the error", ""},
    {"assign", "elements join patches by", ""},
    {"coherence_min", "smallest coherence of a patch", ""},
    {"patch_area_min", "smallest area of a patch", "m2"},
    {"threshold", "values dropped below", ""},
    {"correction", "correction of dropped values", ""},
    {"probe_residual", "residual of random emission", ""},
    {"smooth_residual", "residual of smooth emission", ""},
    {"uniform_error", "error of uniform radiosity", ""},
    {"residual", "largest residual of an emitter", ""},
    {"paths", "random walks of each position", ""},
    {"reuse", "walks serve other positions by way", ""},
    {"rays_of_path", "rays of a walk", ""},
    {"sweeps", "most products with the form factors", ""},
};

const report_words *report_words_of(const char *name) {
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        if (strcmp(words[k].name, name) == 0) return &words[k];
    return NULL;
}

static report_figure *place_of(build_report *report, const char *name) {
    size_t k = 0;
    while (k < report->n_figures && strcmp(report->figures[k].name, name) != 0) k++;
    assert(k < REPORT_FIGURES && report_words_of(name) != NULL);
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

/* "rank 20", "smallest area of a patch 0.2 m2"; counts are written out. */
static int write_figure(const report_figure *f, char *text, size_t size) {
    const report_words *w = report_words_of(f->name);
    const char *space = w->unit[0] != '\0' ? " " : "";
    if (f->text != NULL) return snprintf(text, size, "%s %s", w->label, f->text);
    return snprintf(text, size, f->whole ? "%s %.0f%s%s" : "%s %.3g%s%s", w->label, f->number, space,
                    w->unit);
}

void report_line(const build_report *report, char *line, size_t size) {
    size_t length = 0;
    line[0] = '\0';
    for (size_t k = 0; k < report->n_figures && length < size; k++) {
        if (k > 0) length += (size_t)snprintf(line + length, size - length, ", ");
        if (length >= size) break;
        const int n = write_figure(&report->figures[k], line + length, size - length);
        length += n > 0 ? (size_t)n : 0;
    }
}

lam_status report_save(const build_report *report, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < report->n_figures; k++) {
        const report_figure *f = &report->figures[k];
        if (f->text != NULL)
            TRY(store_set_text(s, STORE_OPERATOR, f->name, f->text, error));
        else if (f->whole)
            TRY(store_set_integer(s, STORE_OPERATOR, f->name, (int64_t)f->number, error));
        else
            TRY(store_set_number(s, STORE_OPERATOR, f->name, f->number, error));
    }
done:
    return status;
}
