/* /form_factors of a store, in mesh order: rows F[i][.], or A_i F_ij for j > i. */
#include "solver/formfactor/formfactor.h"

#include "solver/formfactor/upper.h"

#include <stdlib.h>
#include <string.h>

#define GROUP "/form_factors"

lam_status form_factors_save(const form_factors *f, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const bool rows = f->upper.indptr == NULL;
    const csr *held = rows ? &f->F : &f->upper;
    const size_t n = held->n, nnz = held->indptr[n];
    TRY(store_write(s, GROUP "/indptr", STORE_U64, 1, (size_t[]){n + 1}, held->indptr, error));
    TRY(store_write(s, GROUP "/indices", STORE_U32, 1, &nnz, held->indices, error));
    TRY(store_write(s, GROUP "/data", STORE_F32, 1, &nnz, held->data, error));
    TRY(store_write(s, GROUP "/leaving", STORE_F64, 1, &n, f->leaving, error));
    TRY(store_write(s, GROUP "/absorbed", STORE_F64, 1, &n, f->absorbed, error));
    if (f->repair != NULL) TRY(store_write(s, GROUP "/repair", STORE_F64, 1, &n, f->repair, error));
    TRY(recipe_save(&f->recipe, &recipe_of_form_factors, s, error));
    TRY(store_set_text(s, GROUP, "storage", rows ? "rows" : "upper", error));
    if (f->pairs.accuracy > 0) TRY(store_set_number(s, GROUP, "accuracy_reached", f->pairs.accuracy, error));
    TRY(store_set_integer(s, GROUP, "closed", f->closed, error));
    TRY(store_set_number(s, GROUP, "leaving_share", f->leaving_share, error));
    TRY(store_set_number(s, GROUP, "absorbed_share", f->absorbed_share, error));
    TRY(store_set_number(s, GROUP, "closure_error", f->closure_error, error));
    TRY(store_set_number(s, GROUP, "reciprocity_error", f->reciprocity_error, error));
    TRY(store_set_number(s, GROUP, "repair_mean", f->repair_mean, error));
    TRY(store_set_number(s, GROUP, "repair_max", f->repair_max, error));
done:
    return status;
}

static lam_status load_attributes(store *s, form_factors *f, bool *rows, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    int64_t closed;
    TRY(store_get_text(s, GROUP, "storage", &text, error));
    *rows = strcmp(text, "rows") == 0;
    if (!*rows && strcmp(text, "upper") != 0)
        FAIL(error, LAM_ERR_UNSUPPORTED, "%s: /form_factors with storage '%.20s' is not supported yet",
             store_path(s), text);
    TRY(recipe_load(s, &recipe_of_form_factors, &f->recipe, error));
    TRY(store_get_integer(s, GROUP, "closed", &closed, error));
    f->closed = closed != 0;
    if (store_has_attribute(s, GROUP, "accuracy_reached"))
        TRY(store_get_number(s, GROUP, "accuracy_reached", &f->pairs.accuracy, error));
    TRY(store_get_number(s, GROUP, "leaving_share", &f->leaving_share, error));
    TRY(store_get_number(s, GROUP, "absorbed_share", &f->absorbed_share, error));
    TRY(store_get_number(s, GROUP, "closure_error", &f->closure_error, error));
    TRY(store_get_number(s, GROUP, "reciprocity_error", &f->reciprocity_error, error));
    TRY(store_get_number(s, GROUP, "repair_mean", &f->repair_mean, error));
    TRY(store_get_number(s, GROUP, "repair_max", &f->repair_max, error));
done:
    free(text);
    return status;
}

/* Each entry from 0 to 1, each row at most 1; fills row_sums. */
static lam_status check_rows(store *s, const csr *F, double *row_sums, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < F->n; i++) {
        row_sums[i] = 0;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const float value = F->data[p];
            if (value < 0 || value > 1)
                FAIL(error, LAM_ERR_FORMAT, "%s: form factor F[%zu][%u] = %g, must be from 0 to 1",
                     store_path(s), i, F->indices[p], (double)value);
            row_sums[i] += (double)value;
        }
        if (row_sums[i] > 1 + 1e-5)
            FAIL(error, LAM_ERR_FORMAT, "%s: form factors of element %zu sum to %g, must be at most 1",
                 store_path(s), i, row_sums[i]);
    }
done:
    return status;
}

/* The same of the upper triangle: each entry stands for two. */
static lam_status check_upper(store *s, const csr *g, const double *area, double *row_sums,
                              lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < g->n; i++) {
        for (uint64_t p = g->indptr[i]; p < g->indptr[i + 1]; p++) {
            const uint32_t j = g->indices[p];
            const double exchange = (double)g->data[p], least = fmin(area[i], area[j]);
            if (j <= i)
                FAIL(error, LAM_ERR_FORMAT, "%s: /form_factors: row %zu has the column %u, must be above it",
                     store_path(s), i, j);
            /* Rounded to single precision twice. */
            if (exchange < 0 || exchange > least * (1 + 1e-6))
                FAIL(error, LAM_ERR_FORMAT,
                     "%s: /form_factors: A_i F_ij of elements %zu and %u is %g m2, must be from 0 to %g",
                     store_path(s), i, j, exchange, least);
            row_sums[i] += (double)upper_factor(g->data[p], area[i]);
            row_sums[j] += (double)upper_factor(g->data[p], area[j]);
        }
    }
    for (size_t i = 0; i < g->n; i++)
        if (row_sums[i] > 1 + 1e-5)
            FAIL(error, LAM_ERR_FORMAT, "%s: form factors of element %zu sum to %g, must be at most 1",
                 store_path(s), i, row_sums[i]);
done:
    return status;
}

/* Rows or the triangle, checked as sparse rows. */
static lam_status load_csr(store *s, csr *held, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    size_t nnz[STORE_MAX_RANK];
    int rank;
    void *data;
    TRY(store_read(s, GROUP "/indptr", STORE_U64, 1, (size_t[]){held->n + 1}, &data, error));
    held->indptr = data;
    TRY(store_array_info(s, GROUP "/indices", &type, &rank, nnz, error));
    if (rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s has %d dimensions, must have 1", store_path(s), GROUP "/indices",
             rank);
    TRY(csr_reserve(held, nnz[0], error));
    TRY(store_read_into(s, GROUP "/indices", STORE_U32, 1, nnz, held->indices, error));
    TRY(store_read_into(s, GROUP "/data", STORE_F32, 1, nnz, held->data, error));
    TRY(csr_check(held, nnz[0], GROUP, error));
done:
    return status;
}

lam_status form_factors_load(store *s, const mesh *m, const large_place *large, form_factors *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    form_factors f = {0};
    const size_t n = m->n;
    char *recorded = NULL, found[33];
    if (!store_has(s, GROUP))
        FAIL(error, LAM_ERR_FORMAT, "%s holds no /form_factors; make it again with --keep-form-factors",
             store_path(s));
    TRY(store_get_text(s, "/mesh", "geometry_hash", &recorded, error));
    mesh_geometry_hash(m, found);
    if (strcmp(recorded, found) != 0)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: the form factors belong to geometry %.32s, the mesh is %s; precompute from the scene again",
             store_path(s), recorded, found);
    bool rows;
    TRY(load_attributes(s, &f, &rows, error));

    void *data;
    csr *const held = rows ? &f.F : &f.upper;
    *held = (csr){.n = n, .place = large};
    TRY(load_csr(s, held, error));
    TRY(store_read(s, GROUP "/leaving", STORE_F64, 1, (size_t[]){n}, &data, error));
    f.leaving = data;
    TRY(store_read(s, GROUP "/absorbed", STORE_F64, 1, (size_t[]){n}, &data, error));
    f.absorbed = data;
    if (store_has(s, GROUP "/repair")) {
        TRY(store_read(s, GROUP "/repair", STORE_F64, 1, (size_t[]){n}, &data, error));
        f.repair = data;
    }

    f.row_sums = memory_allocate(n, sizeof *f.row_sums, "form factors", error);
    if (f.row_sums == NULL) TRY(LAM_ERR_MEMORY);
    TRY(rows ? check_rows(s, held, f.row_sums, error) : check_upper(s, held, m->area, f.row_sums, error));
    *out = f;
    f = (form_factors){0};
done:
    free(recorded);
    form_factors_free(&f);
    return status;
}
