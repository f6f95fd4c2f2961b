/* Figures 3.3 to 3.5 of the thesis: time against levels, with and without Z-order, and rank against elements.
 */
#include "solver/bench/lowrank.h"

#include <math.h>
#include <stdio.h>

enum { LEVELS_MOST = 9, EPSILONS = 4, SIZES_MOST = 4, MANY = 5000 };

static const double epsilons[EPSILONS] = {.1, .05, .02, .01};
static const char *const epsilon_labels[EPSILONS] = {"epsilon .1", "epsilon .05", "epsilon .02",
                                                     "epsilon .01"};

/* One line of a plot. */
typedef struct line {
    size_t n;
    double x[LEVELS_MOST + 1], y[LEVELS_MOST + 1];
} line;

static lam_status draw(const bench_run *run, const char *name, const char *title, const char *x_label,
                       const char *y_label, bool x_log, const line *lines, const char *const *labels,
                       size_t n, lam_error *error) {
    plot_series series[PLOT_SERIES_MOST];
    for (size_t k = 0; k < n; k++)
        series[k] = (plot_series){
            .label = labels[k], .n = lines[k].n, .x = lines[k].x, .y = lines[k].y, .joined = true};
    const plot p = {.name = name,
                    .title = title,
                    .x_label = x_label,
                    .y_label = y_label,
                    .x_log = x_log,
                    .y_log = true,
                    .series = series,
                    .n_series = n};
    return run->sink->plot(run->sink->context, &p, error);
}

/* Levels whose leaves have between 32 and 2,560 columns. */
static bool is_tried(size_t n, int levels) {
    return n >> levels >= 32 && n >> levels <= 2560;
}

static lam_status levels_of_scene(const bench_run *run, const lowrank_scene *s, table *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    line lines[EPSILONS + 1] = {{.n = 0}};
    const char *labels[EPSILONS + 1];
    char name[64], title[128];
    for (int e = 0; e <= EPSILONS; e++) {
        const bool z = e < EPSILONS;
        labels[e] = z ? epsilon_labels[e] : "epsilon .1, without Z-order";
        for (int levels = 0; levels <= LEVELS_MOST; levels++) {
            factorizer_options how = lowrank_options(run, z ? epsilons[e] : .1, 0);
            lowrank_result r;
            if (!is_tried(s->m.n, levels)) continue;
            how.levels = levels;
            TRY(lowrank_factorize(run, s, "hf", &how, z, 1, &r, error));
            table_number(out, (double)s->m.n);
            table_number(out, how.epsilon);
            table_text(out, z ? "z" : "mesh");
            table_number(out, levels);
            table_number(out, r.seconds);
            table_number(out, (double)r.rank);
            table_number(out, r.real);
            lines[e].x[lines[e].n] = levels;
            lines[e].y[lines[e].n++] = r.seconds;
        }
    }
    snprintf(name, sizeof name, "levels-%zu", s->m.n);
    snprintf(title, sizeof title, "Open room of %zu elements: time by levels", s->m.n);
    TRY(draw(run, name, title, "levels", "factorization, seconds", false, lines, labels, EPSILONS + 1,
             error));
done:
    return status;
}

lam_status lowrank_of_levels(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                             lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"epsilon", "", "bound"},
        {"order", NULL, "of the columns"},
        {"levels", "", "of the tree"},
        {"seconds", "s", "of the factorization"},
        {"rank", "", "k"},
        {"real", "", "|S - Q V^T|_2"},
    };
    lam_status status = LAM_OK;
    table out = {.name = "levels",
                 .title = "Time by levels (thesis: figures 3.3 and 3.4)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns};
    for (size_t i = 0; i < n; i++) /* many elements take minutes with too few levels */
        if (run->scale == BENCH_FULL || scenes[i]->m.n <= MANY)
            TRY(levels_of_scene(run, scenes[i], &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

lam_status lowrank_of_rank(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                           lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"epsilon", "", "bound"},
        {"rank", "", "k of hf"},
        {"real", "", "|S - Q V^T|_2"},
        {"thesis_rank", "", "as published, where it gives one (real error .05 at epsilon .1)"},
    };
    static const double theirs[][2] = {{2560, 416}, {10240, 877}, {40960, 1791}, {163840, 3990}};
    lam_status status = LAM_OK;
    line lines[EPSILONS] = {{.n = 0}};
    table out = {.name = "rank",
                 .title = "Rank by elements (thesis: figure 3.5)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t i = 0; i < n; i++)
        for (int e = 0; e < EPSILONS; e++) {
            const factorizer_options how = lowrank_options(run, epsilons[e], 0);
            lowrank_result r;
            double published = NAN;
            /* What is below the noise of the rays is noise. */
            if (epsilons[e] < 2 * recipe_noise(&scenes[i]->f.recipe)) continue;
            TRY(lowrank_factorize(run, scenes[i], "hf", &how, true, 1, &r, error));
            for (size_t t = 0; e == 0 && t < sizeof theirs / sizeof *theirs; t++)
                if (theirs[t][0] == (double)scenes[i]->m.n) published = theirs[t][1];
            table_number(&out, (double)scenes[i]->m.n);
            table_number(&out, epsilons[e]);
            table_number(&out, (double)r.rank);
            table_number(&out, r.real);
            table_number(&out, published);
            lines[e].x[lines[e].n] = (double)scenes[i]->m.n;
            lines[e].y[lines[e].n++] = (double)r.rank;
        }
    TRY(bench_table(run, &out, error));
    TRY(draw(run, "rank", "Open room: rank by elements", "elements", "rank", true, lines, epsilon_labels,
             EPSILONS, error));
done:
    table_free(&out);
    return status;
}
