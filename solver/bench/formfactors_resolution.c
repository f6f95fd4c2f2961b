#include "solver/bench/formfactors.h"
#include "solver/bench/scenes.h"

#include <math.h>
#include <stdlib.h>

/* The thesis' table 4.6: cities 1 to 3 of 35,588 elements, on its graphics card of 2016. */
enum { ROWS = 5, CITIES = 3 };
static const struct {
    size_t resolution;
    double density[CITIES], speedup[CITIES], error[CITIES];
} thesis[ROWS] = {{512, {.0048, .0060, .0087}, {1, 1, 1}, {0, 0, 0}},
                  {256, {.0034, .0046, .0069}, {1.8, 1.8, 1.8}, {.0072, .0072, .0076}},
                  {128, {.0022, .0032, .0049}, {2.8, 2.8, 2.7}, {.0610, .0125, .0121}},
                  {64, {.0012, .0019, .0030}, {3.1, 3.1, 3.1}, {.0642, .0360, .0346}},
                  {32, {.0006, .0009, .0015}, {3.2, 3.2, 3.2}, {.1444, .1281, .1279}}};

static const table_column columns[] = {
    {"scene", NULL, "which"},
    {"elements", "", "n"},
    {"resolution", "", "pixels along the top of a hemicube"},
    {"seconds", "s", "of the form factors"},
    {"density", "", "share of F that is not 0"},
    {"speedup", "", "against the finest"},
    {"error", "", "|F_finest - F| / |F_finest|, Frobenius"},
    {"density_1", "", "thesis, city 1"},
    {"density_2", "", "thesis, city 2"},
    {"density_3", "", "thesis, city 3"},
    {"speedup_1", "", "thesis, city 1"},
    {"error_1", "", "thesis, city 1"},
    {"error_2", "", "thesis, city 2"},
    {"error_3", "", "thesis, city 3"},
};

/* |A - B| / |A| in the Frobenius norm. */
static double distance(const csr *A, const csr *B) {
    double difference = 0, norm = 0;
    for (size_t i = 0; i < A->n; i++) {
        uint64_t p = A->indptr[i], q = B->indptr[i];
        while (p < A->indptr[i + 1] || q < B->indptr[i + 1]) {
            const uint32_t a = p < A->indptr[i + 1] ? A->indices[p] : UINT32_MAX;
            const uint32_t b = q < B->indptr[i + 1] ? B->indices[q] : UINT32_MAX;
            const double x = a <= b ? (double)A->data[p++] : 0, y = b <= a ? (double)B->data[q++] : 0;
            difference += (x - y) * (x - y);
            norm += x * x;
        }
    }
    return norm > 0 ? sqrt(difference / norm) : NAN;
}

static void add_row(table *out, const char *name, size_t row, const form_factors *f, double seconds,
                    double finest_seconds, double error) {
    const double n = (double)f->F.n;
    table_text(out, name);
    table_number(out, n);
    table_number(out, (double)f->recipe.resolution);
    table_number(out, seconds);
    table_number(out, (double)f->F.indptr[f->F.n] / (n * n));
    table_number(out, finest_seconds / seconds);
    table_number(out, error);
    for (int city = 0; city < CITIES; city++) table_number(out, thesis[row].density[city]);
    table_number(out, thesis[row].speedup[0]);
    for (int city = 0; city < CITIES; city++) table_number(out, thesis[row].error[city]);
}

static lam_status draw(const bench_run *run, const char *name, const double *resolution, const double *errors,
                       size_t n, lam_error *error) {
    double of_city[CITIES][ROWS], all[ROWS];
    plot_series series[CITIES + 1] = {{.label = name, .n = n, .x = resolution, .y = errors, .joined = true}};
    static const char *const labels[CITIES] = {"thesis, city 1", "thesis, city 2", "thesis, city 3"};
    for (size_t r = 0; r < ROWS; r++) all[r] = (double)thesis[r].resolution;
    for (int city = 0; city < CITIES; city++) {
        for (size_t r = 0; r < ROWS; r++) of_city[city][r] = thesis[r].error[city];
        series[city + 1] =
            (plot_series){.label = labels[city], .n = ROWS, .x = all, .y = of_city[city], .joined = true};
    }
    const plot picture = {.name = "resolution",
                          .title = "Hemicubes against the finest one (thesis: table 4.6)",
                          .x_label = "resolution, pixels",
                          .y_label = "relative error of F (ours: Frobenius norm)",
                          .x_log = true,
                          .y_log = true,
                          .series = series,
                          .n_series = CITIES + 1};
    return run->sink->plot(run->sink->context, &picture, error);
}

lam_status formfactors_resolution(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = run->scale == BENCH_QUICK ? 3 : 0;
    const size_t lots = run->scale == BENCH_QUICK ? 1 : run->scale == BENCH_FULL ? 6 : 2;
    table out = {.name = "resolution",
                 .title = "Resolution of hemicubes (thesis: table 4.6)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    mesh m = {0};
    uint32_t *order = NULL;
    form_factors finest = {.row_sums = NULL}, f = {.row_sums = NULL};
    char name[64];
    double resolution[ROWS], errors[ROWS], finest_seconds = 0, seconds = 0;
    TRY(formfactors_open_scene(run, lots, &m, name, error));
    TRY(formfactors_order(&m, &order, error));
    for (size_t r = first; r < ROWS; r++) {
        const recipe how = formfactors_hemicube(thesis[r].resolution);
        form_factors *made = r == first ? &finest : &f;
        TRY(formfactors_make_timed(run, &m, order, &how, "resolution of hemicubes", made, &seconds, error));
        if (r == first) finest_seconds = seconds;
        resolution[r - first] = (double)thesis[r].resolution;
        errors[r - first] = r == first ? 0 : distance(&finest.F, &f.F);
        add_row(&out, name, r, made, seconds, finest_seconds, errors[r - first]);
        form_factors_free(&f);
    }
    TRY(bench_table(run, &out, error));
    TRY(draw(run, name, resolution, errors, ROWS - first, error));
done:
    form_factors_free(&f);
    form_factors_free(&finest);
    free(order);
    mesh_free(&m);
    table_free(&out);
    return status;
}
