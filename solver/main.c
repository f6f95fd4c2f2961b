/* `lambert`: finds the verb; the verbs are in cmd_*.c. */
#include "solver/base/terminal.h"
#include "solver/linalg/core.h"
#include "solver/verbs/verbs.h"

#include <stdio.h>
#include <string.h>

typedef struct verb {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *summary;
} verb;

static const verb verbs[] = {
    {"generate", cmd_generate, "write one of the known scenes"},
    {"precompute", cmd_precompute, "turn a scene into a store: the operator from emission to radiosity"},
    {"info", cmd_info, "say what a store holds and how exact it is"},
    {"classify", cmd_classify, "say what kind of scene it is, and which operator suits it"},
    {"sky", cmd_sky, "turn weather into the radiance of sky tiles"},
    {"solve", cmd_solve, "light a store and write the radiosity"},
    {"verify", cmd_verify, "check a store: checksums, invariants, error"},
    {"render", cmd_render, "picture a lighting"},
    {"bench", cmd_bench, "measure: error against exact values and time, throughput"},
};

static void print_help(void) {
    puts(
        "Usage: lambert VERB [OPTION...]\n\nOffline radiosity: a scene goes in, an operator that answers any "
        "lighting of it comes out.\n");
    for (size_t i = 0; i < sizeof verbs / sizeof verbs[0]; i++)
        printf("  %-12s%s\n", verbs[i].name, verbs[i].summary);
    puts("\n  --help      print this and stop\n  --version   print the version and stop\n\n`lambert VERB "
         "--help` "
         "explains a verb. Exit status: 0 done, 1 it failed, 2 wrong usage.");
}

int main(int argc, char **argv) {
    if (argc < 2) {
        fputs("lambert: no verb given; see lambert --help\n", stderr);
        return 2;
    }
    core_keep_thread_limit();
    if (strcmp(argv[1], "--help") == 0) {
        print_help();
        return terminal_finish("lambert", 0);
    }
    if (strcmp(argv[1], "--version") == 0) {
        puts("lambert " LAMBERT_VERSION);
        return terminal_finish("lambert", 0);
    }
    for (size_t i = 0; i < sizeof verbs / sizeof verbs[0]; i++) {
        if (strcmp(argv[1], verbs[i].name) != 0) continue;
        return terminal_finish("lambert", verbs[i].run(argc - 1, argv + 1));
    }
    fputs("lambert: ", stderr);
    for (const char *c = argv[1]; *c != '\0'; c++)
        fputc((unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c, stderr);
    fputs(": no such verb; see lambert --help\n", stderr);
    return 2;
}
