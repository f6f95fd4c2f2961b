/* Tables 3.1 to 3.7 and figures 3.3 to 3.5 of the thesis row by row, its figures beside ours. */
#include "tests/bench/suites/lowrank.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { REPEATS = 3 };

/* A figure that the thesis does not give. */
static const double none = NAN;

lam_status lowrank_of_alpha(const bench_run *run, const lowrank_scene *s, lam_error *error) {
    static const table_column columns[] = {
        {"alpha", "", "share of the bound that the root may take"},
        {"seconds", "s", "of the factorization"},
        {"rank", "", "k"},
        {"real", "", "|S - Q V^T|_2"},
        {"thesis_seconds", "s", "as published (2,560 elements, an i7)"},
        {"thesis_rank", "", "as published"},
        {"thesis_real", "", "as published"},
    };
    static const double theirs[9][3] = {{.768, 641, .0214}, {.568, 585, .0204}, {.600, 535, .0301},
                                        {.619, 462, .0401}, {.645, 416, .0500}, {.704, 392, .0595},
                                        {.815, 373, .0696}, {1.01, 357, .0800}, {1.27, 344, .0892}};
    lam_status status = LAM_OK;
    table out = {.name = "alpha",
                 .title = "Share of the root, epsilon .1 (thesis: table 3.1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int a = 1; a <= 9; a++) {
        table_number(&out, .1 * a);
        factorizer_options how = lowrank_options(run, .1, 0);
        lowrank_result r;
        how.budget.alpha = .1 * a;
        TRY(lowrank_factorize(run, s, "hf", &how, true, REPEATS, &r, error));
        table_number(&out, r.seconds);
        table_number(&out, (double)r.rank);
        table_number(&out, r.real);
        for (int k = 0; k < 3; k++) table_number(&out, s->m.n == 2560 ? theirs[a - 1][k] : none);
    }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

typedef struct thesis_size {
    size_t n;
    double plain_seconds, plain_rank, plain_real, z_seconds, z_rank, z_real, factors_mb, peak_mb;
} thesis_size;

static const thesis_size thesis_sizes[] = {
    {2560, 1.31, 416, .0501, .257, 416, .0500, 8.12, 184},
    {10240, 8.24, 874, .0505, 5.67, 877, .0498, 68.3, 209},
    {40960, 260, 1786, .0500, 141, 1791, .0496, 558, 820},
    {163840, 46500, 3981, NAN, 23200, 3990, NAN, 4976.6, 7731.2},
};

static thesis_size thesis_of(size_t n) {
    for (size_t k = 0; k < sizeof thesis_sizes / sizeof *thesis_sizes; k++)
        if (thesis_sizes[k].n == n) return thesis_sizes[k];
    return (thesis_size){n, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
}

lam_status lowrank_of_order(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                            lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"order", NULL, "order of the columns"},
        {"seconds", "s", "time of the factorization"},
        {"rank", "", "k"},
        {"real", "", "|S - Q V^T|_2"},
        {"levels", "", "levels of the tree"},
        {"full_mb", "MB", "n^2 numbers of 4 bytes"},
        {"factors_mb", "MB", "Q and V"},
        {"peak_mb", "MB", "peak of memory during the factorization, beside the form factors"},
        {"thesis_seconds", "s", "as published"},
        {"thesis_rank", "", "as published"},
        {"thesis_real", "", "as published"},
        {"thesis_factors_mb", "MB", "as published"},
        {"thesis_peak_mb", "MB", "as published"},
    };
    lam_status status = LAM_OK;
    table out = {.name = "order",
                 .title = "With and without Z-order, epsilon .1 (thesis: tables 3.2 and 3.3)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t i = 0; i < n; i++)
        for (int z = 1; z >= 0; z--) {
            const size_t elements = scenes[i]->m.n;
            const thesis_size theirs = thesis_of(elements);
            factorizer_options how = lowrank_options(run, .1, 0);
            lowrank_result r;
            if (z == 0 && elements > 50000) continue;
            TRY(lowrank_factorize(run, scenes[i], "hf", &how, z == 1, elements > 20000 ? 1 : REPEATS, &r,
                                  error));
            table_number(&out, (double)elements);
            table_text(&out, z ? "z" : "mesh");
            table_number(&out, r.seconds);
            table_number(&out, (double)r.rank);
            table_number(&out, r.real);
            table_number(&out, r.report.levels);
            table_number(&out, 4e-6 * (double)elements * (double)elements);
            table_number(&out, 8e-6 * (double)elements * (double)r.rank);
            table_number(&out, 1e-6 * r.peak);
            table_number(&out, z ? theirs.z_seconds : theirs.plain_seconds);
            table_number(&out, z ? theirs.z_rank : theirs.plain_rank);
            table_number(&out, z ? theirs.z_real : theirs.plain_real);
            table_number(&out, theirs.factors_mb);
            table_number(&out, theirs.peak_mb);
        }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

/* Eq. 3.16: m n^2 [2^-l + sum_i 2^(i-l) prod_{j > l-i} rho_j^2]; rho[l] of the leaves, rho[1] below the root.
 */
static double cost_of_levels(double n, int levels, const double *rho) {
    double sum = ldexp(1, -levels), product = 1;
    for (int i = 1; i <= levels; i++) {
        product *= rho[levels - i + 1] * rho[levels - i + 1];
        sum += ldexp(product, i - levels);
    }
    return n * n * n * sum;
}

/* Eq. 3.19. */
static double cost_of_mean(double n, int levels, double rho) {
    const double r2 = rho * rho;
    return n * n * n *
           (ldexp(1, -levels) + (ldexp(r2, 1 - levels) - 2 * pow(rho, 2 + 2 * levels)) / (1 - 2 * r2));
}

lam_status lowrank_of_compression(const bench_run *run, const lowrank_scene *s, lam_error *error) {
    static const table_column columns[] = {
        {"levels", "", "levels of the tree"},
        {"epsilon", "", "bound"},
        {"rho_1", "", "columns kept over columns given, below the root"},
        {"rho_2", "", ""},
        {"rho_3", "", ""},
        {"rho_4", "", "likewise of the leaves"},
        {"rho_mean", "", "geometric mean"},
        {"T_HF", "", "operations by eq. 3.16"},
        {"T_mean", "", "by eq. 3.19"},
        {"seconds", "s", "measured"},
        {"thesis_rho_mean", "", "as published (2,560 elements)"},
        {"thesis_T_HF", "", "as published"},
    };
    static const double theirs[4][4][2] = {{{.21, 9.13e9}, {.35, 1.04e10}, {.59, 1.42e10}, {.93, 2.29e10}},
                                           {{.50, 5.97e9}, {.64, 9.11e9}, {.82, 1.77e10}, {.91, 2.39e10}},
                                           {{.63, 4.61e9}, {.74, 9.84e9}, {.88, 1.92e10}, {.94, 2.57e10}},
                                           {{.70, 4.43e9}, {.80, 1.08e10}, {.91, 2.00e10}, {.96, 2.59e10}}};
    lam_status status = LAM_OK;
    table out = {.name = "compression",
                 .title =
                     "Compression by level, the same part of epsilon^2 for each level (thesis: table 3.4)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int levels = 1; levels <= 4; levels++)
        for (int e = 1; e <= 4; e++) {
            factorizer_options how = lowrank_options(run, pow(10, -e), 0);
            lowrank_result r;
            double mean = 1;
            budget_divide(&how.budget, levels, 1, 0);
            how.levels = levels;
            TRY(lowrank_factorize(run, s, "hf", &how, true, 1, &r, error));
            for (int l = 1; l <= levels; l++) mean *= pow(r.report.compression[l], 1. / levels);
            table_number(&out, levels);
            table_number(&out, how.epsilon);
            for (int l = 1; l <= 4; l++) table_number(&out, l <= levels ? r.report.compression[l] : none);
            table_number(&out, mean);
            table_number(&out, cost_of_levels((double)s->m.n, levels, r.report.compression));
            table_number(&out, cost_of_mean((double)s->m.n, levels, mean));
            table_number(&out, r.seconds);
            for (int k = 0; k < 2; k++)
                table_number(&out, s->m.n == 2560 ? theirs[levels - 1][e - 1][k] : none);
        }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

static void add_factorizer(table *out, const lowrank_scene *s, const char *name, const char *how,
                           const lowrank_result *r, double hf_seconds, const double theirs[2]) {
    table_number(out, (double)s->m.n);
    table_text(out, how);
    table_text(out, name);
    table_number(out, (double)r->rank);
    table_number(out, r->seconds);
    table_number(out, r->seconds / hf_seconds);
    table_number(out, r->real);
    table_number(out, r->report.passes);
    table_number(out, 1e-6 * r->peak);
    table_number(out, theirs[0]);
    table_number(out, theirs[1]);
}

lam_status lowrank_of_factorizers(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                                  lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"at", NULL, "the same rank (that of hf at epsilon .1), or the same bound"},
        {"factorizer", NULL, "name of the factorizer"},
        {"rank", "", "k"},
        {"seconds", "s", "time of the factorization"},
        {"over_hf", "", "its time over that of hf"},
        {"real", "", "|S - Q V^T|_2"},
        {"passes", "", "over the columns of S"},
        {"peak_mb", "MB", "peak of memory during the factorization, beside the form factors"},
        {"thesis_over_hf", "", "as published"},
        {"thesis_real", "", "as published"},
    };
    static const char *const names[] = {"hf", "rsi", "sgrsvd", "svd"};
    /* speed-up and real error, in the order of names */
    static const struct {
        size_t n;
        double of[4][2];
    } theirs[] = {{2560, {{1, .05}, {1.11, .057}, {2.83, .0513}, {11.3, .05}}},
                  {10240, {{1, .0505}, {1.25, .0586}, {1.60, .0872}, {28.8, .0504}}},
                  {40960, {{1, .05}, {1.38, .06}, {7.66, .0986}, {39.6, .05}}},
                  {163840, {{1, NAN}, {1.45, NAN}, {15.23, NAN}, {NAN, NAN}}}};
    static const double unknown[2] = {NAN, NAN};
    lam_status status = LAM_OK;
    table out = {.name = "factorizers",
                 .title = "HF beside RSI, SGRSVD and the SVD (thesis: table 3.5)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t i = 0; i < n; i++) {
        const lowrank_scene *s = scenes[i];
        const size_t repeats = run->scale == BENCH_QUICK || s->m.n > 5000 ? 1 : REPEATS;
        const double(*published)[2] = NULL;
        lowrank_result hf = {.rank = 0}, r;
        for (size_t t = 0; t < sizeof theirs / sizeof *theirs; t++)
            if (theirs[t].n == s->m.n) published = theirs[t].of;
        for (int fixed = 0; fixed < 2; fixed++)
            for (int k = 0; k < 4; k++) {
                const factorizer_options how = lowrank_options(run, .1, fixed && k > 0 ? hf.rank : 0);
                if (k == 3 && s->m.n > 15000) continue; /* n^2 numbers three times, and hours */
                if (k > 1 && s->m.n > 5000 && run->scale != BENCH_FULL) continue; /* minutes */
                if (k > 0 || !fixed) TRY(lowrank_factorize(run, s, names[k], &how, true, repeats, &r, error));
                if (k == 0 && !fixed) hf = r;
                add_factorizer(&out, s, names[k], fixed ? "equal rank" : "epsilon .1", k == 0 ? &hf : &r,
                               hf.seconds, fixed && published != NULL ? published[k] : unknown);
            }
    }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

enum { LEVELS_MOST = 9, RANK_EPSILONS = 4, MANY = 5000 };

static const double rank_epsilons[RANK_EPSILONS] = {.1, .05, .02, .01};
/* Levels whose leaves have between 32 and 2,560 columns. */
static bool is_tried(size_t n, int levels) {
    return n >> levels >= 32 && n >> levels <= 2560;
}

static lam_status levels_of_scene(const bench_run *run, const lowrank_scene *s, table *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    for (int e = 0; e <= RANK_EPSILONS; e++) {
        const bool z = e < RANK_EPSILONS;
        for (int levels = 0; levels <= LEVELS_MOST; levels++) {
            factorizer_options how = lowrank_options(run, z ? rank_epsilons[e] : .1, 0);
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
        }
    }
done:
    return status;
}

lam_status lowrank_of_levels(const bench_run *run, const lowrank_scene *const *scenes, size_t n,
                             lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"epsilon", "", "bound"},
        {"order", NULL, "order of the columns"},
        {"levels", "", "levels of the tree"},
        {"seconds", "s", "time of the factorization"},
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
    table out = {.name = "rank",
                 .title = "Rank by elements (thesis: figure 3.5)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t i = 0; i < n; i++)
        for (int e = 0; e < RANK_EPSILONS; e++) {
            const factorizer_options how = lowrank_options(run, rank_epsilons[e], 0);
            lowrank_result r;
            double published = NAN;
            /* Columns below the sampling noise of the rays are noise. */
            if (rank_epsilons[e] < 2 * recipe_noise(&scenes[i]->f.recipe)) continue;
            TRY(lowrank_factorize(run, scenes[i], "hf", &how, true, 1, &r, error));
            for (size_t t = 0; e == 0 && t < sizeof theirs / sizeof *theirs; t++)
                if (theirs[t][0] == (double)scenes[i]->m.n) published = theirs[t][1];
            table_number(&out, (double)scenes[i]->m.n);
            table_number(&out, rank_epsilons[e]);
            table_number(&out, (double)r.rank);
            table_number(&out, r.real);
            table_number(&out, published);
        }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

enum { RADIOSITY_EPSILONS = 5, PROBES = 500, PROBES_OF_LARGE = 64, LARGE = 5000 };

static const double radiosity_epsilons[RADIOSITY_EPSILONS] = {.05, .1, .2, .3, .5};

/* k, mean, standard deviation and largest relative error of the thesis. */
static const double patio[RADIOSITY_EPSILONS][4] = {{3920, .0025, .0013, .0073},
                                                    {3114, .0048, .0030, .0170},
                                                    {2227, .0096, .0073, .0395},
                                                    {1617, .0142, .0124, .0635},
                                                    {932, .0232, .0224, .1205}};
static const double cornell[RADIOSITY_EPSILONS][4] = {{560, .0021, .0017, .0094},
                                                      {416, .0045, .0042, .0213},
                                                      {328, .0088, .0075, .0448},
                                                      {274, .0133, .0122, .0839},
                                                      {139, .0255, .0299, .1713}};

static lam_status add_epsilon(const bench_run *run, const lowrank_scene *s, double epsilon,
                              const double theirs[4], table *out, lam_error *error) {
    lam_status status = LAM_OK;
    /* The measured error of the thesis is half of its epsilon. */
    const lowrank_case of = {.method = "low-rank",
                             .factorizer = "hf",
                             .epsilon = epsilon / 2,
                             .probes = s->m.n > LARGE ? PROBES_OF_LARGE : PROBES};
    lowrank_verdict v;
    TRY(lowrank_judge(run, s, &of, &v, error));
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_number(out, epsilon);
    table_number(out, report_get(&v.built, "rank", NAN));
    table_number(out, report_get(&v.built, "measured_norm_error", NAN));
    table_number(out, v.built.steps[0].seconds);
    table_number(out, v.built.steps[1].seconds);
    table_number(out, 1e3 * v.answer_seconds);
    table_number(out, v.judged.single.operator_relative.mean);
    table_number(out, v.judged.single.operator_relative.std);
    table_number(out, v.judged.single.operator_relative.max);
    table_number(out, v.judged.single.operator_indirect.mean);
    for (int k = 0; k < 4; k++) table_number(out, theirs[k]);
done:
    return status;
}

static lam_status add_epsilons(const bench_run *run, const lowrank_scene *s, bool courtyard, table *out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    for (int e = 0; e < RADIOSITY_EPSILONS; e++)
        TRY(add_epsilon(run, s, radiosity_epsilons[e], courtyard ? patio[e] : cornell[e], out, error));
done:
    return status;
}

lam_status lowrank_of_radiosity(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "name of the scene"},
        {"elements", "", "n"},
        {"epsilon", "",
         "epsilon of the thesis, whose measured error is half of it; ours is bound to that half"},
        {"rank", "", "k"},
        {"real", "", "|S - Q V^T|_2"},
        {"factorize_s", "s", "time of the factorization"},
        {"invert_s", "s", "time of Y_k"},
        {"answer_ms", "ms", "time of one B, median"},
        {"relative_mean", "", "|B~ - B|/|B| for single emitters"},
        {"relative_std", "", "standard deviation of the same"},
        {"relative_max", "", "maximum of the same"},
        {"indirect_mean", "", "|B~ - B|/|B - E|"},
        {"thesis_rank", "", "as published (patio of 21,888, Cornell box of 2,560 elements)"},
        {"thesis_mean", "", "as published, relative"},
        {"thesis_std", "", "as published"},
        {"thesis_max", "", "as published"},
    };
    static const size_t sizes[3][2] = {{640, 640}, {2560, 2700}, {2560, 21888}};
    table out = {.name = "radiosity",
                 .title = "Error of the radiosity at the real error of the thesis (tables 3.6 and 3.7)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    const lam_status status = lowrank_box_and_patio(run, sizes[run->scale], add_epsilons, &out, error);
    table_free(&out);
    return status;
}
