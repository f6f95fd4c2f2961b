/* Sends answers: content coding, entity tag, headers. */
#include "server/http/browser.h"

#include <stdio.h>
#include <string.h>

/* The longest body that the I/O thread compresses, in a millisecond or two; no other client is served
 * meanwhile. */
#define IO_THREAD_MAX ((size_t)128 << 10)

const char *http_header(const request *r, const char *name) {
    return MHD_lookup_connection_value(r->connection, MHD_HEADER_KIND, name);
}

void http_finish_answer(request *r, bool on_io_thread) {
    answer *a = &r->answer;
    /* The tag is that of the bytes before compression. */
    const uint64_t hash = a->cacheable ? etag_hash(a->body.bytes, a->body.length) : 0;
    if (!on_io_thread || a->body.length <= IO_THREAD_MAX) r->coding = coding_apply(&a->body, r->accepted);
    if (a->cacheable) etag_make(hash, coding_name(r->coding), r->etag);
}

/* True if the client has these bytes (304). The body is still passed to libmicrohttpd for its length, which
 * leaves it out as for HEAD. */
static bool is_known(const request *r) {
    return r->etag[0] != '\0' && r->answer.status == 200 &&
           etag_is_listed(http_header(r, MHD_HTTP_HEADER_IF_NONE_MATCH), r->etag);
}

static bool add(struct MHD_Response *response, const char *name, const char *value) {
    return MHD_add_response_header(response, name, value) == MHD_YES;
}

/* Headers of a refined answer: NPY has no place for these figures. */
static bool add_refined(struct MHD_Response *response, const answer *a) {
    char certificate[32], iterations[24];
    snprintf(certificate, sizeof certificate, "%.17g", a->certificate);
    snprintf(iterations, sizeof iterations, "%zu", a->iterations);
    return add(response, "Lambert-Certificate", certificate) &&
           add(response, "Lambert-Iterations", iterations);
}

static bool add_headers(const request *r, size_t length, struct MHD_Response *response) {
    const answer *a = &r->answer;
    bool good = add(response, "X-Request-Id", r->id) && browser_add_headers(r, response);
    if (a->type != NULL) good = good && add(response, MHD_HTTP_HEADER_CONTENT_TYPE, a->type);
    if (a->allow[0] != '\0') good = good && add(response, MHD_HTTP_HEADER_ALLOW, a->allow);
    if (a->location != NULL) good = good && add(response, MHD_HTTP_HEADER_LOCATION, a->location);
    if (a->refined) good = good && add_refined(response, a);
    if (a->retry_after > 0) {
        char seconds[16];
        snprintf(seconds, sizeof seconds, "%u", a->retry_after);
        good = good && add(response, MHD_HTTP_HEADER_RETRY_AFTER, seconds);
    }
    if (a->status == 401) good = good && add(response, MHD_HTTP_HEADER_WWW_AUTHENTICATE, "Bearer");
    if (r->etag[0] != '\0')
        good = good && add(response, MHD_HTTP_HEADER_ETAG, r->etag) &&
               add(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-cache");
    /* Also for a body that was not compressed, as another client may get it compressed. */
    if (r->coding != CODING_IDENTITY || r->etag[0] != '\0' || length >= COMPRESS_LEAST)
        good = good && add(response, MHD_HTTP_HEADER_VARY, MHD_HTTP_HEADER_ACCEPT_ENCODING);
    if (r->coding != CODING_IDENTITY && a->status != MHD_HTTP_NOT_MODIFIED)
        good = good && add(response, MHD_HTTP_HEADER_CONTENT_ENCODING, coding_name(r->coding));
    if (r->last || atomic_load(&r->service->state) >= SERVICE_DRAINING)
        good = good && add(response, MHD_HTTP_HEADER_CONNECTION, "close");
    return good;
}

enum MHD_Result http_send_answer(request *r) {
    answer *a = &r->answer;
    struct MHD_Response *response;
    if (is_known(r)) {
        a->status = MHD_HTTP_NOT_MODIFIED;
        a->type = NULL;
    }
    const bool with_body = a->status != MHD_HTTP_NOT_MODIFIED && strcmp(r->method, "HEAD") != 0;
    const size_t length = a->body.length;
    r->sent = with_body ? length : 0;
    if (a->body.bytes == NULL) {
        static char nothing[1];
        response = MHD_create_response_from_buffer(0, nothing, MHD_RESPMEM_PERSISTENT);
    } else {
        response = MHD_create_response_from_buffer(length, a->body.bytes, MHD_RESPMEM_MUST_FREE);
    }
    if (response == NULL) return MHD_NO;
    a->body = (buffer){0};
    const bool good = add_headers(r, length, response);
    client_enter(r->service->connections, r->client, STAGE_ANSWER, r->sent);
    enum MHD_Result result = good ? MHD_queue_response(r->connection, a->status, response) : MHD_NO;
    MHD_destroy_response(response);
    r->queued = result == MHD_YES;
    return result;
}
