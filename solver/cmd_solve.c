/* lambert solve: lights a store and writes what it answers. */
#include "solver/emission_apply.h"
#include "solver/operator/operator.h"
#include "solver/operator/sky.h"
#include "solver/output.h"
#include "solver/output_file.h"
#include "solver/terminal.h"
#include "solver/verbs.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

typedef struct fields {
    option_list emit, reduce;
    const char *emission, *sky, *quantity, *output;
} fields;

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_TEXT,
     .offset = FIELD(output),
     .value = "FILE",
     .doc = ".npy, .json, .csv, .ply or .vtu; without it the mean of every group is printed"},
    {.kind = OPTION_HEADING, .doc = "light (without: the scene's own)"},
    {.name = "emit",
     .kind = OPTION_LIST,
     .offset = FIELD(emit),
     .value = "GROUP=V[,V,V]",
     .doc = "A group emits V W/m2, one number or one per channel; again for more groups"},
    {.name = "emission",
     .kind = OPTION_TEXT,
     .offset = FIELD(emission),
     .value = "FILE.npy|.json",
     .doc = "One emission or a batch from a file"},
    {.name = "sky",
     .kind = OPTION_TEXT,
     .offset = FIELD(sky),
     .value = "FILE.npy",
     .doc = "Radiances of the sky's tiles, W/(m2 sr): [m], [C][m] or a batch; alone or beside the others"},
    {.kind = OPTION_HEADING, .doc = "answer"},
    {.name = "quantity",
     .kind = OPTION_CHOICE,
     .offset = FIELD(quantity),
     .value = "NAME",
     .doc = "radiosity (the default), irradiance or indirect",
     .choices = "radiosity|irradiance|indirect"},
    {.name = "reduce",
     .kind = OPTION_LIST,
     .offset = FIELD(reduce),
     .value = "GROUP=FIGURE",
     .doc = "mean, sum, min, max, uniformity or variance of a group; again for more"},
    {.name = "tolerance", .kind = OPTION_LATER, .value = "X", .doc = "(not supported yet)"},
    {0},
};

static const option_verb verb = {
    .name = "solve",
    .arguments = "STORE",
    .summary = "Light a store and write its radiosity, irradiance or indirect light, element by element.",
    .options = rows,
    .min_arguments = 1,
    .max_arguments = 1,
};

static lam_quantity quantity_of(const char *name) {
    if (strcmp(name, "irradiance") == 0) return LAM_IRRADIANCE;
    if (strcmp(name, "indirect") == 0) return LAM_INDIRECT;
    return LAM_RADIOSITY;
}

static bool is_dark(const emission *light, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (light->E[i] > 0) return false;
    return true;
}

/* The mean total error for the scene's own lights, or for single elements; negative where there is none. */
static void stated_error(store *s, double *relative, double *indirect) {
    static const char *const groups[] = {"/error/lights", "/error/single"};
    *relative = *indirect = -1;
    for (size_t i = 0; i < sizeof groups / sizeof groups[0]; i++) {
        if (!store_has(s, groups[i]) || !store_has_attribute(s, groups[i], "total_relative_mean")) continue;
        if (store_get_number(s, groups[i], "total_relative_mean", relative, NULL) == LAM_OK &&
            store_get_number(s, groups[i], "total_indirect_mean", indirect, NULL) == LAM_OK)
            return;
        *relative = *indirect = -1;
    }
}

static void print_columns(const solution *s, const char *first) {
    char name[OUTPUT_COLUMN];
    fputs(first, stdout);
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t c = 0; c < s->m->n_channels; c++) {
            output_column(s, v, c, name);
            printf(" %14s", name);
        }
    putchar('\n');
}

static void print_means(const solution *s, bool *inside) {
    print_columns(s, "group                    elements   area, m2");
    for (size_t g = 0; g < s->m->n_groups; g++) {
        double area = 0;
        size_t count = 0;
        for (size_t i = 0; i < s->m->n; i++)
            if (s->m->group[i] == g) {
                area += s->m->area[i];
                count++;
            }
        printf("%-24s %8zu %10.4g", s->m->group_names[g], count, area);
        memset(inside, 0, s->m->n_groups * sizeof *inside);
        inside[g] = true;
        for (size_t k = 0; k < s->n_vectors * s->m->n_channels; k++) {
            double figures[REDUCE_COUNT];
            reduce_compute(s->m, inside, s->values + k * s->m->n, figures);
            printf(" %14.6g", figures[REDUCE_MEAN]);
        }
        putchar('\n');
    }
}

static void print_reductions(const solution *s) {
    print_columns(s, "group                    figure    ");
    for (size_t r = 0; r < s->n_reductions; r++)
        for (int k = 0; k < REDUCE_COUNT; k++) {
            if (!s->reductions[r].wanted[k]) continue;
            printf("%-24s %-10s", s->reductions[r].group, reduce_name((reduce_statistic)k));
            for (size_t column = 0; column < s->n_vectors * s->m->n_channels; column++) {
                double figures[REDUCE_COUNT];
                reduce_compute(s->m, s->reductions[r].inside, s->values + column * s->m->n, figures);
                printf(" %14.6g", figures[k]);
            }
            putchar('\n');
        }
}

static lam_status print_solution(const solution *s, lam_error *error) {
    bool *inside = memory_allocate(s->m->n_groups, sizeof *inside, "groups", error);
    if (inside == NULL) return LAM_ERR_MEMORY;
    if (s->n_reductions > 0)
        print_reductions(s);
    else
        print_means(s, inside);
    if (s->relative >= 0)
        printf("stated error of the store: relative %.3g, indirect %.3g\n", s->relative, s->indirect);
    free(inside);
    return LAM_OK;
}

/* The elements that some reduction is about, *selected freed with free(); NULL where all are wanted. */
static lam_status wanted_elements(const mesh *m, const reduction *reductions, size_t n_reductions,
                                  size_t *n_selected, uint32_t **selected, lam_error *error) {
    *selected = NULL;
    *n_selected = 0;
    if (n_reductions == 0) return LAM_OK;
    *selected = memory_allocate(m->n, sizeof **selected, "the elements wanted", error);
    if (*selected == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        bool inside = false;
        for (size_t r = 0; r < n_reductions; r++) inside = inside || reductions[r].inside[m->group[i]];
        if (inside) (*selected)[(*n_selected)++] = (uint32_t)i;
    }
    return LAM_OK;
}

static lam_status solve(const char *path, const fields *f, reduction *reductions, terminal *t,
                        lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    mesh m = {0};
    lam_operator *op = NULL;
    lam_sky *sky = NULL;
    emission light = {0};
    double *row_sums = NULL;
    float *values = NULL;
    char *scene = NULL;
    uint32_t *selected = NULL;
    size_t n_selected = 0;
    bool own = false;
    if (f->output != NULL) TRY(output_file_check(f->output, error));
    TRY(store_open(path, &s, error));
    TRY(store_get_text(s, "/", "name", &scene, error));
    TRY(mesh_load(s, &m, &row_sums, error));
    for (size_t i = 0; i < f->reduce.count; i++) TRY(reduce_bind(&reductions[i], &m, error));
    TRY(sky_load(s, m.n, &sky, error));
    const emission_wish wish = {.items = &f->emit, .path = f->emission, .sky = f->sky};
    TRY(operator_load(s, &op, error));
    TRY(emission_choose(&m, emission_sources_of(op, sky), &wish, &light, &own, error));
    if (own && is_dark(&light, m.n * m.n_channels))
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: the scene has no light of its own; give --emit GROUP=V, --emission FILE%s", path,
             sky != NULL ? " or --sky FILE" : "");
    if (own) terminal_log(t, "no --emit, --emission or --sky: the scene's own light");
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    TRY(terminal_check(error));
    /* With --reduce only figures are written, with -o too. */
    TRY(wanted_elements(&m, reductions, f->reduce.count, &n_selected, &selected, error));
    TRY(emission_apply(&light, op, sky, quantity_of(f->quantity), n_selected, selected, terminal_check,
                       &values, error));
    solution out = {.m = &m,
                    .scene = scene,
                    .quantity = f->quantity,
                    .n_vectors = light.n_vectors,
                    .batch = light.batch,
                    .values = values,
                    .reductions = reductions,
                    .n_reductions = f->reduce.count};
    stated_error(s, &out.relative, &out.indirect);
    if (f->output != NULL)
        TRY(output_write(&out, f->output, error));
    else
        TRY(print_solution(&out, error));
done:
    free(scene);
    free(selected);
    free(values);
    free(row_sums);
    emission_free(&light);
    lam_operator_close(op);
    lam_sky_close(sky);
    mesh_free(&m);
    store_close(s);
    return status;
}

int cmd_solve(int argc, char **argv) {
    fields f = {.quantity = "radiosity"};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    int code = options_parse(&verb, argc, argv, &f, &given);
    if (code != OPTIONS_GO) return code;
    if (f.emit.count > 0 && f.emission != NULL)
        return options_usage(verb.name, "give --emit or --emission, not both");
    if (emission_check_items(&f.emit, &error) != LAM_OK) return options_usage(verb.name, "%s", error.message);
    if (f.output != NULL && output_check(f.output, f.reduce.count > 0, &error) != LAM_OK)
        return options_usage(verb.name, "%s", error.message);
    reduction reductions[OPTION_LIST_MAX] = {0};
    for (size_t i = 0; i < f.reduce.count; i++)
        if (reduce_parse(f.reduce.items[i], &reductions[i], &error) != LAM_OK)
            return options_usage(verb.name, "%s", error.message);
    terminal_open(&term, verb.name, false, false);
    const lam_status status = solve(given.arguments[0], &f, reductions, &term, &error);
    for (size_t i = 0; i < f.reduce.count; i++) reduce_free(&reductions[i]);
    return status == LAM_OK ? 0 : terminal_fail(&term, &error);
}
