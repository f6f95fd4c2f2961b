/* /form_factors of a store: rows F[i][.] in mesh order. */
#include "solver/formfactor/formfactor.h"

#include <stdlib.h>
#include <string.h>

#define GROUP "/form_factors"

lam_status form_factors_save(const form_factors *f, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = f->F.n, nnz = f->F.indptr[n];
    TRY(store_write(s, GROUP "/indptr", STORE_U64, 1, (size_t[]){n + 1}, f->F.indptr, error));
    TRY(store_write(s, GROUP "/indices", STORE_U32, 1, &nnz, f->F.indices, error));
    TRY(store_write(s, GROUP "/data", STORE_F32, 1, &nnz, f->F.data, error));
    TRY(store_write(s, GROUP "/leaving", STORE_F64, 1, &n, f->leaving, error));
    TRY(store_write(s, GROUP "/absorbed", STORE_F64, 1, &n, f->absorbed, error));
    TRY(recipe_save(&f->recipe, &recipe_of_form_factors, s, error));
    TRY(store_set_text(s, GROUP, "storage", "rows", error));
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

static lam_status load_attributes(store *s, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    int64_t closed;
    TRY(store_get_text(s, GROUP, "storage", &text, error));
    if (strcmp(text, "rows") != 0)
        FAIL(error, LAM_ERR_UNSUPPORTED, "%s: /form_factors with storage '%.20s' is not supported yet",
             store_path(s), text);
    TRY(recipe_load(s, &recipe_of_form_factors, &f->recipe, error));
    TRY(store_get_integer(s, GROUP, "closed", &closed, error));
    f->closed = closed != 0;
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

lam_status form_factors_load(store *s, const mesh *m, form_factors *out, lam_error *error) {
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
    TRY(load_attributes(s, &f, error));

    size_t nnz = SIZE_MAX;
    void *data;
    f.F.n = n;
    TRY(store_read(s, GROUP "/indptr", STORE_U64, 1, (size_t[]){n + 1}, &data, error));
    f.F.indptr = data;
    TRY(store_read(s, GROUP "/indices", STORE_U32, 1, &nnz, &data, error));
    f.F.indices = data;
    TRY(store_read(s, GROUP "/data", STORE_F32, 1, &nnz, &data, error));
    f.F.data = data;
    TRY(csr_check(&f.F, nnz, GROUP, error));
    TRY(store_read(s, GROUP "/leaving", STORE_F64, 1, (size_t[]){n}, &data, error));
    f.leaving = data;
    TRY(store_read(s, GROUP "/absorbed", STORE_F64, 1, (size_t[]){n}, &data, error));
    f.absorbed = data;

    f.row_sums = memory_allocate(n, sizeof *f.row_sums, "form factors", error);
    if (f.row_sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++) {
            const float value = f.F.data[p];
            if (value < 0 || value > 1)
                FAIL(error, LAM_ERR_FORMAT, "%s: form factor F[%zu][%u] = %g, must be from 0 to 1",
                     store_path(s), i, f.F.indices[p], (double)value);
            f.row_sums[i] += (double)value;
        }
        if (f.row_sums[i] > 1 + 1e-5)
            FAIL(error, LAM_ERR_FORMAT, "%s: form factors of element %zu sum to %g, must be at most 1",
                 store_path(s), i, f.row_sums[i]);
    }
    *out = f;
    f = (form_factors){0};
done:
    free(recorded);
    form_factors_free(&f);
    return status;
}
