/* `lambert`: the list of its verbs; each is in its own cmd_*.c. */
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/linalg/core.h"
#include "solver/verbs/verbs.h"
#include "solver/waits.h"

#include <signal.h>

static const option_verb verbs[] = {
    {"generate", cmd_generate, "write one of the known scenes"},
    {"precompute", cmd_precompute, "turn a scene into a store: the operator from emission to radiosity"},
    {"info", cmd_info, "print the contents of a store and its measured errors"},
    {"classify", cmd_classify, "choose the operator that suits a scene, with the reason"},
    {"sky", cmd_sky, "turn weather into the radiance of sky tiles"},
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

int main(int argc, char **argv) {
    waits_sleep(argv);
    signal(SIGCHLD, SIG_DFL); /* if the launcher left it ignored, the end of a child would be unknown */
    core_keep_thread_limit();
    return terminal_finish(program.name, options_run_verb(&program, verbs, argc, argv));
}
