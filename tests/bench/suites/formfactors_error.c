/* Error of the radiosity against the time of its form factors, in Cornell boxes. */
#include "solver/method/reference.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/scenes.h"
#include "tests/bench/suites/stats.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const table_column columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"method", NULL, "how the form factors were computed"},
    {"reference", NULL, "form factors of the reference, of another seed"},
    {"seconds", "s", "time of the form factors"},
    {"entries", "", "entries of F that are not 0"},
    {"single_mean", "", "indirect error of B for one bright element, mean over the probes"},
    {"single_q05", "", "5 % quantile of the same"},
    {"single_median", "", "median of the same"},
    {"single_q95", "", "95 % quantile of the same"},
    {"lamp", "", "indirect error of B for the scene's own lights"},
};

enum { PROBES = 32, VECTORS = PROBES + 1, REFERENCES_MOST = 2, SETTINGS_MOST = 5 };

/* Residual at which a solution counts as converged, far below every error in the table. */
static const double tolerance = 1e-8;

/* A scene and its converged radiosity by each reference. */
typedef struct lit_scene {
    mesh m;
    uint32_t *order;
    size_t n_references;
    double *B[REFERENCES_MOST]; /* [C][VECTORS][n] */
    char described[REFERENCES_MOST][64];
} lit_scene;

static void lit_free(lit_scene *s) {
    for (int r = 0; r < REFERENCES_MOST; r++) free(s->B[r]);
    free(s->order);
    mesh_free(&s->m);
}

/* Emissions: one bright element per vector, spread over the scene by the Z-order; the last vector is the
 * scene's lights. */
static void light(const lit_scene *s, size_t channel, double *E) {
    const size_t n = s->m.n;
    memset(E, 0, VECTORS * n * sizeof *E);
    for (size_t v = 0; v < PROBES; v++) E[v * n + s->order[(2 * v + 1) * n / (2 * PROBES)]] = 1;
    for (size_t i = 0; i < n; i++) E[PROBES * n + i] = (double)s->m.emission[channel * n + i];
}

/* The converged radiosity of all vectors and channels; B holds a guess. */
static lam_status solve(const bench_run *run, const lit_scene *s, const csr *F, double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n;
    reference *r = NULL;
    double *E = memory_allocate(VECTORS * n, sizeof *E, "probes", error);
    if (E == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < s->m.n_channels; c++) {
        light(s, c, E);
        TRY(bench_check(run, error));
        const factor_product product = factor_product_of_rows(F);
        const float *rho = s->m.reflectance + c * n;
        const reference_way way = reference_choose(&product, s->m.area, rho, VECTORS, false);
        TRY(reference_create(F, s->m.area, rho, way, &r, error));
        TRY(reference_solve(r, VECTORS, E, B + c * VECTORS * n, tolerance, run->progress, error));
        reference_destroy(r);
        r = NULL;
    }
done:
    reference_destroy(r);
    free(E);
    return status;
}

static lam_status add_reference(const bench_run *run, lit_scene *s, const recipe *how, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n;
    form_factors f = {.row_sums = NULL};
    double seconds;
    double *B = memory_allocate(s->m.n_channels, VECTORS * n * sizeof *B, "reference", error);
    if (B == NULL) TRY(LAM_ERR_MEMORY);
    recipe_describe(how, s->described[s->n_references]);
    TRY(formfactors_make_timed(run, &s->m, s->order, how, "reference", &f, &seconds, error));
    for (size_t c = 0; c < s->m.n_channels; c++) light(s, c, B + c * VECTORS * n);
    TRY(solve(run, s, &f.F, B, error));
    bench_say(run, "reference of %zu elements: %s, %.1f s", n, s->described[s->n_references], seconds);
    s->B[s->n_references++] = B;
    B = NULL;
done:
    form_factors_free(&f);
    free(B);
    return status;
}

/* |B~ - B| / |B - E| of one vector, area-weighted, channels stacked; NaN where there is no indirect light. */
static double indirect_error(const lit_scene *s, const double *approximate, const double *B, const double *E,
                             size_t vector) {
    const size_t n = s->m.n;
    double wrong = 0, indirect = 0;
    for (size_t c = 0; c < s->m.n_channels; c++)
        for (size_t i = 0; i < n; i++) {
            const size_t at = (c * VECTORS + vector) * n + i;
            const double a = s->m.area[i];
            wrong += a * (approximate[at] - B[at]) * (approximate[at] - B[at]);
            indirect += a * (B[at] - E[at]) * (B[at] - E[at]);
        }
    return indirect > 0 ? sqrt(wrong / indirect) : NAN;
}

/* Makes the form factors of one recipe and judges them by every reference. */
static lam_status judge(const bench_run *run, const lit_scene *s, const recipe *how, table *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n, size = s->m.n_channels * VECTORS * n;
    form_factors f = {.row_sums = NULL};
    double seconds, *E = NULL;
    char method[64];
    double *B = memory_allocate(size, sizeof *B, "radiosity", error);
    E = memory_allocate(size, sizeof *E, "probes", error);
    if (B == NULL || E == NULL) TRY(LAM_ERR_MEMORY);
    TRY(formfactors_make_timed(run, &s->m, s->order, how, "error against time", &f, &seconds, error));
    for (size_t c = 0; c < s->m.n_channels; c++) light(s, c, E + c * VECTORS * n);
    memcpy(B, s->B[0], size * sizeof *B);
    TRY(solve(run, s, &f.F, B, error));
    recipe_describe(how, method);
    for (size_t r = 0; r < s->n_references; r++) {
        double errors[PROBES];
        size_t lit = 0;
        for (size_t v = 0; v < PROBES; v++) {
            const double x = indirect_error(s, B, s->B[r], E, v);
            if (isfinite(x)) errors[lit++] = x;
        }
        table_text(out, "cornell");
        table_number(out, (double)n);
        table_text(out, method);
        table_text(out, s->described[r]);
        table_number(out, seconds);
        table_number(out, (double)f.F.indptr[n]);
        table_number(out, stats_mean(errors, lit));
        table_number(out, stats_quantile(errors, lit, .05));
        table_number(out, stats_median(errors, lit));
        table_number(out, stats_quantile(errors, lit, .95));
        table_number(out, indirect_error(s, B, s->B[r], E, PROBES));
    }
done:
    form_factors_free(&f);
    free(B);
    free(E);
    return status;
}

/* The settings of one scene and its approximate number of elements. */
typedef struct trial {
    size_t elements;
    size_t rays[SETTINGS_MOST], resolution[SETTINGS_MOST]; /* up to the first 0 */
    double accuracy[SETTINGS_MOST];
    double finest;         /* accuracy of the reference */
    size_t reference_rays; /* of a second reference; 0: none */
} trial;

static lam_status measure(const bench_run *run, const trial *t, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lit_scene s = {.n_references = 0};
    const recipe reference_pairs = formfactors_pairs(t->finest, run->seed + 1000),
                 reference_rays = formfactors_rays(t->reference_rays, run->seed + 1000);
    TRY(scene_cornell(t->elements, &s.m, error));
    TRY(formfactors_order(&s.m, &s.order, error));
    TRY(add_reference(run, &s, &reference_pairs, error));
    if (t->reference_rays > 0) TRY(add_reference(run, &s, &reference_rays, error));
    for (int k = 0; k < SETTINGS_MOST; k++) {
        const recipe rays = formfactors_rays(t->rays[k], run->seed),
                     cube = formfactors_hemicube(t->resolution[k]),
                     pairs = formfactors_pairs(t->accuracy[k], run->seed);
        if (t->rays[k] > 0) TRY(judge(run, &s, &rays, out, error));
        if (t->resolution[k] > 0) TRY(judge(run, &s, &cube, out, error));
        if (t->accuracy[k] > 0) TRY(judge(run, &s, &pairs, out, error));
    }
done:
    lit_free(&s);
    return status;
}

lam_status formfactors_error(const bench_run *run, lam_error *error) {
    static const trial quick[] = {
        {.elements = 160, .rays = {256, 1024}, .resolution = {32}, .accuracy = {2.8e-4}, .finest = 7e-5},
        {.elements = 0}};
    static const trial usual[] = {{.elements = 640,
                                   .rays = {256, 1024, 4096, 16384},
                                   .resolution = {32, 64, 128},
                                   .accuracy = {7e-4, 7e-5},
                                   .finest = 2e-5},
                                  {.elements = 2560,
                                   .rays = {256, 1024, 4096, 16384},
                                   .resolution = {32, 64, 128},
                                   .accuracy = {7e-4, 7e-5},
                                   .finest = 7e-6},
                                  {.elements = 0}};
    static const trial full[] = {{.elements = 640,
                                  .rays = {256, 1024, 4096, 16384, 65536},
                                  .resolution = {32, 64, 128, 256, 512},
                                  .accuracy = {7e-4, 7e-5, 7e-6},
                                  .finest = 7e-6},
                                 {.elements = 2560,
                                  .rays = {256, 1024, 4096, 16384, 65536},
                                  .resolution = {32, 64, 128, 256, 512},
                                  .accuracy = {7e-4, 7e-5, 7e-6},
                                  .finest = 7e-6,
                                  .reference_rays = 1 << 20},
                                 {.elements = 10240,
                                  .rays = {256, 1024, 4096, 16384},
                                  .resolution = {32, 64, 128},
                                  .accuracy = {7e-4, 7e-5, 7e-6},
                                  .finest = 7e-6},
                                 {.elements = 0}};
    lam_status status = LAM_OK;
    table out = {.name = "error",
                 .title = "Error of the radiosity against the time of its form factors",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    const trial *trials = run->scale == BENCH_QUICK ? quick : run->scale == BENCH_FULL ? full : usual;
    for (; trials->elements > 0; trials++) TRY(measure(run, trials, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
