/* Answers that are encoded, and compressed, while they are sent: by parts, which the threads that solve make
 * one by one, each when the one before was sent, so that the I/O thread only copies. Private to
 * http_answer.c.
 */
#ifndef LAMBERT_SERVER_HTTP_HTTP_STREAM_H
#define LAMBERT_SERVER_HTTP_HTTP_STREAM_H

#include "server/http/http_request.h"

/* Bytes of a part, at most. */
#define STREAM_PART ((size_t)128 << 10)

/* Memory of a stream on its way beside its numbers: a window, a part and the block of libmicrohttpd. */
#define STREAM_BYTES (((size_t)96 << 10) + STREAM_PART)

/* Chooses the coding of the answer's stream. Any thread that has the request. */
void http_stream_choose(request *r);

/* A response that sends the stream, which it takes over with the memory that the request holds; NULL if
 * memory is short. *most: bytes that are sent, at most. */
struct MHD_Response *http_stream_response(request *r, uint64_t *most);

#endif
