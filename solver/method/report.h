/* The report of a build: named figures, which the store, the log and `lambert info` walk. Each name has its
 * words in the table of report.c. */
#ifndef LAMBERT_METHOD_REPORT_H
#define LAMBERT_METHOD_REPORT_H

#include "store/store.h"

#include <stddef.h>

enum { REPORT_FIGURES = 20, REPORT_STEPS = 4 };

typedef struct report_figure {
    const char *name; /* static, as the attribute of /operator that it becomes; report_words_of knows it */
    const char *text; /* static; NULL: a number */
    double number;
    bool whole; /* stored as an integer */
} report_figure;

typedef struct report_step {
    const char *name; /* static */
    double seconds;
} report_step;

typedef struct build_report {
    const char *method; /* as built; static text */
    char detail[288];   /* figures that the method adds to the reason */
    char reason[864];   /* why this method, and detail */
    size_t n_figures;
    report_figure figures[REPORT_FIGURES];
    size_t n_steps;
    report_step steps[REPORT_STEPS];
    double cost;   /* of an answer, as choice.h counts it, where the method knows it; 0: not */
    bool by_noise; /* the compression follows the noise of rays, so that a smaller epsilon changes nothing */
    bool below_noise; /* the bound asked for is below the noise of the form factors, which is stored too */
    double
        doubtful; /* the residual of smooth emission that the tolerance leaves, where it is larger; else 0 */
} build_report;

/* Each replaces a figure of the same name. */
void report_number(build_report *report, const char *name, double value);
void report_count(build_report *report, const char *name, double value);
void report_text(build_report *report, const char *name, const char *text);

/* The number of this name; otherwise where there is none. */
double report_get(const build_report *report, const char *name, double otherwise);

/* True if a figure has this text. */
bool report_is(const build_report *report, const char *name, const char *text);

/* Adds a step that took so long; the time of all steps. */
void report_step_add(build_report *report, const char *name, double seconds);
double report_seconds(const build_report *report);

/* A figure in words: the label that a reader sees in the place of its name, and its unit. */
typedef struct report_words {
    const char *name, *label;
    const char *unit; /* "" for a text and for a plain number */
} report_words;

/* The words of the figure of this name, static; NULL if no method reports such a figure. */
const report_words *report_words_of(const char *name);

/* The figures in one line, in words: "rank 20, smallest area of a patch 0.2 m2, ...". */
void report_line(const build_report *report, char *line, size_t size);

/* Writes the figures as attributes of /operator. */
lam_status report_save(const build_report *report, store *s, lam_error *error);

#endif
