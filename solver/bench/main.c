/* `lambert-bench`: runs suites of measurements. */
#include "solver/base/options.h"
#include "solver/bench/bench_files.h"
#include "solver/linalg/core.h"
#include "solver/precompute/forecast.h"

#include <omp.h>
#include <stdio.h>
#include <string.h>

#define SUITES_MOST 8

typedef struct fields {
    const char *output, *scene;
    bool full, quick;
    uint64_t seed;
} fields;

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_TEXT,
     .offset = FIELD(output),
     .argument = "DIR",
     .preset = "lambert-bench",
     .help = "Folder of the results; it is made if it is missing"},
    {.name = "full",
     .kind = OPTION_FLAG,
     .offset = FIELD(full),
     .help = "More settings, larger scenes, more seeds: half an hour instead of minutes"},
    {.name = "quick",
     .kind = OPTION_FLAG,
     .offset = FIELD(quick),
     .help = "Small scenes only, in seconds: to see that it works; the figures say little"},
    {.name = "scene",
     .kind = OPTION_TEXT,
     .offset = FIELD(scene),
     .argument = "SCENE",
     .help = "formfactors: the open scene of throughput and resolution, every face an element (houses); "
             "hierarchical: the only scene, divided where it is coarse"},
    {.name = "seed",
     .kind = OPTION_COUNT,
     .offset = FIELD(seed),
     .argument = "S",
     .preset = "1",
     .help = "Seed of all sampling"},
    {0},
};

static const option_command command = {
    .name = "lambert bench",
    .arguments = "SUITE... [-o DIR]",
    .summary =
        "Measure. Suites: formfactors (error against exact values and time, throughput of rays), lowrank "
        "(factorizations and two meshes beside the tables of the papers), stability (operators where "
        "numbers are hard), cities (sparse inverses, few emitters and Jacobi beside the tables of the "
        "thesis), service (lambertd under load beside servers that compute nothing and beside solves in "
        "process; wrk and nginx take part where they are installed), hierarchical (that kind of operator "
        "beside all others at equal error, and how it grows). Each writes its "
        "tables as CSV and JSON, its plots as SVG and PNG.",
    .least_arguments = 1,
    .most_arguments = SUITES_MOST,
};

/* Usage errors of any suite come before the first is run. */
static int find_suites(const option_result *given, const bench_suite *found[SUITES_MOST]) {
    for (size_t i = 0; i < given->n_arguments; i++) {
        const bench_suite *s = bench_suites;
        while (s->name != NULL && strcmp(s->name, given->arguments[i]) != 0) s++;
        if (s->name == NULL)
            return options_usage(command.name, "%s: no such suite; see lambert bench --help",
                                 given->arguments[i]);
        found[i] = s;
    }
    return OPTIONS_GO;
}

static int measure(int argc, char **argv) {
    fields f = {0};
    option_result given = {0};
    const bench_suite *suites[SUITES_MOST] = {NULL};
    lam_error error = {0};
    terminal t;
    const option_table tables[] = {{NULL, rows, &f}, {0}};
    int code = options_parse(&command, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    if (f.full && f.quick) return options_usage(command.name, "--full and --quick exclude each other");
    code = find_suites(&given, suites);
    if (code != OPTIONS_GO) return code;

    terminal_open(&t, command.name, false, false);
    t.nothing = "files that were finished stay";
    const progress how = terminal_progress(&t);
    const bench_scale scale = f.full ? BENCH_FULL : f.quick ? BENCH_QUICK : BENCH_DEFAULT;
    bench_files files = {.folder = f.output,
                         .t = &t,
                         .run = {.tool = "lambert " LAMBERT_VERSION,
                                 .scale = bench_scale_name(scale),
                                 .seed = f.seed,
                                 .threads = omp_get_max_threads()}};
    const bench_sink sink = bench_files_sink(&files);
    const bench_run run = {.scale = scale,
                           .seed = f.seed,
                           .memory = memory_available(),
                           .scene = f.scene,
                           .sink = &sink,
                           .progress = &how};
    lam_status status = bench_files_open(&files, &error);
    for (size_t i = 0; i < given.n_arguments && status == LAM_OK; i++) {
        files.suite = suites[i]->name;
        status = suites[i]->run(&run, &error);
    }
    bench_files_close(&files);
    if (status != LAM_OK) return terminal_fail(&t, &error);
    printf("%zu files in %s\n", files.n_files, f.output);
    return 0;
}

int main(int argc, char **argv) {
    core_keep_thread_limit();
    return terminal_finish(command.name, measure(argc, argv));
}
