/* A solution as a table on standard output: one line a group, or one a figure. */
#include "solver/output/output.h"

#include <math.h>
#include <string.h>

enum { NARROWEST = 14 };

/* "irradiance, lx": the name of the column of a vector and channel, with its unit. */
enum { COLUMN = OUTPUT_COLUMN + 16 };
static void column_name(const solution *s, size_t column, char name[COLUMN]) {
    const size_t v = column / s->m->n_channels;
    output_column(s, v, column % s->m->n_channels, name);
    const size_t length = strlen(name);
    const char *unit = output_unit(s, v);
    if (unit[0] != '\0') snprintf(name + length, COLUMN - length, ", %s", unit);
}

/* The width of the column of a vector and channel, under its name. */
static int column_width(const solution *s, size_t column) {
    char name[COLUMN];
    column_name(s, column, name);
    return strlen(name) > NARROWEST ? (int)strlen(name) : NARROWEST;
}

static void print_columns(const solution *s, const char *first) {
    char name[COLUMN];
    fputs(first, stdout);
    for (size_t k = 0; k < s->n_vectors * s->m->n_channels; k++) {
        column_name(s, k, name);
        printf(" %*s", NARROWEST, name);
    }
    putchar('\n');
}

/* A figure of nothing has no value. */
static void print_figure(int width, double value) {
    if (isnan(value))
        printf(" %*s", width, "-");
    else
        printf(" %*.6g", width, value);
}

static void print_means(const solution *s) {
    const mesh *m = s->m;
    print_columns(s, "group                    elements   area, m2");
    for (uint32_t g = 0; g < m->n_groups; g++) {
        group_extent counted, buried;
        group_index_extent(s->groups, g, m->area, &counted, &buried);
        printf("%-24s %8zu %10.4g", m->group_names[g], counted.elements, counted.area);
        for (size_t k = 0; k < s->n_vectors * m->n_channels; k++) {
            double figures[REDUCE_COUNT];
            const reduce_values x = {.floats = s->values != NULL ? s->values + k * m->n : NULL,
                                     .doubles = s->refined != NULL ? s->refined + k * m->n : NULL};
            reduce_groups(1, &g, s->groups, m->area, x, figures);
            print_figure(column_width(s, k), figures[REDUCE_MEAN]);
        }
        putchar('\n');
    }
}

/* A face without an element has no value. */
static void print_faces(const solution *s) {
    const size_t n = output_width(s);
    print_columns(s, "face       group                      area, m2");
    for (size_t f = 0; f < n; f++) {
        double area;
        const char *group = output_face_group(s, f, &area);
        printf("%-10zu %-24s %10.4g", f, group != NULL ? group : "-", area);
        for (size_t k = 0; k < s->n_vectors * s->m->n_channels; k++) {
            const double value = output_value(s, k * n + f);
            if (isnan(value))
                printf(" %*s", column_width(s, k), "-");
            else
                printf(" %*.6g", column_width(s, k), value);
        }
        putchar('\n');
    }
}

static void print_reductions(const solution *s) {
    print_columns(s, "group                    figure    ");
    for (size_t r = 0; r < s->n_reductions; r++) {
        const reduction *of = &s->reductions[r];
        for (size_t k = 0; k < of->request.n_with; k++) {
            printf("%-24s %-10s", of->group, reduce_statistic_name(of->request.with[k]));
            for (size_t column = 0; column < s->n_vectors * s->m->n_channels; column++)
                print_figure(column_width(s, column), output_figure(s, of, k, column));
            putchar('\n');
        }
    }
}

/* Elements that lie below bodies, of the groups printed: figures leave them out. */
static void print_buried(const solution *s) {
    const char *before = "figures leave out ";
    if (s->groups->buried == NULL || s->faces != NULL) return;
    for (uint32_t g = 0; g < s->m->n_groups; g++) {
        group_extent counted, buried;
        bool is_printed = s->n_reductions == 0;
        for (size_t r = 0; r < s->n_reductions; r++)
            for (size_t k = 0; k < s->reductions[r].request.names[0].n_groups; k++)
                is_printed = is_printed || s->reductions[r].request.names[0].groups[k] == g;
        group_index_extent(s->groups, g, s->m->area, &counted, &buried);
        if (!is_printed || buried.elements == 0) continue;
        printf("%s%zu element%s of %s, %.4g m2", before, buried.elements, buried.elements == 1 ? "" : "s",
               s->m->group_names[g], buried.area);
        before = "; ";
    }
    if (before[0] == ';') puts(", below bodies that stand on them");
}

/* Names that are reduced and that no light reaches: their errors are shares of nothing. */
static void print_dark_names(const solution *s) {
    size_t n = 0;
    for (size_t r = 0; s->name_errors != NULL && r < s->n_reductions; r++) {
        if (headline_has_light(&s->name_errors[r].parts)) continue;
        printf("%s%s", n++ == 0 ? "no error is stated of " : ", ", s->reductions[r].group);
    }
    if (n > 0) puts(", which no light reaches");
}

void output_print_error(const solution *s) {
    const bool own = s->error_light != NULL && strcmp(s->error_light, "own") == 0;
    char text[HEADLINE_BYTES];
    if (!s->head.known && s->head.advice == NULL) return;
    if (!s->head.known) {
        printf("no error is stated: %s\n", s->head.advice);
        return;
    }
    if (!headline_has_light(&s->head.parts)) {
        puts("no error is stated: no light reaches what is asked for, so that it is no share of it");
        return;
    }
    headline_text(&s->head, text);
    printf("stated error of %s%s%s%s%s", own ? "this answer" : "the store",
           s->error_of != NULL ? ", of the light of " : "", s->error_of != NULL ? s->error_of : "",
           s->error_from != NULL ? ", emitted by " : "", s->error_from != NULL ? s->error_from : "");
    if (own) printf(", %.3g emitters", s->emitters);
    printf(": %s\n", text);
    print_dark_names(s);
    if (!s->tells_parts) return;
    headline_text_parts(&s->head, text);
    printf("parts: %s; operator and form factors: relative %.3g", text, s->relative);
    if (isfinite(s->indirect)) /* or it would be divided by light that is 0 */
        printf(", indirect %.3g\n", s->indirect);
    else
        puts(", no light is reflected there");
}

void output_print(const solution *s) {
    if (s->n_reductions > 0)
        print_reductions(s);
    else if (s->faces != NULL)
        print_faces(s);
    else
        print_means(s);
    print_buried(s);
    output_print_error(s);
}
