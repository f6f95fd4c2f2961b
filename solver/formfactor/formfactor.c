/* Form factors once they are made: rows and upper triangle, the mean of two samples, and /form_factors of a
 * store, in mesh order: rows F[i][.], or A_i F_ij for j > i. */
#include "solver/formfactor/formfactor.h"

#include "solver/formfactor/rows/upper.h"
#include "solver/formfactor/source.h"
#include "solver/operator/blocks/block_store.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/scene/glass.h"
#include "store/groups.h"

#include <stdlib.h>
#include <string.h>

#define GROUP STORE_FORM_FACTORS

void form_factors_free(form_factors *f) {
    csr_free(&f->F);
    csr_free(&f->upper);
    free(f->row_sums);
    free(f->through);
    free(f->leaving);
    free(f->absorbed);
    free(f->repair);
    sky_bounce_free(&f->sky);
    *f = (form_factors){0};
}

lam_status form_factors_expand(form_factors *f, const double *area, lam_error *error) {
    if (f->upper.indptr == NULL) return LAM_OK;
    f->F = f->upper;
    f->upper = (csr){0};
    return upper_expand(&f->F, area, f->row_sums, error);
}

/* A repair below this is rounding, or what cubatures leave. */
static const double repair_least = 1e-3;

double form_factors_repair_error(const form_factors *f) {
    const double own = recipe_source(&f->recipe)->repair(&f->recipe),
                 beyond = f->repair_mean * f->repair_mean - own * own;
    return beyond > repair_least * repair_least ? sqrt(beyond) : 0;
}

lam_status form_factors_gather(form_factors *f, const double *area, lam_error *error) {
    if (f->F.indptr == NULL) return LAM_OK;
    f->upper = f->F;
    f->F = (csr){0};
    return upper_gather(&f->upper, area, error);
}

/* Everything of n elements but the rows; storage is the attribute that says how these are stored. */
static lam_status save_about(const form_factors *f, size_t n, const char *storage, store *s,
                             lam_error *error) {
    lam_status status = LAM_OK;
    TRY(store_write(s, GROUP "/leaving", STORE_F64, 1, &n, f->leaving, error));
    TRY(store_write(s, GROUP "/absorbed", STORE_F64, 1, &n, f->absorbed, error));
    if (f->repair != NULL) TRY(store_write(s, GROUP "/repair", STORE_F64, 1, &n, f->repair, error));
    TRY(recipe_save(&f->recipe, &recipe_of_form_factors, s, error));
    TRY(store_set_text(s, GROUP, "storage", storage, error));
    if (f->pairs.accuracy > 0) TRY(store_set_number(s, GROUP, "accuracy_reached", f->pairs.accuracy, error));
    TRY(store_set_integer(s, GROUP, "closed", f->closed, error));
    TRY(store_set_integer(s, GROUP, "fronts_only", f->outlet.fronts_only, error));
    TRY(store_set_number(s, GROUP, "leaving_share", f->leaving_share, error));
    TRY(store_set_number(s, GROUP, "absorbed_share", f->absorbed_share, error));
    TRY(store_set_number(s, GROUP, "closure_error", f->closure_error, error));
    TRY(store_set_number(s, GROUP, "reciprocity_error", f->reciprocity_error, error));
    TRY(store_set_number(s, GROUP, "repair_mean", f->repair_mean, error));
    TRY(store_set_number(s, GROUP, "repair_max", f->repair_max, error));
done:
    return status;
}

lam_status form_factors_save(const form_factors *f, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const bool rows = f->upper.indptr == NULL;
    TRY(csr_save(rows ? &f->F : &f->upper, GROUP, s, error));
    TRY(save_about(f, rows ? f->F.n : f->upper.n, rows ? "rows" : "upper", s, error));
done:
    return status;
}

lam_status form_factors_save_blocks(const form_factors *f, const block_factors *blocks, store *s,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    TRY(block_factors_save(blocks, s, error));
    TRY(save_about(f, blocks->n, "blocks", s, error));
done:
    return status;
}

static lam_status load_attributes(store *s, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    int64_t closed, fronts_only;
    TRY(recipe_load(s, &recipe_of_form_factors, &f->recipe, error));
    TRY(store_get_integer(s, GROUP, "closed", &closed, error));
    f->closed = closed != 0;
    if (store_has_attribute(s, GROUP, "accuracy_reached"))
        TRY(store_get_number(s, GROUP, "accuracy_reached", &f->pairs.accuracy, error));
    TRY(store_get_number(s, GROUP, "leaving_share", &f->leaving_share, error));
    TRY(store_get_number(s, GROUP, "absorbed_share", &f->absorbed_share, error));
    TRY(store_get_integer(s, GROUP, "fronts_only", &fronts_only, error));
    f->outlet.fronts_only = fronts_only != 0;
    TRY(store_get_number(s, GROUP, "closure_error", &f->closure_error, error));
    TRY(store_get_number(s, GROUP, "reciprocity_error", &f->reciprocity_error, error));
    TRY(store_get_number(s, GROUP, "repair_mean", &f->repair_mean, error));
    TRY(store_get_number(s, GROUP, "repair_max", &f->repair_max, error));
done:
    return status;
}

/* All but the form factors themselves; row_sums is for the caller to fill. */
static lam_status load_about(store *s, const mesh *m, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    char *recorded = NULL, found[33];
    void *data;
    if (!store_has(s, GROUP))
        FAIL(error, LAM_ERR_FORMAT, "%s holds no /form_factors; make it again with --keep-form-factors",
             store_path(s));
    TRY(store_get_text(s, STORE_MESH, "geometry_hash", &recorded, error));
    mesh_geometry_hash(m, found);
    if (strcmp(recorded, found) != 0)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: the form factors belong to geometry %.32s, the mesh is %s; precompute from the scene again",
             store_path(s), recorded, found);
    TRY(load_attributes(s, f, error));
    f->row_sums = memory_allocate(n, sizeof *f->row_sums, "form factors", error);
    if (f->row_sums == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_read(s, GROUP "/leaving", STORE_F64, 1, (size_t[]){n}, &data, error));
    f->leaving = data;
    TRY(store_read(s, GROUP "/absorbed", STORE_F64, 1, (size_t[]){n}, &data, error));
    f->absorbed = data;
    if (store_has(s, GROUP "/repair")) {
        TRY(store_read(s, GROUP "/repair", STORE_F64, 1, (size_t[]){n}, &data, error));
        f->repair = data;
    }
done:
    free(recorded);
    return status;
}

lam_status form_factors_load(store *s, const mesh *m, const large_place *large, form_factors *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    form_factors f = {0};
    csr held = {0};
    bool rows = true;
    TRY(load_about(s, m, &f, error));
    status = form_factor_rows_read(s, m->n, m->area, large, &held, &rows, f.row_sums, error);
    *(rows ? &f.F : &f.upper) = held;
    if (status != LAM_OK) goto done;
    *out = f;
    f = (form_factors){0};
done:
    form_factors_free(&f);
    return status;
}

lam_status form_factors_load_blocks(store *s, const mesh *m, plane_tree *tree, block_factors *blocks,
                                    form_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors f = {0};
    const double most = mesh_row_most(m);
    double *ones = memory_allocate(m->n, 2 * sizeof *ones, "form factors", error);
    if (ones == NULL) TRY(LAM_ERR_MEMORY);
    TRY(load_about(s, m, &f, error));
    TRY(block_factors_load(s, m->n, m->area, tree, blocks, error));
    for (size_t p = 0; p < m->n; p++) ones[p] = 1;
    TRY(block_factors_multiply(blocks, 1, ones, ones + m->n, error));
    for (size_t p = 0; p < m->n; p++) {
        const double sum = ones[m->n + p];
        if (!(sum <= most * (1 + 1e-5)))
            FAIL(error, LAM_ERR_FORMAT, "%s: form factors of element %u sum to %g, must be at most %.4g",
                 store_path(s), blocks->order[p], sum, most);
        f.row_sums[blocks->order[p]] = sum < most ? sum : most;
    }
    *out = f;
    f = (form_factors){0};
done:
    free(ones);
    form_factors_free(&f);
    return status;
}
