/* The indirect error of B for single bright elements where a scene is too large for a reference of all pairs:
 *
 *     bench_single_elements SCENE RECIPE[,RECIPE...] PROBES [JUDGE]
 *
 * B - E = rho F_e + D,  (I - R F') D = R F' (rho F_e)
 * with F_e, the light of the bright element itself, pair by pair and far more finely than the recipes do, and
 * F' of the recipe JUDGE (the one that is judged) and another seed for what bounces on: by then it comes from
 * everywhere, and its noise has averaged out. The share of it that has not is printed beside. As CSV. */
#include "solver/base/clock.h"
#include "solver/bench/stats.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/sight/occlusion.h"
#include "solver/method/reference.h"
#include "solver/scene/import/import.h"
#include "tests/bench/bench_recipe.h"

#include <math.h>
#include <stdio.h>

enum { MOST_PROBES = 64 };

typedef struct bench {
    mesh m;
    uint32_t *order;
    size_t n_probes;
    uint32_t probe[MOST_PROBES];
    double *first; /* [n_probes][n], rho F_e */
    double *B;     /* [n_probes][n], the reference without E */
} bench;

/* rho F_e of one probe: at least 256 visibility segments for each partly occluded pair. */
static void first_bounce(const bench *b, const occlusion *o, uint32_t e, double *out) {
#pragma omp parallel for schedule(dynamic, 256)
    for (size_t i = 0; i < b->m.n; i++) {
        const uint32_t j = (uint32_t)i;
        double g =
            j == e ? 0 : pair_factor_exchange(o->rules, &o->polygons[e], &o->polygons[j], o->tolerance);
        if (g > 0) g = occlusion_estimate(o, NULL, e < j ? e : j, e < j ? j : e, g);
        out[i] = (double)b->m.reflectance[i] * g / b->m.area[i];
    }
}

static lam_status find_first_bounces(bench *b, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    pair_factor_rules rules;
    polygon *polygons = memory_allocate(b->m.n, sizeof *polygons, "bench", error);
    if (polygons == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < b->m.n; i++) polygon_of_element(&b->m, i, &polygons[i]);
    pair_factor_rules_init(&rules);
    TRY(visibility_create(&b->m, &v, error));
    const occlusion o = {.v = v,
                         .area = b->m.area,
                         .polygons = polygons,
                         .rules = &rules,
                         .tolerance = 1e-6,
                         .accuracy = 7e-6,
                         .segments = 256,
                         .seed = 12345};
    for (size_t k = 0; k < b->n_probes; k++) first_bounce(b, &o, b->probe[k], b->first + k * b->m.n);
done:
    visibility_destroy(v);
    free(polygons);
    return status;
}

static lam_status make_rows(const bench *b, const recipe *how, csr *F, form_factors *f, double *seconds,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options options = {
        .recipe = *how, .stage = "form factors", .upper = true, .scratch_name = "form-factors"};
    const double started = clock_seconds();
    TRY(form_factors_make(&b->m, b->order, &options, f, error));
    *seconds = clock_seconds() - started;
    TRY(form_factors_expand(f, b->m.area, error));
    *F = f->F;
done:
    return status;
}

/* B - E for E = 1 on each probe (first = NULL), or the D of a given first bounce added to it. */
static lam_status solve(const bench *b, const csr *F, const double *first, double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = b->m.n, m = b->n_probes;
    reference *r = NULL;
    double *X = NULL, *E = memory_allocate(m * n, sizeof *E, "bench", error);
    X = memory_allocate(n, sizeof *X, "bench", error);
    if (E == NULL || X == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < m; k++) {
        if (first == NULL) {
            E[k * n + b->probe[k]] = 1;
            continue;
        }
        csr_multiply_rows(F, 0, n, 1, first + k * n, X);
        for (size_t i = 0; i < n; i++) E[k * n + i] = (double)b->m.reflectance[i] * X[i];
    }
    for (size_t i = 0; i < m * n; i++) B[i] = E[i];
    TRY(reference_create(F, b->m.area, b->m.reflectance, REFERENCE_ITERATED, &r, error));
    TRY(reference_solve(r, m, E, B, 1e-6, NULL, error));
    for (size_t i = 0; i < m * n; i++) B[i] += first == NULL ? -E[i] : first[i];
done:
    reference_destroy(r);
    free(E);
    free(X);
    return status;
}

/* |X - B| / |B|, area-weighted, of every probe. */
static void compare(const bench *b, const double *X, double *errors) {
    const size_t n = b->m.n;
    for (size_t k = 0; k < b->n_probes; k++) {
        double wrong = 0, all = 0;
        for (size_t i = 0; i < n; i++) {
            const double B = b->B[k * n + i], x = X[k * n + i];
            wrong += b->m.area[i] * (x - B) * (x - B);
            all += b->m.area[i] * B * B;
        }
        errors[k] = all > 0 ? sqrt(wrong / all) : 0;
    }
}

static lam_status judge(bench *b, const char *text, const char *judge_text, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors f = {.closed = false}, other = {.closed = false};
    csr F, F_other;
    recipe how, judging;
    double seconds, ignored, errors[MOST_PROBES], own[MOST_PROBES];
    double *X = memory_allocate(b->n_probes * b->m.n, sizeof *X, "bench", error);
    if (X == NULL) TRY(LAM_ERR_MEMORY);
    if (!bench_recipe(text, 1, &how) || !bench_recipe(judge_text, 2, &judging))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: must be RAYS, pairs or near:RAYS", text);
    TRY(make_rows(b, &judging, &F_other, &other, &ignored, error));
    TRY(solve(b, &F_other, b->first, b->B, error));
    form_factors_free(&other);
    TRY(make_rows(b, &how, &F, &f, &seconds, error));
    TRY(solve(b, &F, b->first, X, error));
    compare(b, X, own);
    TRY(solve(b, &F, NULL, X, error));
    compare(b, X, errors);
    const size_t m = b->n_probes;
    printf("%zu,%s,%s,%.1f,%zu,%.4f,%.4f,%.4f,%.4f,%.4f\n", b->m.n, text, judge_text, seconds, m,
           stats_mean(errors, m), stats_quantile(errors, m, .05), stats_median(errors, m),
           stats_quantile(errors, m, .95), stats_mean(own, m));
    fflush(stdout);
done:
    form_factors_free(&f);
    form_factors_free(&other);
    free(X);
    return status;
}

int main(int argc, char **argv) {
    lam_status status = LAM_OK;
    lam_error problem = {0}, *error = &problem;
    bench b = {.order = NULL};
    import_report report;
    const import_options plain = {.unit = 1, .reflectance = -1};
    if (argc < 4 || argc > 5) {
        fprintf(stderr, "usage: %s SCENE RECIPE[,RECIPE...] PROBES [JUDGE]\n", argv[0]);
        return 2;
    }
    b.n_probes = strtoull(argv[3], NULL, 10);
    if (b.n_probes < 1 || b.n_probes > MOST_PROBES) return 2;
    TRY(scene_import(argv[1], &plain, &b.m, &report, error));
    b.order = memory_allocate(b.m.n, sizeof *b.order, "bench", error);
    b.first = memory_allocate(b.n_probes * b.m.n, sizeof *b.first, "bench", error);
    b.B = memory_allocate(b.n_probes * b.m.n, sizeof *b.B, "bench", error);
    if (b.order == NULL || b.first == NULL || b.B == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&b.m, b.order, error));
    for (size_t k = 0; k < b.n_probes; k++) b.probe[k] = b.order[(2 * k + 1) * b.m.n / (2 * b.n_probes)];
    TRY(find_first_bounces(&b, error));
    printf("elements,recipe,judge,make_s,probes,indirect_mean,q05,median,q95,of_the_judge_mean\n");
    for (char *text = strtok(argv[2], ","); text != NULL; text = strtok(NULL, ","))
        TRY(judge(&b, text, argc > 4 ? argv[4] : text, error));
done:
    if (status != LAM_OK) fprintf(stderr, "%s\n", problem.message);
    free(b.order);
    free(b.first);
    free(b.B);
    mesh_free(&b.m);
    return status == LAM_OK ? 0 : 1;
}
