/* Answers that are encoded, and compressed, while they are sent: by the I/O thread, as much at a time as one
 * buffer of libmicrohttpd takes. Private to http_answer.c. */
#ifndef LAMBERT_SERVER_HTTP_HTTP_STREAM_H
#define LAMBERT_SERVER_HTTP_HTTP_STREAM_H

#include "server/http/http_request.h"

/* Memory of a stream on its way beside its numbers: a window, and the block of libmicrohttpd. */
#define STREAM_BYTES ((size_t)96 << 10)

/* Chooses the coding of the answer's stream. Any thread that has the request. */
void http_stream_choose(request *r);

/* A response that sends the stream, which it takes over with the memory that the request holds; NULL if
 * memory is short. *most: bytes that are sent, at most. */
struct MHD_Response *http_stream_response(request *r, uint64_t *most);

#endif
