#include "solver/bench/formfactors.h"
#include "solver/bench/formfactors_truths.h"
#include "solver/method/reference.h"

#include <math.h>
#include <stdlib.h>

static const table_column columns[] = {
    {"enclosure", NULL, "which"},
    {"source", NULL, "of the truth"},
    {"method", NULL, "how the form factors were found"},
    {"quantity", NULL, "F, or B in W/m2"},
    {"from", "", "surface, from 1"},
    {"to", "", "surface, from 1"},
    {"truth", "", "F: exact, or as published; B: as published"},
    {"estimate", "", "as found"},
    {"error", "", "absolute"},
    {"own_accuracy", "", "how far the published value may be off"},
};

static const table_column summary_columns[] = {
    {"enclosure", NULL, "which"},
    {"method", NULL, "how the form factors were found"},
    {"F_worst", "", "largest absolute error of a form factor"},
    {"F_own", "", "how far the published form factors may be off"},
    {"B_worst", "W/m2", "largest absolute error of a radiosity"},
    {"B_own", "W/m2", "how far the published radiosity may be off"},
    {"seconds", "s", "of the form factors"},
};

enum { SURFACES_MOST = 8 };

/* Area-weighted means of F over the pieces of a surface, and the area that it stands for. */
static void between_surfaces(const formfactors_enclosure *e, const mesh *m, const csr *F, double *out,
                             double *area) {
    for (size_t s = 0; s < e->n_surfaces; s++) {
        double *row = out + s * e->n_surfaces;
        bool first = true;
        area[s] = 0;
        for (size_t t = 0; t < e->n_surfaces; t++) row[t] = 0;
        for (size_t i = 0; i < e->n; i++) {
            if (e->surface[i] != (int)s || (e->strips && !first)) continue;
            first = false;
            area[s] += m->area[i];
            for (size_t j = 0; j < e->n; j++) row[e->surface[j]] += m->area[i] * formfactors_entry(F, i, j);
        }
        for (size_t t = 0; t < e->n_surfaces; t++) row[t] /= area[s];
    }
}

/* B = E + rho F B between the surfaces themselves. */
static lam_status solve_surfaces(const formfactors_enclosure *e, const double *F, const double *area,
                                 double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = e->n_surfaces;
    uint64_t indptr[SURFACES_MOST + 1] = {0};
    uint32_t indices[SURFACES_MOST * SURFACES_MOST];
    float data[SURFACES_MOST * SURFACES_MOST], reflectance[SURFACES_MOST];
    for (size_t i = 0; i < n; i++) {
        reflectance[i] = .1f;
        indptr[i + 1] = (i + 1) * n;
        for (size_t j = 0; j < n; j++) {
            indices[i * n + j] = (uint32_t)j;
            data[i * n + j] = (float)F[i * n + j];
        }
    }
    const csr rows = {.n = n, .indptr = indptr, .indices = indices, .data = data};
    reference *r = NULL;
    TRY(reference_create(&rows, area, reflectance, REFERENCE_DENSE, &r, error));
    TRY(reference_solve(r, 1, e->E, B, 1e-9, NULL, error));
done:
    reference_destroy(r);
    return status;
}

/* One row of the table; returns the error. */
static double add_row(table *out, const formfactors_enclosure *e, const char *method, size_t from, size_t to,
                      const double pair[2], double own) {
    table_text(out, e->name);
    table_text(out, e->source);
    table_text(out, method);
    table_text(out, to > 0 ? "F" : "B");
    table_number(out, (double)from);
    table_number(out, to > 0 ? (double)to : NAN);
    table_number(out, pair[0]);
    table_number(out, pair[1]);
    table_number(out, fabs(pair[1] - pair[0]));
    table_number(out, own);
    return fabs(pair[1] - pair[0]);
}

static lam_status measure(const bench_run *run, const formfactors_enclosure *e, const recipe *how, table *out,
                          table *summary, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    uint32_t *order = NULL;
    form_factors f = {.row_sums = NULL};
    double F[SURFACES_MOST * SURFACES_MOST], area[SURFACES_MOST], B[SURFACES_MOST];
    double seconds, F_worst = 0, B_worst = 0;
    char method[64];
    TRY(scene_of_pieces(e->pieces, e->n, &m, error));
    TRY(formfactors_order(&m, &order, error));
    TRY(formfactors_make_timed(run, &m, order, how, "enclosures", &f, &seconds, error));
    between_surfaces(e, &m, &f.F, F, area);
    recipe_describe(how, method);
    for (size_t s = 0; s < e->n_surfaces; s++)
        for (size_t t = 0; t < e->n_surfaces; t++) {
            const size_t at = s * e->n_surfaces + t;
            const double pair[2] = {e->F[at], F[at]};
            F_worst = fmax(F_worst, add_row(out, e, method, s + 1, t + 1, pair, e->F_within));
        }
    if (e->B != NULL) {
        TRY(solve_surfaces(e, F, area, B, error));
        for (size_t s = 0; s < e->n_surfaces; s++) {
            const double pair[2] = {e->B[s], B[s]};
            B_worst = fmax(B_worst, add_row(out, e, method, s + 1, 0, pair, e->B_within));
        }
    }
    table_text(summary, e->name);
    table_text(summary, method);
    table_number(summary, F_worst);
    table_number(summary, e->F_within);
    table_number(summary, e->B != NULL ? B_worst : NAN);
    table_number(summary, e->B != NULL ? e->B_within : NAN);
    table_number(summary, seconds);
done:
    form_factors_free(&f);
    free(order);
    mesh_free(&m);
    return status;
}

lam_status formfactors_of_enclosures(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t rays = run->scale == BENCH_QUICK ? 4096 : 65536,
                 resolution = run->scale == BENCH_QUICK ? 64 : 512;
    const recipe methods[] = {formfactors_rays(rays, run->seed), formfactors_hemicube(resolution),
                              formfactors_pairs(7e-5, run->seed), formfactors_pairs(7e-6, run->seed)};
    const size_t n_methods = run->scale == BENCH_QUICK ? 3 : 4;
    table out = {.name = "enclosures",
                 .title = "Enclosures: every factor between surfaces",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns};
    table summary = {.name = "enclosures-summary",
                     .title = "Enclosures: largest errors beside the accuracy of what was published",
                     .columns = summary_columns,
                     .n_columns = sizeof summary_columns / sizeof *summary_columns,
                     .printed = true};
    for (const formfactors_enclosure *e = formfactors_enclosures; e->name != NULL; e++)
        for (size_t k = 0; k < n_methods; k++) TRY(measure(run, e, &methods[k], &out, &summary, error));
    TRY(bench_table(run, &out, error));
    TRY(bench_table(run, &summary, error));
done:
    table_free(&out);
    table_free(&summary);
    return status;
}
