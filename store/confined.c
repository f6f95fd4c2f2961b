#include "store/confined.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#if defined(__x86_64__)
#define FILTER_MACHINE AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define FILTER_MACHINE AUDIT_ARCH_AARCH64
#endif

#if defined(FILTER_MACHINE) && !defined(LAMBERT_SANITIZED)
/* A program of the kernel's filter. */
typedef struct call_filter {
    struct sock_filter code[160];
    unsigned short length;
} call_filter;

static void add(call_filter *f, struct sock_filter one) {
    f->code[f->length++] = one;
}

/* A call with this number ends the program with `then`. */
static void answer_call(call_filter *f, int number, unsigned then) {
    add(f, (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (unsigned)number, 0, 1));
    add(f, (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, then));
}

/* A call with this number is allowed if the low half of an argument has none of the bits of mask (same false)
 * or is the value (same true). */
static void check_call(call_filter *f, int number, unsigned argument, bool same, unsigned value) {
    const unsigned short test = same ? BPF_JEQ : BPF_JSET;
    add(f, (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (unsigned)number, 0, 4));
    add(f, (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS,
                                        (unsigned)(offsetof(struct seccomp_data, args) + 8 * argument)));
    add(f, (struct sock_filter)BPF_JUMP(BPF_JMP | test | BPF_K, value, same ? 1 : 0, same ? 0 : 1));
    add(f, (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
    add(f, (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
}

/* Files and folders are opened to be read, and looked at; a signal is sent to the process itself. */
static void allow_files(call_filter *f) {
    static const int allowed[] = {
        SYS_newfstatat, SYS_statx,       SYS_readlinkat, SYS_faccessat, SYS_faccessat2,
        SYS_getcwd,     SYS_sched_yield, SYS_getdents64,
#ifdef SYS_readlink /* older calls, which newer machines do not have */
        SYS_readlink,   SYS_stat,        SYS_lstat,      SYS_access
#endif
    };
    const unsigned harmless = O_CLOEXEC | O_NOCTTY | O_NONBLOCK | O_DIRECTORY | O_NOFOLLOW | O_LARGEFILE;
    for (size_t k = 0; k < sizeof allowed / sizeof *allowed; k++)
        answer_call(f, allowed[k], SECCOMP_RET_ALLOW);
    check_call(f, SYS_openat, 2, false, ~harmless);
    check_call(f, SYS_tgkill, 0, true, (unsigned)getpid());
}

/* Any other call fails with EPERM, also those of another machine's numbers: no socket is made, no process
 * started or sent a signal, and no file opened, or but to be read. A kernel without filters leaves the other
 * limits. */
static void filter_calls(bool reads_files) {
    static const int allowed[] = {
        SYS_pread64,        SYS_read,       SYS_write,     SYS_lseek, SYS_close,    SYS_mmap,
        SYS_munmap,         SYS_mremap,     SYS_brk,       SYS_futex, SYS_mprotect, SYS_madvise,
        SYS_rt_sigaction,   SYS_getpid,     SYS_gettid,    SYS_uname, SYS_exit,     SYS_rt_sigreturn,
        SYS_rt_sigprocmask, SYS_exit_group, SYS_getrandom, SYS_fcntl, SYS_fstat,    SYS_clock_gettime};
    call_filter f = {.length = 0};
    add(&f, (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, arch)));
    add(&f, (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, FILTER_MACHINE, 1, 0));
    add(&f, (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS));
    add(&f, (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)));
    for (size_t k = 0; k < sizeof allowed / sizeof *allowed; k++)
        answer_call(&f, allowed[k], SECCOMP_RET_ALLOW);
    if (reads_files) allow_files(&f);
    add(&f, (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
    const struct sock_fprog program = {.len = f.length, .filter = f.code};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0)
        (void)prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
}
#else
static void filter_calls(bool reads_files) { /* a sanitizer reads its maps and writes reports */
    (void)reads_files;
}
#endif

static void limit(int resource, rlim_t soft, rlim_t hard) {
    struct rlimit old;
    if (getrlimit(resource, &old) != 0) return;
    if (old.rlim_max != RLIM_INFINITY && hard > old.rlim_max) hard = old.rlim_max;
    const struct rlimit wanted = {soft < hard ? soft : hard, hard};
    setrlimit(resource, &wanted);
}

#ifdef LAMBERT_SANITIZED
static void limit_memory(size_t more) { /* the shadow memory of a sanitizer is larger than any limit */
    (void)more;
}
#else
/* The copy of the caller's memory counts, mapped stores included. */
static void limit_memory(size_t more) {
    char text[32] = "";
    const int fd = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    const ssize_t n = fd < 0 ? -1 : read(fd, text, sizeof text - 1);
    size_t pages = 0;
    for (ssize_t i = 0; i < n && text[i] >= '0' && text[i] <= '9'; i++)
        pages = 10 * pages + (size_t)(text[i] - '0');
    if (fd >= 0) close(fd);
    if (pages == 0) return;
    const rlim_t most = (rlim_t)(pages * (size_t)sysconf(_SC_PAGESIZE) + more);
    limit(RLIMIT_AS, most, most);
}
#endif

/* Default signals, none of them blocked. */
static void reset_signals(void) {
    sigset_t none;
    for (int number = 1; number < NSIG; number++) signal(number, SIG_DFL);
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
}

/* The descriptors that the child keeps go to their places above those of the standard streams. */
static void keep_descriptors(int reply, int input) {
    const int null = open("/dev/null", O_RDWR);
    /* They may stand where standard streams or each other belong. */
    const int safe_reply = fcntl(reply, F_DUPFD, CONFINED_INPUT + 1);
    const int safe_input = input < 0 ? -1 : fcntl(input, F_DUPFD, CONFINED_INPUT + 1);
    if (null >= 0) {
        dup2(null, STDIN_FILENO);
        dup2(null, STDOUT_FILENO);
#ifndef LAMBERT_SANITIZED /* whose reports are wanted */
        dup2(null, STDERR_FILENO);
#endif
    }
    dup2(safe_reply, CONFINED_REPLY);
    if (safe_input >= 0) dup2(safe_input, CONFINED_INPUT);
    close_range(safe_input >= 0 ? CONFINED_INPUT + 1 : CONFINED_REPLY + 1, ~0u, 0);
}

static void confine(int reply, int input, const confined_limits *limits) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    reset_signals();
    limit_memory(limits->memory_bytes);
    keep_descriptors(reply, input);
    limit(RLIMIT_CORE, 0, 0);
#ifndef __SANITIZE_THREAD__ /* which writes a file when a program starts */
    limit(RLIMIT_FSIZE, 0, 0);
#endif
    limit(RLIMIT_NOFILE, 32, 32);
    limit(RLIMIT_CPU, limits->cpu_seconds, limits->cpu_seconds + 1);
    if (limits->filtered) filter_calls(limits->reads_files);
}

lam_status confined_start(confined_main *run, void *context, int input, const confined_limits *limits,
                          const char *path, confined *out, lam_error *error) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return status_fail(error, LAM_ERR_IO, "%s: no process can be started to read it: pipe: %s", path,
                           strerror(errno));
    clock_gettime(CLOCK_MONOTONIC, &out->end);
    out->end.tv_sec += limits->all_seconds;
    out->late = out->stopped = false;
    out->stop = limits->stop;
    out->pid = fork();
    if (out->pid == 0) {
        confine(ends[1], input, limits);
        run(context);
        _exit(0); /* handlers of exit belong to the parent */
    }
    const int why = errno;
    close(ends[1]);
    out->reply = ends[0];
    if (out->pid > 0) return LAM_OK;
    close(ends[0]);
    out->reply = -1;
    return status_fail(error, LAM_ERR_IO, "%s: no process can be started to read it: %s", path,
                       strerror(why));
}

/* Milliseconds that are left, rounded up; 0 when the time is over. */
static int time_left_ms(const struct timespec *end) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    const double ms = 1e3 * (double)(end->tv_sec - now.tv_sec) + 1e-6 * (double)(end->tv_nsec - now.tv_nsec);
    return ms <= 0 ? 0 : ms < 1e6 ? (int)ms + 1 : 1000000;
}

/* Milliseconds between two questions whether to wait on. */
enum { BETWEEN_STOPS_MS = 50 };

bool confined_receive(confined *c, void *out, size_t bytes) {
    for (char *at = out; bytes > 0;) {
        struct pollfd ready = {.fd = c->reply, .events = POLLIN};
        const int left_ms = time_left_ms(&c->end);
        c->stopped = c->stopped || stop_asked(c->stop);
        if (c->stopped) return false;
        const int wait_ms = c->stop != NULL && left_ms > BETWEEN_STOPS_MS ? BETWEEN_STOPS_MS : left_ms;
        const int n = left_ms == 0 ? 0 : poll(&ready, 1, wait_ms);
        if (n < 0 && errno == EINTR) continue;
        if (n == 0 && left_ms > 0) continue;
        if (n == 0) c->late = true;
        if (n <= 0) return false;
        const ssize_t got = read(c->reply, at, bytes);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += got;
        bytes -= (size_t)got;
    }
    return true;
}

/* True while the child runs; also false where the system has forgotten it, so that no other process of its
 * number is killed. */
static bool runs(pid_t pid) {
    siginfo_t info = {.si_pid = 0};
    return waitid(P_PID, (id_t)pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
}

/* The OpenMP of clang registers a process that is forked, by a file of shared memory, before any code of ours
 * runs in it, and removes that only in handlers of exit. A later process of that number would crash by it. */
static void forget_registration(pid_t pid) {
    char name[64];
    snprintf(name, sizeof name, "/__KMP_REGISTERED_LIB_%d_%d", (int)pid, (int)getuid());
    shm_unlink(name);
}

lam_status confined_end(confined *c, bool answered, const char *path, int *how, lam_error *error) {
    const struct timespec pause = {.tv_nsec = 1000000};
    int status = 0;
    pid_t ended;
    close(c->reply);
    c->reply = -1;
    /* The pipe of a process that crashes ends before the process. */
    for (int k = 0; !answered && !c->late && !c->stopped && k < 100 && runs(c->pid); k++)
        nanosleep(&pause, NULL);
    const bool killed = runs(c->pid);
    if (killed) kill(c->pid, SIGKILL);
    do ended = waitpid(c->pid, &status, 0);
    while (ended < 0 && errno == EINTR);
    const int why = errno;
    forget_registration(c->pid);
    *how = killed ? 0 : status;
    if (ended >= 0) return LAM_OK;
    return status_fail(error, LAM_ERR_IO,
                       "%s: the system does not tell how the process that reads it ended: %s; do not ignore "
                       "SIGCHLD",
                       path, strerror(why));
}

bool confined_send(int fd, const void *data, size_t bytes) {
    for (const char *at = data; bytes > 0;) {
        const ssize_t sent = write(fd, at, bytes);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        at += sent;
        bytes -= (size_t)sent;
    }
    return true;
}

lam_status confined_verdict(const confined *c, const confined_limits *limits, int how, const char *path,
                            const char *who, lam_error *error) {
    const int number = WIFSIGNALED(how) ? WTERMSIG(how) : 0;
    if (c->late || number == SIGXCPU)
        return status_fail(error, LAM_ERR_FORMAT,
                           "%s: %s took more than its %u s; simplify or repair the file", path, who,
                           limits->cpu_seconds);
    if (number == SIGINT || number == SIGTERM || number == SIGHUP)
        return status_fail(error, LAM_ERR_CANCELLED, "%s: %s was interrupted (signal %d)", path, who, number);
    if (number == SIGKILL)
        return status_fail(error, LAM_ERR_MEMORY, "%s: %s was killed (signal 9), perhaps for lack of memory",
                           path, who);
    if (number != 0)
        return status_fail(error, LAM_ERR_FORMAT,
                           "%s: %s crashed (signal %d); the file is damaged or needs more than %zu MiB", path,
                           who, number, limits->memory_bytes >> 20);
    return status_fail(error, LAM_ERR_FORMAT, "%s: %s ended without an answer (exit status %d)", path, who,
                       WIFEXITED(how) ? WEXITSTATUS(how) : -1);
}
