/* Figure 5.1 of the thesis: sparse or not against of low rank or not, and the kind of operator that suits. */
#include "solver/bench/cities.h"
#include "solver/method/classify.h"

#include <math.h>
#include <string.h>

/* Density of section 5.2.1, in percent: the Cornell box "around 20 %", city 1, of 8,897 elements, "less than
 * 1 %". */
static double their_density(const bench_run *run, const lowrank_scene *s) {
    if (run->scale != BENCH_QUICK && strcmp(s->name, "cornell") == 0) return 20;
    return run->scale == BENCH_FULL && strcmp(s->name, "city 1") == 0 ? 1 : NAN;
}

typedef struct place {
    double density, rank; /* share of n^2; at epsilon .1 over n */
} place;

static lam_status add_scene(const bench_run *run, const lowrank_scene *s, place *at, table *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem problem = lowrank_problem(s);
    const double n = (double)s->m.n;
    const classify_options how = {
        .epsilon = .05, .seed = run->seed, .thorough = true, .progress = run->progress};
    scene_class fine;
    spectrum values = {.nodes = 0};
    TRY(bench_check(run, error));
    TRY(classify_scene(&problem, &how, &fine, error));
    TRY(map_spectrum(run, s, &values, error));
    const double rough = classify_rank(&values, .1);
    *at = (place){.density = fine.density, .rank = rough / n};
    table_text(out, s->name);
    table_number(out, n);
    table_number(out, 100 * fine.density);
    table_number(out, their_density(run, s));
    table_number(out, spectrum_above(&values, .5));
    table_number(out, spectrum_above(&values, .1));
    table_number(out, rough);
    table_number(out, fine.rank);
    table_number(out, 100 * fine.rank / n);
    table_number(out, fine.tail);
    table_text(out, fine.method);
    table_number(out, strcmp(fine.method, "sparse") == 0 ? fine.threshold : NAN);
    table_text(out, fine.reason);
    bench_say(run, "%s, %zu elements: %s", s->name, s->m.n, fine.reason);
done:
    spectrum_free(&values);
    return status;
}

static lam_status draw(const bench_run *run, const lowrank_scene *scenes, const place places[MAP_SCENES],
                       lam_error *error) {
    plot_series series[MAP_SCENES];
    for (size_t k = 0; k < MAP_SCENES; k++)
        series[k] = (plot_series){
            .label = scenes[k].name, .n = 1, .x = &places[k].density, .y = &places[k].rank, .named = true};
    const plot p = {.name = "map",
                    .title = "Sparse (left) and of low rank (below) (thesis: figure 5.1)",
                    .x_label = "density of F",
                    .y_label = "rank at epsilon .1, over n",
                    .x_log = true,
                    .series = series,
                    .n_series = MAP_SCENES};
    return run->sink->plot(run->sink->context, &p, error);
}

lam_status cities_map(const bench_run *run, const lowrank_scene *scenes, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "as lambert generate makes it; cities of reflectance .7"},
        {"elements", "", "n"},
        {"density", "%", "of F, pair by pair"},
        {"density_theirs", "%",
         "section 5.2.1: the Cornell box around 20 %, city 1 of 8,897 elements less than 1 %"},
        {"above_.5", "", "singular values of F above .5, estimate"},
        {"above_.1", "", "above .1"},
        {"rank_.1", "", "estimate of the rank that a factorization of epsilon .1 has"},
        {"rank_.05", "", "the same at .05"},
        {"share_.05", "%", "rank_.05 / n"},
        {"tail", "", "what epsilon .05 leaves out, |S - S_k|_F / |S|_F"},
        {"kind", NULL, "of operator that suits it at epsilon .05, as classify_scene finds"},
        {"threshold", "", "of a sparse inverse where that suits"},
        {"reason", NULL, "why"}};
    lam_status status = LAM_OK;
    place places[MAP_SCENES];
    table out = {.name = "map",
                 .title = "Density and rank of scenes (figure 5.1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < MAP_SCENES; k++) TRY(add_scene(run, &scenes[k], &places[k], &out, error));
    TRY(bench_table(run, &out, error));
    TRY(draw(run, scenes, places, error));
done:
    table_free(&out);
    return status;
}
