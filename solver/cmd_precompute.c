/* lambert precompute: turns a scene into a store. */
#include "solver/options.h"
#include "solver/output_file.h"
#include "solver/precompute.h"
#include "solver/verbs.h"

#include <inttypes.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

typedef struct fields {
    const char *output;
    uint64_t subdivide, elements;
    double max_edge, unit, reflectance;
    const char *up;
    bool two_sided;
    const char *form_factors;
    uint64_t rays, resolution;
    const char *quality, *sky, *keep_form_factors;
    double ground_albedo;
    const char *method, *factorizer;
    double epsilon, alpha;
    const char *budget;
    uint64_t levels, rank;
    double coherence, min_area, threshold;
    const char *assign, *correction, *precision;
    const char *scratch;
    uint64_t threads, memory, seed, probes;
    bool quiet, progress;
} fields;

/* NULL: none. */
static lam_status parse_sky(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    const char **sky = field;
    lam_error why = {0};
    *sky = NULL;
    if (strcmp(text, "none") == 0) return LAM_OK;
    status = sky_tiling_create(text, 'z', &tiling, &why);
    if (status != LAM_OK) FAIL(error, status, "--sky %s", why.message);
    *sky = text;
done:
    sky_tiling_free(&tiling);
    return status;
}

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_TEXT,
     .offset = FIELD(output),
     .value = "STORE.h5",
     .doc = "Where the store goes"},

    {.kind = OPTION_HEADING, .doc = "mesh (without: every imported face is one element)"},
    {.name = "subdivide",
     .kind = OPTION_COUNT,
     .offset = FIELD(subdivide),
     .value = "LEVELS",
     .doc = "Each face into 4, this often",
     .low = 1,
     .high = 12},
    {.name = "max-edge",
     .kind = OPTION_NUMBER,
     .offset = FIELD(max_edge),
     .value = "METRES",
     .doc = "No edge longer than this",
     .low_open = true},
    {.name = "elements",
     .kind = OPTION_COUNT,
     .offset = FIELD(elements),
     .value = "N",
     .doc = "About this many elements",
     .low = 1,
     .high = 4e9},
    {.name = "unit",
     .kind = OPTION_NUMBER,
     .offset = FIELD(unit),
     .value = "METRES",
     .doc = "Length of the file's unit (1)",
     .low_open = true},
    {.name = "up",
     .kind = OPTION_CHOICE,
     .offset = FIELD(up),
     .value = "x|y|z",
     .doc = "Which axis is up (y for glTF, else z)",
     .choices = "x|y|z"},
    {.name = "two-sided",
     .kind = OPTION_FLAG,
     .offset = FIELD(two_sided),
     .doc = "Every face is two elements: all fronts, then all backs"},
    {.name = "reflectance",
     .kind = OPTION_NUMBER,
     .offset = FIELD(reflectance),
     .value = "X",
     .doc = "Of every face, grey, in place of the file's",
     .low = 0,
     .high = 1,
     .high_open = true},

    {.kind = OPTION_HEADING, .doc = "form factors"},
    {.name = "form-factors",
     .kind = OPTION_CHOICE,
     .offset = FIELD(form_factors),
     .value = "rays|hemicube",
     .doc = "How they are found (rays)",
     .choices = "rays|hemicube"},
    {.name = "rays",
     .kind = OPTION_COUNT_AUTO,
     .offset = FIELD(rays),
     .value = "N|auto",
     .doc = "Rays from every element (auto: by --epsilon and --quality)",
     .low = 1,
     .high = 1 << 24},
    {.name = "resolution",
     .kind = OPTION_COUNT,
     .offset = FIELD(resolution),
     .value = "PIXELS",
     .doc = "Of a hemicube: pixels along its top, even (512)",
     .low = RECIPE_RESOLUTION_LEAST,
     .high = RECIPE_RESOLUTION_MOST},
    {.name = "quality",
     .kind = OPTION_CHOICE,
     .offset = FIELD(quality),
     .value = "draft|normal|high",
     .doc = "draft: rays whose noise is at most 1/2 of epsilon; normal, high: pair by pair, magnitudes by "
            "mathematics and rays only for what is hidden, or, where there are too many pairs, the near ones "
            "so and the others by rays at 1/4, 1/8 (normal)",
     .choices = "draft|normal|high"},
    {.name = "sky",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(sky),
     .value = "none|tregenza|reinhart:MF|grid:AxB",
     .doc = "Sky in tiles, whose light the store then takes: 145, 144 MF^2 + 1, or A sectors by B bands "
            "(none)",
     .parse = parse_sky},
    {.name = "ground-albedo",
     .kind = OPTION_NUMBER,
     .offset = FIELD(ground_albedo),
     .value = "X",
     .doc = "Share of the sky's light that the ground returns: what lies below the horizon (0)",
     .low = 0,
     .high = 1},
    {.name = "keep-form-factors",
     .kind = OPTION_OPTIONAL,
     .offset = FIELD(keep_form_factors),
     .value = "compressed",
     .doc = "Keep them in the store (compressed is not supported yet)",
     .choices = "",
     .later = "compressed"},

    {.kind = OPTION_HEADING, .doc = "operator"},
    {.name = "method",
     .kind = OPTION_CHOICE,
     .offset = FIELD(method),
     .value = "auto|exact|low-rank|2msc",
     .doc = "Kind of operator (auto)",
     .choices = "auto|exact|low-rank|2msc",
     .later = "sparse|emitters|hierarchical"},
    {.name = "factorizer",
     .kind = OPTION_CHOICE,
     .offset = FIELD(factorizer),
     .value = "auto|hf|svd|rsi|sgrsvd|qr",
     .doc = "How a low rank is found (auto); qr: 2msc with its columns made orthogonal",
     .choices = "auto|hf|svd|rsi|sgrsvd|qr"},
    {.name = "epsilon",
     .kind = OPTION_NUMBER,
     .offset = FIELD(epsilon),
     .value = "X",
     .doc = "Bound of the factorization in the 2-norm (.05)",
     .low = 0,
     .low_open = true,
     .high = 1},
    {.name = "alpha",
     .kind = OPTION_NUMBER,
     .offset = FIELD(alpha),
     .value = "X",
     .doc = "hf: share of the bound that the last step may take (.5)",
     .low = 0,
     .low_open = true,
     .high = 1,
     .high_open = true},
    {.name = "budget",
     .kind = OPTION_CHOICE,
     .offset = FIELD(budget),
     .value = "squares|sums|frobenius",
     .doc =
         "hf: how errors of its steps add up: in squares (the default), as eq. 3.10 of the thesis has it, or "
         "in squares with --epsilon in the Frobenius norm",
     .choices = "squares|sums|frobenius"},
    {.name = "levels",
     .kind = OPTION_COUNT_AUTO,
     .offset = FIELD(levels),
     .value = "N|auto",
     .doc = "Levels of the factorization (auto)",
     .low = 0,
     .high = 20},
    {.name = "rank",
     .kind = OPTION_COUNT,
     .offset = FIELD(rank),
     .value = "K",
     .doc = "Exactly this many columns (2msc: patches) in place of --epsilon",
     .low = 1,
     .high = 4e9},
    {.name = "keep-factors", .kind = OPTION_LATER, .doc = "(not supported yet)"},
    {.name = "store-precision",
     .kind = OPTION_CHOICE,
     .offset = FIELD(precision),
     .value = "f32|f16|bf16|i8",
     .doc =
         "Of a stored low-rank operator (f32); f16 and bf16 take half of the memory and time, i8 a quarter",
     .choices = "f32|f16|bf16|i8"},
    {.name = "coherence",
     .kind = OPTION_NUMBER,
     .offset = FIELD(coherence),
     .value = "X",
     .doc = "2msc: split patches whose coherence is below this. Coherence is 1 less the variance of what the "
            "elements of a patch see over its mean square, by area: 1 where all see the same (without this "
            "and --min-area: those that lose most, until patches have 16 elements on average)",
     .low_open = true,
     .high = 1},
    {.name = "min-area",
     .kind = OPTION_NUMBER,
     .offset = FIELD(min_area),
     .value = "M2",
     .doc = "2msc: split no patch of this area or less (alone: split all others)",
     .low_open = true},
    {.name = "assign",
     .kind = OPTION_CHOICE,
     .offset = FIELD(assign),
     .value = "inclusion|proximity",
     .doc = "2msc: elements are of the patch they were split into, or of the nearest that faces the same way "
            "(inclusion)",
     .choices = "inclusion|proximity"},
    {.name = "threshold",
     .kind = OPTION_NUMBER,
     .offset = FIELD(threshold),
     .value = "X",
     .doc = "sparse: what is discarded (1e-4)",
     .low_open = true},
    {.name = "correction",
     .kind = OPTION_CHOICE,
     .offset = FIELD(correction),
     .value = "none|delta|discarded",
     .doc = "sparse: how that is made up for (delta)",
     .choices = "none|delta|discarded"},
    {.name = "emitters", .kind = OPTION_LATER, .value = "FILE|group=NAME|sky", .doc = "(not supported yet)"},
    {.name = "positions", .kind = OPTION_LATER, .value = "FILE.json", .doc = "(not supported yet)"},
    {.name = "path", .kind = OPTION_LATER, .value = "FILE.json", .doc = "(not supported yet)"},
    {.name = "frames", .kind = OPTION_LATER, .value = "N", .doc = "(not supported yet)"},
    {.name = "reuse", .kind = OPTION_LATER, .value = "A|B|C|D", .doc = "(not supported yet)"},
    {.name = "paths", .kind = OPTION_LATER, .value = "N", .doc = "(not supported yet)"},

    {.kind = OPTION_HEADING, .doc = "resources"},
    {.name = "threads",
     .kind = OPTION_COUNT,
     .offset = FIELD(threads),
     .value = "T",
     .doc = "Threads (one per core)",
     .low = 1,
     .high = 1024},
    {.name = "memory",
     .kind = OPTION_SIZE,
     .offset = FIELD(memory),
     .value = "SIZE",
     .doc = "Memory to stay within, such as 500M or 16G (70 % of what is free)"},
    {.name = "scratch",
     .kind = OPTION_TEXT,
     .offset = FIELD(scratch),
     .value = "DIR",
     .doc = "Keep rows of form factors there as they are found; the same command after a stop goes on there"},
    {.name = "seed", .kind = OPTION_COUNT, .offset = FIELD(seed), .value = "S", .doc = "Of the sampling (1)"},
    {.name = "probes",
     .kind = OPTION_COUNT,
     .offset = FIELD(probes),
     .value = "P",
     .doc = "Single elements that the error is measured with (200; 32 above 10240 elements; 0: none)",
     .low = 0,
     .high = 1e6},
    {.name = "quiet", .kind = OPTION_FLAG, .offset = FIELD(quiet), .doc = "No log, no progress line"},
    {.name = "progress",
     .kind = OPTION_FLAG,
     .offset = FIELD(progress),
     .doc = "A progress line even where standard error is no terminal"},
    {0},
};
_Static_assert(sizeof rows / sizeof rows[0] <= OPTIONS_MAX, "the set of given options has one bit a row");

static const option_verb verb = {
    .name = "precompute",
    .arguments = "SCENE -o STORE.h5",
    .summary = "Turn a scene (OBJ, glTF, PLY, STL, or a store that keeps its form factors) into a store: the "
               "operator from any emission to its radiosity, with its measured error.",
    .options = rows,
    .min_arguments = 1,
    .max_arguments = 1,
};

/* Whether a file is an HDF5 file, or is called one. */
static bool is_store(const char *path) {
    static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    unsigned char start[8] = {0};
    char extension[16];
    struct stat about;
    output_file_extension(path, extension);
    if (strcmp(extension, "h5") == 0) return true;
    if (stat(path, &about) != 0 || !S_ISREG(about.st_mode)) return false;
    FILE *stream = fopen(path, "rb");
    if (stream == NULL) return false;
    const bool whole = fread(start, 1, sizeof start, stream) == sizeof start;
    fclose(stream);
    return whole && memcmp(start, signature, sizeof start) == 0;
}

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

/* What the arguments say together; 0 or the status of wrong usage. */
static int check_together(const fields *f, const option_result *given, bool from_store) {
    const char *input = given->arguments[0];
    static const char *const of_mesh[] = {"subdivide", "max-edge", "elements", "unit", "up", "two-sided"};
    const int refinements = (f->subdivide > 0) + (f->max_edge > 0) + (f->elements > 0);
    if (f->output == NULL) return options_usage(verb.name, "no -o STORE.h5 given");
    if (refinements > 1)
        return options_usage(verb.name, "--subdivide, --max-edge and --elements exclude each other");
    static const char *const of_sky[] = {"sky", "ground-albedo"};
    for (size_t i = 0; from_store && i < 2; i++)
        if (options_given(&verb, given, of_sky[i]))
            return options_usage(verb.name,
                                 "--%s: a store keeps the sky it has; precompute from its scene instead",
                                 of_sky[i]);
    for (size_t i = 0; from_store && i < sizeof of_mesh / sizeof of_mesh[0]; i++)
        if (options_given(&verb, given, of_mesh[i]))
            return options_usage(verb.name,
                                 "--%s: the mesh of a store is fixed; precompute from its scene instead",
                                 of_mesh[i]);
    const bool qr = strcmp(f->factorizer, "qr") == 0, two_mesh = strcmp(f->method, "2msc") == 0;
    if (qr && !two_mesh) return options_usage(verb.name, "--factorizer qr: goes with --method 2msc only");
    if (two_mesh && !qr && strcmp(f->factorizer, "auto") != 0)
        return options_usage(verb.name, "--factorizer %s: --method 2msc has auto or qr", f->factorizer);
    if (f->resolution % 2 != 0)
        return options_usage(verb.name, "--resolution %" PRIu64 ": must be even", f->resolution);
    if (!from_store && same_file(input, f->output))
        return options_usage(verb.name, "-o %s: is the scene itself", f->output);
    return 0;
}

static bool is_hemicube(const fields *f) {
    return strcmp(f->form_factors, "hemicube") == 0;
}

/* Whether an option about form factors had no use. Those of a store leave only the judge to cast rays; the
 * judge of a hemicube chooses its own number of them. */
static bool unused_by_form_factors(const char *name, const fields *f, bool from_store) {
    const bool hemicube = is_hemicube(f);
    if (strcmp(name, "form-factors") == 0) return from_store;
    if (strcmp(name, "resolution") == 0) return from_store || !hemicube;
    if (strcmp(name, "quality") == 0) return from_store || hemicube || f->rays != OPTION_AUTO;
    if (strcmp(name, "ground-albedo") == 0) return f->sky == NULL;
    if (strcmp(name, "rays") == 0) return from_store ? f->probes == 0 : hemicube;
    return false;
}

static bool unused_by_method(const char *name, const fields *f, const build_report *built) {
    static const char *const never[] = {"threshold", "correction"};
    static const char *const patches[] = {"coherence", "min-area", "assign"};
    static const char *const factorized[] = {"factorizer", "epsilon", "alpha", "budget", "levels", "rank"};
    static const char *const of_hf[] = {"alpha", "budget", "levels"};
    const bool two_mesh = strcmp(built->method, "2msc") == 0;
    for (size_t k = 0; k < sizeof patches / sizeof patches[0]; k++)
        if (strcmp(name, patches[k]) == 0) return !two_mesh || (k < 2 && f->rank > 0);
    for (size_t k = 0; two_mesh && k < sizeof of_hf / sizeof of_hf[0]; k++)
        if (strcmp(name, of_hf[k]) == 0) return true;
    if (two_mesh && (strcmp(name, "factorizer") == 0 || strcmp(name, "rank") == 0)) return false;
    if (two_mesh && strcmp(name, "epsilon") == 0) return true;
    for (size_t k = 0; k < sizeof never / sizeof never[0]; k++)
        if (strcmp(name, never[k]) == 0) return true;
    if (strcmp(name, "store-precision") == 0) return strcmp(built->method, "exact") == 0;
    for (size_t k = 0; built->factorizer == NULL && k < sizeof factorized / sizeof factorized[0]; k++)
        if (strcmp(name, factorized[k]) == 0) return true;
    for (size_t k = 0; strcmp(built->factorizer != NULL ? built->factorizer : "hf", "hf") != 0 && k < 3; k++)
        if (strcmp(name, of_hf[k]) == 0) return true;
    return strcmp(name, "epsilon") == 0 && f->rank > 0;
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
static void log_unused(terminal *t, const option_result *given, const build_report *built, const fields *f,
                       bool from_store) {
    name_list of_form_factors = {""}, of_method = {""};
    for (size_t i = 0; verb.options[i].name != NULL || verb.options[i].doc != NULL; i++) {
        const char *name = verb.options[i].name;
        if (name == NULL || !options_given(&verb, given, name)) continue;
        if (unused_by_form_factors(name, f, from_store)) list_add(&of_form_factors, name);
        if (unused_by_method(name, f, built)) list_add(&of_method, name);
    }
    if (of_form_factors.text[0] != '\0')
        terminal_log(t, "%s does not use %s", from_store ? "a store with form factors" : f->form_factors,
                     of_form_factors.text);
    if (of_method.text[0] != '\0') terminal_log(t, "%s does not use %s", built->method, of_method.text);
}

int cmd_precompute(int argc, char **argv) {
    fields f = {.unit = 1,
                .reflectance = -1,
                .rays = OPTION_AUTO,
                .form_factors = "rays",
                .resolution = 512,
                .quality = "normal",
                .method = "auto",
                .factorizer = "auto",
                .precision = "f32",
                .assign = "inclusion",
                .epsilon = .05,
                .alpha = .5,
                .budget = "squares",
                .levels = OPTION_AUTO,
                .seed = 1,
                .probes = PRECOMPUTE_AUTO};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    build_report built = {0};
    char *command = command_line(argc, argv), *continues = NULL;
    int code = options_parse(&verb, argc, argv, &f, &given);
    const bool from_store = code == OPTIONS_GO && is_store(given.arguments[0]);
    if (code == OPTIONS_GO && check_together(&f, &given, from_store) != 0) code = 2;
    if (code != OPTIONS_GO) {
        free(command);
        return code;
    }
    if (f.scratch != NULL && command != NULL &&
        asprintf(&continues, "what was finished stays in %s; to go on: %s", f.scratch, command) < 0)
        continues = NULL;
    terminal_open(&term, verb.name, f.quiet, f.progress);
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
        .reflectance = f.reflectance,
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
        .memory = f.memory,
        .scratch = f.scratch,
        .continues = continues != NULL ? continues : "what was finished stays in the scratch folder",
    };
    lam_status status = output_file_check(f.output, &error);
    if (status == LAM_OK) status = precompute_run(&options, &term, &built, &error);
    code = status == LAM_OK ? 0 : terminal_fail(&term, &error);
    free(command);
    free(continues);
    if (code != 0) return code;
    log_unused(&term, &given, &built, &f, from_store);
    terminal_log(&term, "%s", f.output);
    return 0;
}
