/* Sends answers: content coding, entity tag, headers. */
#include "server/http/browser.h"
#include "server/http/http_parts.h"
#include "server/http/http_stream.h"
#include "store/store.h"

#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

/* Bodies of this capacity give back what they do not use. */
#define TRIM_LEAST ((size_t)256 << 10)

/* The longest body that the I/O thread compresses, in a tenth of a millisecond or two; no other client is
 * served meanwhile. Longer ones are kept, or made by the queue. */
#define IO_THREAD_MAX ((size_t)16 << 10)

const char *http_header(const request *r, const char *name) {
    return MHD_lookup_connection_value(r->connection, MHD_HEADER_KIND, name);
}

/* Answers of this length are sent whatever the ledger has: problems, and most figures of the daemon. */
#define FREE_OF_LEDGER ((size_t)4 << 10)

/* Keeps of the memory of the request what its answer and its body take. */
static void count_answer(request *r) {
    const answer *a = &r->answer;
    /* Kept bytes count themselves, but for the part that is sent. */
    const bool by_parts = a->kept != NULL && a->kept->content.length > HTTP_PART;
    const size_t length = a->stream != NULL ? answer_stream_held(a->stream) + STREAM_BYTES
                          : by_parts        ? HTTP_PART
                                            : a->body.capacity;
    const bool free_of =
        a->stream == NULL && (length <= FREE_OF_LEDGER || r->match.route == NULL || r->match.route->open);
    if (request_memory_keep(&r->memory, bytes_plus(r->body.length, free_of ? 0 : length))) return;
    answer_refuse(&r->answer, PROBLEM_NO_MEMORY,
                  "the answer takes %zu bytes of memory, which other requests hold now "
                  "(--max-request-memory); try again",
                  length);
    (void)request_memory_keep(&r->memory, r->body.length);
}

/* Compresses a whole body within the memory that requests may take. */
static void code_body(request *r) {
    buffer *b = &r->answer.body;
    problem unused;
    if (r->accepted.coding == CODING_IDENTITY || !request_memory_take(&r->memory, b->length, &unused)) return;
    r->coding = coding_apply(b, r->accepted);
    count_answer(r);
}

void http_finish_answer(request *r, bool on_io_thread) {
    answer *a = &r->answer;
    if (a->stream == NULL && a->body.capacity >= TRIM_LEAST) buffer_trim(&a->body);
    count_answer(r);
    if (a->stream != NULL) {
        http_stream_choose(r);
        return;
    }
    if (a->fixed != NULL) {
        if (coding_accepts(http_header(r, MHD_HTTP_HEADER_ACCEPT_ENCODING), CODING_GZIP))
            r->coding = CODING_GZIP;
        etag_make(a->fixed->tag, coding_name(r->coding), r->etag);
        return;
    }
    if (a->kept != NULL) {
        r->coding = a->kept_coding;
        if (a->cacheable) etag_make(a->tag, coding_name(r->coding), r->etag);
        return;
    }
    /* The tag is that of the bytes before compression. */
    const uint64_t hash = a->cacheable ? store_checksum(a->body.bytes, a->body.length) : 0;
    if (!on_io_thread || a->body.length <= IO_THREAD_MAX) code_body(r);
    if (a->cacheable) etag_make(hash, coding_name(r->coding), r->etag);
}

/* True if the client has these bytes (304). The body is still passed to libmicrohttpd for its length, which
 * leaves it out as for HEAD. */
static bool is_known(const request *r) {
    return r->etag[0] != '\0' && r->answer.status == 200 &&
           etag_is_listed(http_header(r, MHD_HTTP_HEADER_IF_NONE_MATCH), r->etag);
}

/* Headers of a refined answer: NPY has no place for these figures. */
static bool add_refined(struct MHD_Response *response, const answer *a) {
    char certificate[32], iterations[24];
    snprintf(certificate, sizeof certificate, "%.17g", a->certificate);
    snprintf(iterations, sizeof iterations, "%zu", a->iterations);
    return http_add_header(response, "Lambert-Certificate", certificate) &&
           http_add_header(response, "Lambert-Iterations", iterations);
}

/* The elements that were below zero, for which NPY has no place either. */
static bool add_limited(struct MHD_Response *response, const answer *a) {
    char limited[24];
    snprintf(limited, sizeof limited, "%zu", a->limited);
    return http_add_header(response, "Lambert-Limited", limited);
}

/* The unit of the numbers and their conversion, likewise. */
static bool add_unit(struct MHD_Response *response, const answer *a) {
    return http_add_header(response, "Lambert-Unit", a->unit) &&
           (a->converted[0] == '\0' || http_add_header(response, "Lambert-Converted-By", a->converted));
}

/* The times of parsing, solving and encoding, which pages read as performance entries. */
static bool add_times(struct MHD_Response *response, const answer *a) {
    char times[120];
    snprintf(times, sizeof times, "parse;dur=%.3f, solve;dur=%.3f, encode;dur=%.3f", a->parse_ms, a->solve_ms,
             a->encode_ms);
    return http_add_header(response, "Server-Timing", times);
}

static bool add_headers(const request *r, size_t length, struct MHD_Response *response) {
    const answer *a = &r->answer;
    bool good = http_add_header(response, "X-Request-Id", r->id) && browser_add_headers(r, response);
    if (a->type != NULL) good = good && http_add_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, a->type);
    if (a->allow[0] != '\0') good = good && http_add_header(response, MHD_HTTP_HEADER_ALLOW, a->allow);
    if (a->location != NULL) good = good && http_add_header(response, MHD_HTTP_HEADER_LOCATION, a->location);
    if (a->policy != NULL) good = good && http_add_header(response, "Content-Security-Policy", a->policy);
    if (r->call.scene != NULL)
        good =
            good && http_add_header(response, "Lambert-Scene", scene_elements_text(r->call.scene->elements));
    if (a->timed) good = good && add_times(response, a);
    if (a->refined) good = good && add_refined(response, a);
    if (a->counts_limited) good = good && add_limited(response, a);
    if (a->unit != NULL) good = good && add_unit(response, a);
    if (a->retry_after > 0) {
        char seconds[16];
        snprintf(seconds, sizeof seconds, "%u", a->retry_after);
        good = good && http_add_header(response, MHD_HTTP_HEADER_RETRY_AFTER, seconds);
    }
    if (a->status == 401)
        good = good && http_add_header(response, MHD_HTTP_HEADER_WWW_AUTHENTICATE, "Bearer");
    if (r->etag[0] != '\0')
        good = good && http_add_header(response, MHD_HTTP_HEADER_ETAG, r->etag) &&
               http_add_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-cache");
    /* Also for a body that was not compressed, as another client may get it compressed. */
    if (r->coding != CODING_IDENTITY || r->etag[0] != '\0' || length >= COMPRESS_LEAST)
        good = good && http_add_header(response, MHD_HTTP_HEADER_VARY,
                                       a->by_type ? "Accept, Accept-Encoding" : "Accept-Encoding");
    if (r->coding != CODING_IDENTITY && a->status != MHD_HTTP_NOT_MODIFIED)
        good = good && http_add_header(response, MHD_HTTP_HEADER_CONTENT_ENCODING, coding_name(r->coding));
    if (r->last || atomic_load(&r->service->state) >= SERVICE_DRAINING)
        good = good && http_add_header(response, MHD_HTTP_HEADER_CONNECTION, "close");
    return good;
}

static void release_kept(void *context) {
    kept_bytes_release(context);
}

/* A response of bytes that are kept by the program, or by a reference that it takes over. */
static struct MHD_Response *kept_response(request *r, const char *bytes, size_t length, bool with_body) {
    answer *a = &r->answer;
    /* The library takes bytes that are not const, and does not write to them. */
    union {
        const char *held;
        void *taken;
    } same = {bytes};
    struct MHD_Response *response;
    if (with_body && length > HTTP_PART)
        response = http_parts_response(r, bytes, length, a->kept);
    else
        response =
            MHD_create_response_from_buffer_with_free_callback_cls(length, same.taken, release_kept, a->kept);
    if (response != NULL) a->kept = NULL;
    return response;
}

enum MHD_Result http_send_answer(request *r) {
    answer *a = &r->answer;
    struct MHD_Response *response;
    if (is_known(r)) {
        a->status = MHD_HTTP_NOT_MODIFIED;
        a->type = NULL;
    }
    const bool with_body = a->status != MHD_HTTP_NOT_MODIFIED && strcmp(r->method, "HEAD") != 0;
    uint64_t length = a->body.length;
    if (a->fixed != NULL) length = r->coding == CODING_GZIP ? a->fixed->gzip_length : a->fixed->length;
    if (a->kept != NULL) length = a->kept->content.length;
    r->sent = with_body ? length : 0;
    if (a->stream != NULL) {
        r->sent = 0;
        response = http_stream_response(r, &length);
    } else if (a->fixed != NULL) {
        const unsigned char *bytes = r->coding == CODING_GZIP ? a->fixed->gzip : a->fixed->plain;
        response = kept_response(r, (const char *)bytes, length, with_body);
    } else if (a->kept != NULL) {
        response = kept_response(r, a->kept->content.bytes, length, with_body);
    } else if (a->body.bytes == NULL) {
        static char nothing[1];
        response = MHD_create_response_from_buffer(0, nothing, MHD_RESPMEM_PERSISTENT);
    } else {
        response = MHD_create_response_from_buffer(length, a->body.bytes, MHD_RESPMEM_MUST_FREE);
    }
    if (response == NULL) return MHD_NO;
    a->body = (buffer){0};
    const bool good = add_headers(r, length, response);
    client_enter(r->service->connections, r->client, STAGE_ANSWER, with_body ? length : 0);
    enum MHD_Result result = good ? MHD_queue_response(r->connection, a->status, response) : MHD_NO;
    MHD_destroy_response(response);
    r->queued = result == MHD_YES;
    return result;
}

void http_write_refusal(request *r) {
    const answer *a = &r->answer;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(r->connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    buffer b = {0};
    bool good =
        info != NULL && a->body.bytes != NULL &&
        buffer_printf(&b,
                      "HTTP/1.1 %u %s\r\nConnection: close\r\nContent-Type: %s\r\nContent-Length: %zu\r\n"
                      "X-Request-Id: %s\r\nX-Content-Type-Options: nosniff\r\n",
                      a->status, MHD_get_reason_phrase_for(a->status), a->type, a->body.length, r->id);
    if (r->origin != NULL)
        good = good && buffer_printf(&b, "Access-Control-Allow-Origin: %s\r\nVary: Origin\r\n", r->origin);
    if (a->retry_after > 0) good = good && buffer_printf(&b, "Retry-After: %u\r\n", a->retry_after);
    good = good && buffer_append_text(&b, "\r\n") && buffer_append(&b, a->body.bytes, a->body.length);
    const ssize_t written =
        good ? send(info->connect_fd, b.bytes, b.length, MSG_DONTWAIT | MSG_NOSIGNAL) : -1;
    r->written = written == (ssize_t)b.length;
    if (r->written) r->sent = a->body.length;
    buffer_free(&b);
}
