/* Messages of a running verb: log lines, the progress line, seconds of its stages, Ctrl-C. Standard error
 * only. */
#ifndef LAMBERT_BASE_TERMINAL_H
#define LAMBERT_BASE_TERMINAL_H

#include "solver/base/progress.h"

#include <stdint.h>

/* A finished stage of work and its time. */
typedef struct terminal_stage {
    char name[24];
    double seconds;
} terminal_stage;
#define TERMINAL_STAGES 16

typedef struct terminal {
    const char *program; /* "lambert solve", with which messages begin */
    const char *nothing; /* the end of the message of a cancelled verb: "nothing was written" */
    bool quiet;
    bool brief;           /* leaves out the log */
    bool live;            /* shows a progress line */
    char stage[64];       /* the stage the line shows */
    double stage_started; /* seconds */
    double last_shown;
    bool line_shown;
    terminal_stage done[TERMINAL_STAGES];
    size_t n_done;
} terminal;

/* Makes ready: progress shows when standard error is a terminal or force_progress is set, and never with
 * quiet. Catches SIGINT and SIGTERM (a second one ends at once) and turns "file too large" into an error. */
void terminal_open(terminal *t, const char *program, bool quiet, bool force_progress);

/* Leaves out the log, for a person who waits, where standard error is a terminal: of long work that says at
 * its end what came of it. */
void terminal_be_brief(terminal *t);

/* The callbacks to hand to long work; they live as long as t. */
progress terminal_progress(terminal *t);

/* One line of the log; nothing with quiet. Erases the progress line first. */
void terminal_log(terminal *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* One line of the outcome, which brevity does not leave out; nothing with quiet. */
void terminal_say(terminal *t, const char *line);

/* Logs "NAME   1.23 s" and keeps it in done, where equal names add up, and of which later stages than the
 * TERMINAL_STAGES-th are left out. */
void terminal_log_stage(terminal *t, const char *name, double seconds);

/* One line that quiet does not silence: "PROGRAM: warning: ...". */
void terminal_warn(terminal *t, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Erases the progress line. */
void terminal_clear(terminal *t);

/* Prints why a verb failed, in one line ("cancelled; ..." when a signal came); returns its exit status. */
int terminal_fail(terminal *t, const lam_error *error);

/* The exit status of a verb once its standard output is out: 1 instead of status where that cannot be
 * written. */
int terminal_finish(const char *program, int status);

/* True after SIGINT or SIGTERM. */
bool terminal_cancelled(void);

/* Fails with LAM_ERR_CANCELLED when a signal came: between stages that do not poll. */
lam_status terminal_check(lam_error *error);

#endif
