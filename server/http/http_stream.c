#include "server/http/http_stream.h"

#include <stdlib.h>

/* Plain bytes that are coded at a time. */
#define WINDOW ((size_t)16 << 10)

/* Bytes of a response of known length that are asked for at a time. Of others libmicrohttpd asks for as much
 * as fits into the memory of a connection. */
#define BLOCK ((size_t)64 << 10)

/* Lives until its response is freed, which may be after its request. */
typedef struct sending {
    answer_stream *source;
    coder *coder; /* NULL: the bytes are sent as they are */
    char window[WINDOW];
    const char *at; /* in window: bytes that are not coded yet */
    size_t left;
    bool all_read, ended;
    size_t *sent; /* of the request, which lives while bytes are asked for */
    request_memory memory;
} sending;

void http_stream_choose(request *r) {
    char sample[WINDOW];
    problem unused;
    const coding_choice choice = r->accepted;
    r->coding = CODING_IDENTITY;
    if (choice.coding == CODING_IDENTITY) return;
    const size_t length = answer_stream_look(r->answer.stream, sample, sizeof sample);
    if ((choice.forced || coding_pays(choice.coding, sample, length)) &&
        request_memory_take(&r->memory, CODER_BYTES, &unused))
        r->coding = choice.coding;
}

static ssize_t read_coded(sending *s, char *to, size_t room) {
    size_t written = 0;
    while (written == 0 && !s->ended) {
        if (s->left == 0 && !s->all_read) {
            s->at = s->window;
            s->left = answer_stream_read(s->source, s->window, WINDOW);
            s->all_read = s->left == 0;
        }
        if (!coder_run(s->coder, &s->at, &s->left, s->all_read, to, room, &written, &s->ended))
            return MHD_CONTENT_READER_END_WITH_ERROR;
    }
    return (ssize_t)written;
}

static ssize_t read_answer(void *context, uint64_t position, char *to, size_t room) {
    sending *s = context;
    (void)position;
    if (room < ANSWER_STREAM_LEAST) return MHD_CONTENT_READER_END_WITH_ERROR;
    const ssize_t count =
        s->coder != NULL ? read_coded(s, to, room) : (ssize_t)answer_stream_read(s->source, to, room);
    if (count == 0) return MHD_CONTENT_READER_END_OF_STREAM;
    if (count > 0) *s->sent += (size_t)count;
    return count;
}

static void end_sending(void *context) {
    sending *s = context;
    answer_stream_free(s->source);
    coder_free(s->coder);
    request_memory_give_back(&s->memory, s->memory.held);
    free(s);
}

struct MHD_Response *http_stream_response(request *r, uint64_t *most) {
    sending *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    if (r->coding != CODING_IDENTITY && (s->coder = coder_create(r->coding)) == NULL)
        r->coding = CODING_IDENTITY;
    uint64_t length = answer_stream_length(r->answer.stream);
    *most = length != UINT64_MAX ? length : answer_stream_most(r->answer.stream);
    if (s->coder != NULL) length = MHD_SIZE_UNKNOWN;
    s->sent = &r->sent;
    struct MHD_Response *response =
        MHD_create_response_from_callback(length, BLOCK, read_answer, s, end_sending);
    if (response == NULL) {
        coder_free(s->coder);
        free(s);
        return NULL;
    }
    s->source = r->answer.stream;
    r->answer.stream = NULL;
    s->memory = r->memory;
    r->memory.held = 0;
    return response;
}
