/* lambert precompute: turns a scene into a store. */
#include "solver/base/atomic_file.h"
#include "solver/precompute/precompute.h"
#include "solver/verbs/precompute_arguments.h"
#include "solver/verbs/verbs.h"

#include <inttypes.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static bool same_file(const char *a, const char *b) {
    struct stat of_a, of_b;
    return stat(a, &of_a) == 0 && stat(b, &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
           of_a.st_ino == of_b.st_ino;
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

static bool is_among(const char *name, const char *const *list) {
    while (*list != NULL && strcmp(name, *list) != 0) list++;
    return *list != NULL;
}

/* What the arguments say together; 0 or the status of wrong usage. */
static int check_together(const precompute_arguments *f, const option_result *given, bool from_store) {
    const char *input = given->arguments[0];
    static const char *const of_mesh[] = {"subdivide", "max-edge", "elements", "unit", "up", "two-sided"};
    const int refinements = (f->subdivide > 0) + (f->max_edge > 0) + (f->elements > 0);
    if (f->output == NULL) return options_usage(precompute_command.name, "no -o STORE.h5 given");
    if (refinements > 1)
        return options_usage(precompute_command.name,
                             "--subdivide, --max-edge and --elements exclude each other");
    static const char *const of_sky[] = {"sky", "ground-albedo"};
    for (size_t i = 0; from_store && i < 2; i++)
        if (options_given(given, of_sky[i]))
            return options_usage(precompute_command.name,
                                 "--%s: a store keeps the sky it has; precompute from its scene instead",
                                 of_sky[i]);
    for (size_t i = 0; from_store && i < sizeof of_mesh / sizeof of_mesh[0]; i++)
        if (options_given(given, of_mesh[i]))
            return options_usage(precompute_command.name,
                                 "--%s: the mesh of a store is fixed; precompute from its scene instead",
                                 of_mesh[i]);
    static const char *const factorizing[] = {"auto", "low-rank", NULL};
    if (strcmp(f->factorizer, "qr") == 0 && is_among(f->method, factorizing))
        return options_usage(precompute_command.name, "--factorizer qr: goes with --method 2msc only");
    if (strcmp(f->method, "emitters") == 0 && f->emitters == NULL)
        return options_usage(precompute_command.name,
                             "--method emitters: give --emitters FILE, group=NAME or sky");
    if (f->resolution % 2 != 0)
        return options_usage(precompute_command.name, "--resolution %" PRIu64 ": must be even",
                             f->resolution);
    if (!from_store && same_file(input, f->output))
        return options_usage(precompute_command.name, "-o %s: is the scene itself", f->output);
    return 0;
}

static bool is_hemicube(const precompute_arguments *f) {
    return strcmp(f->form_factors, "hemicube") == 0;
}

/* Whether an option about form factors had no use. Those of a store leave only the judge to cast rays; the
 * judge of a hemicube chooses its own number of them. */
static bool unused_by_form_factors(const char *name, const precompute_arguments *f, bool from_store) {
    const bool hemicube = is_hemicube(f);
    if (strcmp(name, "form-factors") == 0) return from_store;
    if (strcmp(name, "resolution") == 0) return from_store || !hemicube;
    if (strcmp(name, "quality") == 0) return from_store || hemicube || f->rays != OPTION_AUTO;
    if (strcmp(name, "ground-albedo") == 0) return f->sky == NULL;
    if (strcmp(name, "rays") == 0) return from_store ? f->probes == 0 : hemicube;
    return false;
}

static bool unused_by_method(const char *name, const precompute_arguments *f, const build_report *built) {
    static const char *const of_sparse[] = {"threshold", "correction", NULL};
    static const char *const of_patches[] = {"coherence", "min-area", "assign", NULL};
    static const char *const of_bound[] = {"epsilon", "alpha", "budget", NULL};
    static const char *const of_hf[] = {"alpha", "budget", "levels", NULL};
    static const char *const of_factors[] = {"factorizer", "epsilon", "alpha", "budget",
                                             "levels",     "rank",    NULL};
    const bool two_mesh = strcmp(built->method, "2msc") == 0;
    const bool emitters = strcmp(built->method, "emitters") == 0;
    const bool hierarchical = strcmp(built->method, "hierarchical") == 0;
    const bool rank_given = f->rank > 0;
    if (is_among(name, of_sparse)) return strcmp(built->method, "sparse") != 0;
    if (hierarchical && strcmp(name, "epsilon") == 0) return false;
    if (strcmp(name, "emitters") == 0) return !emitters;
    if (strcmp(name, "store-precision") == 0 || strcmp(name, "keep-factors") == 0)
        return strcmp(built->method, "exact") == 0 || built->threshold > 0 || emitters;
    if (is_among(name, of_patches)) return !two_mesh || (rank_given && strcmp(name, "assign") != 0);
    if (two_mesh && strcmp(name, "factorizer") == 0)
        return built->factorizer == NULL && strcmp(f->factorizer, "auto") != 0;
    if (two_mesh) return is_among(name, of_hf) || strcmp(name, "epsilon") == 0;
    if (built->factorizer == NULL) return is_among(name, of_factors);
    if (rank_given && is_among(name, of_bound)) return true;
    /* Whose norm a bound is in matters to every factorizer that keeps it. */
    if (strcmp(name, "budget") == 0 && built->norm == TRUNCATION_FROBENIUS) return false;
    return strcmp(built->factorizer, "hf") != 0 && is_among(name, of_hf);
}

typedef struct name_list {
    char text[256];
} name_list;

static void list_add(name_list *list, const char *name) {
    if (strlen(list->text) + strlen(name) + 5 > sizeof list->text) return;
    strcat(list->text, list->text[0] == '\0' ? "--" : ", --");
    strcat(list->text, name);
}

/* Names the options that what was done had no use for. */
static void log_unused(terminal *t, const option_result *given, const build_report *built,
                       const precompute_arguments *f, bool from_store) {
    name_list of_form_factors = {""}, of_method = {""};
    for (size_t i = 0; i < given->n_given; i++) {
        const char *name = given->given[i];
        if (unused_by_form_factors(name, f, from_store)) list_add(&of_form_factors, name);
        if (unused_by_method(name, f, built)) list_add(&of_method, name);
    }
    if (of_form_factors.text[0] != '\0')
        terminal_log(t, "%s does not use %s", from_store ? "a store with form factors" : f->form_factors,
                     of_form_factors.text);
    if (of_method.text[0] != '\0') terminal_log(t, "%s does not use %s", built->method, of_method.text);
}

int cmd_precompute(int argc, char **argv) {
    precompute_arguments f = {0};
    option_table tables[PRECOMPUTE_TABLES];
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    build_report built = {0};
    char *command = command_line(argc, argv), *continues = NULL;
    precompute_tables(&f, tables);
    int code = options_parse(&precompute_command, tables, argc, argv, &given);
    const bool from_store = code == OPTIONS_GO && precompute_takes_as_store(given.arguments[0]);
    if (code == OPTIONS_GO && check_together(&f, &given, from_store) != 0) code = 2;
    if (code != OPTIONS_GO) {
        free(command);
        return code;
    }
    if (f.scratch != NULL && command != NULL &&
        asprintf(&continues, "what was finished stays in %s; to go on: %s", f.scratch, command) < 0)
        continues = NULL;
    terminal_open(&term, precompute_command.name, f.quiet, f.progress);
    panel_precision precision = PANEL_F32;
    (void)panel_precision_find(f.precision, &precision);    /* one of the choices */
    if (f.threads > 0) omp_set_num_threads((int)f.threads); /* OpenBLAS asks OpenMP too */
    const precompute_options options = {
        .input = given.arguments[0],
        .output = f.output,
        .from_store = from_store,
        .command = command != NULL ? command : "",
        .refinement = {.subdivide_levels = (unsigned)f.subdivide,
                       .max_edge = f.max_edge,
                       .elements = f.elements},
        .unit = f.unit,
        .up = f.up != NULL ? f.up[0] : 0,
        .two_sided = f.two_sided,
        .reflectance = options_given(&given, "reflectance") ? f.reflectance : -1,
        /* Beside hemicubes only the judge casts rays, and --quality is not about the judge. */
        .form_factors = {.quality = is_hemicube(&f) ? "normal" : f.quality,
                         .epsilon = f.epsilon,
                         .rays = is_hemicube(&f) && !from_store ? CHOICE_AUTO : f.rays,
                         .resolution = is_hemicube(&f) && !from_store ? f.resolution : 0,
                         .seed = f.seed,
                         .sky = f.sky != NULL},
        .sky = f.sky,
        .ground_albedo = f.ground_albedo,
        .probes = f.probes,
        .keep_form_factors = f.keep_form_factors != NULL,
        .compress_form_factors = f.keep_form_factors != NULL && *f.keep_form_factors != '\0',
        .keep_factors = f.keep_factors,
        .method = f.method,
        .factorizer = f.factorizer,
        .epsilon = f.epsilon,
        .alpha = f.alpha,
        .budget = f.budget,
        .seed = f.seed,
        .levels = f.levels,
        .rank = f.rank,
        .precision = precision,
        .coherence = f.coherence,
        .min_area = f.min_area,
        .proximity = strcmp(f.assign, "proximity") == 0,
        .threshold = strcmp(f.method, "auto") == 0 && !options_given(&given, "threshold") ? 0 : f.threshold,
        .correction = f.correction,
        .emitters = f.emitters,
        .memory = f.memory,
        .scratch = f.scratch,
        .continues = continues != NULL ? continues : "what was finished stays in the scratch folder",
    };
    lam_status status = atomic_file_check(f.output, &error);
    if (status == LAM_OK) status = precompute_run(&options, &term, &built, &error);
    code = status == LAM_OK ? 0 : terminal_fail(&term, &error);
    free(command);
    free(continues);
    if (code != 0) return code;
    log_unused(&term, &given, &built, &f, from_store);
    terminal_log(&term, "%s", f.output);
    return 0;
}
