/* 2msc: two meshes with spatial coherence (Fernández et al. 2011). The coarse mesh sends, the fine one
 * receives; with --factorizer qr its columns only choose the space that S is projected on. */
#include "solver/method/two_mesh/method_two_mesh.h"

#include "solver/base/clock.h"
#include "solver/method/choice.h"
#include "solver/method/norm.h"
#include "solver/method/tall_factors.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const option_row rows[] = {
    {.name = "factorizer",
     .kind = OPTION_CHOICE,
     .offset = offsetof(two_mesh_options, factorizer),
     .preset = "auto",
     .choices = METHOD_FACTORIZERS},
    {.name = "rank",
     .kind = OPTION_COUNT,
     .offset = offsetof(two_mesh_options, rank),
     .least = 1,
     .most = 4e9},
    {.name = "keep-factors", .kind = OPTION_FLAG, .offset = offsetof(two_mesh_options, keep_factors)},
    {.name = "coherence",
     .kind = OPTION_NUMBER,
     .offset = offsetof(two_mesh_options, coherence),
     .argument = "X",
     .most = 1,
     .above = true,
     .help =
         "Split patches whose coherence is below X. Coherence is 1 less the variance of the form factors "
         "of the elements of a patch over their mean square, weighted by area; it is 1 where all elements "
         "see the same. Without this and --min-area the patches that lose most are split, until patches "
         "have 16 elements on average"},
    {.name = "min-area",
     .kind = OPTION_NUMBER,
     .offset = offsetof(two_mesh_options, min_area),
     .argument = "M2",
     .above = true,
     .help = "Split no patch of this area or less; without --coherence, split all others"},
    {.name = "assign",
     .kind = OPTION_WORD,
     .offset = offsetof(two_mesh_options, assign),
     .preset = "inclusion",
     .choices = "inclusion|proximity",
     .help = "An element belongs to the patch that it was split into, or to the nearest patch that faces the "
             "same way"},
    {0},
};

/* Elements a patch has on average where nothing is asked for. */
enum { ELEMENTS_OF_PATCH = 16 };

static bool by_proximity(const two_mesh_options *o) {
    return o->assign == ASSIGN_PROXIMITY;
}

/* Patches where their number is known before; 0: it is not. */
static double patches_of(const two_mesh_options *o, double n) {
    if (o->rank > 0) return fmin((double)o->rank, n);
    return o->coherence <= 0 && o->min_area <= 0 ? ceil(n / ELEMENTS_OF_PATCH) : 0;
}

static coarse_options coarse_of(const build_problem *problem, const two_mesh_options *o) {
    return (coarse_options){.coherence = o->coherence > 0 ? o->coherence : 1,
                            .min_area = o->min_area,
                            .proximity = by_proximity(o),
                            .patches = (size_t)patches_of(o, (double)problem->n)};
}

/* U, one copy of it while it goes over into the operator, the core in double and single; QR has factors
 * twice. */
static lam_status check_memory(const build_problem *problem, const build_options *options, size_t k, bool qr,
                               lam_error *error) {
    const double n = (double)problem->n, columns = (double)k, C = (double)problem->n_channels;
    const double bytes = 4 * n * columns * (qr ? 5 : 2) + columns * columns * (8 + 4 * C);
    if (k > INT_MAX || (options->memory > 0 && bytes > (double)options->memory))
        return status_fail(error, LAM_ERR_MEMORY,
                           "--method 2msc: %zu elements in %zu patches need %.2f GiB, --memory allows %.2f; "
                           "give a smaller --coherence, a larger --min-area, or --rank",
                           problem->n, k, bytes * 0x1p-30, (double)options->memory * 0x1p-30);
    return LAM_OK;
}

/* eqs. 5 and 6: the operator of two meshes, folded for one channel unless its factors are to be kept. */
static lam_status build_summed(const build_problem *problem, coarse_mesh *mesh, bool keep_factors,
                               lam_operator **op, double *worst, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels, k = mesh->k;
    lam_operator *made = NULL;
    two_mesh_arrays arrays = {0};
    float *core = memory_allocate(C, k * k * sizeof *core, "core", error);
    if (core == NULL) TRY(LAM_ERR_MEMORY);
    TRY(two_mesh_factors(problem, mesh, &arrays.left, &arrays.weight, error));
    *worst = 1;
    for (size_t c = 0; c < C; c++) {
        double rcond;
        TRY(two_mesh_core(mesh, arrays.left, arrays.weight, problem->reflectance + c * n, core + c * k * k,
                          &rcond, error));
        *worst = fmin(*worst, rcond);
    }
    if (C == 1 && !keep_factors) {
        TRY(factors_fold(n, k, core, problem->reflectance, mesh->element, arrays.left, error));
    } else {
        arrays.core = core;
        core = NULL;
    }
    free(core);
    core = NULL;
    arrays.begin = mesh->begin;
    arrays.coherence = mesh->coherence;
    mesh->begin = NULL;
    mesh->coherence = NULL;
    TRY(operator_two_mesh_create(n, k, C, problem->reflectance, &arrays, &made, error));
    TRY(operator_set_order(made, mesh->element, error));
    *op = made;
    made = NULL;
done:
    two_mesh_arrays_free(&arrays);
    free(core);
    lam_operator_close(made);
    return status;
}

/* Section 3.2: U_QR from the QR of the columns S W of the two meshes, V_QR = S^T U_QR. S is projected, so the
 * product's norm is at most |S| <= 1 whatever the patches. */
static lam_status qr_factors(const build_problem *problem, const coarse_mesh *mesh, const scaled_matrix *S,
                             tall_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, k = mesh->k;
    tall_factors f = {.n = n, .m = n, .rank = k};
    float *U = NULL, *weight = NULL;
    TRY(two_mesh_factors(problem, mesh, &U, &weight, error));
    f.Q = memory_allocate(n, k * sizeof *f.Q, "U_QR", error);
    if (f.Q == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t r = 0; r < n; r++) { /* S W but for the lengths of its columns: A^1/2 U has the same span */
        const size_t e = mesh->element[r];
        float *row = f.Q + S->position[e] * k;
        for (size_t p = 0; p < k; p++) row[p] = (float)(S->root_area[e] * (double)U[r * k + p]);
    }
    free(U);
    U = NULL;
    TRY(orthonormal_columns(n, k, f.Q, error));
    f.V = memory_allocate(n, k * sizeof *f.V, "V_QR", error);
    if (f.V == NULL) TRY(LAM_ERR_MEMORY);
    TRY(scaled_multiply(S, k, f.Q, f.V, error)); /* V = S^T Q, and S is symmetric */
    *out = f;
    f = (tall_factors){0};
done:
    free(U);
    free(weight);
    tall_factors_free(&f);
    return status;
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const two_mesh_options *o = own;
    const bool qr = strcmp(o->factorizer, "qr") == 0;
    const coarse_options coarse = coarse_of(problem, o);
    row_source rows_of_F;
    scaled_matrix S = {0};
    coarse_mesh mesh = {0};
    tall_factors f = {0};
    double norm, rcond;
    if (problem->surface == NULL)
        FAIL(error, LAM_ERR_INTERNAL, "--method 2msc: needs the surfaces of the elements");

    const double start = clock_seconds();
    progress_report(options->progress, "patches", 0);
    TRY(coarse_mesh_create(problem, &coarse, options->progress, &mesh, error));
    TRY(check_memory(problem, options, mesh.k, qr, error));
    double factorized = clock_seconds() - start;
    row_source_of_csr(&rows_of_F, problem->F);
    TRY(scaled_init(&S, &rows_of_F, problem->area, problem->order, error));
    if (qr) {
        TRY(qr_factors(problem, &mesh, &S, &f, error));
        factorized = clock_seconds() - start;
        TRY(norm_of_error(&S, &f, options->progress, &norm, error));
    } else {
        TRY(two_mesh_norm(problem, &mesh, &S, options->progress, &norm, error));
    }
    report_step_add(report, "factorize", factorized);

    const double inverting = clock_seconds();
    progress_report(options->progress, "invert", 0);
    const size_t k = mesh.k;
    report_text(report, "assign", by_proximity(o) ? "proximity" : "inclusion");
    report_number(report, "coherence_min", mesh.smallest_coherence);
    report_number(report, "patch_area_min", mesh.smallest_area);
    snprintf(report->detail, sizeof report->detail,
             "%zu patches of %zu elements by %s, coherence %.3g or more, the smallest patch %.3g m2", k,
             problem->n, by_proximity(o) ? "proximity" : "inclusion", mesh.smallest_coherence,
             mesh.smallest_area);
    if (qr)
        TRY(operator_of_factors(problem, &S, &f, o->keep_factors, op, &rcond, error));
    else
        TRY(build_summed(problem, &mesh, o->keep_factors, op, &rcond, error));
    report_step_add(report, "invert", clock_seconds() - inverting);
    if (qr) report_text(report, "factorizer", "qr");
    report_number(report, "epsilon", norm);
    report_number(report, "rcond", rcond);
    report_count(report, "rank", (double)k);
    norm_report(problem, norm, report);
done:
    scaled_free(&S);
    coarse_mesh_free(&mesh);
    tall_factors_free(&f);
    return status;
}

/* The options that split patches have no effect with --rank; qr is the only factorizer of this method. */
static bool ignores(const void *own, const build_report *report, const char *option) {
    const two_mesh_options *o = own;
    (void)report;
    if (strcmp(option, "factorizer") == 0)
        return strcmp(o->factorizer, "auto") != 0 && strcmp(o->factorizer, "qr") != 0;
    return o->rank > 0 && (strcmp(option, "coherence") == 0 || strcmp(option, "min-area") == 0);
}

static void forecast(const method_scale *scale, const void *own, method_forecast *out) {
    const double n = scale->n, known = patches_of(own, n), k = known > 0 ? known : fmin(1024, n);
    *out = (method_forecast){
        .building = 4 * n * (2 * fmin(1024, n) + 6 * k), .loaded = 8 * n * k, .stored = 8 * n * k};
}

const build_method method_two_mesh = {
    .name = "2msc",
    .summary = "patches of a coarse mesh send, elements receive (Fernández et al. 2011)",
    .kind = &operator_two_mesh,
    .rows = rows,
    .flags = METHOD_GEOMETRY | METHOD_SURFACES,
    .ignores = ignores,
    .forecast = forecast,
    .build = build,
};
_Static_assert(sizeof(two_mesh_options) <= METHOD_OPTIONS_BYTES, "they fit");
