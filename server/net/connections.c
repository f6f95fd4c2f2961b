/* This list of connections is swept by one thread every second, and at ends that come before. Bytes that move
 * set the deadline of a body or an answer to min(deadline + bytes / least_rate, now + timeout_s); a
 * connection past it is shut down here, and the thread that serves it closes it. */
#include "server/net/connections.h"

#include "server/net/descriptors.h"
#include "server/net/lingering.h"
#include "server/net/shares.h"
#include "server/net/socket_state.h"
#include "solver/base/clock.h"

#include <fcntl.h>
#include <linux/sockios.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

/* A connection lingers for so many seconds without a byte, or timeout_s if that is less, and for so many
 * times as long in all; a part of all connections does at once, at most. */
#define LINGERING_QUIET_S 5.0
#define LINGERING_TIMES 6.0
#define LINGERING_PART 4

/* When all connections are in use, an idle one is kept for this time. */
#define IDLE_GRACE_S 1.0

/* Seconds after its end when a connection is closed. */
#define END_SLACK 1e-3

/* Idle connections closed in a second, at most. */
#define PLACES 64

/* Seconds from which on a client that has ended its sending in the middle of a request is taken as gone: not
 * at once, as its bytes may be a whole request that is being processed. While all connections are in use it
 * has less time, and the next look for others waits for a moment, as one asks the kernel for each. */
#define GONE_AFTER_S 1.0
#define GONE_AFTER_FULL_S .25
#define GONE_PAUSE_S .05

typedef enum cut_reason {
    CUT_IDLE,
    CUT_HEAD,
    CUT_BODY,
    CUT_ANSWER,
    CUT_PLACE,
    CUT_DEADLINE,
    CUT_SHARE,
    CUT_LINGERING,
    N_CUT_REASONS
} cut_reason;
static const char *const reasons[N_CUT_REASONS] = {"idle",  "head",     "body",  "answer",
                                                   "place", "deadline", "share", "lingering"};

struct client {
    client *before, *after;
    int fd;
    connection_stage stage;
    bool cut;
    bool lingers;    /* once it is closed */
    bool counts;     /* counts for its client */
    uint64_t key;    /* of its client */
    bool checked;    /* seen was set in this stage */
    double since;    /* seconds, begin of the stage */
    double deadline; /* extended by bytes that move */
    double end;      /* of body and answer; INFINITY: none */
    uint64_t bytes;  /* received of a body, or to be sent of an answer */
    uint64_t seen;   /* the counter of bytes when it was last checked */
};

struct connections {
    pthread_mutex_t lock;
    pthread_cond_t ending;
    pthread_t thread;
    connection_limits limits;
    client *first;
    double next_end; /* the earliest of all, or earlier */
    bool hurried;    /* an end comes before the next check */
    double looked;   /* for those that are gone, while all were in use */
    size_t n_open, n_lingering;
    lingering *lingering;
    shares kept;        /* connections but those that are being closed */
    uint64_t n_refused; /* not accepted, as their client has most of all */
    uint64_t n_cut[N_CUT_REASONS];
    bool ended;
};

/* Bytes of an answer that were read since the last check. A Unix socket reports only the bytes waiting in it:
 * any change then counts as enough, and the time for the whole answer is limited. */
static double measure_read(const connection_limits *limits, client *c, double now) {
    uint64_t seen;
    int waiting = 0;
    const double enough = (double)limits->timeout_s * (double)limits->least_rate;
    const bool counted = socket_acknowledged(c->fd, &seen);
    if (!counted) seen = ioctl(c->fd, SIOCOUTQ, &waiting) == 0 ? (uint64_t)waiting : 0;
    const bool changed = c->checked && seen != c->seen;
    const double read = !changed ? 0.0 : counted ? (double)(seen - c->seen) : enough;
    c->checked = true;
    c->seen = seen;
    if (!counted && now - c->since > ((double)c->bytes + enough) / (double)limits->least_rate)
        c->deadline = c->since;
    return read;
}

/* Seconds for which a connection lingers without a byte. */
static double quiet_of(const connection_limits *limits) {
    return fmin(LINGERING_QUIET_S, (double)limits->timeout_s);
}

/* True if c is past its deadline. Every byte that moves extends the deadline by 1/rate, to at most one
 * time-out from now, so that a client cannot save up time. */
static bool is_over_time(const connection_limits *limits, client *c, double now, cut_reason *why) {
    const double timeout = c->stage == STAGE_LINGERING ? quiet_of(limits) : (double)limits->timeout_s;
    double moved = 0.0;
    switch (c->stage) {
    case STAGE_SOLVE:
        return false;
    case STAGE_IDLE:
        *why = CUT_IDLE;
        return now > c->deadline || (now - c->since > GONE_AFTER_S && socket_has_hung_up(c->fd));
    case STAGE_HEAD:
    case STAGE_BODY:
        *why = c->stage == STAGE_HEAD ? CUT_HEAD : CUT_BODY;
        moved = (double)(c->bytes - c->seen);
        c->seen = c->bytes;
        if (moved <= 0 && now - c->since > GONE_AFTER_S && socket_has_hung_up(c->fd)) return true;
        break;
    case STAGE_ANSWER:
        *why = CUT_ANSWER;
        moved = measure_read(limits, c, now);
        break;
    case STAGE_LINGERING:
        *why = CUT_LINGERING;
        moved = (double)(c->bytes - c->seen);
        c->seen = c->bytes;
        break;
    }
    if (now > c->end && c->stage != STAGE_HEAD) {
        if (c->stage != STAGE_LINGERING) *why = CUT_DEADLINE;
        return true;
    }
    c->deadline += moved / (double)limits->least_rate;
    if (c->deadline > now + timeout) c->deadline = now + timeout;
    return now > c->deadline;
}

/* The connection counts no more. */
static void uncount(connections *all, const client *c) {
    all->kept.taken--;
    all->n_lingering -= c->stage == STAGE_LINGERING;
    if (c->counts) all->kept.of[shares_place(c->key)]--;
}

/* The caller holds the lock, so that the descriptor still belongs to this client. The thread that serves it
 * finds the socket shut down and closes it. */
static void cut(connections *all, client *c, cut_reason why) {
    uncount(all, c);
    /* Discards unread bytes of the answer, which would otherwise stay in the socket. */
    const struct linger none = {.l_onoff = 1, .l_linger = 0};
    if (c->stage == STAGE_ANSWER) setsockopt(c->fd, SOL_SOCKET, SO_LINGER, &none, sizeof none);
    c->cut = true;
    all->n_cut[why]++;
    shutdown(c->fd, SHUT_RDWR);
}

/* True between requests, where nobody loses an answer. */
static bool is_between(const client *c) {
    return c->stage == STAGE_IDLE || c->stage == STAGE_HEAD || c->stage == STAGE_LINGERING;
}

/* The client that has been between requests for longest, and longer than IDLE_GRACE_S; NULL if none. */
static client *find_idle(const connections *all, double now) {
    client *oldest = NULL;
    for (client *c = all->first; c != NULL; c = c->after)
        if (!c->cut && is_between(c) && now - c->since > IDLE_GRACE_S &&
            (oldest == NULL || c->since < oldest->since))
            oldest = c;
    return oldest;
}

/* The caller holds the lock. Closes what is past its deadline and, if all connections or descriptors are in
 * use, at most a quarter of them that are idle. O(open) for each one closed. */
static void sweep(connections *all) {
    const double now = clock_seconds();
    cut_reason why = CUT_HEAD;
    all->next_end = INFINITY;
    for (client *c = all->first; c != NULL; c = c->after) {
        if (c->cut) continue;
        if (is_over_time(&all->limits, c, now, &why))
            cut(all, c, why);
        else if (c->stage != STAGE_SOLVE)
            all->next_end = fmin(all->next_end, c->end);
    }
    if (all->n_open < all->limits.most && !descriptors_are_out()) return;
    for (size_t place = 0; place <= all->limits.most / 4 && place < PLACES; place++) {
        client *idle = find_idle(all, now);
        if (idle == NULL) return;
        cut(all, idle, CUT_PLACE);
    }
}

/* Checks every second, and at the ends that come before. */
static void *watch(void *argument) {
    connections *all = argument;
    double check_at = clock_seconds() + 1;
    pthread_mutex_lock(&all->lock);
    while (!all->ended) {
        const double next = fmin(check_at, all->next_end + END_SLACK);
        const struct timespec when = {.tv_sec = (time_t)next, .tv_nsec = (long)(1e9 * (next - floor(next)))};
        all->hurried = false;
        while (!all->ended && !all->hurried && pthread_cond_timedwait(&all->ending, &all->lock, &when) == 0) {
        }
        if (all->ended || clock_seconds() < next) continue;
        sweep(all);
        check_at = clock_seconds() + 1;
    }
    pthread_mutex_unlock(&all->lock);
    return NULL;
}

/* Of lingering_calls. */
static bool take_lingering(void *context, void *who, size_t bytes) {
    connections *all = context;
    client *c = who;
    pthread_mutex_lock(&all->lock);
    c->bytes += bytes;
    const bool goes_on = !c->cut;
    pthread_mutex_unlock(&all->lock);
    return goes_on;
}

static void end_lingering(void *context, void *who) {
    connections_remove(context, who);
}

lam_status connections_start(const connection_limits *limits, connections **out, lam_error *error) {
    lam_status status = LAM_OK;
    pthread_condattr_t monotonic;
    sigset_t every, before;
    connections *all = memory_allocate(1, sizeof *all, "connections", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    all->limits = *limits;
    all->next_end = INFINITY;
    const lingering_calls calls = {take_lingering, end_lingering, all};
    pthread_mutex_init(&all->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&all->ending, &monotonic);
    pthread_condattr_destroy(&monotonic);
    TRY(lingering_start(&calls, &all->lingering, error));
    sigfillset(&every);
    pthread_sigmask(SIG_SETMASK, &every, &before);
    const int failed = pthread_create(&all->thread, NULL, watch, all);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (failed != 0) FAIL(error, LAM_ERR_MEMORY, "cannot start the thread that watches connections");
    *out = all;
    all = NULL;
done:
    if (all != NULL) {
        lingering_stop(all->lingering);
        pthread_cond_destroy(&all->ending);
        pthread_mutex_destroy(&all->lock);
        free(all);
    }
    return status;
}

void connections_reserve(connections *all, size_t n_stores) {
    connection_limits limits = {.wanted = all->limits.wanted};
    if (descriptors_afford(&limits, n_stores, NULL) != LAM_OK) return;
    pthread_mutex_lock(&all->lock);
    all->limits.most = limits.most;
    pthread_mutex_unlock(&all->lock);
}

void connections_stop(connections *all) {
    if (all == NULL) return;
    pthread_mutex_lock(&all->lock);
    all->ended = true;
    pthread_cond_signal(&all->ending);
    pthread_mutex_unlock(&all->lock);
    pthread_join(all->thread, NULL);
    pthread_mutex_lock(&all->lock);
    for (client *c = all->first; c != NULL; c = c->after)
        if (!c->cut) cut(all, c, CUT_LINGERING);
    pthread_mutex_unlock(&all->lock);
    lingering_stop(all->lingering);
    pthread_cond_destroy(&all->ending);
    pthread_mutex_destroy(&all->lock);
    free(all);
}

static void begin_stage(const connections *all, client *c, connection_stage stage, size_t bytes, double now) {
    c->stage = stage;
    c->since = now;
    c->deadline = now + (stage == STAGE_LINGERING ? quiet_of(&all->limits)
                         : stage == STAGE_IDLE    ? (double)all->limits.keep_alive_s
                                                  : (double)all->limits.timeout_s);
    c->bytes = bytes;
    c->seen = 0;
    c->checked = false;
    if (stage == STAGE_HEAD) c->end = INFINITY;
}

/* Wakes the thread that checks, if the end of c comes before all others. */
static void hurry(connections *all, const client *c) {
    if (c->stage == STAGE_SOLVE || !(c->end < all->next_end)) return;
    all->next_end = c->end;
    all->hurried = true;
    pthread_cond_signal(&all->ending);
}

/* The loss of what a connection is in, least first. */
static unsigned loss_of(const client *c) {
    static const unsigned losses[] = {[STAGE_LINGERING] = 0, [STAGE_IDLE] = 1,   [STAGE_HEAD] = 2,
                                      [STAGE_BODY] = 3,      [STAGE_ANSWER] = 4, [STAGE_SOLVE] = 5};
    return losses[c->stage];
}

/* The connection that the clients of a place of the table give away. */
static client *find_gift(const connections *all, size_t place) {
    client *found = NULL;
    for (client *c = all->first; c != NULL; c = c->after) {
        if (c->cut || !c->counts || shares_place(c->key) != place) continue;
        if (found == NULL || loss_of(c) < loss_of(found) ||
            (loss_of(c) == loss_of(found) && c->since < found->since))
            found = c;
    }
    return found;
}

/* Closes one of the client's connections that has sent no head; false if there is none. */
static bool replace_idle(connections *all, uint64_t key) {
    client *gift = find_gift(all, shares_place(key));
    if (gift == NULL || !is_between(gift)) return false;
    cut(all, gift, CUT_SHARE);
    return true;
}

/* Closes those whose clients are gone without an answer, which would count for their clients until the next
 * sweep. O(open). */
static void cut_gone(connections *all) {
    const double now = clock_seconds();
    if (now - all->looked < GONE_PAUSE_S) return;
    all->looked = now;
    for (client *c = all->first; c != NULL; c = c->after) {
        const bool in_request = c->stage == STAGE_HEAD || c->stage == STAGE_BODY;
        if (!c->cut && (in_request || c->stage == STAGE_IDLE) && now - c->since > GONE_AFTER_FULL_S &&
            socket_has_hung_up(c->fd))
            cut(all, c, c->stage == STAGE_BODY ? CUT_BODY : c->stage == STAGE_HEAD ? CUT_HEAD : CUT_IDLE);
    }
}

bool connections_admit(connections *all, uint64_t key) {
    pthread_mutex_lock(&all->lock);
    if (all->kept.taken >= all->limits.most) cut_gone(all);
    const size_t kept = all->kept.taken;
    bool admitted = kept < all->limits.most;
    if (!admitted) {
        size_t most = 0;
        for (size_t p = 1; p < SHARES_CLIENTS; p++)
            if (all->kept.of[p] > all->kept.of[most]) most = p;
        if (all->kept.of[most] > shares_of(&all->kept, key) + 1) {
            cut(all, find_gift(all, most), CUT_SHARE);
            admitted = true;
        } else {
            admitted = kept < all->limits.most + all->limits.beyond / 2 || replace_idle(all, key);
        }
    }
    all->n_refused += !admitted;
    pthread_mutex_unlock(&all->lock);
    return admitted;
}

client *connections_add(connections *all, int fd, uint64_t key, bool counts) {
    client *c = calloc(1, sizeof *c);
    if (c == NULL) return NULL;
    c->fd = fd;
    c->key = key;
    c->counts = counts;
    begin_stage(all, c, STAGE_HEAD, 0, clock_seconds());
    pthread_mutex_lock(&all->lock);
    c->after = all->first;
    if (all->first != NULL) all->first->before = c;
    all->first = c;
    all->n_open++;
    all->kept.taken++;
    if (counts) all->kept.of[shares_place(key)]++;
    pthread_mutex_unlock(&all->lock);
    return c;
}

void connections_remove(connections *all, client *c) {
    if (c == NULL) return;
    pthread_mutex_lock(&all->lock);
    if (c->before != NULL)
        c->before->after = c->after;
    else
        all->first = c->after;
    if (c->after != NULL) c->after->before = c->before;
    if (!c->cut) uncount(all, c);
    all->n_open--;
    pthread_mutex_unlock(&all->lock);
    free(c);
}

/* The connection that has lingered for longest. The caller holds the lock. */
static client *find_lingering(const connections *all) {
    client *oldest = NULL;
    for (client *c = all->first; c != NULL; c = c->after)
        if (!c->cut && c->stage == STAGE_LINGERING && (oldest == NULL || c->since < oldest->since))
            oldest = c;
    return oldest;
}

void connections_close(connections *all, client *c) {
    if (c == NULL) return;
    const double now = clock_seconds();
    bool lingers = false;
    pthread_mutex_lock(&all->lock);
    const int fd = c->lingers && !c->cut ? fcntl(c->fd, F_DUPFD_CLOEXEC, 0) : -1;
    if (fd >= 0) {
        client *oldest = all->n_lingering < all->limits.most / LINGERING_PART ? NULL : find_lingering(all);
        if (oldest != NULL) cut(all, oldest, CUT_LINGERING);
        begin_stage(all, c, STAGE_LINGERING, 0, now);
        c->end = now + LINGERING_TIMES * quiet_of(&all->limits);
        c->fd = fd;
        all->n_lingering++;
        lingers = lingering_add(all->lingering, fd, c);
    }
    pthread_mutex_unlock(&all->lock);
    if (lingers) return;
    connections_remove(all, c);
    if (fd >= 0) close(fd);
}

size_t connections_lingering(connections *all) {
    pthread_mutex_lock(&all->lock);
    const size_t count = all->n_lingering;
    pthread_mutex_unlock(&all->lock);
    return count;
}

void client_enter(connections *all, client *c, connection_stage stage, size_t bytes) {
    if (c == NULL) return;
    const double now = clock_seconds();
    pthread_mutex_lock(&all->lock);
    begin_stage(all, c, stage, bytes, now);
    hurry(all, c);
    pthread_mutex_unlock(&all->lock);
}

void client_received(connections *all, client *c, size_t bytes) {
    if (c == NULL) return;
    pthread_mutex_lock(&all->lock);
    c->bytes += bytes;
    pthread_mutex_unlock(&all->lock);
}

void client_end_by(connections *all, client *c, double end) {
    if (c == NULL) return;
    pthread_mutex_lock(&all->lock);
    c->end = end;
    hurry(all, c);
    pthread_mutex_unlock(&all->lock);
}

void client_linger(connections *all, client *c) {
    if (c == NULL) return;
    pthread_mutex_lock(&all->lock);
    c->lingers = true;
    pthread_mutex_unlock(&all->lock);
}

bool client_has_request(const client *c) {
    return c != NULL && c->stage != STAGE_IDLE && c->stage != STAGE_HEAD;
}

size_t client_bytes_received(const client *c) {
    return c != NULL ? socket_received(c->fd) : 0;
}

bool client_is_lost(const client *c) {
    return c != NULL && socket_is_lost(c->fd);
}

bool connections_write(connections *all, buffer *b) {
    uint64_t n_cut[N_CUT_REASONS];
    pthread_mutex_lock(&all->lock);
    const size_t n_open = all->n_open, n_lingering = all->n_lingering, most = all->limits.most;
    const uint64_t n_refused = all->n_refused;
    for (size_t r = 0; r < N_CUT_REASONS; r++) n_cut[r] = all->n_cut[r];
    pthread_mutex_unlock(&all->lock);
    bool written = buffer_printf(b,
                                 "# HELP lambertd_connections Open connections.\n"
                                 "# TYPE lambertd_connections gauge\n"
                                 "lambertd_connections %zu\n"
                                 "# HELP lambertd_connections_lingering Connections of these whose answer "
                                 "was sent and whose rest is dropped.\n"
                                 "# TYPE lambertd_connections_lingering gauge\n"
                                 "lambertd_connections_lingering %zu\n"
                                 "# HELP lambertd_connections_most Limit of open connections.\n"
                                 "# TYPE lambertd_connections_most gauge\n"
                                 "lambertd_connections_most %zu\n"
                                 "# HELP lambertd_connections_refused_total Connections that were not "
                                 "accepted, of clients that have most of all.\n"
                                 "# TYPE lambertd_connections_refused_total counter\n"
                                 "lambertd_connections_refused_total %llu\n"
                                 "# HELP lambertd_connections_cut_total Connections closed at a time limit, "
                                 "or to make room.\n"
                                 "# TYPE lambertd_connections_cut_total counter\n",
                                 n_open, n_lingering, most, (unsigned long long)n_refused);
    for (size_t r = 0; r < N_CUT_REASONS; r++)
        written = written && buffer_printf(b, "lambertd_connections_cut_total{why=\"%s\"} %llu\n", reasons[r],
                                           (unsigned long long)n_cut[r]);
    return written;
}
