#include "solver/bench/child.h"

#include "solver/base/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* How often a signal to us is looked for, and how long a program may take to end. */
enum { POLL_MS = 50 };
static const double patience_s = 10;

bool child_find(const char *program, char path[PATH_MAX]) {
    static const char system_folders[] = "/usr/sbin:/usr/local/sbin:/sbin";
    const char *const lists[] = {getenv("PATH"), system_folders};
    for (size_t l = 0; l < 2; l++)
        for (const char *at = lists[l]; at != NULL && *at != '\0';) {
            const size_t length = strcspn(at, ":");
            const int needed = snprintf(path, PATH_MAX, "%.*s/%s", (int)length, at, program);
            if (length > 0 && needed < PATH_MAX && access(path, X_OK) == 0) return true;
            at += length + (at[length] == ':');
        }
    return false;
}

/* In the new process: never returns. Only calls that are safe after a fork of several threads. */
static void become(const char *folder, const char *const arguments[], int out, int errors, pid_t parent) {
    setpgid(0, 0); /* Ctrl-C is for us, who end the others */
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);
    const int nothing = open("/dev/null", O_RDONLY);
    if (chdir(folder) != 0 || nothing < 0 || dup2(nothing, STDIN_FILENO) < 0 ||
        dup2(out, STDOUT_FILENO) < 0 || dup2(errors, STDERR_FILENO) < 0)
        _exit(127);
    union {
        const char *const *given;
        char *const *taken;
    } list = {.given = arguments}; /* execv changes nothing of them */
    execv(arguments[0], list.taken);
    _exit(127);
}

lam_status child_start(child *c, const char *name, const char *folder, const char *const arguments[],
                       lam_error *error) {
    lam_status status = LAM_OK;
    int ends[2] = {-1, -1}, errors = -1;
    const pid_t parent = getpid();
    *c = (child){.name = name, .out = -1};
    if (snprintf(c->errors, sizeof c->errors, "%s/%s.errors", folder, name) >= (int)sizeof c->errors)
        FAIL(error, LAM_ERR_IO, "%s: the name is too long", folder);
    errors = open(c->errors, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (errors < 0) FAIL(error, LAM_ERR_IO, "%s: %s", c->errors, strerror(errno));
    if (pipe2(ends, O_CLOEXEC) != 0) FAIL(error, LAM_ERR_IO, "%s: no pipe: %s", name, strerror(errno));
    const pid_t pid = fork();
    if (pid < 0) FAIL(error, LAM_ERR_IO, "%s cannot be started: %s", name, strerror(errno));
    if (pid == 0) become(folder, arguments, ends[1], errors, parent);
    setpgid(pid, pid); /* whoever comes first */
    c->pid = pid;
    c->out = ends[0];
    ends[0] = -1;
done:
    if (ends[0] >= 0) close(ends[0]);
    if (ends[1] >= 0) close(ends[1]);
    if (errors >= 0) close(errors);
    return status;
}

/* Its last line on standard error that is not empty, "" for none. */
static void last_complaint(const child *c, char *line, size_t size) {
    char next[256];
    FILE *stream = fopen(c->errors, "r");
    line[0] = '\0';
    if (stream == NULL) return;
    while (fgets(next, sizeof next, stream) != NULL) {
        next[strcspn(next, "\n")] = '\0';
        if (next[0] != '\0') snprintf(line, size, "%s", next);
    }
    fclose(stream);
}

static lam_status complain(const child *c, const char *what, lam_error *error) {
    char line[256];
    last_complaint(c, line, sizeof line);
    return status_fail(error, LAM_ERR_IO, "%s %s%s%s", c->name, what, line[0] != '\0' ? ": " : "", line);
}

/* Reads on; *ended when there will be no more. LAM_ERR_CANCELLED, LAM_ERR_IO past the deadline. */
static lam_status read_some(child *c, const bench_run *run, double deadline, bool *ended, lam_error *error) {
    lam_status status = LAM_OK;
    char dropped[4096];
    struct pollfd wait = {.fd = c->out, .events = POLLIN};
    TRY(bench_check(run, error));
    if (clock_seconds() > deadline) TRY(complain(c, "takes too long", error));
    if (poll(&wait, 1, POLL_MS) <= 0) return LAM_OK;
    const size_t room = sizeof c->said - 1 - c->n_said;
    const ssize_t got =
        read(c->out, room > 0 ? c->said + c->n_said : dropped, room > 0 ? room : sizeof dropped);
    *ended = got == 0 || (got < 0 && errno != EINTR);
    if (got > 0 && room > 0) c->n_said += (size_t)got;
    c->said[c->n_said] = '\0';
done:
    return status;
}

lam_status child_await(child *c, const bench_run *run, const char *words, double seconds, const char **after,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const double deadline = clock_seconds() + seconds;
    for (bool ended = false;;) {
        const char *found = strstr(c->said, words);
        if (found != NULL && strchr(found, '\n') != NULL) {
            *after = found + strlen(words);
            return LAM_OK;
        }
        if (ended) TRY(complain(c, "ended before it was ready", error));
        TRY(read_some(c, run, deadline, &ended, error));
    }
done:
    return status;
}

/* Whether it has ended, within so many seconds; its wait status. */
static bool reap(child *c, double seconds, int *wait_status) {
    const struct timespec pause = {.tv_nsec = 2000000};
    const double deadline = clock_seconds() + seconds;
    for (;;) {
        const pid_t found = waitpid(c->pid, wait_status, WNOHANG);
        if (found == c->pid || (found < 0 && errno != EINTR)) break;
        if (clock_seconds() > deadline) return false;
        nanosleep(&pause, NULL);
    }
    c->pid = 0;
    close(c->out);
    c->out = -1;
    return true;
}

lam_status child_finish(child *c, const bench_run *run, double seconds, lam_error *error) {
    lam_status status = LAM_OK;
    const double deadline = clock_seconds() + seconds;
    int how = 0;
    for (bool ended = false; !ended;) TRY(read_some(c, run, deadline, &ended, error));
    if (!reap(c, patience_s, &how)) TRY(complain(c, "does not end", error));
    if (!WIFEXITED(how) || WEXITSTATUS(how) != 0) TRY(complain(c, "failed", error));
done:
    return status;
}

bool child_runs(child *c) {
    int how;
    return c->pid != 0 && !reap(c, 0, &how);
}

void child_stop(child *c) {
    int how;
    if (c->pid == 0) return;
    kill(-c->pid, SIGTERM);
    if (reap(c, patience_s, &how)) return;
    kill(-c->pid, SIGKILL);
    reap(c, patience_s, &how);
}
