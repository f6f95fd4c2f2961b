/* An HTTP server that computes nothing: it answers every request, once its body has come, with one of
 * the files it has read; at once, or after a sleep as long as a solve. `lambert bench service` measures
 * lambertd beside it, so it is built like lambertd: one thread talks, the sleep is on others.
 *
 *     ready_server MICROSECONDS SLEEPERS FILE...
 *
 * /0 is the first file, /1 the next. At most SLEEPERS requests sleep at once, the others wait their turn.
 * Listens on a free port of the loopback, says which, and ends on SIGTERM or SIGINT. */
#include <errno.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

enum { MOST_FILES = 8, MOST_SLEEPERS = 4096, BACKLOG = 512 };

typedef struct request {
    struct MHD_Connection *connection;
    bool slept;
    struct request *next; /* in the queue of those that wait for their sleep */
} request;

typedef struct server {
    size_t n_files;
    struct MHD_Response *responses[MOST_FILES];
    char *bytes[MOST_FILES];
    long nanoseconds; /* of a sleep; 0: none */
    pthread_mutex_t lock;
    pthread_cond_t work;
    request *first, *last;
    bool closed;
} server;

static void die(const char *what, const char *why) {
    fprintf(stderr, "ready_server: %s: %s\n", what, why);
    exit(1);
}

static void enqueue(server *s, request *r) {
    pthread_mutex_lock(&s->lock);
    if (s->first == NULL)
        s->first = r;
    else
        s->last->next = r;
    s->last = r;
    pthread_cond_signal(&s->work);
    pthread_mutex_unlock(&s->lock);
}

/* NULL when the server ends; *hurry is set when it is about to. */
static request *dequeue(server *s, bool *hurry) {
    pthread_mutex_lock(&s->lock);
    while (s->first == NULL && !s->closed) pthread_cond_wait(&s->work, &s->lock);
    request *r = s->first;
    if (r != NULL) s->first = r->next;
    *hurry = s->closed;
    pthread_mutex_unlock(&s->lock);
    return r;
}

static void *sleep_for_others(void *context) {
    server *s = context;
    request *r;
    bool hurry;
    /* By default the kernel may add 50 us to every sleep, which is half of a small solve. */
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    while ((r = dequeue(s, &hurry)) != NULL) {
        struct timespec left = {.tv_sec = s->nanoseconds / 1000000000,
                                .tv_nsec = s->nanoseconds % 1000000000};
        while (!hurry && nanosleep(&left, &left) != 0 && errno == EINTR) continue;
        r->slept = true;
        MHD_resume_connection(r->connection);
    }
    return NULL;
}

static enum MHD_Result answer(server *s, struct MHD_Connection *connection, const char *path) {
    const size_t file = path[0] == '/' && path[1] >= '0' && path[1] <= '9' && path[2] == '\0'
                            ? (size_t)(path[1] - '0')
                            : MOST_FILES;
    if (file < s->n_files) return MHD_queue_response(connection, MHD_HTTP_OK, s->responses[file]);
    static char nothing[1];
    struct MHD_Response *none = MHD_create_response_from_buffer(0, nothing, MHD_RESPMEM_PERSISTENT);
    if (none == NULL) return MHD_NO;
    const enum MHD_Result result = MHD_queue_response(connection, MHD_HTTP_NOT_FOUND, none);
    MHD_destroy_response(none);
    return result;
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *connection, const char *path,
                                  const char *method, const char *version, const char *bytes, size_t *size,
                                  void **request_context) {
    (void)method;
    (void)version;
    (void)bytes;
    server *s = context;
    request *r = *request_context;
    if (r == NULL) {
        r = calloc(1, sizeof *r);
        if (r == NULL) return MHD_NO;
        r->connection = connection;
        *request_context = r;
        return MHD_YES;
    }
    if (*size > 0) {
        *size = 0;
        return MHD_YES;
    }
    if (s->nanoseconds == 0 || r->slept) return answer(s, connection, path);
    /* Suspended first: the sleep may be over before enqueue returns. */
    MHD_suspend_connection(connection);
    enqueue(s, r);
    return MHD_YES;
}

static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
                         enum MHD_RequestTerminationCode code) {
    (void)context;
    (void)connection;
    (void)code;
    free(*request_context);
    *request_context = NULL;
}

static void read_file(server *s, const char *path) {
    FILE *file = fopen(path, "rb");
    long size = -1;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0) size = ftell(file);
    if (size < 0) die(path, strerror(errno));
    rewind(file);
    char *bytes = malloc((size_t)size + 1);
    if (bytes == NULL || fread(bytes, 1, (size_t)size, file) != (size_t)size) die(path, "cannot be read");
    fclose(file);
    s->bytes[s->n_files] = bytes;
    s->responses[s->n_files] = MHD_create_response_from_buffer((size_t)size, bytes, MHD_RESPMEM_PERSISTENT);
    if (s->responses[s->n_files++] == NULL) die(path, "not enough memory");
}

static int listen_on_loopback(unsigned *port) {
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&address, size) != 0 || listen(fd, BACKLOG) != 0 ||
        getsockname(fd, (struct sockaddr *)&address, &size) != 0)
        die("cannot listen", strerror(errno));
    *port = ntohs(address.sin_port);
    return fd;
}

static long number(const char *text, long most) {
    char *end;
    const long value = strtol(text, &end, 10);
    if (*end != '\0' || end == text || value < 0 || value > most) die(text, "is not a number in range");
    return value;
}

int main(int argc, char **argv) {
    static server s = {.lock = PTHREAD_MUTEX_INITIALIZER, .work = PTHREAD_COND_INITIALIZER};
    static pthread_t sleepers[MOST_SLEEPERS];
    unsigned port = 0;
    int signal_number;
    sigset_t signals;
    if (argc < 4 || argc > 3 + MOST_FILES) {
        fprintf(stderr, "usage: ready_server MICROSECONDS SLEEPERS FILE...\n");
        return 2;
    }
    s.nanoseconds = 1000 * number(argv[1], 3600000000L);
    const long n_sleepers = s.nanoseconds > 0 ? number(argv[2], MOST_SLEEPERS) : 0;
    if (s.nanoseconds > 0 && n_sleepers == 0) die(argv[2], "nobody would ever wake");
    for (int i = 3; i < argc; i++) read_file(&s, argv[i]);
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    sigprocmask(SIG_BLOCK, &signals, NULL); /* before any thread, so that none gets them */
    signal(SIGPIPE, SIG_IGN);
    const int fd = listen_on_loopback(&port);
    for (long t = 0; t < n_sleepers; t++)
        if (pthread_create(&sleepers[t], NULL, sleep_for_others, &s) != 0) die("threads", "cannot start");
    struct MHD_Daemon *daemon =
        MHD_start_daemon(MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME, 0, NULL, NULL, on_request,
                         &s, MHD_OPTION_LISTEN_SOCKET, fd, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                         (size_t)32 << 10, MHD_OPTION_NOTIFY_COMPLETED, on_completed, NULL,
                         MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_END);
    if (daemon == NULL) die("the HTTP server", "cannot start");
    printf("listening on http://127.0.0.1:%u\n", port);
    fflush(stdout);
    sigwait(&signals, &signal_number);
    /* Sleeping requests wake first: libmicrohttpd cannot stop with a connection suspended. */
    pthread_mutex_lock(&s.lock);
    s.closed = true;
    pthread_cond_broadcast(&s.work);
    pthread_mutex_unlock(&s.lock);
    for (long t = 0; t < n_sleepers; t++) pthread_join(sleepers[t], NULL);
    MHD_stop_daemon(daemon);
    for (size_t i = 0; i < s.n_files; i++) {
        MHD_destroy_response(s.responses[i]);
        free(s.bytes[i]);
    }
    return 0;
}
