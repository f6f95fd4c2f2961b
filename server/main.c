/* lambertd: reads stores and answers requests over HTTP until a signal ends it. */
#include "server/http/http.h"
#include "server/net/listener.h"
#include "server/route/routes.h"
#include "server/scene/map_guard.h"
#include "solver/base/clock.h"
#include "solver/base/options/options.h"
#include "solver/codec/reflectance.h"
#include "solver/linalg/core.h"
#include "solver/waits.h"

#include <errno.h>
#include <malloc.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

/* OpenMP binds the first thread, and so all others, to one processor where the environment asks it to bind
 * its own; they are none here. True if it did. */
static bool undo_binding(void) {
    static const char *const names[] = {"OMP_PROC_BIND", "OMP_PLACES", "GOMP_CPU_AFFINITY"};
    cpu_set_t all;
    bool bound = false;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        bound = bound || getenv(names[i]) != NULL;
        (void)unsetenv(names[i]);
    }
    memset(&all, 0xff, sizeof all);
    if (bound) (void)sched_setaffinity(0, sizeof all, &all);
    return bound;
}

/* Loops are shared by the threads of the queue alone. OpenMP would give each of them a team of its own, and
 * end the program where the system allows no more threads. The environment forbids that only before the
 * program starts, so it starts once more. ps and pgrep would then call it "exe", after the path of the second
 * start. */
static void forbid_teams(char **argv) {
    const char *limit = getenv("OMP_THREAD_LIMIT");
    const bool right = limit != NULL && strcmp(limit, "1") == 0;
    (void)prctl(PR_SET_NAME, program_invocation_short_name);
    if ((!undo_binding() && right) || setenv("OMP_THREAD_LIMIT", "1", 1) != 0) return;
    execv("/proc/self/exe", argv);
}

/* Longer arrays lie outside the heap, and what they took is given back at once. By itself the C library
 * raises this to 32 MiB after the first of them, and the heap then keeps what vectors of requests took. */
#define LONGEST_IN_HEAP (4 << 20)

/* Threads that allocate little need no heaps of their own. With one heap for each thread, every heap kept its
 * largest size and the daemon grew by a tenth in its first hundred thousand requests. */
static void share_one_heap(void) {
    (void)mallopt(M_ARENA_MAX, 1);
    (void)mallopt(M_MMAP_THRESHOLD, LONGEST_IN_HEAP);
}

/* The heap keeps a sixteenth of what requests may take, within these limits, at its end while requests come.
 * Of 16 MiB sixteen clients have no use that ask for two megabytes each: their pages are then given back and
 * taken again with every answer, which costs more than the solve. */
#define LEAST_KEPT ((size_t)16 << 20)
#define MOST_KEPT ((size_t)128 << 20)

static void keep_heap(size_t max_request_memory) {
    const size_t share = max_request_memory / 16, most = share < MOST_KEPT ? share : MOST_KEPT;
    (void)mallopt(M_TRIM_THRESHOLD, (int)(most > LEAST_KEPT ? most : LEAST_KEPT));
}

/* Gives back what the heap keeps. */
static void trim_heap(void) {
    (void)malloc_trim(0);
}

/* Blocks the signals that the main thread waits for, before any thread starts, so that no thread gets them.
 * Where SIGCHLD was ignored by the launcher, the end of a child would be unknown. */
static sigset_t block_signals(void) {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGHUP);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGCHLD, SIG_DFL);
    return set;
}

/* True if a signal that ends the program waits beside others: sigwait gives the lowest number first, which is
 * SIGHUP. */
static bool is_ended(void) {
    const struct timespec now = {.tv_nsec = 0};
    sigset_t ends;
    sigemptyset(&ends);
    sigaddset(&ends, SIGINT);
    sigaddset(&ends, SIGTERM);
    return sigtimedwait(&ends, NULL, &now) > 0;
}

/* The same, remembered: the signal is taken once. context: a bool. */
static bool is_ended_now(void *context) {
    bool *const ended = context;
    *ended = *ended || is_ended();
    return *ended;
}

/* Reads the stores again on every SIGHUP until another signal comes, also while it reads. */
static void serve_until_signal(service *s, const sigset_t *signals) {
    int signal_number = 0;
    bool ended = false;
    const stop_check stop = {is_ended_now, &ended};
    for (;;) {
        if (sigwait(signals, &signal_number) != 0 || signal_number != SIGHUP || stop_asked(&stop)) return;
        access_log_reopen(s->access_log);
        lam_error error;
        if (tokens_reload(s->tokens, stderr, &error) != LAM_OK) {
            fprintf(stderr, "lambertd: the tokens stay as they were: %s\n", error.message);
            fflush(stderr);
        }
        size_t served = catalog_reload(s->catalog, &stop);
        if (ended) return;
        connections_reserve(s->connections, catalog_stores(s->catalog));
        printf("reloaded: %zu scene%s\n", served, served == 1 ? "" : "s");
        fflush(stdout);
    }
}

/* Seconds in which the answers of solves that are given up are sent, the last of --shutdown-timeout. */
#define LAST_ANSWERS_S .8

static bool is_busy(service *s) {
    return metrics_in_flight(s->metrics) > 0 || variants_busy(s->variants);
}

/* Waits for a signal (but SIGHUP) that hurries; false if none came in so many seconds. */
static bool hurried_within(double seconds, const sigset_t *signals) {
    const double end = clock_seconds() + seconds;
    for (double left; (left = end - clock_seconds()) > 0;) {
        const struct timespec pause = {.tv_sec = (time_t)left,
                                       .tv_nsec = (long)(1e9 * (left - (double)(time_t)left))};
        const int signal_number = sigtimedwait(signals, NULL, &pause);
        if (signal_number == SIGINT || signal_number == SIGTERM) return true;
    }
    return false;
}

/* Waits until no request is open and no variant is built; false if a signal hurries or the seconds are over.
 */
static bool idle_within(service *s, double seconds, const sigset_t *signals) {
    const double end = clock_seconds() + seconds;
    while (is_busy(s)) {
        if (clock_seconds() >= end || hurried_within(5e-3, signals)) return false;
    }
    return true;
}

/* Waits as long for clients that still send what was refused, and then read why. */
static void wait_for_lingering(service *s, double seconds, const sigset_t *signals) {
    const double end = clock_seconds() + seconds;
    while (connections_lingering(s->connections) > 0 && clock_seconds() < end &&
           !hurried_within(5e-3, signals)) {
    }
}

/* Leaves as --drain-delay and --shutdown-timeout say; a second signal hurries. True if no thread is in a
 * function that could take long. */
static bool leave(service *s, http *h, unix_socket *own, const sigset_t *signals) {
    const bool served = atomic_exchange(&s->state, SERVICE_DRAINING) == SERVICE_READY;
    const bool hurried = served && hurried_within((double)s->config->drain_delay_s, signals);
    http_quiesce(h);
    listener_unlink(own);
    variants_close(s->variants);
    if (!hurried && idle_within(s, (double)s->config->shutdown_timeout_s - LAST_ANSWERS_S, signals)) {
        wait_for_lingering(s, LAST_ANSWERS_S, signals);
        return true;
    }
    atomic_store(&s->state, SERVICE_ENDING);
    batch_abandon(s->queue);
    (void)idle_within(s, LAST_ANSWERS_S, signals);
    return batch_jobs(s->queue) == 0 && !variants_busy(s->variants);
}

/* Ends the process while threads are in functions that take long. Nothing is lost: a daemon writes no file
 * but its log. */
static void end_at_once(service *s) {
    fprintf(stderr, "lambertd: what still runs is given up\n");
    batch_leave(s->queue);
    access_log_close(s->access_log);
    fflush(NULL);
    _exit(EXIT_SUCCESS);
}

/* A daemon that other machines reach should know who asks, and by which names. */
static void warn_if_open(const service *s) {
    if (s->origins.is_local) return;
    if (s->config->token_file == NULL)
        fprintf(stderr, "lambertd: other machines may reach %s, and no token is asked for (--token-file)\n",
                s->origins.bound);
    if (s->origins.any_host)
        fprintf(stderr, "lambertd: any Host is accepted on %s; name those to answer to by --allow-host\n",
                s->origins.bound);
    fflush(stderr);
}

static lam_status run(const config *c, const sigset_t *signals, lam_error *error) {
    lam_status status = LAM_OK;
    service s = {.config = c};
    http *h = NULL;
    int listen_fd = -1;
    bool ended = false;
    const stop_check stop = {is_ended_now, &ended};
    unix_socket own = {.path = NULL};
    char where[256];
    const char **labels = memory_allocate(route_label_count(), sizeof *labels, "routes", error);
    if (labels == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < route_label_count(); i++) labels[i] = route_label(i);
    atomic_init(&s.state, SERVICE_LOADING);
    keep_heap(c->max_request_memory);
    request_ledger_init(&s.memory, c->max_request_memory, c->max_buffered);
    TRY(peer_rules_read(&c->trusted_proxies, &s.peers, error));
    if (c->token_file != NULL) TRY(tokens_open(c->token_file, stderr, &s.tokens, error));
    if (c->access_log != NULL) TRY(access_log_open(c->access_log, &s.access_log, error));
    s.audit_log = s.access_log;
    if (s.audit_log == NULL && c->max_variants > 0) TRY(access_log_open(NULL, &s.audit_log, error));
    TRY(metrics_create(route_label_count(), labels, &s.metrics, error));
    TRY(metrics_page_create(&s.metrics_page, error));
    TRY(openapi_keep(&s.openapi, error));
    TRY(manual_keep(&s.manual, error));
    TRY(catalog_create(c, stdout, stderr, &s.catalog, error));
    TRY(variants_start(c, s.catalog, &s.variants, error));
    TRY(batch_start(c->threads, c->max_inflight, &s.queue, error));
    if (batch_threads(s.queue) < c->threads)
        fprintf(stderr, "lambertd: %zu of %zu --threads: the system allows no more\n", batch_threads(s.queue),
                c->threads);
    if (c->threads_why[0] != '\0')
        printf("%zu thread%s: %s\n", batch_threads(s.queue), c->threads == 1 ? "" : "s", c->threads_why);
    batch_when_resting(s.queue, trim_heap);
    batch_lend(s.queue);
    TRY(c->unix_path != NULL ? listener_open_unix(c->unix_path, &listen_fd, where, sizeof where, &own, error)
                             : listener_open_tcp(c->listen_address, &listen_fd, where, sizeof where, error));
    TRY(origin_rules_read(&c->allowed_hosts, &c->allowed_origins,
                          c->unix_path == NULL ? c->listen_address : NULL, where, &s.origins, error));
    warn_if_open(&s);
    TRY(http_start(&s, listen_fd, &h, error));
    if (catalog_reload(s.catalog, &stop) == 0 && !ended) FAIL(error, LAM_ERR_IO, "no store can be served");
    if (c->strict && !catalog_read_all(s.catalog) && !ended)
        FAIL(error, LAM_ERR_IO, "a store was refused, and --strict allows none");
    if (!ended) {
        connections_reserve(s.connections, catalog_stores(s.catalog));
        atomic_store(&s.state, SERVICE_READY);
        printf("listening on %s\n", where);
        fflush(stdout);
        serve_until_signal(&s, signals);
    }
    if (!leave(&s, h, &own, signals)) end_at_once(&s);
done:
    if (s.queue != NULL) batch_close(s.queue);
    http_stop(h);
    batch_destroy(s.queue);
    variants_destroy(s.variants);
    catalog_destroy(s.catalog);
    metrics_destroy(s.metrics);
    metrics_page_destroy(s.metrics_page);
    kept_forms_release(s.openapi);
    kept_forms_release(s.manual);
    if (s.audit_log != s.access_log) access_log_close(s.audit_log);
    access_log_close(s.access_log);
    request_ledger_destroy(&s.memory);
    tokens_close(s.tokens);
    listener_unlink(&own);
    free(labels);
    return status;
}

int main(int argc, char **argv) {
    waits_sleep(argv);
    forbid_teams(argv);
    share_one_heap();
    config c;
    lam_error error = {0};
    sigset_t signals = block_signals();
    map_guard_install();
    reflectance_watch_memory();
    core_use_one_thread();
    const int code = config_read(&c, argc, argv);
    if (code != OPTIONS_GO) return fflush(stdout) == 0 ? code : EXIT_FAILURE;
    if (run(&c, &signals, &error) == LAM_OK) return EXIT_SUCCESS;
    fprintf(stderr, "lambertd: %s\n", error.message);
    return EXIT_FAILURE;
}
