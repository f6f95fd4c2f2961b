/* The reader of HDF5 may crash on a damaged header (1.10 frees unallocated memory, or does not end). So a
 * file is opened in a child process first, and in this process only if the child survives. */
#include "store/store_private.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* Far more than the headers of any store need. */
enum { CPU_SECONDS = 20, ALL_SECONDS = 30, TRIALS = 3 };

#ifdef LAMBERT_SANITIZED
/* A sanitizer's allocator, unlike the C library's, may be locked by another thread when a process forks; the
 * child would then wait for ever. */
static bool may_fork(void) {
    struct dirent **threads = NULL;
    const int count = scandir("/proc/self/task", &threads, NULL, NULL);
    for (int i = 0; i < count; i++) free(threads[i]);
    free(threads);
    return count == 3; /* ., .. and this one */
}
#else
static bool may_fork(void) {
    return true;
}
#endif

static _Noreturn void probe_in_child(store_opener *opener, const char *path) {
    static const int handled[] = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGALRM, SIGXCPU};
    const struct rlimit no_core = {0, 0}, cpu = {CPU_SECONDS, CPU_SECONDS + 1};
    store *s = NULL;
    lam_error error;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (size_t k = 0; k < sizeof handled / sizeof *handled; k++) signal(handled[k], SIG_DFL);
    setrlimit(RLIMIT_CORE, &no_core);
    setrlimit(RLIMIT_CPU, &cpu);
    alarm(ALL_SECONDS);
    const int null = open("/dev/null", O_WRONLY); /* hides the report of the C library on a damaged heap */
    if (null >= 0) dup2(null, STDERR_FILENO);
    /* A refusal is found again, and reported, by the parent. */
    (void)opener(path, &s, &error);
    store_close(s);
    _exit(0);
}

/* *how: the wait status of the child. An error where there can be none: without it a file that ends its
 * readers would be taken for sound. */
static lam_status probe_once(store_opener *opener, const char *path, int *how, lam_error *error) {
    lam_status status = LAM_OK;
    const pid_t child = fork();
    if (child == 0) probe_in_child(opener, path);
    if (child < 0)
        FAIL(error, LAM_ERR_IO, "%s: no process can be started to read its headers first: %s", path,
             strerror(errno));
    while (waitpid(child, how, 0) < 0)
        if (errno != EINTR)
            FAIL(
                error, LAM_ERR_IO,
                "%s: the system does not tell how the process that reads its headers first ended: %s; do not "
                "ignore SIGCHLD",
                path, strerror(errno));
done:
    return status;
}

lam_status store_probe(store_opener *opener, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    int how = 0;
    if (!may_fork()) return LAM_OK;
    /* A damaged file ends every child; other causes (it is killed, memory is short) hardly end three. */
    for (int trial = 0; trial < TRIALS; trial++) {
        TRY(probe_once(opener, path, &how, error));
        if (WIFEXITED(how) && WEXITSTATUS(how) == 0) return LAM_OK;
        if (WIFSIGNALED(how) && (WTERMSIG(how) == SIGALRM || WTERMSIG(how) == SIGXCPU)) break;
    }
    FAIL(error, LAM_ERR_DAMAGED, "%s: damaged so that HDF5 cannot read its headers; make the store again",
         path);
done:
    return status;
}
