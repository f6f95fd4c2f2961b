/* The program of the test files of a room: `unit_base nearest` runs tests/unit/base/test_nearest.c. */
#ifndef LAMBERT_TESTS_PROGRAM_H
#define LAMBERT_TESTS_PROGRAM_H

typedef struct {
    const char *name; /* NULL ends a table */
    int (*run)(void); /* the main() of the file; it returns an exit status */
} test_file;

/* The table of the program, which tests/CMakeLists.txt generates. */
extern const test_file test_files[];

#endif
