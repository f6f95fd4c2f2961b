#include "server/net/access_log.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Bytes of lines that may wait; milliseconds between two looks at whether the log is closed while nobody
 * reads, and looks until it is given up then. */
enum { RING = 1 << 18, LOOK_MS = 50, LOOKS_MOST = 20 };

struct access_log {
    const char *path; /* "-": standard output; NULL: standard error */
    int fd;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t more;
    char *ring;         /* [RING] */
    size_t begin, used; /* bytes that wait */
    uint64_t lost;      /* lines */
    bool closing, reopen;
};

/* -1 with errno. A named pipe without a reader is refused, not waited for. */
static int open_file(const char *path) {
    if (path == NULL) return STDERR_FILENO;
    if (strcmp(path, "-") == 0) return STDOUT_FILENO;
    return open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
}

static void close_file(int fd) {
    if (fd > STDERR_FILENO) close(fd);
}

/* Takes what waits and lies in one piece, as many bytes as a pipe takes at once; 0 at the end. */
static size_t take(access_log *log, char piece[PIPE_BUF]) {
    size_t count = 0;
    pthread_mutex_lock(&log->mutex);
    while (log->used == 0 && !log->closing && !log->reopen) pthread_cond_wait(&log->more, &log->mutex);
    count = log->used < PIPE_BUF ? log->used : PIPE_BUF;
    for (size_t k = 0; k < count; k++) piece[k] = log->ring[(log->begin + k) % RING];
    log->begin = (log->begin + count) % RING;
    log->used -= count;
    const bool again = count == 0 && log->reopen;
    if (again) log->reopen = false;
    pthread_mutex_unlock(&log->mutex);
    if (!again) return count;
    const int fd = open_file(log->path);
    if (fd >= 0 && fd != log->fd) {
        close_file(log->fd);
        log->fd = fd;
    }
    return take(log, piece);
}

static bool is_closing(access_log *log) {
    pthread_mutex_lock(&log->mutex);
    const bool closing = log->closing;
    pthread_mutex_unlock(&log->mutex);
    return closing;
}

static void count_lost(access_log *log, const char *piece, size_t count) {
    pthread_mutex_lock(&log->mutex);
    for (size_t k = 0; k < count; k++) log->lost += piece[k] == '\n';
    pthread_mutex_unlock(&log->mutex);
}

/* Writes a piece as its reader takes it. False where the log is closed and nobody has read for a second. */
static bool put(access_log *log, const char *piece, size_t count, unsigned *looks) {
    while (count > 0) {
        struct pollfd one = {.fd = log->fd, .events = POLLOUT};
        const int ready = poll(&one, 1, LOOK_MS);
        if (ready == 0 && is_closing(log) && ++*looks > LOOKS_MOST) return false;
        if (ready <= 0) continue;
        const ssize_t done = write(log->fd, piece, count);
        if (done < 0 && (errno == EAGAIN || errno == EINTR)) continue;
        if (done < 0) { /* a full disk, a reader that left */
            count_lost(log, piece, count);
            return true;
        }
        piece += done;
        count -= (size_t)done;
    }
    return true;
}

static void *write_lines(void *context) {
    access_log *log = context;
    char piece[PIPE_BUF];
    unsigned looks = 0;
    size_t count;
    while ((count = take(log, piece)) > 0 && put(log, piece, count, &looks)) {
    }
    return NULL;
}

lam_status access_log_open(const char *path, access_log **out, lam_error *error) {
    lam_status status = LAM_OK;
    access_log *log = memory_allocate(1, sizeof *log, "the access log", error);
    if (log == NULL) return LAM_ERR_MEMORY;
    *log = (access_log){.path = path, .fd = -1, .ring = memory_allocate(RING, 1, "the access log", error)};
    if (log->ring == NULL) TRY(LAM_ERR_MEMORY);
    log->fd = open_file(path);
    if (log->fd < 0) FAIL(error, LAM_ERR_IO, "%s: cannot be opened: %s", path, strerror(errno));
    pthread_mutex_init(&log->mutex, NULL);
    pthread_cond_init(&log->more, NULL);
    const int failed = pthread_create(&log->thread, NULL, write_lines, log);
    if (failed != 0) FAIL(error, LAM_ERR_MEMORY, "the access log: no thread: %s", strerror(failed));
    *out = log;
    log = NULL;
done:
    if (log != NULL) {
        close_file(log->fd);
        free(log->ring);
        free(log);
    }
    return status;
}

void access_log_add(access_log *log, const char *line, size_t length) {
    if (log == NULL) return;
    pthread_mutex_lock(&log->mutex);
    if (length > RING - log->used) {
        log->lost++;
    } else {
        const size_t at = (log->begin + log->used) % RING, first = length < RING - at ? length : RING - at;
        memcpy(log->ring + at, line, first);
        memcpy(log->ring, line + first, length - first);
        log->used += length;
        pthread_cond_signal(&log->more);
    }
    pthread_mutex_unlock(&log->mutex);
}

void access_log_reopen(access_log *log) {
    if (log == NULL || log->path == NULL || strcmp(log->path, "-") == 0) return;
    pthread_mutex_lock(&log->mutex);
    log->reopen = true;
    pthread_cond_signal(&log->more);
    pthread_mutex_unlock(&log->mutex);
}

bool access_log_metrics(access_log *log, buffer *b) {
    uint64_t lost = 0;
    if (log != NULL) pthread_mutex_lock(&log->mutex);
    if (log != NULL) lost = log->lost;
    if (log != NULL) pthread_mutex_unlock(&log->mutex);
    return buffer_printf(
        b,
        "# HELP lambertd_access_log_lost_total Lines of the access log that were dropped, as "
        "nobody read it.\n# TYPE lambertd_access_log_lost_total counter\n"
        "lambertd_access_log_lost_total %llu\n",
        (unsigned long long)lost);
}

void access_log_close(access_log *log) {
    if (log == NULL) return;
    pthread_mutex_lock(&log->mutex);
    log->closing = true;
    pthread_cond_signal(&log->more);
    pthread_mutex_unlock(&log->mutex);
    pthread_join(log->thread, NULL);
    pthread_mutex_destroy(&log->mutex);
    pthread_cond_destroy(&log->more);
    close_file(log->fd);
    free(log->ring);
    free(log);
}
