#include "server/http/head_fields.h"

#include "server/http/framing.h"

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
