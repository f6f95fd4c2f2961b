/* The access log: lines that a thread of its own writes, so that no request and no signal waits for a file, a
 * pipe or a terminal whose reader does not read. Any thread may add. */
#ifndef LAMBERT_SERVER_NET_ACCESS_LOG_H
#define LAMBERT_SERVER_NET_ACCESS_LOG_H

#include "solver/codec/buffer.h"
#include "store/status.h"

typedef struct access_log access_log;

/* Opens path for appending, or standard output for "-", standard error for NULL. Errors: LAM_ERR_IO (also a
 * named pipe without a reader), LAM_ERR_MEMORY. */
lam_status access_log_open(const char *path, access_log **out, lam_error *error);

/* Adds a whole line, or drops and counts it where so many wait already. Never blocks. NULL: no log. */
void access_log_add(access_log *log, const char *line, size_t length);

/* Opens the file again by its path, once what waits is written; a file that cannot be opened is kept. */
void access_log_reopen(access_log *log);

/* Appends how many lines were dropped, 0 without a log, as a metric. False when memory is short. */
bool access_log_metrics(access_log *log, buffer *b);

/* Writes what waits, for a second at most, and closes. NULL is allowed. */
void access_log_close(access_log *log);

#endif
