/* lambert bench: executes the program lambert-bench, which is installed only by users who measure. */
#include "solver/verbs/verbs.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

int cmd_bench(int argc, char **argv) {
    static char name[] = "lambert-bench";
    char path[PATH_MAX + sizeof name];
    const ssize_t length = readlink("/proc/self/exe", path, PATH_MAX);
    /* The manual and the completion of `lambert` are whole without lambert-bench. */
    if (argc > 1 && strncmp(argv[1], "--print-", 8) == 0) return 0;
    argv[0] = name;
    if (length > 0) {
        path[length] = '\0';
        char *const slash = strrchr(path, '/');
        strcpy(slash != NULL ? slash + 1 : path, name);
        execv(path, argv);
    }
    if (length <= 0 || errno == ENOENT) execvp(name, argv);
    fprintf(stderr,
            "lambert bench: the program lambert-bench cannot be run: %s; build the target lambert-bench, and "
            "install it beside lambert or in PATH\n",
            strerror(errno));
    return 1;
}
