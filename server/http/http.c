/* The callbacks of libmicrohttpd are here: on_accept admits a connection, on_head checks a head (fields,
 * route, host, token, scene, type, length), on_body holds a body in counted memory, and handle answers on the
 * I/O thread or hands the request to the queue of solves. */
#include "server/http/http.h"

#include "server/http/browser.h"
#include "server/http/framing.h"
#include "server/http/head_fields.h"
#include "server/http/request_log.h"
#include "server/net/descriptors.h"
#include "solver/base/clock.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

struct http {
    service *service;
    struct MHD_Daemon *daemon;
    uint64_t seed, next_id;
    unsigned unread_status; /* of a head that libmicrohttpd refused, until its connection is closed; or 0 */
    char unread_reason[64];
    int listen_fd; /* after http_quiesce; before, the daemon's */
};

/* Memory of libmicrohttpd for the head of a request; bodies are in request.body. */
#define CONNECTION_MEMORY (32u << 10)

/* The rest of a refused body is read and dropped up to this length, so that its connection can be used again.
 */
#define DROP_MAX ((uint64_t)1 << 20)

/* The part of a body without a length beyond --max-body that is read before its answer, for the sake of the
 * connection. */
#define EXCESS_MAX ((uint64_t)64 << 20)

/* True if the client may have the route, by its token where one is needed. */
static bool check_token(request *r) {
    tokens *all = r->service->tokens;
    const route *to = r->match.route;
    const token_right right = to != NULL && to->right != 0 ? to->right : TOKEN_READ;
    if (all == NULL || !(r->match.with_token || (right == TOKEN_METRICS && tokens_guard_metrics(all))))
        return true;
    if (!tokens_find(all, http_header(r, MHD_HTTP_HEADER_AUTHORIZATION), &r->holder)) {
        answer_refuse(&r->answer, PROBLEM_NO_TOKEN, "a bearer token is needed: Authorization: Bearer TOKEN");
        return false;
    }
    if (to == NULL || (r->holder.rights & right) != 0) return true;
    answer_refuse(&r->answer, PROBLEM_NO_RIGHT, "the token has no right to %s",
                  right == TOKEN_READ   ? "read"
                  : right == TOKEN_VARY ? "make or delete variants"
                                        : "read metrics");
    return false;
}

static bool check_scene(request *r) {
    const variant_state variant = r->call.variant;
    if (!r->match.has_name) return true;
    r->call.scene = catalog_find(r->snapshot, r->match.name);
    r->call.name = r->match.name;
    if (r->call.scene != NULL) return http_check_health(r);
    if (variant != VARIANT_SETTLED && r->match.route->also_built) return true;
    if (variant == VARIANT_BUILDING)
        answer_refuse(&r->answer, PROBLEM_UNAVAILABLE, "%.200s is being built", r->match.name);
    else if (variant == VARIANT_FAILED)
        answer_problem(&r->answer, &r->variant_why);
    else if (atomic_load(&r->service->state) == SERVICE_LOADING)
        answer_refuse(&r->answer, PROBLEM_UNAVAILABLE, "stores are being loaded");
    else
        answer_refuse(&r->answer, PROBLEM_NOT_FOUND, "there is no scene %.200s; GET /v1/scenes lists them",
                      r->match.name);
    return false;
}

static bool check_type(request *r) {
    const char *type = http_header(r, MHD_HTTP_HEADER_CONTENT_TYPE);
    const char *encoding = http_header(r, MHD_HTTP_HEADER_CONTENT_ENCODING);
    r->call.body_type = media_content_type(type);
    r->call.accept = media_choose(http_header(r, MHD_HTTP_HEADER_ACCEPT));
    /* Without a type a page of any origin could send the body, as that asks for no preflight. */
    if (type == NULL && (strcmp(r->method, "POST") == 0 || strcmp(r->method, "PUT") == 0))
        answer_refuse(&r->answer, PROBLEM_MEDIA_TYPE,
                      "Content-Type is missing, must be application/json or application/x-npy");
    else if (r->call.body_type == MEDIA_OTHER)
        answer_refuse(&r->answer, PROBLEM_MEDIA_TYPE,
                      "Content-Type is %.100s, must be application/json or application/x-npy", type);
    else if (encoding != NULL && strcasecmp(encoding, "identity") != 0)
        answer_refuse(&r->answer, PROBLEM_MEDIA_TYPE, "Content-Encoding is %.100s, must be left out",
                      encoding);
    else
        return true;
    return false;
}

static void refuse_length(request *r) {
    const size_t most = r->service->config->max_body, room = request_ledger_most(&r->service->memory);
    answer_refuse(
        &r->answer, PROBLEM_TOO_LONG,
        "the body is longer than %zu bytes (--max-body, --max-request-memory); send several requests",
        most < room ? most : room);
}

static void refuse_to_hold(request *r, const char *what) {
    answer_refuse(&r->answer, PROBLEM_UNAVAILABLE,
                  "there is no room for %s: %zu bytes of bodies are held at once, and not all of them of one "
                  "client (--max-buffered)",
                  what, r->service->config->max_buffered);
}

/* The checks of the head: route, method, host and page, token, scene, type, length. True if the body is to be
 * read. */
static bool check_head(request *r, const char *method, const char *target, uint64_t length) {
    const service *s = r->service;
    route_find(method, r->path, &r->match, &r->answer);
    if (!browser_check(r, target)) return false;
    if (!check_token(r) || r->match.route == NULL) return false;
    /* The state of the variant before the snapshot: a variant built in between is then in the snapshot. */
    const variant_state variant =
        r->match.has_name ? variants_state(s->variants, r->match.name, &r->variant_why) : VARIANT_SETTLED;
    r->snapshot = catalog_acquire(s->catalog);
    r->call = (call){.service = s,
                     .snapshot = r->snapshot,
                     .variant = variant,
                     .variant_why = &r->variant_why,
                     .keeps = r->match.route->keeps,
                     .accepted = r->accepted,
                     .memory = &r->memory};
    if (!check_scene(r)) return false;
    const route *to = r->match.route;
    if (to->with_query && !head_read_query(r)) return false;
    if (to->with_query && !to->with_body)
        r->call.accept = media_choose_table(http_header(r, MHD_HTTP_HEADER_ACCEPT));
    if (!to->with_body) return true;
    if (!check_type(r)) return false;
    if (length > s->config->max_body || length > request_ledger_most(&s->memory)) {
        refuse_length(r);
        return false;
    }
    /* Announced bytes are not reserved: otherwise a few slow clients would exclude all others. */
    if (length == 0 || request_memory_allows_body(&r->memory, length)) return true;
    refuse_to_hold(r, "the body");
    return false;
}

/* Appends to the body and counts its bytes; false, with the answer made, if there is no room. */
static bool hold_body(request *r, const char *bytes, size_t count) {
    problem why = {0};
    r->memory.wanted = 0;
    if (request_memory_take_body(&r->memory, count, &why)) {
        if (buffer_append(&r->body, bytes, count)) return true;
        request_memory_give_back_body(&r->memory, count);
        answer_refuse(&r->answer, PROBLEM_NO_MEMORY, "not enough memory for the body");
    } else if (why.status != 0) {
        answer_problem(&r->answer, &why);
    } else {
        refuse_to_hold(r, "the rest of the body");
    }
    return false;
}

/* True if it is the turn of the request's client, now or when libmicrohttpd calls again. */
static bool has_turn(request *r) {
    turns *all = r->service->turns;
    if (!r->had_turn) {
        r->turn.client = r->peer.key;
        r->turn.connection = r->connection;
        r->had_turn = http_has_turn(all, &r->turn);
        if (r->had_turn) return true;
        client_enter(r->service->connections, r->client, STAGE_SOLVE, 0);
        MHD_suspend_connection(r->connection);
        turns_wait(all, &r->turn);
    }
    return r->had_turn;
}

static void go(turn *t) {
    MHD_resume_connection(t->connection);
}

/* Answers on this thread, where the route allows that: its work counts for its client. False, with nothing
 * done, if the queue has to. */
static bool answer_here(request *r) {
    const route *to = r->match.route;
    const double before = clock_thread_seconds();
    if (to->shortcut != NULL && to->shortcut(&r->call, &r->answer))
        http_drop_body(r);
    else if (to->with_body || to->steps != NULL)
        return false;
    else
        to->handle(&r->call, &r->answer);
    http_finish_answer(r, true);
    turns_charge(r->service->turns, r->peer.key, clock_thread_seconds() - before);
    return true;
}

/* The whole request has arrived. */
static enum MHD_Result handle(request *r) {
    if (!has_turn(r)) return MHD_YES;
    if (!r->answered) {
        r->memory.wanted = 0;
        r->call.body = r->body.bytes == NULL ? "" : r->body.bytes;
        r->call.length = r->body.length;
        if (!answer_here(r)) {
            http_solve(r);
            return MHD_YES;
        }
        if (http_wait_for_memory(r, 0)) return MHD_YES;
        r->answered = true;
    }
    return http_send_answer(r);
}

static client *client_of(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info != NULL ? info->socket_context : NULL;
}

/* The line of a request was read: its connection is idle no more. The result becomes that of the request. */
static void *on_request_line(void *context, const char *target, struct MHD_Connection *connection) {
    (void)target;
    client_enter(((http *)context)->service->connections, client_of(connection), STAGE_HEAD, 0);
    return NULL;
}

static request *begin_request(http *h, struct MHD_Connection *connection, const char *path,
                              const char *method) {
    request *r = calloc(1, sizeof *r);
    if (r == NULL || (r->path = strdup(framing_path(path))) == NULL) {
        free(r);
        return NULL;
    }
    r->service = h->service;
    r->memory.ledger = &h->service->memory; /* its client is set with the peer */
    r->connection = connection;
    r->client = client_of(connection);
    request_id_choose(http_header(r, "X-Request-Id"), h->seed, h->next_id++, r->id);
    r->accepted = coding_choose(http_header(r, MHD_HTTP_HEADER_ACCEPT_ENCODING));
    client_enter(h->service->connections, r->client, STAGE_BODY, 0);
    snprintf(r->method, sizeof r->method, "%s", method);
    r->start = clock_seconds();
    r->deadline = r->start + (double)h->service->config->request_timeout_s;
    client_end_by(h->service->connections, r->client, r->deadline);
    r->match.label = route_label_count() - 1;
    metrics_begin(h->service->metrics);
    return r;
}

/* The Content-Length; UINT64_MAX if it is not a number. */
static uint64_t announced_length(const request *r) {
    const char *text = http_header(r, MHD_HTTP_HEADER_CONTENT_LENGTH);
    if (text == NULL) return 0;
    char *end;
    unsigned long long length = strtoull(text, &end, 10);
    return *end == '\0' ? length : UINT64_MAX;
}

/* Answers before the body has come: the connection ends with the answer. */
static enum MHD_Result send_early(request *r) {
    client_linger(r->service->connections, r->client);
    return http_send_answer(r);
}

static enum MHD_Result on_head(http *h, struct MHD_Connection *connection, const char *path,
                               const char *method, const char *version, void **context) {
    request *r = begin_request(h, connection, path, method);
    if (r == NULL) return MHD_NO;
    *context = r;
    if (!head_check_fields(r, version)) {
        /* Nothing that follows may be read as a request, nor waited for as a body. */
        r->answered = r->last = true;
        return send_early(r);
    }
    const uint64_t length = announced_length(r);
    r->announced = length;
    r->answered = !http_read_timeout(r) || !check_head(r, method, path, length);
    /* An answer sent before the end of the body closes the connection. So the body of a refused request is
     * read and dropped, unless it is long, of unknown length, or its client waits for 100 Continue. */
    if (r->answered && (length > DROP_MAX || http_header(r, MHD_HTTP_HEADER_EXPECT) != NULL ||
                        http_header(r, MHD_HTTP_HEADER_TRANSFER_ENCODING) != NULL))
        return send_early(r);
    return MHD_YES;
}

static enum MHD_Result on_body(request *r, const char *bytes, size_t *size) {
    const config *c = r->service->config;
    if (r->paused) {
        r->paused = false;
        client_enter(r->service->connections, r->client, STAGE_BODY, r->received);
    }
    if (!r->answered && r->match.route->with_body) {
        if (r->received + *size > c->max_body) {
            refuse_length(r);
            r->answered = true;
            http_drop_body(r);
        } else if (!hold_body(r, bytes, *size)) {
            if (http_wait_for_memory(r, r->announced)) return MHD_YES;
            r->answered = true;
            http_drop_body(r);
        }
    }
    r->received += *size;
    client_received(r->service->connections, r->client, *size);
    /* libmicrohttpd sends no answer in the middle of a body, and closes the connection of one without end. */
    if (r->received > c->max_body + EXCESS_MAX) {
        if (!r->answered) refuse_length(r); /* of a route that takes no body */
        client_linger(r->service->connections, r->client);
        http_write_refusal(r);
        return MHD_NO;
    }
    *size = 0;
    return MHD_YES;
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *connection, const char *path,
                                  const char *method, const char *version, const char *bytes, size_t *size,
                                  void **request_context) {
    request *r = *request_context;
    if (r == NULL) return on_head(context, connection, path, method, version, request_context);
    if (*size > 0) return on_body(r, bytes, size);
    return handle(r);
}

static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
                         enum MHD_RequestTerminationCode code) {
    (void)connection;
    http *h = context;
    request *r = *request_context;
    if (r == NULL) return;
    *request_context = NULL;
    const double seconds = clock_seconds() - r->start;
    turns_leave(h->service->turns, &r->turn);
    client_enter(h->service->connections, r->client, STAGE_IDLE, 0);
    const bool sent = r->written || (r->queued && code == MHD_REQUEST_TERMINATED_COMPLETED_OK);
    unsigned status = sent ? r->answer.status : 0;
    request_log(r, status, seconds * 1e3);
    if (r->answer.problem != PROBLEM_NONE) problem_counts_add(&h->service->problems, r->answer.problem);
    catalog_release(r->snapshot);
    http_drop_body(r);
    answer_free(&r->answer);
    (void)request_memory_keep(&r->memory, 0);
    free(r->call.changed);
    size_t label = r->match.label;
    free(r->path);
    free(r->query);
    free(r);
    metrics_end(h->service->metrics, label, status, seconds);
}

/* The key of the socket's address, whoever its requests come from. */
static uint64_t key_of(const service *s, const struct sockaddr *from) {
    const peer_fields none = {.n_forwarded = 0};
    peer who;
    peer_find(&s->peers, from, &none, &who);
    return who.key;
}

/* NULL for a Unix socket. */
static const struct sockaddr *address_of(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    return info != NULL ? info->client_addr : NULL;
}

static client *add_connection(const http *h, struct MHD_Connection *connection, int fd) {
    const service *s = h->service;
    const struct sockaddr *from = address_of(connection);
    return connections_add(s->connections, fd, key_of(s, from), !peer_is_proxy(&s->peers, from));
}

static enum MHD_Result on_accept(void *context, const struct sockaddr *from, socklen_t size) {
    const service *s = ((http *)context)->service;
    (void)size;
    return connections_admit(s->connections, key_of(s, from)) ? MHD_YES : MHD_NO;
}

/* Writes the line of a head that libmicrohttpd refused. It names no connection to its log, but sends its
 * answer and closes the connection before it turns to another one: the next that is closed without a request.
 */
static void log_unread(http *h, struct MHD_Connection *connection) {
    if (h->unread_status == 0) return;
    if (connection != NULL) client_linger(h->service->connections, client_of(connection));
    peer who = {.text = ""};
    size_t received = 0;
    if (connection != NULL) {
        const peer_fields none = {.n_forwarded = 0};
        peer_find(&h->service->peers, address_of(connection), &none, &who);
        received = client_bytes_received(client_of(connection));
    }
    request_log_unread(h->service->access_log, who.text, h->unread_status, h->unread_reason, received);
    h->unread_status = 0;
}

static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
                          enum MHD_ConnectionNotificationCode code) {
    connections *all = ((http *)context)->service->connections;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        if (info != NULL) *socket_context = add_connection(context, connection, info->connect_fd);
        /* Without a client of `connections`, libmicrohttpd has to apply the time limit. */
        if (*socket_context == NULL)
            MHD_set_connection_option(connection, MHD_CONNECTION_OPTION_TIMEOUT,
                                      (unsigned)((http *)context)->service->config->timeout_s);
    } else {
        /* The descriptor is still open. */
        if (!client_has_request(*socket_context)) log_unread(context, connection);
        connections_close(all, *socket_context);
        *socket_context = NULL;
    }
}

/* libmicrohttpd 0.9.75 answers by itself what it cannot read, and calls no function but that of its log.
 * Other words of the log are dropped. */
static void on_library_words(void *context, const char *format, va_list arguments) {
    static const char refusal[] = "Error processing request (HTTP response code is %u";
    http *h = context;
    if (strncmp(format, refusal, sizeof refusal - 1) != 0) return;
    const unsigned status = va_arg(arguments, unsigned);
    problem_counts_add_unread(&h->service->problems, status);
    /* One whose connection was not closed since is told without a client. */
    log_unread(h, NULL);
    h->unread_status = status;
    const char *page = va_arg(arguments, const char *),
               *title = page != NULL ? strstr(page, "<title>") : NULL;
    const char *reason = title != NULL ? title + 7 : MHD_get_reason_phrase_for(status);
    snprintf(h->unread_reason, sizeof h->unread_reason, "%.*s", (int)strcspn(reason, "<"), reason);
}

/* Escapes stay in the path, so that %2F does not become a slash; route_find resolves them. */
static size_t keep_escapes(void *context, struct MHD_Connection *connection, char *text) {
    (void)context;
    (void)connection;
    return strlen(text);
}

lam_status http_start(service *s, int listen_fd, http **out, lam_error *error) {
    lam_status status = LAM_OK;
    http *h = memory_allocate(1, sizeof *h, "HTTP", error);
    if (h == NULL) {
        close(listen_fd);
        return LAM_ERR_MEMORY;
    }
    h->service = s;
    h->listen_fd = listen_fd;
    h->seed = request_id_seed();
    h->next_id = 1;
    connection_limits limits = {.wanted = s->config->max_connections,
                                .timeout_s = s->config->timeout_s,
                                .keep_alive_s = s->config->keep_alive_s,
                                .least_rate = s->config->min_rate};
    TRY(descriptors_afford(&limits, catalog_stores(s->catalog), error));
    TRY(connections_start(&limits, &s->connections, error));
    TRY(turns_create(go, &s->turns, error));
    /* No time-out of libmicrohttpd: it would close a client whose answer waits in a slow socket. At its limit
     * of connections, or out of descriptors, the daemon accepts none until one closes. */
    h->daemon = MHD_start_daemon(
        MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, 0, on_accept, h,
        on_request, h, MHD_OPTION_EXTERNAL_LOGGER, on_library_words, h, MHD_OPTION_LISTEN_SOCKET, listen_fd,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_MEMORY, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)(limits.most + limits.beyond), MHD_OPTION_NOTIFY_CONNECTION, on_connection, h,
        MHD_OPTION_NOTIFY_COMPLETED, on_completed, h, MHD_OPTION_URI_LOG_CALLBACK, on_request_line, h,
        MHD_OPTION_UNESCAPE_CALLBACK, keep_escapes, NULL, MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1,
        MHD_OPTION_END);
    if (h->daemon == NULL) FAIL(error, LAM_ERR_IO, "the HTTP server cannot start");
    h->listen_fd = -1;
    *out = h;
    h = NULL;
done:
    if (h != NULL) {
        connections_stop(s->connections);
        s->connections = NULL;
        turns_destroy(s->turns);
        s->turns = NULL;
        close(h->listen_fd);
        free(h);
    }
    return status;
}

void http_quiesce(http *h) {
    h->listen_fd = MHD_quiesce_daemon(h->daemon);
    /* New connections are refused from here on; the descriptor is closed later, as the I/O thread may still
     * use it. */
    if (h->listen_fd >= 0) shutdown(h->listen_fd, SHUT_RDWR);
}

void http_stop(http *h) {
    if (h == NULL) return;
    turns_close(h->service->turns);
    MHD_stop_daemon(h->daemon);
    connections_stop(h->service->connections);
    h->service->connections = NULL;
    turns_destroy(h->service->turns);
    h->service->turns = NULL;
    if (h->listen_fd >= 0) close(h->listen_fd);
    free(h);
}
