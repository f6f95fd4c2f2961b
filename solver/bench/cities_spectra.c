/* Figure 4.1 of the thesis: why not to factorize a city. */
#include "solver/bench/cities.h"
#include "solver/method/classify.h"
#include "solver/method/low_rank/tsvd.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIZES_MOST = 2, POINTS = 80, EXACT_MOST = 2600, EXACT_MOST_FULL = 9000 };

/* Section 4.2.1: "to get an error of 0.1, the city needs three times more singular values". */
static const double their_ratio = 3;

/* Below it eigenvalues of a Gram matrix in single precision are rounding. */
static const double smallest_value = 2e-3;

/* A falling curve: how large the singular value is that a share of all is above. */
typedef struct fall {
    size_t n;
    double share[POINTS], value[POINTS];
    char label[96];
} fall;

/* All singular values, falling. */
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

/* Points at indices that grow by a factor, 1, 2, 3 ... at first. */
static void fall_of_all(size_t n, const double *values, fall *out) {
    const double factor = pow((double)n, 1. / (POINTS - 1));
    size_t last = 0;
    for (size_t p = 0; p < POINTS; p++) {
        size_t index = (size_t)round(pow(factor, (double)p));
        if (index <= last) continue;
        if (index > n || values[index - 1] < smallest_value) break;
        out->share[out->n] = (double)index / (double)n;
        out->value[out->n++] = values[index - 1];
        last = index;
    }
}

/* From where a count is one of several: the largest few are not told one by one. */
static void fall_of_counts(size_t n, const spectrum *s, fall *out) {
    for (size_t p = 0; p < POINTS; p++) {
        const double value = pow(smallest_value, (double)p / (POINTS - 1));
        const double above = spectrum_above(s, value);
        if (above < 5) continue;
        out->share[out->n] = above / (double)n;
        out->value[out->n++] = value;
    }
}

static size_t count_above(size_t n, const double *values, double x) {
    size_t count = 0;
    while (count < n && values[count] > x) count++;
    return count;
}

/* Its row; of_box are the counts of the Cornell box of as many elements, by all values and by quadrature. */
static void add_row(const char *name, size_t n, double all, double counted, const double of_box[2],
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
    TRY(spectrum_find(&S, CLASSIFY_STEPS, run->seed, run->progress, out, error));
done:
    scaled_free(&S);
    return status;
}

static lam_status measure(const bench_run *run, const lowrank_scene *s, double of_box[2], double theirs,
                          fall *drawn, table *out, lam_error *error) {
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
        fall_of_all(n, values, drawn);
    } else {
        fall_of_counts(n, &found, drawn);
    }
    snprintf(drawn->label, sizeof drawn->label, "%s, %zu elements", s->name, n);
    if (isnan(of_box[1])) {
        of_box[0] = all;
        of_box[1] = counted;
    }
    add_row(s->name, n, all, counted, of_box, theirs, out);
    bench_say(run, "%s, %zu elements: %.0f singular values above .1", s->name, n, counted);
done:
    free(values);
    spectrum_free(&found);
    return status;
}

static lam_status draw(const bench_run *run, const fall *falls, size_t n, lam_error *error) {
    static const double limit[2] = {.1, .1};
    double ends[2] = {1, 0};
    plot_series series[SIZES_MOST * FALL_SCENES + 1];
    for (size_t k = 0; k < n; k++) {
        series[k] = (plot_series){.label = falls[k].label,
                                  .n = falls[k].n,
                                  .x = falls[k].share,
                                  .y = falls[k].value,
                                  .joined = true,
                                  .plain = true};
        for (size_t p = 0; p < falls[k].n; p++) {
            ends[0] = fmin(ends[0], falls[k].share[p]);
            ends[1] = fmax(ends[1], falls[k].share[p]);
        }
    }
    series[n] = (plot_series){.label = ".1", .n = 2, .x = ends, .y = limit, .joined = true, .unmarked = true};
    const plot p = {.name = "singular-values",
                    .title = "Singular values of F (thesis: figure 4.1)",
                    .x_label = "index / n",
                    .y_label = "singular value",
                    .x_log = true,
                    .y_log = true,
                    .series = series,
                    .n_series = n + 1};
    return run->sink->plot(run->sink->context, &p, error);
}

lam_status cities_spectra(const bench_run *run, const lowrank_scene *const *scenes, size_t n_sizes,
                          lam_error *error) {
    static const table_column columns[] = {{"scene", NULL, "cities of reflectance .7"},
                                           {"elements", "", "n"},
                                           {"above", "", "singular values of F above .1, from all of them"},
                                           {"estimate", "", "the same by stochastic Lanczos quadrature"},
                                           {"share", "%", "estimate / n"},
                                           {"ratio", "", "above over that of the Cornell box"},
                                           {"ratio_estimate", "", "estimate over that of the Cornell box"},
                                           {"ratio_theirs", "", "of city 1 (section 4.2.1)"}};
    lam_status status = LAM_OK;
    fall falls[SIZES_MOST * FALL_SCENES] = {{.n = 0}};
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
            TRY(measure(run, scenes[at], of_box, theirs, &falls[at], &out, error));
        }
    }
    TRY(bench_table(run, &out, error));
    TRY(draw(run, falls, n_sizes * FALL_SCENES, error));
done:
    table_free(&out);
    return status;
}
