/* lambert classify: says what kind of scene it is and which operator suits it. */
#include "solver/precompute/precompute.h"
#include "solver/verbs/precompute_arguments.h"
#include "solver/verbs/verbs.h"

#include <jansson.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The options are those of precompute that say what the scene is, and this one's own. */
typedef struct fields {
    precompute_arguments of_scene;
    bool json;
} fields;

static const char *const taken[] = {"subdivide",   "max-edge", "elements", "unit",     "up",      "two-sided",
                                    "reflectance", "rays",     "sky",      "emitters", "epsilon", "threshold",
                                    "threads",     "memory",   "seed",     "quiet",    "progress"};
enum { TAKEN = sizeof taken / sizeof *taken };

static const option_row own_rows[] = {
    {.name = "json", .kind = OPTION_FLAG, .offset = offsetof(fields, json), .help = "Print JSON"},
    {0},
};

static bool is_taken(const char *name) {
    for (size_t k = 0; k < TAKEN; k++)
        if (strcmp(name, taken[k]) == 0) return true;
    return false;
}

static void take_rows(const option_table *tables, option_row rows[TAKEN + 1]) {
    size_t n = 0;
    for (; tables->rows != NULL; tables++)
        for (const option_row *row = tables->rows; row->name != NULL; row++)
            if (is_taken(row->name)) rows[n++] = *row;
    rows[n] = (option_row){0};
}

static void print_cost(const char *method, double cost, const scene_class *c) {
    if (!isfinite(cost)) return;
    printf("  %-16s%.3g numbers an answer, %.3g an element%s\n", method, cost, cost / (double)c->n,
           strcmp(method, c->method) == 0 ? " <-" : "");
}

static void print_text(const scene_class *c, double epsilon, size_t rays) {
    printf("%-18s%zu\n", "elements", c->n);
    printf("%-18s%.3g %% of F", "density", 100 * c->density);
    if (rays > 0) printf(", by %zu rays an element", rays);
    printf("\n%-18s%.0f at epsilon %g, %.3g %% of the elements\n", "rank estimate", c->rank, epsilon,
           100 * c->rank / (double)c->n);
    if (c->entries >= 0)
        printf("%-18s%.3g entries, %.3g %%, at threshold %.3g\n", "sparse inverse", c->entries,
               100 * c->entries / ((double)c->n * (double)c->n), c->threshold);
    if (c->numbers >= 0) printf("%-18s%.3g numbers an element\n", "hierarchical", c->numbers);
    printf("%-18s%s\n%-18s%s\n", "method", c->method, "reason", c->reason);
    print_cost("exact", c->exact_cost, c);
    print_cost("low-rank", c->low_rank_cost, c);
    print_cost("sparse", c->sparse_cost, c);
    print_cost("emitters", c->emitters_cost, c);
    print_cost("hierarchical", c->hierarchical_cost, c);
}

static json_t *number_or_null(double x) {
    return isfinite(x) && x >= 0 ? json_real(x) : json_null();
}

static lam_status print_json(const scene_class *c, double epsilon, size_t rays, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    const bool sparse = c->entries >= 0;
    json_t *root = json_pack(
        "{s:I, s:f, s:o, s:{s:f, s:o, s:f}, s:o, s:o, s:{s:o, s:o, s:o, s:o, s:o}, s:s, s:s}", "elements",
        (json_int_t)c->n, "density", c->density, "rays",
        rays > 0 ? json_integer((json_int_t)rays) : json_null(), "rank", "epsilon", epsilon, "estimate",
        number_or_null(c->rank), "share", c->rank / (double)c->n, "sparse",
        sparse ? json_pack("{s:f, s:f}", "entries", c->entries, "threshold", c->threshold) : json_null(),
        "hierarchical", c->numbers >= 0 ? json_pack("{s:f}", "numbers", c->numbers) : json_null(), "numbers",
        "exact", number_or_null(c->exact_cost), "low-rank", number_or_null(c->low_rank_cost), "sparse",
        number_or_null(c->sparse_cost), "emitters", number_or_null(c->emitters_cost), "hierarchical",
        number_or_null(c->hierarchical_cost), "method", c->method, "reason", c->reason);
    if (root != NULL) text = json_dumps(root, JSON_INDENT(2));
    if (text == NULL) FAIL(error, LAM_ERR_MEMORY, "the result cannot be written as JSON");
    puts(text);
done:
    free(text);
    json_decref(root);
    return status;
}

int cmd_classify(int argc, char **argv) {
    fields f = {0};
    const precompute_arguments *a = &f.of_scene;
    option_table of_precompute[PRECOMPUTE_TABLES];
    option_row rows[TAKEN + 1];
    precompute_tables(&f.of_scene, of_precompute);
    take_rows(of_precompute, rows);
    const option_table tables[] = {{NULL, rows, &f.of_scene}, {NULL, own_rows, &f}, {0}};
    static const option_command verb = {
        .name = "lambert classify",
        .arguments = "SCENE",
        .summary =
            "Say how dense a scene's form factors are, how many singular values matter, and which operator "
            "--method auto would build; of a store that keeps form factors these are taken.",
        .least_arguments = 1,
        .most_arguments = 1,
    };
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    scene_class found;
    size_t rays = 0;
    const int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    if ((a->subdivide > 0) + (a->max_edge > 0) + (a->elements > 0) > 1)
        return options_usage(verb.name, "--subdivide, --max-edge and --elements exclude each other");
    terminal_open(&term, verb.name, a->quiet || f.json, a->progress);
    term.nothing = "nothing was found out";
    if (a->threads > 0) omp_set_num_threads((int)a->threads);
    const precompute_options options = {
        .input = given.arguments[0],
        .from_store = precompute_takes_as_store(given.arguments[0]),
        .refinement = {.subdivide_levels = (unsigned)a->subdivide,
                       .max_edge = a->max_edge,
                       .elements = a->elements},
        .unit = a->unit,
        .up = a->up != NULL ? a->up[0] : 0,
        .two_sided = a->two_sided,
        .reflectance = options_given(&given, "reflectance") ? a->reflectance : -1,
        .form_factors = {.quality = "draft",
                         .epsilon = a->epsilon,
                         .rays = a->rays,
                         .seed = a->seed,
                         .sky = a->sky != NULL},
        .sky = a->sky,
        .method = "auto",
        .factorizer = "auto",
        .emitters = a->emitters,
        .epsilon = a->epsilon,
        .threshold = options_given(&given, "threshold") ? a->threshold : 0,
        .seed = a->seed,
        .memory = a->memory,
    };
    lam_status status = precompute_classify(&options, &term, &found, &rays, &error);
    terminal_clear(&term);
    if (status == LAM_OK && f.json) status = print_json(&found, a->epsilon, rays, &error);
    if (status != LAM_OK) return terminal_fail(&term, &error);
    if (!f.json) print_text(&found, a->epsilon, rays);
    return 0;
}
