/* The main() of a program of test files: one process runs one file, so that none hides what another does. */
#include "support/program.h"

#include <stdio.h>
#include <string.h>

int main(int argc, char **argv) {
    for (const test_file *file = test_files; argc == 2 && file->name != NULL; file++)
        if (strcmp(file->name, argv[1]) == 0) return file->run();
    fprintf(stderr, "usage: %s NAME, which is one of:\n", argv[0]);
    for (const test_file *file = test_files; file->name != NULL; file++)
        fprintf(stderr, "    %s\n", file->name);
    return 2;
}
