#include "server/http/head_fields.h"

#include "server/http/framing.h"
#include "server/route/escapes.h"

#include <stdlib.h>

/* One walk over the fields of a head fills these. */
typedef struct head_fields {
    framing framing;
    peer_fields peer;
} head_fields;

static enum MHD_Result take_field(void *context, enum MHD_ValueKind kind, const char *name, size_t name_size,
                                  const char *value, size_t value_size) {
    head_fields *fields = context;
    (void)kind;
    framing_add(&fields->framing, name, name_size, value, value_size);
    peer_add_field(&fields->peer, name, name_size, value, value_size);
    return MHD_YES;
}

bool head_check_fields(request *r, const char *version) {
    head_fields fields = {.peer = {.n_forwarded = 0}};
    problem why;
    MHD_get_connection_values_n(r->connection, MHD_HEADER_KIND, take_field, &fields);
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(r->connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    peer_find(&r->service->peers, info != NULL ? info->client_addr : NULL, &fields.peer, &r->peer);
    r->memory.client = r->peer.key;
    if (framing_check(&fields.framing, version, &why)) return true;
    answer_problem(&r->answer, &why);
    return false;
}

/* A walk over the query: the first one measures, the second one, whose members are there, fills. */
typedef struct query_walk {
    query_member *members; /* or NULL */
    char *text;            /* the next byte behind the members */
    size_t count, bytes;
} query_walk;

/* Copies text with its escapes resolved, and a NUL, to the walk. */
static const char *resolve(const char *text, size_t length, query_walk *to) {
    char *const begin = to->text, *at = begin;
    for (size_t i = 0; i < length; i++) {
        const int byte = escape_byte(text + i, length - i);
        *at++ = byte > 0 ? (char)byte : text[i];
        if (byte > 0) i += 2;
    }
    *at = '\0';
    to->text = at + 1;
    return begin;
}

static enum MHD_Result take_member(void *context, enum MHD_ValueKind kind, const char *name, size_t name_size,
                                   const char *value, size_t value_size) {
    query_walk *walk = context;
    (void)kind;
    if (value == NULL) value_size = 0;
    if (walk->members != NULL) {
        query_member *to = &walk->members[walk->count];
        to->name = resolve(name, name_size, walk);
        to->value = resolve(value, value_size, walk);
    }
    walk->bytes += sizeof *walk->members + name_size + value_size + 2;
    walk->count++;
    return MHD_YES;
}

bool head_read_query(request *r) {
    query_walk walk = {.count = 0};
    MHD_get_connection_values_n(r->connection, MHD_GET_ARGUMENT_KIND, take_member, &walk);
    if (walk.count == 0) return true;
    r->query = malloc(walk.bytes);
    if (r->query == NULL) {
        answer_refuse(&r->answer, PROBLEM_NO_MEMORY, "not enough memory for the query");
        return false;
    }
    walk = (query_walk){.members = r->query, .text = (char *)(r->query + walk.count)};
    MHD_get_connection_values_n(r->connection, MHD_GET_ARGUMENT_KIND, take_member, &walk);
    r->call.query = r->query;
    r->call.n_query = walk.count;
    return true;
}
