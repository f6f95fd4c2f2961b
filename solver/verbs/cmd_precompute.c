/* lambert precompute: turns a scene into a store. */
#include "solver/base/atomic_file.h"
#include "solver/codec/describe.h"
#include "solver/method/emitters_options.h"
#include "solver/precompute/precompute.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/store_lines.h"
#include "solver/verbs/verbs.h"

#include <inttypes.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const option_command command = {
    .name = "lambert precompute",
    .arguments = "SCENE -o STORE.h5",
    .summary = "Turn a scene (OBJ, glTF, PLY, STL, or a store that keeps its form factors) into a store: the "
               "operator from any emission to its radiosity, with its measured error.",
    .least_arguments = 1,
    .most_arguments = 1,
    .gone = precompute_gone,
};

typedef struct own_fields {
    bool verbose, json;
} own_fields;

static const option_row own_rows[] = {
    {.name = "verbose",
     .kind = OPTION_FLAG,
     .offset = offsetof(own_fields, verbose),
     .help = "Print the log on a terminal, too, where three lines at the end stand for it"},
    {.name = "json",
     .kind = OPTION_FLAG,
     .offset = offsetof(own_fields, json),
     .help = "Print the description of the store and the seconds of each stage as JSON"},
    {0},
};

static json_t *times_json(const forecast_times *t) {
    return json_pack("{s:f, s:f, s:f}", "form factors", t->form_factors, "operator", t->operate, "judge",
                     t->judge + t->solves);
}

/* The answer of `lambert info --json`, with the path of the store, the seconds of each stage, the processor
 * seconds of the main ones as forecast and as taken, and the advice on its errors where there is one. */
static lam_status print_json(const char *path, const terminal *t, const precompute_result *result,
                             json_t *about, lam_error *error) {
    json_t *seconds = json_object();
    for (size_t k = 0; k < t->n_done; k++)
        json_object_set_new(seconds, t->done[k].name, json_real(t->done[k].seconds));
    json_object_set_new(about, "output", json_string(path));
    json_object_set(about, "seconds", seconds);
    json_object_set_new(about, "processor_seconds", times_json(&result->spent));
    if (result->forecast.form_factors + result->forecast.judge > 0)
        json_object_set_new(about, "forecast_processor_seconds", times_json(&result->forecast));
    if (result->advice[0] != '\0') json_object_set_new(about, "advice", json_string(result->advice));
    const lam_status status = json_print(path, about, 0, error);
    json_decref(seconds);
    return status;
}

/* The outcome: three lines of the log, and with --json the description of the store. */
static lam_status print_outcome(const precompute_options *o, bool as_json, terminal *t,
                                const precompute_result *result, lam_error *error) {
    lam_status status = LAM_OK;
    char lines[STORE_LINES][STORE_LINE_BYTES];
    store *s = NULL;
    json_t *about = NULL;
    if (o->quiet && !as_json) return LAM_OK;
    TRY(store_open(o->output, &s, error));
    TRY(describe_store(s, &about, error));
    store_lines_make(about, o->output, result->n_faces, lines);
    for (size_t k = 0; k < STORE_LINES; k++) terminal_say(t, lines[k]);
    if (as_json) TRY(print_json(o->output, t, result, about, error));
done:
    json_decref(about);
    store_close(s);
    /* The store is whole: a person can still ask info. */
    if (status != LAM_OK && !as_json) {
        terminal_warn(t, "%s", error->message);
        status = LAM_OK;
    }
    return status;
}

static bool same_file(const char *a, const char *b) {
    struct stat of_a, of_b;
    return stat(a, &of_a) == 0 && stat(b, &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
           of_a.st_ino == of_b.st_ino;
}

/* True where a store would replace a file of another kind: a scene or a picture after a slip of the hand. */
static bool is_other_file(const char *path) {
    struct stat about;
    return stat(path, &about) == 0 && S_ISREG(about.st_mode) && about.st_size > 0 &&
           !precompute_takes_as_store(path);
}

/* The command line as one text that a shell would read the same way; the caller frees. */
static char *command_line(int argc, char **argv) {
    size_t length = 32;
    for (int i = 0; i < argc; i++) length += 4 * strlen(argv[i]) + 3;
    char *text = malloc(length);
    if (text == NULL) return NULL;
    char *end = stpcpy(text, "lambert");
    for (int i = 0; i < argc; i++) {
        static const char plain[] =
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./=:,+@%";
        const bool quote = argv[i][0] == '\0' || argv[i][strspn(argv[i], plain)] != '\0';
        *end++ = ' ';
        if (quote) *end++ = '\'';
        for (const char *c = argv[i]; *c != '\0'; c++) {
            if (*c == '\'')
                end = stpcpy(end, "'\\''");
            else
                *end++ = *c;
        }
        if (quote) *end++ = '\'';
    }
    *end = '\0';
    return text;
}

/* Of options that go together by name: values that --time does not forecast. */
static int check_time(const precompute_options *o) {
    const build_method *method = method_find(o->build.method);
    const factor_source *const asked = source_asked(o->form_factors);
    if (!(o->time > 0)) return OPTIONS_GO;
    if (asked != NULL && asked->asked != NULL)
        return options_usage(command.name, "--time: is not supported together with --form-factors %s",
                             asked->name);
    if (method != NULL && !(method->flags & METHOD_BLOCKS))
        return options_usage(command.name, "--time: is not supported together with --method %s",
                             method->name);
    return OPTIONS_GO;
}

/* The same of options of methods: those of the method that is going to be built. */
static int check_method(const precompute_options *o) {
    const build_method *method = method_find(o->build.method);
    const emitters_options *of_light = emitters_options_of(&o->build);
    const bool walked = emitters_are_positions(of_light);
    lam_error error = {.message = ""};
    if (walked && method != NULL && method != method_find("emitters"))
        return options_usage(command.name, "--%s: gives a store of emitters: leave out --method %s",
                             of_light->positions != NULL ? "positions" : "path", o->build.method);
    if (method == NULL && (walked || of_light->frames > 0)) method = method_find("emitters");
    if (method == NULL) method = method_fallback(); /* auto may come to it */
    if (method->check != NULL && method->check(method_own_const(&o->build, method), &error) != LAM_OK)
        return options_usage(command.name, "%s", error.message);
    return OPTIONS_GO;
}

/* OPTIONS_GO, or the status of wrong usage where values do not go together. */
static int check_together(const precompute_options *o, const option_table *tables,
                          const option_result *given) {
    int code = OPTIONS_GO;
    if (o->output == NULL) return options_usage(command.name, "no -o STORE.h5 given");
    if (o->from_store)
        code = options_refuse_settled(&command, tables, given, "precompute from its scene instead");
    if (code == OPTIONS_GO) code = check_method(o);
    if (code != OPTIONS_GO) return code;
    if (o->resolution % 2 != 0)
        return options_usage(command.name, "--resolution %" PRIu64 ": must be even", o->resolution);
    if (!o->from_store && same_file(o->input, o->output))
        return options_usage(command.name, "-o %s: is the scene itself", o->output);
    if (o->group_error > 0 && o->probes == 0)
        return options_usage(command.name,
                             "--group-error %g: needs errors that are measured: give --probes "
                             "above 0, or leave it out",
                             o->group_error);
    code = check_time(o);
    if (code != OPTIONS_GO) return code;
    if (is_other_file(o->output))
        return options_usage(command.name,
                             "-o %s: there is a file that is not a store; give another name or remove it",
                             o->output);
    return OPTIONS_GO;
}

/* True if an option about form factors had no effect. With form factors from a store only the judge casts
 * rays; with a hemicube it chooses their number itself. */
static bool unused_by_form_factors(const char *name, const precompute_options *o) {
    const factor_source *const asked = source_asked(o->form_factors);
    const bool hemicube = asked != NULL && (asked->flags & SOURCE_RESOLUTION);
    if (strcmp(name, "form-factors") == 0) return o->from_store;
    if (strcmp(name, "resolution") == 0) return o->from_store || !hemicube;
    if (strcmp(name, "quality") == 0) return o->from_store || hemicube || o->rays != OPTION_AUTO;
    if (strcmp(name, "ground-albedo") == 0) return o->sky == NULL;
    if (strcmp(name, "north") == 0) return o->sky == NULL;
    if (strcmp(name, "rays") == 0) return o->from_store ? o->probes == 0 : hemicube;
    return false;
}

/* Names the options that had no effect. */
static void log_unused(terminal *t, const option_result *given, const precompute_options *o,
                       const precompute_result *result) {
    char list[256] = "";
    const bool walked = emitters_are_positions(emitters_options_of(&o->build));
    const factor_source *const asked = source_asked(o->form_factors);
    size_t length = 0;
    for (size_t i = 0; i < given->n_given; i++) {
        const char *name = given->given[i];
        if (!(walked ? precompute_walks_ignore(name) : unused_by_form_factors(name, o)) ||
            length + strlen(name) + 5 > sizeof list)
            continue;
        length += (size_t)sprintf(list + length, "%s--%s", length > 0 ? ", " : "", name);
    }
    if (length > 0)
        terminal_log(t, "%s%s does not use %s",
                     walked          ? "a light that moves"
                     : o->from_store ? "a store with form factors"
                                     : "--form-factors ",
                     walked || o->from_store ? ""
                     : asked != NULL         ? asked->name
                                             : "auto",
                     list);
    if (result->unused[0] != '\0' && !walked)
        terminal_log(t, "%s does not use %s", result->report.method, result->unused);
}

int cmd_precompute(int argc, char **argv) {
    precompute_options o;
    precompute_tables tables;
    own_fields own = {.json = false};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    precompute_result result = {.unused = "", .advice = ""};
    char *line = command_line(argc, argv), *continues = NULL;
    precompute_tables_make(&o, false, &tables);
    precompute_tables_add(&tables, own_rows, &own);
    int code = options_parse(&command, tables.tables, argc, argv, &given);
    if (code == OPTIONS_GO) {
        o.input = given.arguments[0];
        o.from_store = precompute_takes_as_store(o.input);
        code = check_together(&o, tables.tables, &given);
    }
    if (code != OPTIONS_GO) {
        free(line);
        return code;
    }
    if (o.scratch != NULL && line != NULL &&
        asprintf(&continues, "what was finished stays in %s; to go on: %s", o.scratch, line) < 0)
        continues = NULL;
    terminal_open(&term, command.name, o.quiet, o.progress);
    if (!own.verbose) terminal_be_brief(&term);
    if (o.threads > 0) omp_set_num_threads((int)o.threads); /* OpenBLAS asks OpenMP too */
    o.command = line != NULL ? line : "";
    o.continues = continues != NULL ? continues : "what was finished stays in the scratch folder";
    lam_status status = atomic_file_check(o.output, &error);
    if (status == LAM_OK) status = precompute_run(&o, &given, &term, &result, &error);
    code = status == LAM_OK ? 0 : terminal_fail(&term, &error);
    free(line);
    free(continues);
    if (code != 0) return code;
    log_unused(&term, &given, &o, &result);
    terminal_log(&term, "%s", o.output);
    if (print_outcome(&o, own.json, &term, &result, &error) != LAM_OK) return terminal_fail(&term, &error);
    return 0;
}
