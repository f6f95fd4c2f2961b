/* The limit on open files (RLIMIT_NOFILE) and how it is shared among connections, stores and other files. */
#include "server/net/descriptors.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

/* Descriptors for other than connections: standard streams, the listening socket, epoll, stores being read,
 * the log, libraries. */
#define OTHER_DESCRIPTORS 64

/* Connections that are always allowed; files that are more than all tables of the program can hold, to which
 * the limit is raised at most. */
#define LEAST_CONNECTIONS 8
#define MOST_DESCRIPTORS ((rlim_t)1 << 17)

/* Connections that are accepted beyond the limit, of which the client that has most may take half. */
#define BEYOND_MOST ((size_t)32)
#define BEYOND_LEAST ((size_t)8)

lam_status descriptors_afford(connection_limits *limits, size_t n_stores, lam_error *error) {
    lam_status status = LAM_OK;
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) FAIL(error, LAM_ERR_IO, "the limit on open files is unknown");
    const rlim_t highest = limit.rlim_max < MOST_DESCRIPTORS ? limit.rlim_max : MOST_DESCRIPTORS;
    if (limit.rlim_cur < highest) {
        struct rlimit raised = limit;
        raised.rlim_cur = highest;
        if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
    }
    if (limit.rlim_cur <= OTHER_DESCRIPTORS)
        FAIL(error, LAM_ERR_IO, "only %llu files may be open (ulimit -n), must be more than %d",
             (unsigned long long)limit.rlim_cur, OTHER_DESCRIPTORS);
    const size_t others = OTHER_DESCRIPTORS + n_stores,
                 left = limit.rlim_cur > others ? (size_t)(limit.rlim_cur - others) : 0;
    const size_t allowed = left < LEAST_CONNECTIONS ? LEAST_CONNECTIONS : left;
    limits->most = limits->wanted < allowed ? limits->wanted : allowed;
    const size_t spare = allowed - limits->most;
    limits->beyond = spare < BEYOND_LEAST ? BEYOND_LEAST : spare < BEYOND_MOST ? spare : BEYOND_MOST;
done:
    return status;
}

bool descriptors_are_out(void) {
    const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (fd < 0) return errno == EMFILE || errno == ENFILE;
    close(fd);
    return false;
}
