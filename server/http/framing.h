/* Faults in the head of a request by which two readers of one connection see different requests (RFC
 * 9112, 11.2): libmicrohttpd 0.9.75 lets them pass. Knows no HTTP library. */
#ifndef LAMBERT_SERVER_HTTP_FRAMING_H
#define LAMBERT_SERVER_HTTP_FRAMING_H

#include "solver/codec/problem.h"

#include <stdbool.h>
#include <stddef.h>

/* The fields of a head that were seen so far; zero at the start. */
typedef struct framing {
    unsigned n_hosts, n_lengths, n_codings;
    bool continued;    /* a field of the body's length that goes on in a second line */
    bool other_coding; /* a Transfer-Encoding that is not "chunked" */
    problem first;     /* the first fault within a field; status 0: none */
} framing;

/* Takes the next field; name and value may hold any bytes, value NULL is empty. O(bytes). */
void framing_add(framing *f, const char *name, size_t name_size, const char *value, size_t value_size);

/* True if the fields go together in a request of this version ("HTTP/1.1"). False, with the problem: 400, or
 * 501 for a transfer coding that is not known. The bytes behind it must then not be read as a request. */
bool framing_check(const framing *f, const char *version, problem *why);

/* The path of a request's target: of http://HOST/PATH (absolute form, RFC 9112, 3.2.2) without scheme and
 * host, of others as it is. Points into the target, or to "/". */
const char *framing_path(const char *target);

/* Sets *host and *length to the HOST of a target in absolute form, which lies in the target; others leave
 * them.
 */
void framing_host(const char *target, const char **host, size_t *length);

#endif
