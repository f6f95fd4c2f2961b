/* Reads scene files in a child process with limits, which sends plain arrays through a pipe. The parent
 * checks all that it receives. */
#include "solver/base/clock.h"
#include "solver/scene/import/imported_faces.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* The first bytes that the child sends; points, elements, both name texts and the material values follow. */
typedef struct reply_header {
    char magic[8];
    uint64_t status;
    char message[sizeof((lam_error *)0)->message];
    import_warnings warnings;
    uint64_t n_points, n_elements, n_objects, object_bytes, n_materials, material_bytes, dropped, latin1;
} reply_header;

static const char reply_magic[8] = "lamsoup";

static bool send_bytes(int fd, const void *data, size_t bytes) {
    for (const char *at = data; bytes > 0;) {
        const ssize_t sent = write(fd, at, bytes);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        at += sent;
        bytes -= (size_t)sent;
    }
    return true;
}

static bool send_reply(int fd, lam_status result, const lam_error *error, const imported_faces *s) {
    reply_header header;
    memset(&header, 0, sizeof header);
    memcpy(header.magic, reply_magic, sizeof reply_magic);
    header.status = (uint64_t)result;
    memcpy(header.message, error->message, sizeof header.message);
    if (result != LAM_OK) return send_bytes(fd, &header, sizeof header);
    header.warnings = s->warnings;
    header.n_points = s->points.n;
    header.n_elements = s->n_elements;
    header.n_objects = s->objects.n;
    header.object_bytes = s->objects.text_bytes;
    header.n_materials = s->materials.n;
    header.material_bytes = s->materials.text_bytes;
    header.dropped = s->dropped;
    header.latin1 = s->latin1;
    return send_bytes(fd, &header, sizeof header) &&
           send_bytes(fd, s->points.points, s->points.n * sizeof *s->points.points) &&
           send_bytes(fd, s->elements, s->n_elements * sizeof *s->elements) &&
           send_bytes(fd, s->objects.text, s->objects.text_bytes) &&
           send_bytes(fd, s->materials.text, s->materials.text_bytes) &&
           send_bytes(fd, s->values, s->materials.n * sizeof *s->values);
}

static void limit(int resource, rlim_t soft, rlim_t hard) {
    struct rlimit old;
    if (getrlimit(resource, &old) != 0) return;
    if (old.rlim_max != RLIM_INFINITY && hard > old.rlim_max) hard = old.rlim_max;
    const struct rlimit wanted = {soft < hard ? soft : hard, hard};
    setrlimit(resource, &wanted);
}

/* Confines the child: default signals, resource limits, and fd as the only descriptor besides a null input
 * and output. Returns the new descriptor. */
static int confine(int fd, const child_limits *limits) {
    const int handled[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGXCPU, SIGALRM, SIGSEGV, SIGABRT};
    for (size_t i = 0; i < sizeof handled / sizeof *handled; i++) signal(handled[i], SIG_DFL);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int null = open("/dev/null", O_RDWR);
    const int safe = fcntl(fd, F_DUPFD, 4); /* the pipe may stand where a closed standard stream was */
    if (null >= 0) {
        dup2(null, STDIN_FILENO);
        dup2(null, STDOUT_FILENO);
#ifndef LAMBERT_SANITIZED /* whose reports are wanted */
        dup2(null, STDERR_FILENO);
#endif
    }
    dup2(safe, 3);
    close_range(4, ~0u, 0);
    limit(RLIMIT_CORE, 0, 0);
    limit(RLIMIT_FSIZE, 0, 0);
    limit(RLIMIT_NOFILE, 32, 32);
    limit(RLIMIT_CPU, limits->cpu_seconds, limits->cpu_seconds + 1);
#ifndef LAMBERT_SANITIZED /* the shadow memory of a sanitizer is larger than any limit */
    limit(RLIMIT_AS, limits->memory_bytes, limits->memory_bytes);
#endif
    return 3;
}

static _Noreturn void child_main(scene_reader *reader, const char *path, const child_limits *limits, int fd) {
    imported_faces s = {.assets = limits->assets};
    lam_error error = {0};
    fd = confine(fd, limits);
    lam_status result = reader(path, &s, &error);
    if (result == LAM_OK) result = imported_faces_split(&s, path, &error);
    if (result == LAM_ERR_MEMORY)
        status_fail(&error, LAM_ERR_MEMORY, "%s: the importer needs more than its %zu MiB of memory", path,
                    limits->memory_bytes >> 20);
    const bool sent = send_reply(fd, result, &error, &s);
    _exit(sent ? 0 : 1); /* _exit: handlers of exit belong to the parent */
}

typedef struct reply_pipe {
    int fd;
    double deadline_ms; /* of clock_ms */
    bool late;
} reply_pipe;

/* Reads exactly that many bytes; false at the end of the pipe or the time. */
static bool receive_bytes(reply_pipe *pipe, void *out, size_t bytes) {
    for (char *at = out; bytes > 0;) {
        const double left_ms = pipe->deadline_ms - clock_ms();
        struct pollfd ready = {.fd = pipe->fd, .events = POLLIN};
        const int n = left_ms <= 0 ? 0 : poll(&ready, 1, left_ms < 1e6 ? (int)left_ms + 1 : 1000000);
        if (n < 0 && errno == EINTR) continue;
        if (n == 0 && left_ms > 1e6) continue;
        if (n == 0) pipe->late = true;
        if (n <= 0) return false;
        const ssize_t got = read(pipe->fd, at, bytes);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += got;
        bytes -= (size_t)got;
    }
    return true;
}

/* Reads an array of count values of size bytes from the pipe, or returns NULL; *whole becomes false where the
 * pipe ends.
 */
static void *receive_array(reply_pipe *pipe, uint64_t count, size_t size, bool *whole, lam_error *error) {
    void *data = memory_allocate(count, size, "imported scene", error);
    if (data != NULL && !receive_bytes(pipe, data, count * size)) *whole = false;
    return data;
}

/* Reads the names in a block of bytes; false where they are not exactly n different ones. */
static lam_status names_of_block(const char *block, uint64_t bytes, uint64_t n, name_table *names,
                                 bool *sound, lam_error *error) {
    lam_status status = LAM_OK;
    *sound = bytes == 0 || block[bytes - 1] == '\0';
    for (size_t at = 0; *sound && at < bytes; at += strlen(block + at) + 1) {
        uint32_t index;
        TRY(name_table_add(names, block + at, strlen(block + at), &index, error));
    }
    *sound = *sound && names->n == n;
done:
    return status;
}

static bool elements_are_sound(const imported_faces *s) {
    for (size_t v = 0; v < s->points.n; v++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(s->points.points[v][k])) return false;
    for (size_t i = 0; i < s->n_elements; i++) {
        const struct imported_element *e = &s->elements[i];
        for (int k = 0; k < 4; k++)
            if (e->corners[k] >= s->points.n && !(k == 3 && e->corners[k] == TABLE_NONE)) return false;
        if (e->object >= s->objects.n && e->object != TABLE_NONE) return false;
        if (e->material >= s->materials.n && e->material != TABLE_NONE) return false;
    }
    return true;
}

/* Receives a reply into s; *whole is false where the pipe ended before. */
static lam_status receive_reply(reply_pipe *pipe, const char *path, size_t most_bytes, imported_faces *s,
                                bool *whole, lam_error *error) {
    lam_status status = LAM_OK;
    reply_header header;
    char *objects = NULL, *materials = NULL;
    *whole = receive_bytes(pipe, &header, sizeof header);
    if (!*whole) goto done;
    bool sound = memcmp(header.magic, reply_magic, sizeof reply_magic) == 0;
    header.message[sizeof header.message - 1] = '\0';
    header.warnings.text[sizeof header.warnings.text - 1] = '\0';
    const bool says_why = header.message[0] != '\0' && strpbrk(header.message, "\r\n") == NULL;
    if (sound && says_why && header.status > LAM_OK && header.status <= LAM_ERR_INTERNAL)
        FAIL(error, (lam_status)header.status, "%s", header.message);
    const uint64_t most = most_bytes / 8; /* except for names, no entry is smaller in the pipe */
    sound = sound && header.status == LAM_OK && header.n_points < most && header.n_elements < most &&
            header.n_points < TABLE_NONE && header.n_elements < TABLE_NONE && header.n_elements > 0 &&
            header.object_bytes < most && header.material_bytes < most && header.n_materials < most;
    if (!sound) FAIL(error, LAM_ERR_INTERNAL, "%s: the importer sent a damaged reply", path);
    s->points.points = receive_array(pipe, header.n_points, sizeof *s->points.points, whole, error);
    if (s->points.points == NULL) TRY(LAM_ERR_MEMORY);
    s->points.n = s->points.capacity = header.n_points;
    s->elements = receive_array(pipe, header.n_elements, sizeof *s->elements, whole, error);
    if (s->elements == NULL) TRY(LAM_ERR_MEMORY);
    s->n_elements = s->element_capacity = header.n_elements;
    objects = receive_array(pipe, header.object_bytes, 1, whole, error);
    if (objects == NULL) TRY(LAM_ERR_MEMORY);
    materials = receive_array(pipe, header.material_bytes, 1, whole, error);
    if (materials == NULL) TRY(LAM_ERR_MEMORY);
    s->values = receive_array(pipe, header.n_materials, sizeof *s->values, whole, error);
    if (s->values == NULL) TRY(LAM_ERR_MEMORY);
    if (!*whole) goto done;
    bool objects_sound = false, materials_sound = false;
    TRY(names_of_block(objects, header.object_bytes, header.n_objects, &s->objects, &objects_sound, error));
    TRY(names_of_block(materials, header.material_bytes, header.n_materials, &s->materials, &materials_sound,
                       error));
    if (!objects_sound || !materials_sound || !elements_are_sound(s))
        FAIL(error, LAM_ERR_INTERNAL, "%s: the importer sent a damaged reply", path);
    s->warnings = header.warnings;
    s->dropped = header.dropped;
    s->latin1 = header.latin1;
done:
    free(objects);
    free(materials);
    return status;
}

/* One line for a child that ended without a whole reply. */
static lam_status child_verdict(const char *path, const child_limits *limits, bool late, int wait_status,
                                lam_error *error) {
    const int number = WIFSIGNALED(wait_status) ? WTERMSIG(wait_status) : 0;
    if (late || number == SIGXCPU)
        return status_fail(error, LAM_ERR_FORMAT,
                           "%s: the importer took more than its %u s; simplify or repair the file", path,
                           limits->cpu_seconds);
    if (number == SIGINT || number == SIGTERM || number == SIGHUP)
        return status_fail(error, LAM_ERR_CANCELLED, "%s: the import was interrupted (signal %d)", path,
                           number);
    if (number == SIGKILL)
        return status_fail(error, LAM_ERR_MEMORY,
                           "%s: the importer was killed (signal 9), perhaps for lack of memory", path);
    if (number != 0)
        return status_fail(
            error, LAM_ERR_FORMAT,
            "%s: the importer crashed (signal %d); the file is damaged or needs more than %zu MiB", path,
            number, limits->memory_bytes >> 20);
    return status_fail(error, LAM_ERR_FORMAT, "%s: the importer ended without an answer (exit status %d)",
                       path, WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : -1);
}

lam_status import_in_child(scene_reader *reader, const char *path, const child_limits *limits,
                           imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    reply_pipe from_child = {.fd = -1};
    int ends[2], wait_status = 0;
    pid_t child = -1;
    bool whole = false;
    imported_faces received = {0};
    if (pipe2(ends, O_CLOEXEC) != 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot start the importer: pipe: %s", path, strerror(errno));
    from_child.fd = ends[0];
    child = fork();
    if (child == 0) child_main(reader, path, limits, ends[1]);
    const int fork_error = errno;
    close(ends[1]);
    if (child < 0)
        FAIL(error, LAM_ERR_IO, "%s: cannot start the importer: fork: %s", path, strerror(fork_error));
    /* The kernel limits the processor time; the clock only ends a child that sleeps. */
    from_child.deadline_ms = clock_ms() + 1e3 * (4 * (double)limits->cpu_seconds + 2);
    status = receive_reply(&from_child, path, limits->memory_bytes, &received, &whole, error);
    if (status != LAM_OK || !whole) kill(child, SIGKILL); /* has no effect on a child that has ended */
    while (waitpid(child, &wait_status, 0) < 0 && errno == EINTR) continue;
    if (status == LAM_OK && !whole) status = child_verdict(path, limits, from_child.late, wait_status, error);
    if (status != LAM_OK) goto done;
    imported_faces_free(s);
    *s = received;
    received = (imported_faces){0};
done:
    if (from_child.fd >= 0) close(from_child.fd);
    imported_faces_free(&received);
    return status;
}
