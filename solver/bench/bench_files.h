/* What suites measure as files of one folder, and as tables on standard output. */
#ifndef LAMBERT_BENCH_BENCH_FILES_H
#define LAMBERT_BENCH_BENCH_FILES_H

#include "solver/base/terminal.h"
#include "solver/bench/bench.h"

typedef struct bench_files {
    const char *folder;
    const char *suite; /* files are called SUITE-NAME.csv, .json, .svg, .png */
    table_run run;
    terminal *t;
    bool made;      /* the folder is ours */
    size_t n_files; /* written */
    char time[32];
} bench_files;

/* Makes the folder where it is missing. LAM_ERR_IO when it cannot be made or written in. */
lam_status bench_files_open(bench_files *b, lam_error *error);

/* Takes the folder away again where nothing came into it. */
void bench_files_close(bench_files *b);

/* Where a suite's results go; b must outlive it. Each file is written aside and renamed. */
bench_sink bench_files_sink(bench_files *b);

#endif
