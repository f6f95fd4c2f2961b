/* lambert classify: reports the properties of a scene and the operator that suits it. */
#include "solver/precompute/precompute.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/verbs.h"

#include <jansson.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fields {
    bool json;
} fields;

static const option_row own_rows[] = {
    {.name = "json", .kind = OPTION_FLAG, .offset = offsetof(fields, json), .help = "Print the same as JSON"},
    {0},
};

static void print_text(const decision *d, double n, size_t rays) {
    printf("%-18s%.0f\n", "elements", n);
    printf("%-18s%.3g %% of F", "density", 100 * d->density);
    if (rays > 0) printf(", by %zu rays per element", rays);
    puts("");
    for (size_t k = 0; k < d->n_candidates; k++)
        if (d->candidates[k].object != NULL && d->candidates[k].found[0] != '\0')
            printf("%-18s%s\n", d->candidates[k].method->name, d->candidates[k].found);
    printf("%-18s%s\n%-18s%s: %s\n", "method", d->taken->method->name, "reason", d->taken->method->name,
           d->reason);
    for (size_t k = 0; k < d->n_candidates; k++) {
        const candidate *c = &d->candidates[k];
        if (isfinite(c->cost))
            printf("  %-16s%.3g coefficients read by an answer, %.3g per element%s\n", c->method->name,
                   c->cost, c->cost / n, c == d->taken ? " <-" : "");
    }
}

static json_t *number_or_null(double x) {
    return isfinite(x) && x >= 0 ? json_real(x) : json_null();
}

/* The figures of a candidate as an object; null where it was not weighed. */
static json_t *figures_of(const candidate *c) {
    json_t *object = c->n_figures > 0 ? json_object() : json_null();
    for (size_t k = 0; k < c->n_figures; k++)
        json_object_set_new(object, c->figures[k].name, json_real(c->figures[k].value));
    return object;
}

static lam_status print_json(const decision *d, double n, size_t rays, lam_error *error) {
    char reason[sizeof d->reason + 32];
    json_t *root = json_object(), *costs = json_object();
    json_object_set_new(root, "elements", json_integer((json_int_t)n));
    json_object_set_new(root, "density", json_real(d->density));
    json_object_set_new(root, "rays", rays > 0 ? json_integer((json_int_t)rays) : json_null());
    for (size_t k = 0; k < d->n_candidates; k++) {
        const candidate *c = &d->candidates[k];
        if (c->object != NULL) json_object_set_new(root, c->object, figures_of(c));
        json_object_set_new(costs, c->method->name, number_or_null(c->cost));
    }
    json_object_set_new(root, "numbers", costs);
    json_object_set_new(root, "method", json_string(d->taken->method->name));
    snprintf(reason, sizeof reason, "%s: %s", d->taken->method->name, d->reason);
    json_object_set_new(root, "reason", json_string(reason));
    const lam_status status = json_print("--json", root, 0, error);
    json_decref(root);
    return status;
}

int cmd_classify(int argc, char **argv) {
    fields f = {0};
    precompute_options o;
    precompute_tables tables;
    static const option_command verb = {
        .name = "lambert classify",
        .arguments = "SCENE",
        .summary =
            "Say how dense a scene's form factors are, how many singular values matter, and which operator "
            "--method auto would build; of a store that keeps form factors these are taken.",
        .least_arguments = 1,
        .most_arguments = 1,
        .gone = precompute_gone,
    };
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    decision found = {.n_candidates = 0};
    size_t rays = 0, n = 0;
    precompute_tables_make(&o, true, &tables);
    precompute_tables_add(&tables, own_rows, &f);
    const int code = options_parse(&verb, tables.tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    terminal_open(&term, verb.name, o.quiet || f.json, o.progress);
    term.nothing = "nothing was found out";
    if (o.threads > 0) omp_set_num_threads((int)o.threads);
    o.input = given.arguments[0];
    o.from_store = precompute_takes_as_store(o.input);
    lam_status status = precompute_classify(&o, &term, &found, &n, &rays, &error);
    terminal_clear(&term);
    if (status == LAM_OK && f.json) status = print_json(&found, (double)n, rays, &error);
    if (status == LAM_OK && !f.json) print_text(&found, (double)n, rays);
    decision_free(&found);
    return status == LAM_OK ? 0 : terminal_fail(&term, &error);
}
