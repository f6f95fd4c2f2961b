/* Figures 4.1 and 5.1 of the thesis: how singular values fall, density against rank, and the scenes of both.
 */
#include "solver/method/choice.h"
#include "solver/method/low_rank/tsvd.h"
#include "tests/bench/suites/cities.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Density of section 5.2.1, in percent: the Cornell box "around 20 %", city 1, of 8,897 elements, "less than
 * 1 %". */
static double their_density(const bench_run *run, const lowrank_scene *s) {
    if (run->scale != BENCH_QUICK && strcmp(s->name, "cornell") == 0) return 20;
    return run->scale == BENCH_FULL && strcmp(s->name, "city 1") == 0 ? 1 : NAN;
}

static lam_status add_place(const bench_run *run, const lowrank_scene *s, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem problem = lowrank_problem(s);
    const double n = (double)s->m.n;
    build_options how = build_presets("auto");
    decision fine = {.n_candidates = 0};
    spectrum values = {.nodes = 0};
    TRY(bench_check(run, error));
    how.seed = run->seed;
    how.progress = run->progress;
    TRY(choose_method(&problem, &how, true, &fine, error));
    const double rank = decision_figure(&fine, "rank", "estimate", NAN);
    const candidate *low_rank = decision_find(&fine, "low-rank");
    TRY(map_spectrum(run, s, &values, error));
    const double rough = spectrum_rank(&values, .1);
    table_text(out, s->name);
    table_number(out, n);
    table_number(out, 100 * fine.density);
    table_number(out, their_density(run, s));
    table_number(out, spectrum_above(&values, .5));
    table_number(out, spectrum_above(&values, .1));
    table_number(out, rough);
    table_number(out, rank);
    table_number(out, 100 * rank / n);
    table_number(out, low_rank != NULL ? low_rank->left : NAN);
    table_text(out, fine.taken->method->name);
    table_number(out, strcmp(fine.taken->method->name, "sparse") == 0
                          ? decision_figure(&fine, "sparse", "threshold", NAN)
                          : NAN);
    table_text(out, fine.reason);
    bench_say(run, "%s, %zu elements: %s", s->name, s->m.n, fine.reason);
done:
    decision_free(&fine);
    spectrum_free(&values);
    return status;
}

lam_status cities_map(const bench_run *run, const lowrank_scene *scenes, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "kind of lambert generate; cities have reflectance .7"},
        {"elements", "", "n"},
        {"density", "%", "density of F, pair by pair"},
        {"density_theirs", "%",
         "section 5.2.1: the Cornell box around 20 %, city 1 of 8,897 elements less than 1 %"},
        {"above_.5", "", "singular values of F above .5, estimate"},
        {"above_.1", "", "above .1"},
        {"rank_.1", "", "estimate of the rank that a factorization of epsilon .1 has"},
        {"rank_.05", "", "estimate of the rank at epsilon .05"},
        {"share_.05", "%", "rank_.05 / n"},
        {"tail", "", "|S - S_k|_F / |S|_F at epsilon .05"},
        {"kind", NULL, "kind of operator that suits the scene at epsilon .05"},
        {"threshold", "", "threshold of a sparse inverse where that suits"},
        {"reason", NULL, "reason for that kind"}};
    lam_status status = LAM_OK;
    table out = {.name = "map",
                 .title = "Density and rank of scenes (figure 5.1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < MAP_SCENES; k++) TRY(add_place(run, &scenes[k], &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

enum { POINTS = 80, EXACT_MOST = 2600, EXACT_MOST_FULL = 9000 };

/* Section 4.2.1: "to get an error of 0.1, the city needs three times more singular values". */
static const double their_ratio = 3;

/* Smaller singular values, as roots of the eigenvalues of a Gram matrix in single precision, are rounding
 * errors. */
static const double smallest_value = 2e-3;

/* A point of a falling curve: a share of all singular values is at least that large. */
static void add_point(const lowrank_scene *s, double share, double value, table *curves) {
    table_text(curves, s->name);
    table_number(curves, (double)s->m.n);
    table_number(curves, share);
    table_number(curves, value);
}

/* All singular values in descending order. */
static lam_status find_all(const lowrank_scene *s, double *values, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n;
    row_source rows;
    scaled_matrix S = {0};
    sparse_block whole = {0};
    row_source_of_csr(&rows, &s->f.F);
    TRY(scaled_init(&S, &rows, s->m.area, s->z_order, error));
    TRY(scaled_block(&S, 0, n, &whole, error));
    TRY(tsvd_values(&whole, n, values, error));
    for (size_t k = 0; k < n / 2; k++) {
        const double small = values[k];
        values[k] = values[n - 1 - k];
        values[n - 1 - k] = small;
    }
    for (size_t k = 0; k < n; k++) values[k] = sqrt(fmax(0, values[k]));
done:
    sparse_block_free(&whole);
    scaled_free(&S);
    return status;
}

/* Points at indices that grow geometrically, from 1. */
static void fall_of_all(const lowrank_scene *s, const double *values, table *curves) {
    const size_t n = s->m.n;
    const double factor = pow((double)n, 1. / (POINTS - 1));
    size_t last = 0;
    for (size_t p = 0; p < POINTS; p++) {
        size_t index = (size_t)round(pow(factor, (double)p));
        if (index <= last) continue;
        if (index > n || values[index - 1] < smallest_value) break;
        add_point(s, (double)index / (double)n, values[index - 1], curves);
        last = index;
    }
}

/* Points at singular values that fall geometrically. The estimated counts begin at 5, as they do not resolve
 * the largest few. */
static void fall_of_counts(const lowrank_scene *s, const spectrum *found, table *curves) {
    for (size_t p = 0; p < POINTS; p++) {
        const double value = pow(smallest_value, (double)p / (POINTS - 1));
        const double above = spectrum_above(found, value);
        if (above >= 5) add_point(s, above / (double)s->m.n, value, curves);
    }
}

static size_t count_above(size_t n, const double *values, double x) {
    size_t count = 0;
    while (count < n && values[count] > x) count++;
    return count;
}

/* The row of a scene; of_box are the counts of the Cornell box of about as many elements, from all singular
 * values and by quadrature. */
static void add_count(const char *name, size_t n, double all, double counted, const double of_box[2],
                      double theirs, table *out) {
    table_text(out, name);
    table_number(out, (double)n);
    table_number(out, all);
    table_number(out, counted);
    table_number(out, 100 * counted / (double)n);
    table_number(out, all / of_box[0]);
    table_number(out, counted / of_box[1]);
    table_number(out, theirs);
}

lam_status map_spectrum(const bench_run *run, const lowrank_scene *s, spectrum *out, lam_error *error) {
    lam_status status = LAM_OK;
    row_source rows;
    scaled_matrix S = {0};
    row_source_of_csr(&rows, &s->f.F);
    TRY(scaled_init(&S, &rows, s->m.area, s->z_order, error));
    TRY(spectrum_find(&S, SPECTRUM_STEPS, run->seed, run->progress, out, error));
done:
    scaled_free(&S);
    return status;
}

static lam_status measure(const bench_run *run, const lowrank_scene *s, double of_box[2], double theirs,
                          table *out, table *curves, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n, exact_most = run->scale == BENCH_FULL ? EXACT_MOST_FULL : EXACT_MOST;
    spectrum found = {.nodes = 0};
    double *values = NULL, all = NAN;
    TRY(bench_check(run, error));
    TRY(map_spectrum(run, s, &found, error));
    const double counted = spectrum_above(&found, .1);
    if (n <= exact_most) {
        values = memory_allocate(n, sizeof *values, "singular values", error);
        if (values == NULL) TRY(LAM_ERR_MEMORY);
        TRY(find_all(s, values, error));
        all = (double)count_above(n, values, .1);
        fall_of_all(s, values, curves);
    } else {
        fall_of_counts(s, &found, curves);
    }
    if (isnan(of_box[1])) {
        of_box[0] = all;
        of_box[1] = counted;
    }
    add_count(s->name, n, all, counted, of_box, theirs, out);
    bench_say(run, "%s, %zu elements: %.0f singular values above .1", s->name, n, counted);
done:
    free(values);
    spectrum_free(&found);
    return status;
}

lam_status cities_spectra(const bench_run *run, const lowrank_scene *const *scenes, size_t n_sizes,
                          lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "cities of reflectance .7"},
        {"elements", "", "n"},
        {"above", "", "singular values of F above .1, from all of them"},
        {"estimate", "", "estimate of above by stochastic Lanczos quadrature"},
        {"share", "%", "estimate / n"},
        {"ratio", "", "above over above of the Cornell box"},
        {"ratio_estimate", "", "estimate over estimate of the Cornell box"},
        {"ratio_theirs", "", "the thesis on city 1 (section 4.2.1)"}};
    static const table_column curve_columns[] = {{"scene", NULL, "cities of reflectance .7"},
                                                 {"elements", "", "n"},
                                                 {"share", "", "index of the singular value over n"},
                                                 {"value", "", "singular value of F"}};
    lam_status status = LAM_OK;
    table curves = {.name = "singular-values-curves",
                    .title = "Singular values of F (figure 4.1)",
                    .columns = curve_columns,
                    .n_columns = sizeof curve_columns / sizeof *curve_columns};
    table out = {.name = "singular-values",
                 .title = "Singular values of F above .1 (figure 4.1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t size = 0; size < n_sizes; size++) {
        double of_box[2] = {NAN, NAN};
        for (size_t k = 0; k < FALL_SCENES; k++) {
            const size_t at = size * FALL_SCENES + k;
            const double theirs = k == 1 && run->scale != BENCH_QUICK ? their_ratio : NAN;
            TRY(measure(run, scenes[at], of_box, theirs, &out, &curves, error));
        }
    }
    TRY(bench_table(run, &out, error));
    TRY(bench_table(run, &curves, error));
done:
    table_free(&out);
    table_free(&curves);
    return status;
}

/* City 1 and the Cornell box, two scenes with the properties of the other two of the thesis, and more. */
const char *const map_scenes[MAP_SCENES] = {"city 1", "rooms", "anechoic", "cornell", "city 2",
                                            "city 3", "patio", "atrium",   "maze",    "canopy"};

/* The scenes of figure 4.1, as indices into map_scenes. */
static const size_t fall_scenes[FALL_SCENES] = {3, 0, 4, 5, 1, 2};

/* In a quick run form factors pair by pair would take most of the time. */
enum { RAYS_QUICK = 1024 };

typedef struct figure_scenes {
    lowrank_scene map[MAP_SCENES];
    lowrank_scene other[FALL_SCENES]; /* the scenes of figure 4.1, larger or smaller */
} figure_scenes;

static void scenes_free(figure_scenes *s) {
    if (s == NULL) return;
    for (size_t k = 0; k < MAP_SCENES; k++) lowrank_scene_free(&s->map[k]);
    for (size_t k = 0; k < FALL_SCENES; k++) lowrank_scene_free(&s->other[k]);
    free(s);
}

lam_status map_scene_open(const bench_run *run, const char *name, size_t elements, lowrank_scene *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    const bool is_city = strncmp(name, "city ", 5) == 0;
    const generate_options kind = {.kind = is_city ? "city" : name,
                                   .variant = is_city ? (unsigned)(name[5] - '0') : 0,
                                   .terrain = "flat",
                                   .elements = elements,
                                   .reflectance = is_city ? .7 : -1,
                                   .seed = 1};
    TRY(bench_check(run, error));
    TRY(scene_generated(&kind, &m, error));
    const recipe how =
        run->scale == BENCH_QUICK ? formfactors_rays(RAYS_QUICK, run->seed) : lowrank_recipe(run, m.n);
    TRY(lowrank_open(run, name, &m, &how, out, error));
done:
    mesh_free(&m);
    return status;
}

lam_status cities_figures(const bench_run *run, lam_error *error) {
    /* elements of the scenes of figure 5.1, and of the second size of figure 4.1 */
    static const size_t elements[][2] = {
        [BENCH_QUICK] = {600, 0}, [BENCH_DEFAULT] = {2500, 8897}, [BENCH_FULL] = {8897, 2500}};
    lam_status status = LAM_OK;
    const size_t *const n = elements[run->scale];
    const size_t n_sizes = n[1] > 0 ? 2 : 1;
    const lowrank_scene *fall[2 * FALL_SCENES];
    figure_scenes *s = memory_allocate(1, sizeof *s, "scenes", error);
    if (s == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < MAP_SCENES; k++) TRY(map_scene_open(run, map_scenes[k], n[0], &s->map[k], error));
    for (size_t k = 0; k < FALL_SCENES; k++) {
        fall[k] = &s->map[fall_scenes[k]];
        fall[FALL_SCENES + k] = &s->other[k];
        if (n_sizes > 1) TRY(map_scene_open(run, map_scenes[fall_scenes[k]], n[1], &s->other[k], error));
    }
    TRY(cities_map(run, s->map, error));
    TRY(cities_kinds(run, s->map, error));
    TRY(cities_spectra(run, fall, n_sizes, error));
    const lowrank_scene *const *const large = n[1] > n[0] ? fall + FALL_SCENES : fall;
    const lowrank_scene *const distributed[2] = {large[1], large[3]};
    TRY(cities_distribution(run, distributed, error));
done:
    scenes_free(s);
    return status;
}
