/* 2msc: two meshes with spatial coherence (Fernández et al. 2011). The coarse mesh sends, the fine one
 * receives; with --factorizer qr its columns only choose the space that S is projected on. */
#include "solver/method/two_mesh/method_two_mesh.h"

#include "solver/base/clock.h"
#include "solver/method/low_rank/fold_factors.h"
#include "solver/method/low_rank/norm.h"
#include "solver/method/low_rank/orthonormal.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Elements a patch has on average where nothing is asked for. */
enum { ELEMENTS_OF_PATCH = 16 };

static coarse_options coarse_of(const build_problem *problem, const build_options *options) {
    coarse_options coarse = {.coherence = options->coherence > 0 ? options->coherence : 1,
                             .min_area = options->min_area,
                             .proximity = options->proximity};
    if (options->rank > 0)
        coarse.patches = options->rank < problem->n ? options->rank : problem->n;
    else if (options->coherence <= 0 && options->min_area <= 0)
        coarse.patches = (problem->n + ELEMENTS_OF_PATCH - 1) / ELEMENTS_OF_PATCH;
    return coarse;
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
                               lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels, k = mesh->k;
    lam_operator *made = NULL;
    two_mesh_arrays arrays = {0};
    float *core = memory_allocate(C, k * k * sizeof *core, "core", error);
    if (core == NULL) TRY(LAM_ERR_MEMORY);
    TRY(two_mesh_factors(problem, mesh, &arrays.left, &arrays.weight, error));
    report->rcond = 1;
    for (size_t c = 0; c < C; c++) {
        double rcond;
        TRY(two_mesh_core(mesh, arrays.left, arrays.weight, problem->reflectance + c * n, core + c * k * k,
                          &rcond, error));
        report->rcond = fmin(report->rcond, rcond);
    }
    if (C == 1 && !keep_factors) {
        TRY(finish_fold(n, k, core, problem->reflectance, mesh->element, arrays.left, error));
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

static void explain(const build_options *options, size_t n, build_report *r) {
    snprintf(r->reason, sizeof r->reason,
             "2msc: asked for by --method; %zu patches of %zu elements by %s, coherence %.3g or more, the "
             "smallest patch %.3g m2",
             r->rank, n, options->proximity ? "proximity" : "inclusion", r->coherence, r->patch_area);
}

static lam_status build(const build_problem *problem, const build_options *options, lam_operator **op,
                        build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const bool qr = strcmp(options->factorizer, "qr") == 0;
    const coarse_options coarse = coarse_of(problem, options);
    row_source rows;
    scaled_matrix S = {0};
    coarse_mesh mesh = {0};
    tall_factors f = {0};
    if (problem->centre == NULL || problem->normal == NULL || problem->surface == NULL)
        FAIL(error, LAM_ERR_INTERNAL,
             "--method 2msc needs the centres, normals and surfaces of the elements");

    const double start = clock_seconds();
    progress_report(options->progress, "patches", 0);
    TRY(coarse_mesh_create(problem, &coarse, options->progress, &mesh, error));
    TRY(check_memory(problem, options, mesh.k, qr, error));
    report->factorize_seconds = clock_seconds() - start;
    row_source_of_csr(&rows, problem->F);
    TRY(scaled_init(&S, &rows, problem->area, problem->order, error));
    if (qr) {
        TRY(qr_factors(problem, &mesh, &S, &f, error));
        report->factorize_seconds = clock_seconds() - start;
        TRY(norm_of_error(&S, &f, options->progress, &report->measured_norm_error, error));
    } else {
        TRY(two_mesh_norm(problem, &mesh, &S, options->progress, &report->measured_norm_error, error));
    }

    const double inverting = clock_seconds();
    progress_report(options->progress, "invert", 0);
    report->rank = mesh.k;
    report->coherence = mesh.smallest_coherence;
    report->patch_area = mesh.smallest_area;
    if (qr)
        TRY(finish_low_rank(problem, &S, &f, options->keep_factors, op, &report->rcond, error));
    else
        TRY(build_summed(problem, &mesh, options->keep_factors, op, report, error));
    report->invert_seconds = clock_seconds() - inverting;
    report->method = "2msc";
    report->factorizer = qr ? "qr" : NULL;
    report->levels = -1;
    report->epsilon = report->measured_norm_error;
    explain(options, problem->n, report);
done:
    scaled_free(&S);
    coarse_mesh_free(&mesh);
    tall_factors_free(&f);
    return status;
}

const build_method build_two_mesh = {"2msc", build};
