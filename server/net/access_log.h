/* One JSON line for each request. */
#ifndef LAMBERT_SERVER_NET_ACCESS_LOG_H
#define LAMBERT_SERVER_NET_ACCESS_LOG_H

#include <stddef.h>
#include <stdio.h>

typedef struct access_entry {
    const char *id;
    const char *method;
    const char *path;
    unsigned status;       /* 0: the client went before */
    size_t received, sent; /* bytes of body */
    size_t n_rhs;
    const char *coding; /* of what was sent */
    double ms;
} access_entry;

/* Writes a line and flushes it; what cannot be written is lost. */
void access_log_write(FILE *log, const access_entry *entry);

#endif
