#include "solver/verbs/sibling.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void sibling_execute(char **argv) {
    char path[PATH_MAX + 64];
    const ssize_t length = readlink("/proc/self/exe", path, PATH_MAX);
    if (length > 0) {
        path[length] = '\0';
        char *const slash = strrchr(path, '/');
        snprintf(slash != NULL ? slash + 1 : path, 64, "%s", argv[0]);
        execv(path, argv);
    }
    if (length <= 0 || errno == ENOENT) execvp(argv[0], argv);
}
