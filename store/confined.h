/* A child process that may do nothing but read what it was given and answer through a pipe: for code that
 * parses files from anywhere. The caller takes the answer for bytes from outside. */
#ifndef LAMBERT_STORE_CONFINED_H
#define LAMBERT_STORE_CONFINED_H

#include "store/status.h"
#include "store/stop.h"

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>
#include <time.h>

/* The only descriptors of the child, beside a standard input and outputs that lead nowhere. */
enum { CONFINED_REPLY = 3, CONFINED_INPUT = 4 };

typedef struct confined_limits {
    unsigned cpu_seconds; /* of processor time */
    unsigned all_seconds; /* of the clock, for the whole answer */
    size_t memory_bytes;  /* of address space, beyond that of the caller; a sanitizer needs more: no limit */
    bool filtered;        /* the system lets it read, write, allocate memory and end, nothing else */
    bool reads_files;     /* if filtered: it may also open files and folders to read them */
    const stop_check *stop; /* asked while the answer is waited for; NULL: nobody is */
} confined_limits;

/* Runs in the child, with default signals; when it returns the child ends. */
typedef void confined_main(void *context);

typedef struct confined {
    pid_t pid;
    int reply; /* the end of the pipe to read from; -1: none */
    struct timespec end;
    bool late; /* the answer was not whole when the time was over */
    const stop_check *stop;
    bool stopped; /* the answer was not whole when the wait was to be left */
} confined;

/* Starts a child, a copy of this process, which runs `run`. input: a descriptor that it gets as
 * CONFINED_INPUT, or -1. Each start is ended by confined_end. Errors: LAM_ERR_IO names path. */
lam_status confined_start(confined_main *run, void *context, int input, const confined_limits *limits,
                          const char *path, confined *out, lam_error *error);

/* Reads exactly that many bytes of the answer; false where it or the time ends before, or the wait is to be
 * left. */
bool confined_receive(confined *c, void *out, size_t bytes);

/* Ends a child that still runs. answered: the caller has all that it wants; otherwise the child gets a moment
 * to end by itself, unless it is late or the wait was left. *how: its wait status, 0 if it was killed here.
 * Errors: LAM_ERR_IO if the system does not tell the end, as while SIGCHLD is ignored. */
lam_status confined_end(confined *c, bool answered, const char *path, int *how, lam_error *error);

/* Says in one line how a child ended that was to read path and gave no whole answer; who: "the importer".
 * Never LAM_OK: LAM_ERR_CANCELLED after a signal that asks to end, LAM_ERR_MEMORY where it was killed, else
 * LAM_ERR_FORMAT. */
lam_status confined_verdict(const confined *c, const confined_limits *limits, int how, const char *path,
                            const char *who, lam_error *error);

/* Writes all bytes to a descriptor; the child calls it. */
bool confined_send(int fd, const void *data, size_t bytes);

#endif
