/* Answers that are kept in every coding that was asked for: meshes, and texts that are sent as they are.
 * Bytes that are kept are sent by the I/O thread at once; others are made by a pass of the queue, which
 * requests for the same bytes share: those that come meanwhile wait without a thread, and find them made. */
#ifndef LAMBERT_SERVER_ROUTE_KEPT_ANSWER_H
#define LAMBERT_SERVER_ROUTE_KEPT_ANSWER_H

#include "server/route/routes.h"

/* The bytes of an answer, and how they are made. */
typedef struct kept_source {
    kept_forms *forms; /* a reference, until the answer is made */
    const char *type;  /* of the answer, static */
    const char *what;  /* "a mesh": for messages */
    bool by_type;      /* of the Accept of the request */
    uint64_t tag;      /* for these bytes alone */
    double cost;       /* seconds to make and to code them, roughly */
    /* Makes form 0 where it is not kept; NULL where it always is. It takes build_bytes of memory and makes at
     * most `most` bytes. False with why. */
    bool (*build)(const call *in, buffer *out, problem *why);
    size_t build_bytes, most;
} kept_source;

/* The source of a text that is always kept as it is. */
kept_source kept_text(kept_forms *forms, const char *type);

#endif
