/* A solution as a table on standard output: one line a group, or one a figure. */
#include "solver/output/output.h"

#include <stdlib.h>
#include <string.h>

enum { NARROWEST = 14 };

/* The width of the column of a vector and channel, under its name. */
static int column_width(const solution *s, size_t column) {
    char name[OUTPUT_COLUMN];
    output_column(s, column / s->m->n_channels, column % s->m->n_channels, name);
    return strlen(name) > NARROWEST ? (int)strlen(name) : NARROWEST;
}

static void print_columns(const solution *s, const char *first) {
    char name[OUTPUT_COLUMN];
    fputs(first, stdout);
    for (size_t k = 0; k < s->n_vectors * s->m->n_channels; k++) {
        output_column(s, k / s->m->n_channels, k % s->m->n_channels, name);
        printf(" %*s", NARROWEST, name);
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
            output_figures(s, inside, k, figures);
            printf(" %*.6g", column_width(s, k), figures[REDUCE_MEAN]);
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
                output_figures(s, s->reductions[r].inside, column, figures);
                printf(" %*.6g", column_width(s, column), figures[k]);
            }
            putchar('\n');
        }
}

lam_status output_print(const solution *s, lam_error *error) {
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
