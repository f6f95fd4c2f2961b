/* lambert bench: executes the program lambert-bench, which is installed only by users who measure. */
#include "solver/verbs/sibling.h"
#include "solver/verbs/verbs.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

int cmd_bench(int argc, char **argv) {
    static char name[] = "lambert-bench";
    /* The manual and the completion of `lambert` are whole without lambert-bench. */
    if (argc > 1 && strncmp(argv[1], "--print-", 8) == 0) return 0;
    argv[0] = name;
    sibling_execute(argv);
    fprintf(stderr,
            "lambert bench: the program lambert-bench cannot be run: %s; build the target lambert-bench, and "
            "install it beside lambert or in PATH\n",
            strerror(errno));
    return 1;
}
