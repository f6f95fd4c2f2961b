#include "server/http/http_stream.h"

#include <stdlib.h>
#include <string.h>

/* Plain bytes that are coded at a time. */
#define WINDOW ((size_t)16 << 10)

/* Bytes of a response of known length that are asked for at a time. Of others libmicrohttpd asks for as much
 * as fits into the memory of a connection. */
#define BLOCK ((size_t)64 << 10)

/* A part is made by a thread that solves: at most so many bytes, of so many plain ones. That takes a few
 * milliseconds. The I/O thread makes one only where there is no place in the queue, of a window. */
#define PART STREAM_PART
#define PART_PLAIN ((size_t)256 << 10)
#define PART_COST 3e-3

/* Lives until its response is freed, which may be after its request. While its connection is suspended it
 * belongs to the thread that makes a part. */
typedef struct sending {
    answer_stream *source;
    coder *coder; /* NULL: the bytes are sent as they are */
    char window[WINDOW];
    const char *at; /* in window: bytes that are not coded yet */
    size_t left;
    bool all_read, ended, failed;
    char *part;        /* [PART]; NULL: the bytes are copied from memory, which takes no thread */
    size_t first, end; /* in part: bytes that are not sent yet */
    batch_job job;
    const service *service;
    struct MHD_Connection *connection;
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

/* Codes the window, or what follows it. Returns the plain bytes that were read. */
static size_t code_window(sending *s) {
    size_t written = 0, read = 0;
    if (s->left == 0 && !s->all_read) {
        s->at = s->window;
        s->left = read = answer_stream_read(s->source, s->window, WINDOW);
        s->all_read = read == 0;
    }
    s->failed = !coder_run(s->coder, &s->at, &s->left, s->all_read, s->part + s->end, PART - s->end, &written,
                           &s->ended);
    s->end += written;
    return read;
}

static size_t copy_window(sending *s) {
    const size_t room = PART - s->end,
                 read = answer_stream_read(s->source, s->part + s->end, room < WINDOW ? room : WINDOW);
    s->end += read;
    s->ended = read == 0;
    return read;
}

/* Makes the next part, of about so many plain bytes. */
static void make_part(sending *s, size_t most_plain) {
    size_t plain = 0;
    s->first = s->end = 0;
    while (plain < most_plain && PART - s->end >= WINDOW && !s->ended && !s->failed)
        plain += s->coder != NULL ? code_window(s) : copy_window(s);
}

static sending *sending_of(batch_job *job) {
    return (sending *)(void *)((char *)job - offsetof(sending, job));
}

static bool begin_part(batch_job *job, batch_workspace *workspace) {
    (void)workspace;
    make_part(sending_of(job), PART_PLAIN);
    return false;
}

static void finish_part(batch_job *job) {
    MHD_resume_connection(sending_of(job)->connection);
}

/* Suspends the connection until a thread has made the next part. False if all places are taken: those that
 * solve go before. */
static bool have_part_made(sending *s) {
    batch_queue *queue = s->service->queue;
    if (batch_jobs(queue) >= s->service->config->max_inflight) return false;
    s->job = (batch_job){.begin = begin_part,
                         .finish = finish_part,
                         .client = s->memory.client,
                         .kind = (unsigned)route_label_count() + 1,
                         .cost = PART_COST};
    MHD_suspend_connection(s->connection);
    if (batch_submit(queue, &s->job)) return true;
    MHD_resume_connection(s->connection);
    return false;
}

static ssize_t read_part(sending *s, char *to, size_t room) {
    /* A part may have no bytes: a coder keeps some. */
    while (s->first == s->end) {
        if (s->failed) return MHD_CONTENT_READER_END_WITH_ERROR;
        if (s->ended) return MHD_CONTENT_READER_END_OF_STREAM;
        if (have_part_made(s)) return 0;
        make_part(s, WINDOW);
    }
    const size_t left = s->end - s->first, count = left < room ? left : room;
    memcpy(to, s->part + s->first, count);
    s->first += count;
    return (ssize_t)count;
}

static ssize_t read_answer(void *context, uint64_t position, char *to, size_t room) {
    sending *s = context;
    (void)position;
    if (s->part == NULL && room < ANSWER_STREAM_LEAST) return MHD_CONTENT_READER_END_WITH_ERROR;
    const ssize_t count =
        s->part != NULL ? read_part(s, to, room) : (ssize_t)answer_stream_read(s->source, to, room);
    if (count == 0 && s->part == NULL) return MHD_CONTENT_READER_END_OF_STREAM;
    if (count > 0) *s->sent += (size_t)count;
    return count;
}

static void free_sending(sending *s) {
    answer_stream_free(s->source);
    coder_free(s->coder);
    free(s->part);
    free(s);
}

static void end_sending(void *context) {
    sending *s = context;
    request_memory_give_back(&s->memory, s->memory.held);
    free_sending(s);
}

struct MHD_Response *http_stream_response(request *r, uint64_t *most) {
    sending *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    if (r->coding != CODING_IDENTITY && (s->coder = coder_create(r->coding)) == NULL)
        r->coding = CODING_IDENTITY;
    uint64_t length = answer_stream_length(r->answer.stream);
    *most = length != UINT64_MAX ? length : answer_stream_most(r->answer.stream);
    /* Text, or coded bytes. */
    const bool by_parts = s->coder != NULL || length == UINT64_MAX;
    if (s->coder != NULL) length = MHD_SIZE_UNKNOWN;
    s->sent = &r->sent;
    s->service = r->service;
    s->connection = r->connection;
    s->part = by_parts ? malloc(PART) : NULL;
    struct MHD_Response *response =
        by_parts && s->part == NULL
            ? NULL
            : MHD_create_response_from_callback(length, BLOCK, read_answer, s, end_sending);
    if (response == NULL) {
        free_sending(s);
        return NULL;
    }
    s->source = r->answer.stream;
    r->answer.stream = NULL;
    s->memory = r->memory;
    r->memory.held = 0;
    return response;
}
