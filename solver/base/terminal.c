#include "solver/base/terminal.h"

#include "solver/base/clock.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Set by the signal handler, which may touch nothing else. */
static volatile sig_atomic_t signal_came;

static void signal_note(int number) {
    (void)number;
    signal_came = 1;
}

bool terminal_cancelled(void) {
    return signal_came != 0;
}

void terminal_open(terminal *t, const char *program, bool quiet, bool force_progress) {
    *t = (terminal){.program = program, .nothing = "nothing was written", .quiet = quiet};
    t->live = !quiet && (force_progress || isatty(STDERR_FILENO) == 1);
    /* The second signal finds the default action again and ends the program at once. */
    struct sigaction action = {.sa_handler = signal_note, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    /* A file over the limit is then an error that is reported, and the partial file is removed. */
    struct sigaction ignore = {.sa_handler = SIG_IGN};
    sigemptyset(&ignore.sa_mask);
    sigaction(SIGXFSZ, &ignore, NULL);
}

void terminal_be_brief(terminal *t) {
    t->brief = isatty(STDERR_FILENO) == 1;
}

void terminal_clear(terminal *t) {
    if (t->line_shown) fputs("\r\033[K", stderr);
    t->line_shown = false;
}

static void show(void *context, const char *stage, double share) {
    terminal *t = context;
    double now = clock_seconds();
    if (strncmp(t->stage, stage, sizeof t->stage - 1) != 0) {
        snprintf(t->stage, sizeof t->stage, "%s", stage);
        t->stage_started = now;
        t->last_shown = 0;
    }
    if (share >= 1) {
        terminal_clear(t);
        return;
    }
    if (now - t->last_shown < 0.1) return;
    t->last_shown = now;
    char left[32] = "";
    double elapsed = now - t->stage_started;
    if (share > 0.01 && elapsed > 0.5) clock_format_seconds(elapsed / share * (1 - share), left);
    fprintf(stderr, "\r\033[K%s: %.0f %%%s%s", stage, 100 * fmax(share, 0), left[0] != '\0' ? ", left: " : "",
            left);
    t->line_shown = true;
}

static bool asked_to_stop(void *context) {
    (void)context;
    return terminal_cancelled();
}

progress terminal_progress(terminal *t) {
    return (progress){.report = t->live ? show : NULL, .cancelled = asked_to_stop, .context = t};
}

void terminal_say(terminal *t, const char *line) {
    if (t->quiet) return;
    terminal_clear(t);
    fprintf(stderr, "%s\n", line);
}

void terminal_log(terminal *t, const char *format, ...) {
    if (t->quiet || t->brief) return;
    va_list arguments;
    terminal_clear(t);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

void terminal_log_stage(terminal *t, const char *name, double seconds) {
    terminal_log(t, "%-14s%8.2f s", name, seconds);
    size_t k = 0;
    while (k < t->n_done && strncmp(t->done[k].name, name, sizeof t->done[k].name - 1) != 0) k++;
    if (k == TERMINAL_STAGES) return;
    terminal_stage *stage = &t->done[k];
    snprintf(stage->name, sizeof stage->name, "%s", name);
    stage->seconds = k < t->n_done ? stage->seconds + seconds : seconds;
    if (k == t->n_done) t->n_done++;
}

void terminal_warn(terminal *t, const char *format, ...) {
    va_list arguments;
    terminal_clear(t);
    fprintf(stderr, "%s: warning: ", t->program);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

int terminal_fail(terminal *t, const lam_error *error) {
    terminal_clear(t);
    if (terminal_cancelled())
        fprintf(stderr, "%s: cancelled; %s\n", t->program, t->nothing);
    else
        fprintf(stderr, "%s: %s\n", t->program,
                error->message[0] != '\0' ? error->message : lam_status_text(error->status));
    return 1;
}

lam_status terminal_check(lam_error *error) {
    return terminal_cancelled() ? status_fail(error, LAM_ERR_CANCELLED, "cancelled") : LAM_OK;
}

int terminal_finish(const char *program, int status) {
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout)) return status;
    /* A refused write longer than the buffer leaves no reason behind: one more byte brings it back. */
    if (errno == 0 && putchar('\n') != EOF) fflush(stdout);
    fprintf(stderr, "%s: cannot write to standard output: %s\n", program, strerror(errno));
    return 1;
}
