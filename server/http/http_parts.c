#include "server/http/http_parts.h"

#include <stdlib.h>
#include <string.h>

/* Lives until its response is freed, which may be after its request. */
typedef struct parts {
    const char *bytes;
    size_t length;
    kept_bytes *kept;
    turns *turns;
    turn turn;
} parts;

static ssize_t read_part(void *context, uint64_t position, char *to, size_t room) {
    parts *p = context;
    if (!http_has_turn(p->turns, &p->turn)) {
        MHD_suspend_connection(p->turn.connection);
        turns_wait(p->turns, &p->turn);
        return 0;
    }
    const size_t left = p->length - (size_t)position, count = left < room ? left : room;
    memcpy(to, p->bytes + position, count);
    return (ssize_t)count;
}

static void free_parts(void *context) {
    parts *p = context;
    turns_leave(p->turns, &p->turn);
    kept_bytes_release(p->kept);
    free(p);
}

struct MHD_Response *http_parts_response(request *r, const char *bytes, size_t length, kept_bytes *kept) {
    parts *p = calloc(1, sizeof *p);
    if (p == NULL) return NULL;
    *p = (parts){.bytes = bytes,
                 .length = length,
                 .kept = kept,
                 .turns = r->service->turns,
                 .turn = {.client = r->peer.key, .connection = r->connection}};
    struct MHD_Response *response =
        MHD_create_response_from_callback(length, HTTP_PART, read_part, p, free_parts);
    if (response == NULL) free(p);
    return response;
}
