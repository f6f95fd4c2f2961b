/* `lambert`: the list of its verbs; each is in its own cmd_*.c. */
#include "solver/base/atomic_file.h"
#include "solver/base/file_stem.h"
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/linalg/core.h"
#include "solver/verbs/verbs.h"
#include "solver/waits.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const option_verb verbs[] = {
    {"generate", cmd_generate, "write one of the known scenes"},
    {"precompute", cmd_precompute, "turn a scene into a store: the operator from emission to radiosity"},
    {"info", cmd_info, "print the contents of a store and its measured errors"},
    {"classify", cmd_classify, "choose the operator that suits a scene, with the reason"},
    {"sky", cmd_sky, "turn weather into the radiance of sky tiles"},
    {"luminaire", cmd_luminaire, "print what a luminaire file says, its lumens and candela"},
    {"solve", cmd_solve, "light a store and write the radiosity"},
    {"verify", cmd_verify, "check a store: checksums, invariants, error"},
    {"render", cmd_render, "draw a picture of a store under any light"},
    {"view", cmd_view, "serve stores to this machine and open the viewer in the browser"},
    {"bench", cmd_bench, "measure errors against exact values, times and throughput"},
    {0},
};

static const option_command program = {
    .name = "lambert",
    .arguments = "VERB [OPTION...]",
    .summary = "Offline radiosity: turns a scene into an operator that answers any lighting of it.",
    .notes = "`lambert help VERB` explains a verb. Exit status: 0 done, 1 it failed, 2 wrong usage.",
};

/* A file in the place of a verb: tells which verb it wants. */
static int want_verb(const char *path) {
    char *stem = file_stem(path), extension[16];
    int code;
    atomic_file_extension(path, extension);
    if (strcmp(extension, "h5") == 0)
        code = options_usage(program.name, "%s: a store needs a verb: lambert view %s, or lambert info %s",
                             path, path, path);
    else if (strcmp(extension, "ies") == 0 || strcmp(extension, "ldt") == 0)
        code = options_usage(program.name, "%s: a luminaire needs a verb: lambert luminaire %s", path, path);
    else
        code = options_usage(program.name, "%s: a scene needs a verb: lambert precompute %s -o %s.h5", path,
                             path, stem != NULL ? stem : "STORE");
    free(stem);
    return code;
}

int main(int argc, char **argv) {
    waits_sleep(argv);
    signal(SIGCHLD, SIG_DFL); /* if the launcher left it ignored, the end of a child would be unknown */
    core_keep_thread_limit();
    /* No verb has such a character in it. */
    if (argc > 1 && argv[1][0] != '-' && strpbrk(argv[1], "./") != NULL && access(argv[1], F_OK) == 0)
        return terminal_finish(program.name, want_verb(argv[1]));
    return terminal_finish(program.name, options_run_verb(&program, verbs, argc, argv));
}
