/* Figure 4.4 of the thesis: most elements of M = (I - R F)^-1 are small, and they are smaller in darker
 * cities. */
#include "solver/method/many_lights.h"
#include "tests/bench/suites/cities.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    CITIES = 2,
    REFLECTANCES = 5,
    COLUMNS = 512,
    COLUMNS_QUICK = 64,
    AT_ONCE = 256,
    BINS = 72,
    BINS_A_DECADE = 6,
    SWEEPS = 48
};

static const unsigned variants[CITIES] = {1, 3};
static const float reflectances[REFLECTANCES] = {.1f, .3f, .5f, .7f, .9f};

/* Section 4.3.2: the share of elements above 1e-5 "for R <= .7", in percent; the most is that of .7. */
static const double their_share[CITIES] = {3, 10};

static const double lowest = 1e-12; /* of the bins: 12 decades up to 1 */

/* A cumulative histogram: all elements counted, and those above lowest 10^(bin / BINS_A_DECADE). */
typedef struct tally {
    double all, above[BINS + 1];
    double shares, squares, columns; /* of each column above 1e-5, for the standard error */
} tally;

static double bin_value(size_t bin) {
    return lowest * pow(10, (double)bin / BINS_A_DECADE);
}

static double share_above(const tally *t, double x) {
    const size_t bin = (size_t)round(BINS_A_DECADE * log10(x / lowest));
    return t->above[bin] / t->all;
}

static void tally_column(size_t n, const float *column, tally *t) {
    double count = 0;
    for (size_t i = 0; i < n; i++) {
        const double x = (double)column[i];
        const double bin = x > 0 ? ceil(BINS_A_DECADE * log10(x / lowest)) - 1 : -1;
        for (size_t b = 0; b <= BINS && (double)b <= bin; b++) t->above[b]++;
        count += x > 1e-5;
    }
    const double share = count / (double)n;
    t->all += (double)n;
    t->shares += share;
    t->squares += share * share;
    t->columns++;
}

/* Tallies columns of M that are spread over the city. Jacobi sweeps from the identity add nonnegative numbers
 * only, so that small elements are as exact as large ones. E holds the unit vectors. */
static lam_status look_at(const bench_run *run, const lowrank_scene *s, float reflectance, size_t count,
                          tally *t, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n;
    float *rho = memory_allocate(n, sizeof *rho, "reflectances", error);
    float *E = memory_allocate(AT_ONCE, n * sizeof *E, "columns of M", error);
    float *T = memory_allocate(AT_ONCE, n * sizeof *T, "columns of M", error);
    if (rho == NULL || E == NULL || T == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) rho[i] = reflectance;
    for (size_t first = 0; first < count; first += AT_ONCE) {
        const size_t m = count - first < AT_ONCE ? count - first : AT_ONCE;
        const many_lights_input unit = {.n = n,
                                        .F = &s->f.F,
                                        .area = s->m.area,
                                        .rho = rho,
                                        .m = m,
                                        .E = E,
                                        .progress = run->progress,
                                        .stage = "columns of M"};
        for (size_t v = 0; v < m; v++) E[v * n + s->z_order[(first + v) * n / count]] = 1;
        TRY(many_lights_jacobi(&unit, SWEEPS, T, error));
        for (size_t v = 0; v < m; v++) {
            const size_t one = v * n + s->z_order[(first + v) * n / count];
            T[one] += E[one]; /* M = I + (M - I) */
            E[one] = 0;
            tally_column(n, T + v * n, t);
        }
    }
done:
    free(rho);
    free(E);
    free(T);
    return status;
}

static void add_row(unsigned variant, size_t n, float reflectance, const tally *t, double theirs,
                    table *out) {
    const double mean = t->shares / t->columns;
    const double variance = fmax(0, t->squares / t->columns - mean * mean);
    table_number(out, variant);
    table_number(out, (double)n);
    table_number(out, round(1e3 * (double)reflectance) / 1e3);
    table_number(out, t->columns);
    table_number(out, 100 * share_above(t, 1e-3));
    table_number(out, 100 * share_above(t, 1e-4));
    table_number(out, 100 * mean);
    table_number(out, 100 * sqrt(variance / t->columns));
    table_number(out, theirs);
    table_number(out, 100 * share_above(t, 1e-6));
    table_number(out, 100 * share_above(t, 1e-7));
}

static void add_curve(unsigned variant, size_t n, float reflectance, const tally *t, table *curves) {
    for (size_t bin = 0; bin <= BINS; bin++) {
        table_number(curves, variant);
        table_number(curves, (double)n);
        table_number(curves, round(1e3 * (double)reflectance) / 1e3);
        table_number(curves, bin_value(bin));
        table_number(curves, 100 * t->above[bin] / t->all);
    }
}

static lam_status add_city(const bench_run *run, const lowrank_scene *s, size_t k, table *out, table *curves,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const bool quick = run->scale == BENCH_QUICK;
    const size_t n = s->m.n, wanted = quick ? COLUMNS_QUICK : run->scale == BENCH_FULL ? n : COLUMNS;
    const size_t count = wanted < n ? wanted : n;
    for (size_t r = 0; r < REFLECTANCES; r++) {
        tally t = {.all = 0};
        TRY(look_at(run, s, reflectances[r], count, &t, error));
        const bool told = !quick && reflectances[r] > .6f && reflectances[r] < .8f;
        add_row(variants[k], n, reflectances[r], &t, told ? their_share[k] : NAN, out);
        add_curve(variants[k], n, reflectances[r], &t, curves);
    }
done:
    return status;
}

lam_status cities_distribution(const bench_run *run, const lowrank_scene *const scenes[2], lam_error *error) {
    static const table_column columns[] = {
        {"city", "", "1: flat houses, 3: with skyscrapers"},
        {"elements", "", "n"},
        {"reflectance", "", "R, of all elements"},
        {"columns", "", "columns of M in the sample"},
        {"above_1e-3", "%", "elements of M greater than 1e-3"},
        {"above_1e-4", "%", "greater than 1e-4"},
        {"above_1e-5", "%", "greater than 1e-5"},
        {"deviation", "%", "standard error of above_1e-5, as only a sample of the columns was computed"},
        {"theirs", "%", "section 4.3.2: share greater than 1e-5 for R <= .7, which is largest at .7"},
        {"above_1e-6", "%", "greater than 1e-6"},
        {"above_1e-7", "%", "greater than 1e-7"}};
    static const table_column curve_columns[] = {{"city", "", "1: flat houses, 3: with skyscrapers"},
                                                 {"elements", "", "n"},
                                                 {"reflectance", "", "R, of all elements"},
                                                 {"x", "", "size of an element of M"},
                                                 {"above", "%", "elements of M greater than x"}};
    lam_status status = LAM_OK;
    table curves = {.name = "distribution-curves",
                    .title = "Elements of M by size (figure 4.4)",
                    .columns = curve_columns,
                    .n_columns = sizeof curve_columns / sizeof *curve_columns};
    table out = {.name = "distribution",
                 .title = "Elements of M by size (figure 4.4)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < CITIES; k++) TRY(add_city(run, scenes[k], k, &out, &curves, error));
    TRY(bench_table(run, &out, error));
    TRY(bench_table(run, &curves, error));
done:
    table_free(&curves);
    table_free(&out);
    return status;
}
