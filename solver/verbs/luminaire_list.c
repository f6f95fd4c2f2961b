#include "solver/verbs/luminaire_list.h"
#include "solver/verbs/json_print.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The luminaires of a name that dims them together. */
typedef struct group_sum {
    const char *name;
    size_t count;
    double lumens;
} group_sum;

typedef struct list_sums {
    size_t n_groups;
    group_sum *groups; /* as they come in the list */
    double lumens;     /* of all luminaires */
} list_sums;

static int by_name(const void *a, const void *b) {
    const group_sum *first = a, *second = b;
    const int order = strcmp(first->name, second->name);
    return order != 0 ? order : (first->count > second->count) - (first->count < second->count);
}

static int by_place(const void *a, const void *b) {
    const group_sum *first = a, *second = b;
    return (first->count > second->count) - (first->count < second->count);
}

/* Sorts luminaires by group, whose first place stands in count until it is known which are equal. */
static lam_status sum_list(const placed_luminaires *p, const char *path, list_sums *sums, lam_error *error) {
    size_t n = 0;
    group_sum *all = memory_allocate(p->n, sizeof *all, path, error);
    size_t *counts = memory_allocate(p->n, sizeof *counts, path, error);
    if (all == NULL || counts == NULL) {
        free(all);
        free(counts);
        return LAM_ERR_MEMORY;
    }
    for (size_t k = 0; k < p->n; k++) {
        const placed_luminaire *l = &p->luminaires[k];
        const double lumens = placed_lumens(p, l);
        sums->lumens += lumens;
        if (l->group[0] != '\0') all[n++] = (group_sum){l->group, k, lumens};
    }
    qsort(all, n, sizeof *all, by_name);
    for (size_t k = 0; k < n; k++) {
        if (sums->n_groups > 0 && strcmp(all[sums->n_groups - 1].name, all[k].name) == 0)
            all[sums->n_groups - 1].lumens += all[k].lumens;
        else
            all[sums->n_groups++] = all[k];
        counts[all[sums->n_groups - 1].count]++;
    }
    qsort(all, sums->n_groups, sizeof *all, by_place);
    for (size_t g = 0; g < sums->n_groups; g++) all[g].count = counts[all[g].count];
    sums->groups = all;
    free(counts);
    return LAM_OK;
}

static luminaire_shape shape_of(const placed_luminaires *p, const placed_luminaire *l) {
    return l->is_point ? OPENING_POINT : p->files[l->file].photometry.opening.shape;
}

static json_t *vector(const double v[3]) {
    return json_pack("[f, f, f]", v[0] + 0, v[1] + 0, v[2] + 0); /* -0 becomes 0 */
}

static json_t *json_of_luminaire(const placed_luminaires *p, const placed_luminaire *l) {
    const placed_file *f = &p->files[l->file];
    const double *size = f->photometry.opening.size;
    const double aim[3] = {-l->z[0], -l->z[1], -l->z[2]}, none[3] = {0};
    json_t *ignore = json_array();
    for (size_t k = 0; k < l->n_ignored; k++)
        json_array_append_new(ignore, json_string(p->ignored[l->ignored + k].text));
    return json_pack("{s:s, s:o, s:s, s:I, s:o, s:o, s:o, s:o, s:f, s:f, s:f, s:f, s:o, s:{s:s, s:o}, s:o}",
                     "name", l->name, "group", l->group[0] != '\0' ? json_string(l->group) : json_null(),
                     "file", f->name, "lamp_set", (json_int_t)f->photometry.set + 1, "at", vector(l->at),
                     "aim", vector(aim), "c0", vector(l->x), "c90", vector(l->y), "dim", l->dim,
                     "maintenance", l->maintenance, "scale", l->scale, "lumens", placed_lumens(p, l),
                     "colour", vector(l->colour), "opening", "shape", luminaire_shape_name(shape_of(p, l)),
                     "size", vector(l->is_point ? none : size), "ignore", ignore);
}

/* Adds the lines of warnings, of a file where name is not NULL. */
static void add_warnings(json_t *lines, const luminaire_warnings *w, const char *name) {
    const char *mark = name != NULL ? ": " : "";
    if (name == NULL) name = "";
    for (const char *line = w->text; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        json_array_append_new(lines, json_sprintf("%s%s%.*s", name, mark, (int)length, line));
        line += length + (line[length] == '\n');
    }
    if (w->omitted > 0)
        json_array_append_new(
            lines, json_sprintf("%s%s%llu more warnings", name, mark, (unsigned long long)w->omitted));
}

/* All warnings as an array of lines; NULL where memory is short. */
static json_t *json_of_warnings(const placed_luminaires *p) {
    json_t *lines = json_array();
    add_warnings(lines, &p->warnings, NULL);
    for (size_t k = 0; k < p->n_files; k++)
        add_warnings(lines, &p->files[k].photometry.warnings, p->files[k].name);
    return lines;
}

static lam_status print_json(const placed_luminaires *p, const list_sums *sums, const char *path,
                             lam_error *error) {
    json_t *luminaires = json_array(), *files = json_array(), *groups = json_array();
    for (size_t k = 0; k < p->n; k++)
        json_array_append_new(luminaires, json_of_luminaire(p, &p->luminaires[k]));
    for (size_t k = 0; k < p->n_files; k++) {
        const placed_file *f = &p->files[k];
        json_array_append_new(files,
                              json_pack("{s:s, s:s, s:s, s:I, s:f}", "file", f->name, "path", f->path,
                                        "format", luminaire_format_name(f->photometry.format), "lamp_set",
                                        (json_int_t)f->photometry.set + 1, "lumens", f->lumens));
    }
    for (size_t g = 0; g < sums->n_groups; g++)
        json_array_append_new(groups,
                              json_pack("{s:s, s:I, s:f}", "name", sums->groups[g].name, "luminaires",
                                        (json_int_t)sums->groups[g].count, "lumens", sums->groups[g].lumens));
    json_t *about = json_pack("{s:o, s:o, s:o, s:f, s:o}", "luminaires", luminaires, "files", files, "groups",
                              groups, "lumens", sums->lumens, "warnings", json_of_warnings(p));
    const lam_status status = json_print(path, about, 10, error);
    json_decref(about);
    return status;
}

/* A number that rounding left beside 0 is 0. */
static double tidy(double value) {
    return fabs(value) < 5e-7 ? 0 : value;
}

static void print_table(const placed_luminaires *p, const list_sums *sums, const char *path) {
    char place[64], aim[64];
    int names = 4, groups = 5, files = 4;
    for (size_t k = 0; k < p->n; k++) {
        const placed_luminaire *l = &p->luminaires[k];
        names = (int)fmax(names, (double)strlen(l->name));
        groups = (int)fmax(groups, (double)strlen(l->group));
        files = (int)fmax(files, fmin(40, (double)strlen(p->files[l->file].name)));
    }
    printf("%s: %zu luminaire%s of %zu file%s\n\n%-*s  %-*s  %-*s  %-22s  %-22s  %-16s  lumens\n", path, p->n,
           p->n == 1 ? "" : "s", p->n_files, p->n_files == 1 ? "" : "s", names, "name", groups, "group",
           files, "file", "at (m)", "gamma 0 to", "opening");
    for (size_t k = 0; k < p->n; k++) {
        const placed_luminaire *l = &p->luminaires[k];
        snprintf(place, sizeof place, "%.6g %.6g %.6g", tidy(l->at[0]), tidy(l->at[1]), tidy(l->at[2]));
        snprintf(aim, sizeof aim, "%.4g %.4g %.4g", tidy(-l->z[0]), tidy(-l->z[1]), tidy(-l->z[2]));
        printf("%-*s  %-*s  %-*s  %-22s  %-22s  %-16s  %.6g\n", names, l->name, groups, l->group, files,
               p->files[l->file].name, place, aim, luminaire_shape_name(shape_of(p, l)), placed_lumens(p, l));
    }
    putchar('\n');
    for (size_t g = 0; g < sums->n_groups; g++)
        printf("group %-*s  %.6g lm of %zu luminaire%s\n", groups, sums->groups[g].name,
               sums->groups[g].lumens, sums->groups[g].count, sums->groups[g].count == 1 ? "" : "s");
    printf("%-*s  %.6g lm\n", groups + 6, "all", sums->lumens);
}

static void warn(terminal *t, const placed_luminaires *p, const char *path) {
    json_t *lines = json_of_warnings(p);
    for (size_t k = 0; k < json_array_size(lines); k++)
        terminal_warn(t, "%s: %s", path, json_string_value(json_array_get(lines, k)));
    json_decref(lines);
}

lam_status luminaire_list_print(const char *path, const char *assets, bool as_json, terminal *t,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const placed_options options = {.assets = assets};
    placed_luminaires p = {.n = 0};
    list_sums sums = {.n_groups = 0};
    TRY(placed_read(path, &options, &p, error));
    TRY(sum_list(&p, path, &sums, error));
    if (as_json) {
        TRY(print_json(&p, &sums, path, error));
    } else {
        print_table(&p, &sums, path);
        warn(t, &p, path);
    }
done:
    free(sums.groups);
    placed_free(&p);
    return status;
}
