/* What a verb says while it works: log lines, the progress line, Ctrl-C. Standard error only. */
#ifndef LAMBERT_BASE_TERMINAL_H
#define LAMBERT_BASE_TERMINAL_H

#include "solver/base/progress.h"

#include <stdint.h>

typedef struct terminal {
    const char *program; /* "lambert solve", with which messages begin */
    const char *nothing; /* what a cancelled verb says after "cancelled; ": "nothing was written" */
    bool quiet;
    bool live;            /* shows a progress line */
    char stage[64];       /* the stage the line shows */
    double stage_started; /* seconds */
    double last_shown;
    bool line_shown;
} terminal;

/* Makes ready: progress shows when standard error is a terminal or force_progress is set, and never with
 * quiet. Catches SIGINT and SIGTERM (a second one ends at once) and turns "file too large" into an error. */
void terminal_open(terminal *t, const char *program, bool quiet, bool force_progress);

/* The callbacks to hand to long work; they live as long as t. */
progress terminal_progress(terminal *t);

/* One line of the log; nothing with quiet. Erases the progress line first. */
void terminal_log(terminal *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* One line that quiet does not silence: "PROGRAM: warning: ...". */
void terminal_warn(terminal *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Erases the progress line. */
void terminal_clear(terminal *t);

/* Says why a verb failed, in one line ("cancelled; ..." when a signal came); returns its exit status. */
int terminal_fail(terminal *t, const lam_error *error);

/* The exit status of a verb once its standard output is out: 1 instead of status where that cannot be
 * written. */
int terminal_finish(const char *program, int status);

/* Whether SIGINT or SIGTERM came. */
bool terminal_cancelled(void);

/* Fails with LAM_ERR_CANCELLED when a signal came: between stages that do not poll. */
lam_status terminal_check(lam_error *error);

#endif
