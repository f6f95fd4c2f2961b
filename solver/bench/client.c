#include "solver/bench/client.h"

#include "solver/base/clock.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { POLL_MS = 50, LEAST_ROOM = 1 << 16 };
static const double patience_s = 120;

client client_to(unsigned port) {
    return (client){.fd = -1, .port = port};
}

static void hang_up(client *c) {
    if (c->fd >= 0) close(c->fd);
    c->fd = -1;
}

void client_close(client *c) {
    hang_up(c);
    free(c->bytes);
    c->bytes = NULL;
    c->capacity = 0;
}

static lam_status dial(client *c, lam_error *error) {
    const struct sockaddr_in address = {.sin_family = AF_INET,
                                        .sin_port = htons((uint16_t)c->port),
                                        .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const int at_once = 1;
    c->fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    /* No waiting for more before a short body is sent. */
    if (c->fd < 0 || connect(c->fd, (const struct sockaddr *)&address, sizeof address) != 0 ||
        setsockopt(c->fd, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once) != 0) {
        status_fail(error, LAM_ERR_IO, "127.0.0.1:%u: %s", c->port, strerror(errno));
        hang_up(c);
        return LAM_ERR_IO;
    }
    return LAM_OK;
}

/* Until the socket can be read or written. */
static lam_status wait_for(const client *c, const bench_run *run, short events, double deadline,
                           lam_error *error) {
    lam_status status = LAM_OK;
    struct pollfd wait = {.fd = c->fd, .events = events};
    while (poll(&wait, 1, POLL_MS) <= 0) {
        TRY(bench_check(run, error));
        if (clock_seconds() > deadline)
            FAIL(error, LAM_ERR_IO, "127.0.0.1:%u: no answer within %.0f s", c->port, patience_s);
    }
done:
    return status;
}

/* *gone: the server has hung up, and may have answered before. */
static lam_status send_all(const client *c, const bench_run *run, const char *bytes, size_t length, int flags,
                           double deadline, bool *gone, lam_error *error) {
    lam_status status = LAM_OK;
    while (length > 0 && !*gone) {
        const ssize_t sent = send(c->fd, bytes, length, flags | MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent < 0 && (errno == EAGAIN || errno == EINTR)) {
            TRY(wait_for(c, run, POLLOUT, deadline, error));
        } else if (sent < 0) {
            *gone = true;
        } else {
            bytes += sent;
            length -= (size_t)sent;
        }
    }
done:
    return status;
}

/* Until there are wanted bytes or the server hangs up. */
static lam_status receive(client *c, const bench_run *run, size_t wanted, double deadline, size_t *got,
                          bool *gone, lam_error *error) {
    lam_status status = LAM_OK;
    if (wanted >= c->capacity) {
        const size_t capacity = 2 * wanted > LEAST_ROOM ? 2 * wanted : LEAST_ROOM;
        char *bytes = realloc(c->bytes, capacity);
        if (bytes == NULL) FAIL(error, LAM_ERR_MEMORY, "an answer of %zu bytes: not enough memory", wanted);
        c->bytes = bytes;
        c->capacity = capacity;
    }
    while (*got < wanted && !*gone) {
        const ssize_t more = recv(c->fd, c->bytes + *got, c->capacity - 1 - *got, MSG_DONTWAIT);
        if (more < 0 && (errno == EAGAIN || errno == EINTR)) {
            TRY(wait_for(c, run, POLLIN, deadline, error));
        } else if (more <= 0) {
            *gone = true;
        } else {
            *got += (size_t)more;
        }
    }
    c->bytes[*got] = '\0';
done:
    return status;
}

static lam_status send_request(client *c, const bench_run *run, const client_request *request,
                               double deadline, bool *gone, lam_error *error) {
    lam_status status = LAM_OK;
    char head[512], about[256] = "";
    if (request->type != NULL)
        snprintf(about, sizeof about, "Content-Type: %s\r\nAccept: %s\r\nContent-Length: %zu\r\n",
                 request->type, request->type, request->length);
    const int length = snprintf(head, sizeof head, "%s %s HTTP/1.1\r\nHost: 127.0.0.1:%u\r\n%s\r\n",
                                request->method, request->path, c->port, about);
    if (length >= (int)sizeof head) FAIL(error, LAM_ERR_INTERNAL, "%s: the path is too long", request->path);
    TRY(send_all(c, run, head, (size_t)length, request->length > 0 ? MSG_MORE : 0, deadline, gone, error));
    TRY(send_all(c, run, request->body, request->length, 0, deadline, gone, error));
done:
    return status;
}

static lam_status receive_answer(client *c, const bench_run *run, double deadline, client_answer *answer,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    bool gone = false;
    size_t got = 0, body = 0;
    const char *end = NULL;
    while (end == NULL && !gone) {
        TRY(receive(c, run, got + 1, deadline, &got, &gone, error));
        end = strstr(c->bytes, "\r\n\r\n");
    }
    if (end == NULL) {
        hang_up(c);
        return LAM_OK;
    }
    const size_t head = (size_t)(end - c->bytes) + 4;
    const char *length = strcasestr(c->bytes, "\r\nContent-Length:");
    if (sscanf(c->bytes, "HTTP/1.1 %u", &answer->status) != 1 || length == NULL || length > end ||
        sscanf(length + strlen("\r\nContent-Length:"), "%zu", &body) != 1)
        FAIL(error, LAM_ERR_IO, "127.0.0.1:%u: an answer without status or length", c->port);
    const char *closing = strcasestr(c->bytes, "\r\nConnection: close");
    const bool last = closing != NULL && closing < end;
    TRY(receive(c, run, head + body, deadline, &got, &gone, error));
    if (got < head + body)
        FAIL(error, LAM_ERR_IO, "127.0.0.1:%u: an answer ends after %zu of %zu bytes", c->port, got - head,
             body);
    answer->body = c->bytes + head;
    answer->length = body;
    if (last) hang_up(c);
done:
    return status;
}

lam_status client_ask(client *c, const bench_run *run, const client_request *request, client_answer *answer,
                      lam_error *error) {
    lam_status status = LAM_OK;
    const double start = clock_seconds(), deadline = start + patience_s;
    bool gone = false;
    *answer = (client_answer){.status = 0};
    if (c->fd < 0) TRY(dial(c, error));
    TRY(send_request(c, run, request, deadline, &gone, error));
    TRY(receive_answer(c, run, deadline, answer, error));
    answer->seconds = clock_seconds() - start;
done:
    if (status != LAM_OK) hang_up(c);
    return status;
}

lam_status client_warm_up(client *c, const bench_run *run, const client_request *request, double seconds,
                          size_t least, lam_error *error) {
    lam_status status = LAM_OK;
    client_answer answer;
    const double end = clock_seconds() + seconds;
    for (size_t i = 0; i < least || clock_seconds() < end; i++) {
        TRY(client_ask(c, run, request, &answer, error));
        if (answer.status != 200)
            FAIL(error, LAM_ERR_IO, "127.0.0.1:%u%s answered %u: %.200s", c->port, request->path,
                 answer.status, answer.status != 0 ? answer.body : "");
    }
done:
    return status;
}
