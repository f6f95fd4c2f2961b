/* `lambert-bench`: runs suites of measurements and keeps their results in a folder: tables as CSV and JSON,
 * plots by plots.py. A suite may be a script, which writes one JSON object a line: a table, a line of the
 * log, progress or an error. */
#include "solver/base/array_grow.h"
#include "solver/base/atomic_file.h"
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/linalg/core.h"
#include "solver/precompute/forecast/forecast.h"
#include "solver/waits.h"
#include "tests/bench/suites/bench.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <omp.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { SUITES_MOST = 10 };

typedef struct fields {
    const char *output, *scene;
    bool full, quick, json;
    uint64_t seed;
} fields;

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    OPTION_ROW_OUTPUT(FIELD(output), "DIR", .preset = "lambert-bench",
                      .help = "Folder of the results; it is made if it is missing"),
    {.name = "full",
     .kind = OPTION_FLAG,
     .offset = FIELD(full),
     .not_with = "quick",
     .help = "More settings, larger scenes and more seeds: half an hour instead of minutes"},
    {.name = "quick",
     .kind = OPTION_FLAG,
     .offset = FIELD(quick),
     .help = "Small scenes only, in seconds: a test of the suites, whose figures mean little"},
    {.name = "json",
     .kind = OPTION_FLAG,
     .offset = FIELD(json),
     .help = "Write all tables to standard output as one JSON document"},
    {.name = "scene",
     .kind = OPTION_TEXT,
     .offset = FIELD(scene),
     .argument = "SCENE",
     .help = "formfactors: the open scene of throughput and resolution, every face an element (houses); "
             "hierarchical: the only scene, divided where it is coarse; mesh: one more scene; "
             "reuse: the second scene of the speed of walks; honesty: a file "
             "or a folder of scenes in place of its own"},
    OPTION_ROW_SEED(FIELD(seed), .help = "Seed of all sampling"),
    {0},
};

static const option_command command = {
    .name = "lambert bench",
    .arguments = "SUITE... [-o DIR]",
    .summary =
        "Measure. Suites: formfactors (error against exact values and against time, rays per second), "
        "lowrank (factorizations and two meshes beside the tables of the papers), stability (operators "
        "of problems that are numerically hard), cities (sparse inverses, few emitters and Jacobi sweeps "
        "beside the tables of the thesis), service (lambertd under load beside servers that compute "
        "nothing and beside solves in process; wrk and nginx take part where they are installed), "
        "hierarchical (this kind of operator beside all others at equal error, and its growth), mesh "
        "(the error of values that are constant on elements, on uniform and adaptive meshes), reuse "
        "(light of 30 positions of a lamp by paths that serve all of them, beside the tables of the "
        "paper), honesty (the errors that answers state beside the true ones, by random requests), cie171 "
        "(luminaires, sensors and skies beside the analytic cases of CIE 171:2006). Each suite writes its "
        "tables as CSV and JSON, and its plots as SVG and PNG where matplotlib is "
        "installed.",
    .least_arguments = 1,
    .most_arguments = SUITES_MOST,
};

/* The folder of results; files are called SUITE-NAME.csv and .json. */
typedef struct results {
    const char *folder, *suite;
    table_run run;
    terminal *t;
    bool made;       /* the folder is ours */
    bool json;       /* tables go to standard output as JSON, else as text */
    size_t n_tables; /* on standard output */
    char time[32];
} results;

static lam_status results_open(results *r, lam_error *error) {
    lam_status status = LAM_OK;
    char *probe = NULL;
    r->made = mkdir(r->folder, 0777) == 0;
    if (!r->made && errno != EEXIST)
        FAIL(error, LAM_ERR_IO, "%s: the folder cannot be made: %s; give another -o", r->folder,
             strerror(errno));
    if (asprintf(&probe, "%s/results", r->folder) < 0) {
        probe = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", r->folder);
    }
    TRY(atomic_file_check(probe, error));
    const time_t now = time(NULL);
    struct tm utc;
    gmtime_r(&now, &utc);
    strftime(r->time, sizeof r->time, "%Y-%m-%dT%H:%M:%SZ", &utc);
    r->run.time = r->time;
done:
    free(probe);
    return status;
}

/* A folder that was made for nothing goes. */
static void results_close(const results *r) {
    if (r->made) rmdir(r->folder);
}

static size_t results_count(const results *r) {
    size_t n = 0;
    DIR *folder = opendir(r->folder);
    for (const struct dirent *file; folder != NULL && (file = readdir(folder)) != NULL;)
        n += file->d_name[0] != '.';
    if (folder != NULL) closedir(folder);
    return n;
}

static lam_status write_file(const results *r, const table *t, const char *extension, lam_error *error) {
    lam_status status = LAM_OK;
    char *path = NULL;
    atomic_file out = {0};
    if (asprintf(&path, "%s/%s-%s.%s", r->folder, r->suite, t->name, extension) < 0) {
        path = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", r->folder);
    }
    TRY(atomic_file_open(path, &out, error));
    if (strcmp(extension, "csv") == 0)
        table_csv(t, out.stream);
    else
        TRY(table_json(t, &r->run, out.stream, error));
    TRY(atomic_file_commit(&out, error));
done:
    atomic_file_abort(&out);
    free(path);
    return status;
}

static lam_status put_table(void *context, const table *t, lam_error *error) {
    lam_status status = LAM_OK;
    results *r = context;
    TRY(write_file(r, t, "csv", error));
    TRY(write_file(r, t, "json", error));
    if (r->json) {
        printf("%s\"%s-%s\": ", r->n_tables++ > 0 ? ",\n" : "{\n", r->suite, t->name);
        TRY(table_json(t, &r->run, stdout, error));
    } else if (t->printed) {
        terminal_clear(r->t);
        table_print(t, stdout);
        fflush(stdout);
    }
done:
    return status;
}

static void say(void *context, const char *line) {
    const results *r = context;
    terminal_log(r->t, "%s", line);
}

/* The folder of this program, where lambertd is too; its name ends in a slash. */
static lam_status programs_folder(char folder[PATH_MAX], lam_error *error) {
    const ssize_t length = readlink("/proc/self/exe", folder, PATH_MAX - 1);
    if (length <= 0) return status_fail(error, LAM_ERR_IO, "/proc/self/exe: %s", strerror(errno));
    folder[length] = '\0';
    strrchr(folder, '/')[1] = '\0';
    return LAM_OK;
}

/* A script stands in bench/ beside this program in a build, in ../share/lambert/bench/ once it is installed.
 */
static lam_status find_script(const char *programs, const char *name, char path[2 * PATH_MAX],
                              lam_error *error) {
    static const char *const places[] = {"bench/", "../share/lambert/bench/"};
    for (size_t p = 0; p < sizeof places / sizeof *places; p++) {
        snprintf(path, 2 * PATH_MAX, "%s%s%s", programs, places[p], name);
        if (access(path, X_OK) == 0) return LAM_OK;
    }
    return status_fail(error, LAM_ERR_IO, "%s: %s; it belongs to lambert-bench", path, strerror(errno));
}

/* Starts a script in a process group of its own, as Ctrl-C is for us alone; out is its standard output. */
static lam_status script_start(const char *const arguments[], pid_t *pid, int *out, lam_error *error) {
    lam_status status = LAM_OK;
    int ends[2] = {-1, -1};
    const pid_t parent = getpid();
    union {
        const char *const *given;
        char *const *taken;
    } list = {.given = arguments}; /* execv changes nothing of them */
    if (pipe2(ends, O_CLOEXEC) != 0)
        FAIL(error, LAM_ERR_IO, "%s: no pipe: %s", arguments[0], strerror(errno));
    *pid = fork();
    if (*pid < 0) FAIL(error, LAM_ERR_IO, "%s cannot be started: %s", arguments[0], strerror(errno));
    if (*pid == 0) {
        setpgid(0, 0);
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (getppid() == parent && dup2(ends[1], STDOUT_FILENO) >= 0) execv(arguments[0], list.taken);
        _exit(127);
    }
    *out = ends[0];
    ends[0] = -1;
done:
    if (ends[0] >= 0) close(ends[0]);
    if (ends[1] >= 0) close(ends[1]);
    return status;
}

/* {"name", "title", "columns": [[name, unit or null, text]...], "rows": [[cell...]...], "printed": preset
 * true}
 */
static lam_status take_table(const bench_run *run, const json_t *of, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *const head = json_object_get(of, "columns"), *const body = json_object_get(of, "rows");
    const size_t n = json_array_size(head);
    table t = {.name = json_string_value(json_object_get(of, "name")),
               .title = json_string_value(json_object_get(of, "title")),
               .n_columns = n,
               .printed = !json_is_false(json_object_get(of, "printed"))};
    table_column *columns = memory_allocate(n, sizeof *columns, "a table", error);
    if (columns == NULL) TRY(LAM_ERR_MEMORY);
    t.columns = columns;
    for (size_t c = 0; c < n; c++) {
        const json_t *const column = json_array_get(head, c);
        columns[c] = (table_column){.name = json_string_value(json_array_get(column, 0)),
                                    .unit = json_string_value(json_array_get(column, 1)),
                                    .doc = json_string_value(json_array_get(column, 2))};
    }
    for (size_t r = 0; r < json_array_size(body); r++)
        for (size_t c = 0; c < n; c++) {
            const json_t *const cell = json_array_get(json_array_get(body, r), c);
            if (columns[c].unit == NULL)
                table_text(&t, json_string_value(cell));
            else
                table_number(&t, json_is_number(cell) ? json_number_value(cell) : NAN);
        }
    TRY(bench_table(run, &t, error));
done:
    table_free(&t);
    free(columns);
    return status;
}

static lam_status take_record(const bench_run *run, const char *line, size_t length, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *record = json_loadb(line, length, 0, NULL);
    const json_t *const table_of = json_object_get(record, "table"), *const at =
                                                                         json_object_get(record, "progress");
    const char *const text = json_string_value(json_object_get(record, "log"));
    const char *const failure = json_string_value(json_object_get(record, "error"));
    if (table_of != NULL) TRY(take_table(run, table_of, error));
    if (text != NULL) bench_say(run, "%s", text);
    if (at != NULL)
        progress_report(run->progress, json_string_value(json_array_get(at, 0)),
                        json_number_value(json_array_get(at, 1)));
    if (failure != NULL) FAIL(error, LAM_ERR_IO, "%s", failure);
    if (record == NULL) FAIL(error, LAM_ERR_INTERNAL, "a script wrote no JSON: %.*s", (int)length, line);
done:
    json_decref(record);
    return status;
}

/* Records of a script until it ends its output. */
static lam_status take_records(const bench_run *run, int out, lam_error *error) {
    enum { PIECE = 1 << 16, POLL_MS = 50 };
    lam_status status = LAM_OK;
    char *bytes = NULL;
    size_t capacity = 0;
    struct pollfd wait = {.fd = out, .events = POLLIN};
    for (size_t used = 0;;) {
        TRY(bench_check(run, error));
        if (poll(&wait, 1, POLL_MS) <= 0) continue;
        TRY(array_grow(&bytes, &capacity, used + PIECE, 1, "a record of a script", error));
        const ssize_t got = read(out, bytes + used, PIECE);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        used += (size_t)got;
        for (char *end; (end = memchr(bytes, '\n', used)) != NULL;) {
            const size_t length = (size_t)(end - bytes);
            TRY(take_record(run, bytes, length, error));
            used -= length + 1;
            memmove(bytes, end + 1, used);
        }
    }
done:
    free(bytes);
    return status;
}

/* Runs a script; a script that fails has written the reason to its output or to standard error. */
static lam_status script_run(const bench_run *run, const char *const arguments[], lam_error *error) {
    lam_status status = LAM_OK;
    pid_t pid = 0;
    int out = -1, how = 0;
    TRY(script_start(arguments, &pid, &out, error));
    status = take_records(run, out, error);
    if (status != LAM_OK) kill(pid, SIGTERM); /* it stops what it has started */
    close(out);
    while (waitpid(pid, &how, 0) < 0 && errno == EINTR) continue;
    if (status == LAM_OK && how != 0) FAIL(error, LAM_ERR_IO, "%s failed", arguments[0]);
done:
    return status;
}

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

/* One suite and its plots; that no plots can be drawn is no failure. */
static lam_status run_suite(const bench_run *run, const bench_suite *suite, const char *folder,
                            lam_error *error) {
    lam_status status = LAM_OK;
    char programs[PATH_MAX], path[2 * PATH_MAX], seed[24];
    lam_error missing;
    TRY(programs_folder(programs, error));
    if (suite->run != NULL) {
        TRY(suite->run(run, error));
    } else {
        snprintf(seed, sizeof seed, "%llu", (unsigned long long)run->seed);
        TRY(find_script(programs, suite->script, path, error));
        const char *const arguments[] = {path, programs,   bench_scale_name(run->scale),
                                         seed, run->scene, NULL};
        TRY(script_run(run, arguments, error));
    }
    if (find_script(programs, "plots.py", path, &missing) != LAM_OK) {
        bench_say(run, "no plots: %s", missing.message);
    } else {
        const char *const arguments[] = {path, folder, suite->name, NULL};
        TRY(script_run(run, arguments, error));
    }
done:
    return status;
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
    code = find_suites(&given, suites);
    if (code != OPTIONS_GO) return code;

    terminal_open(&t, command.name, false, false);
    t.nothing = "files that were finished stay";
    const progress how = terminal_progress(&t);
    const bench_scale scale = f.full ? BENCH_FULL : f.quick ? BENCH_QUICK : BENCH_DEFAULT;
    results r = {.folder = f.output,
                 .t = &t,
                 .json = f.json,
                 .run = {.tool = "lambert " LAMBERT_VERSION,
                         .scale = bench_scale_name(scale),
                         .seed = f.seed,
                         .threads = omp_get_max_threads()}};
    const bench_sink sink = {.table = put_table, .say = say, .context = &r};
    const bench_run run = {.scale = scale,
                           .seed = f.seed,
                           .memory = memory_available(),
                           .scene = f.scene,
                           .sink = &sink,
                           .progress = &how};
    lam_status status = results_open(&r, &error);
    for (size_t i = 0; i < given.n_arguments && status == LAM_OK; i++) {
        r.suite = suites[i]->name;
        status = run_suite(&run, suites[i], f.output, &error);
    }
    results_close(&r);
    if (status != LAM_OK) return terminal_fail(&t, &error);
    if (f.json)
        puts("}");
    else
        printf("%zu files in %s\n", results_count(&r), f.output);
    return 0;
}

int main(int argc, char **argv) {
    waits_sleep(argv);
    signal(SIGCHLD, SIG_DFL); /* if the launcher left it ignored, the end of a child would be unknown */
    core_keep_thread_limit();
    if (argc == 2 && strcmp(argv[1], "service-solver") == 0) return service_solver();
    return terminal_finish(command.name, measure(argc, argv));
}
