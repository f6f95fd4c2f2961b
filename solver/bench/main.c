/* `lambert-bench`: runs suites of measurements. */
#include "solver/bench/bench_files.h"
#include "solver/console/options.h"
#include "solver/linalg/core.h"
#include "solver/precompute/forecast.h"

#include <omp.h>
#include <stdio.h>
#include <string.h>

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
     .value = "DIR",
     .doc = "Folder of the results, made where it is missing (lambert-bench)"},
    {.name = "full",
     .kind = OPTION_FLAG,
     .offset = FIELD(full),
     .doc = "More settings, larger scenes, more seeds: half an hour instead of minutes"},
    {.name = "quick",
     .kind = OPTION_FLAG,
     .offset = FIELD(quick),
     .doc = "Small scenes only, in seconds: to see that it works; the figures say little"},
    {.name = "scene",
     .kind = OPTION_TEXT,
     .offset = FIELD(scene),
     .value = "SCENE",
     .doc = "formfactors: the open scene of throughput and resolution, every face an element (houses); "
            "hierarchical: the only scene, divided where it is coarse"},
    {.name = "seed",
     .kind = OPTION_COUNT,
     .offset = FIELD(seed),
     .value = "S",
     .doc = "Of all that is sampled (1)"},
    {0},
};

static const option_verb verb = {
    .name = "bench",
    .arguments = "SUITE... [-o DIR]",
    .summary =
        "Measure. Suites: formfactors (error against exact values and time, throughput of rays), lowrank "
        "(factorizations and two meshes beside the tables of the papers), stability (operators where "
        "numbers are hard), cities (sparse inverses, few emitters and Jacobi beside the tables of the "
        "thesis), service (lambertd under load beside servers that compute nothing and beside solves in "
        "process; wrk and nginx take part where they are installed), hierarchical (that kind of operator "
        "beside all others at equal error, and how it grows). Not supported yet: reuse. Each writes its "
        "tables as CSV and JSON, its plots as SVG and PNG.",
    .options = rows,
    .min_arguments = 1,
    .max_arguments = OPTIONS_ARGUMENTS_MAX,
};

/* Usage errors of any suite come before the first is run. */
static int find_suites(const option_result *given, const bench_suite *found[OPTIONS_ARGUMENTS_MAX]) {
    for (size_t i = 0; i < given->n_arguments; i++) {
        const bench_suite *s = bench_suites;
        while (s->name != NULL && strcmp(s->name, given->arguments[i]) != 0) s++;
        if (s->name == NULL)
            return options_usage(verb.name, "%s: no such suite; see lambert bench --help",
                                 given->arguments[i]);
        if (s->run == NULL) return options_usage(verb.name, "%s is not supported yet", s->name);
        found[i] = s;
    }
    return OPTIONS_GO;
}

static int measure(int argc, char **argv) {
    fields f = {.output = "lambert-bench", .seed = 1};
    option_result given = {0};
    const bench_suite *suites[OPTIONS_ARGUMENTS_MAX] = {NULL};
    lam_error error = {0};
    terminal t;
    int code = options_parse(&verb, argc, argv, &f, &given);
    if (code != OPTIONS_GO) return code;
    if (f.full && f.quick) return options_usage(verb.name, "--full and --quick exclude each other");
    code = find_suites(&given, suites);
    if (code != OPTIONS_GO) return code;

    terminal_open(&t, verb.name, false, false);
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
    return terminal_finish(verb.name, measure(argc, argv));
}
