/* Bytes that are kept (of a scene, of the program), sent by parts: a write of many MiB would hold up all
 * other clients, and those of a client with many connections wait for their turns (server/net/turns.h).
 * Private to http_answer.c. */
#ifndef LAMBERT_SERVER_HTTP_HTTP_PARTS_H
#define LAMBERT_SERVER_HTTP_HTTP_PARTS_H

#include "server/http/http_request.h"

/* Bytes of a part; shorter answers are sent without a copy. */
#define HTTP_PART ((size_t)64 << 10)

/* A response that sends `length` bytes of a request's answer, which the kept bytes (taken over, or NULL)
 * hold; NULL, with nothing taken over, if memory is short. */
struct MHD_Response *http_parts_response(request *r, const char *bytes, size_t length, kept_bytes *kept);

#endif
