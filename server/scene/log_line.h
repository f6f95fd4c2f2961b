/* Lines of the daemon's own log. Names of stores and files come from others: a line break or an escape
 * sequence in them must not write a line of its own or command a terminal. */
#ifndef LAMBERT_SERVER_SCENE_LOG_LINE_H
#define LAMBERT_SERVER_SCENE_LOG_LINE_H

#include <stdio.h>

/* Writes one line, without a line break in the format, with '?' for every control character, and flushes. A
 * line that memory is too short for is left out. Any thread. */
void log_line(FILE *out, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
