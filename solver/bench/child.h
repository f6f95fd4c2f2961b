/* Programs started for a measurement: each in a process group of its own, ended when it is done with and gone
 * when we are. Knows no HTTP. */
#ifndef LAMBERT_BENCH_CHILD_H
#define LAMBERT_BENCH_CHILD_H

#include "solver/bench/bench.h"

#include <limits.h>
#include <sys/types.h>

/* A zeroed child runs nothing. */
typedef struct child {
    pid_t pid;             /* 0: none, or it has ended */
    int out;               /* its standard output */
    char errors[PATH_MAX]; /* the file of its standard error */
    char said[4096];       /* what came of its standard output, cut to fit, and a NUL */
    size_t n_said;
    const char *name; /* static, for messages */
} child;

/* Where the program of this name is: in PATH, else where system programs are. False when it is nowhere. */
bool child_find(const char *program, char path[PATH_MAX]);

/* Starts arguments[0], a path, in a folder that it may write to; name is static. Its standard error goes to a
 * file there. The caller ends it with child_stop. Errors: LAM_ERR_IO, LAM_ERR_MEMORY. */
lam_status child_start(child *c, const char *name, const char *folder, const char *const arguments[],
                       lam_error *error);

/* Waits until it has said these words and then a line's end; *after points behind them, in c->said.
 * Errors: LAM_ERR_IO with the last line it complained in, when it ends or so many seconds pass before;
 * LAM_ERR_CANCELLED. */
lam_status child_await(child *c, const bench_run *run, const char *words, double seconds, const char **after,
                       lam_error *error);

/* Waits until it ends; what it said is in c->said. Errors: the same, and LAM_ERR_IO when its status is not 0.
 */
lam_status child_finish(child *c, const bench_run *run, double seconds, lam_error *error);

/* Whether it still runs. */
bool child_runs(child *c);

/* Asks it to end and makes it end; nothing when it has. */
void child_stop(child *c);

#endif
