#include "server/net/lingering.h"

#include "solver/base/array_grow.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

/* The most that is dropped of one connection. */
#define LINGERING_BYTES ((uint64_t)1 << 30)

/* Bytes that are read at once; then others have their turn. */
#define READ_AT_ONCE ((size_t)64 << 10)

enum { EVENTS_AT_ONCE = 32 };

typedef struct lingerer {
    int fd;
    void *who;
    uint64_t left; /* bytes that may still come */
} lingerer;

struct lingering {
    lingering_calls calls;
    int events, wake; /* of epoll; readable once the thread is to end */
    pthread_t thread;
    atomic_size_t count;
    char dropped[READ_AT_ONCE]; /* the bytes that were read last */
};

static void end_one(lingering *all, lingerer *one) {
    /* Where another descriptor of the connection is open still, epoll would not forget it by itself. */
    (void)epoll_ctl(all->events, EPOLL_CTL_DEL, one->fd, NULL);
    all->calls.end(all->calls.context, one->who);
    close(one->fd);
    free(one);
    atomic_fetch_sub(&all->count, 1);
}

/* False if it is over. */
static bool read_one(lingering *all, lingerer *one) {
    const ssize_t got = recv(one->fd, all->dropped, sizeof all->dropped, MSG_DONTWAIT);
    if (got < 0) return errno == EAGAIN || errno == EINTR;
    if (got == 0 || (uint64_t)got >= one->left) return false;
    one->left -= (uint64_t)got;
    return all->calls.take(all->calls.context, one->who, (size_t)got);
}

static void *read_all(void *argument) {
    lingering *all = argument;
    struct epoll_event events[EVENTS_AT_ONCE];
    bool ending = false;
    while (!ending || atomic_load(&all->count) > 0) {
        const int found = epoll_wait(all->events, events, EVENTS_AT_ONCE, -1);
        for (int i = 0; i < found; i++) {
            lingerer *one = events[i].data.ptr;
            if (one != NULL) {
                if (!read_one(all, one)) end_one(all, one);
            } else {
                ending = true;
                (void)epoll_ctl(all->events, EPOLL_CTL_DEL, all->wake, NULL);
            }
        }
    }
    return NULL;
}

lam_status lingering_start(const lingering_calls *calls, lingering **out, lam_error *error) {
    lam_status status = LAM_OK;
    sigset_t every, before;
    struct epoll_event wake = {.events = EPOLLIN};
    lingering *all = memory_allocate(1, sizeof *all, "connections", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    all->calls = *calls;
    all->events = epoll_create1(EPOLL_CLOEXEC);
    all->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    atomic_init(&all->count, 0);
    if (all->events < 0 || all->wake < 0 || epoll_ctl(all->events, EPOLL_CTL_ADD, all->wake, &wake) != 0)
        FAIL(error, LAM_ERR_IO, "no descriptor is left for connections that are being closed");
    sigfillset(&every);
    pthread_sigmask(SIG_SETMASK, &every, &before);
    const int failed = pthread_create(&all->thread, NULL, read_all, all);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (failed != 0) FAIL(error, LAM_ERR_MEMORY, "cannot start the thread that closes connections");
    *out = all;
    all = NULL;
done:
    if (all != NULL) {
        if (all->events >= 0) close(all->events);
        if (all->wake >= 0) close(all->wake);
        free(all);
    }
    return status;
}

bool lingering_add(lingering *all, int fd, void *who) {
    lingerer *one = malloc(sizeof *one);
    if (one == NULL) return false;
    *one = (lingerer){.fd = fd, .who = who, .left = LINGERING_BYTES};
    struct epoll_event event = {.events = EPOLLIN | EPOLLRDHUP, .data = {.ptr = one}};
    atomic_fetch_add(&all->count, 1);
    if (epoll_ctl(all->events, EPOLL_CTL_ADD, fd, &event) == 0) return true;
    atomic_fetch_sub(&all->count, 1);
    free(one);
    return false;
}

void lingering_stop(lingering *all) {
    if (all == NULL) return;
    const uint64_t one = 1;
    while (write(all->wake, &one, sizeof one) < 0 && errno == EINTR) {
    }
    pthread_join(all->thread, NULL);
    close(all->wake);
    close(all->events);
    free(all);
}
