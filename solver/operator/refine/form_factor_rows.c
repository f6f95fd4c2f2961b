/* Form factors are read and checked, 0 <= F_ij <= 1 and sum_j F_ij <= 1 + 1e-5, or 0 <= g_ij <= min(A_i, A_j)
 * of a triangle, which gives F_ij = min(g_ij / A_i, 1). The row norms (sum_j F_ij^2 / A_j)^1/2 are those of
 * the certificate in refinement.h. Blocks are left to kept_blocks.h. */
#include "solver/operator/refine/form_factor_rows.h"

#include "solver/base/scene/scene_glass.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GROUP STORE_FORM_FACTORS

lam_status form_factors_storage(store *s, form_factor_storage *out, lam_error *error) {
    static const char *const names[STORAGES] = {"rows", "upper", "blocks"};
    lam_status status = LAM_OK;
    char *text = NULL;
    int k = 0;
    TRY(store_get_text(s, GROUP, "storage", &text, error));
    if (strcmp(text, "compressed") == 0)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "%s: its form factors are compressed, which is not supported any more; precompute the scene "
             "again, with --form-factors blocks --keep-form-factors where rows take too much memory",
             store_path(s));
    while (k < STORAGES && strcmp(text, names[k]) != 0) k++;
    if (k == STORAGES)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "%s: /form_factors has the storage '%.20s', which is not supported; precompute the scene again, "
             "or use the version of lambert that wrote the store",
             store_path(s), text);
    *out = (form_factor_storage)k;
done:
    free(text);
    return status;
}

/* Reads rows or the triangle and checks them as sparse rows. */
static lam_status read_csr(store *s, csr *held, lam_error *error) {
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

/* Row sums may be above their largest value by this share of it, as numbers are rounded. */
static const double rounded = 1e-5;

/* Each entry from 0 to 1, each row at most row_most; fills row_sums. */
static lam_status check_rows(store *s, const csr *F, double *row_sums, lam_error *error) {
    lam_status status = LAM_OK;
    double most;
    TRY(glass_row_most_of(s, &most, error));
    most *= 1 + rounded;
    for (size_t i = 0; i < F->n; i++) {
        row_sums[i] = 0;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const float value = F->data[p];
            if (value < 0 || value > 1)
                FAIL(error, LAM_ERR_FORMAT, "%s: form factor F[%zu][%u] = %g, must be from 0 to 1",
                     store_path(s), i, F->indices[p], (double)value);
            row_sums[i] += (double)value;
        }
        if (row_sums[i] > most)
            FAIL(error, LAM_ERR_FORMAT, "%s: form factors of element %zu sum to %g, must be at most %.4g",
                 store_path(s), i, row_sums[i], most);
    }
done:
    return status;
}

/* check_rows for the upper triangle, each entry of which gives two form factors. */
static lam_status check_upper(store *s, const csr *g, const double *area, double *row_sums,
                              lam_error *error) {
    lam_status status = LAM_OK;
    double most;
    TRY(glass_row_most_of(s, &most, error));
    most *= 1 + rounded;
    memset(row_sums, 0, g->n * sizeof *row_sums);
    for (size_t i = 0; i < g->n; i++) {
        for (uint64_t p = g->indptr[i]; p < g->indptr[i + 1]; p++) {
            const uint32_t j = g->indices[p];
            const double exchange = (double)g->data[p], least = fmin(area[i], area[j]);
            if (j <= i)
                FAIL(error, LAM_ERR_FORMAT, "%s: /form_factors: row %zu has the column %u, must be above it",
                     store_path(s), i, j);
            /* The exchange was rounded to single precision twice. */
            if (exchange < 0 || exchange > least * (1 + 1e-6))
                FAIL(error, LAM_ERR_FORMAT,
                     "%s: /form_factors: A_i F_ij of elements %zu and %u is %g m2, must be from 0 to %g",
                     store_path(s), i, j, exchange, least);
            row_sums[i] += (double)upper_factor(g->data[p], area[i]);
            row_sums[j] += (double)upper_factor(g->data[p], area[j]);
        }
    }
    for (size_t i = 0; i < g->n; i++)
        if (row_sums[i] > most)
            FAIL(error, LAM_ERR_FORMAT, "%s: form factors of element %zu sum to %g, must be at most %.4g",
                 store_path(s), i, row_sums[i], most);
done:
    return status;
}

lam_status form_factor_rows_read(store *s, size_t n, const double *area, const large_place *place, csr *held,
                                 bool *rows, double *row_sums, lam_error *error) {
    lam_status status = LAM_OK;
    form_factor_storage how = STORAGE_ROWS;
    *held = (csr){.n = n, .place = place};
    TRY(form_factors_storage(s, &how, error));
    if (how == STORAGE_BLOCKS)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "%s: its form factors are blocks of clusters, where rows are needed; precompute the scene with "
             "--form-factors rays --keep-form-factors",
             store_path(s));
    *rows = how == STORAGE_ROWS;
    TRY(read_csr(s, held, error));
    TRY(*rows ? check_rows(s, held, row_sums, error) : check_upper(s, held, area, row_sums, error));
done:
    return status;
}

/* Rows of F from the triangle. Rows above j give the entries of row j below the diagonal, in ascending order,
 * and row j of the triangle gives the others. */
static lam_status expand(const csr *g, const double *area, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = g->n;
    csr F = {.n = n};
    uint64_t *end = memory_allocate(n, sizeof *end, "form factors", error);
    F.indptr = memory_allocate(n + 1, sizeof *F.indptr, "form factors", error);
    if (end == NULL || F.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        F.indptr[i + 1] += g->indptr[i + 1] - g->indptr[i];
        for (uint64_t p = g->indptr[i]; p < g->indptr[i + 1]; p++) F.indptr[g->indices[p] + 1]++;
    }
    for (size_t i = 0; i < n; i++) {
        end[i] = F.indptr[i];
        F.indptr[i + 1] += F.indptr[i];
    }
    TRY(csr_reserve(&F, F.indptr[n], error));
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = g->indptr[i]; p < g->indptr[i + 1]; p++) {
            const uint32_t j = g->indices[p];
            const uint64_t here = end[i]++, there = end[j]++;
            F.indices[here] = j;
            F.data[here] = upper_factor(g->data[p], area[i]);
            F.indices[there] = (uint32_t)i;
            F.data[there] = upper_factor(g->data[p], area[j]);
        }
    *out = F;
    F = (csr){.n = 0};
done:
    free(end);
    csr_free(&F);
    return status;
}

/* Norms and the longest row. */
static lam_status describe_rows(lam_form_factors *f, lam_error *error) {
    const csr *F = &f->F;
    f->row_norms = memory_allocate(F->n, sizeof *f->row_norms, "form factors", error);
    if (f->row_norms == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < F->n; i++) {
        const uint64_t begin = F->indptr[i], end = F->indptr[i + 1];
        double sum = 0;
        for (uint64_t p = begin; p < end; p++)
            sum += (double)F->data[p] * (double)F->data[p] / f->area[F->indices[p]];
        f->row_norms[i] = sqrt(sum);
        if (end - begin > f->longest) f->longest = end - begin;
    }
    return LAM_OK;
}

static lam_status read_area(store *s, size_t *n, double **area, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX};
    void *data = NULL;
    TRY(store_read(s, STORE_MESH "/area", STORE_F64, 1, dims, &data, error));
    const double *values = data;
    for (size_t i = 0; i < dims[0]; i++)
        if (!(values[i] > 0 && isfinite(values[i])))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/area[%zu] = %g, must be above 0", store_path(s), i,
                 values[i]);
    if (dims[0] == 0) FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/area is empty", store_path(s));
    *n = dims[0];
    *area = data;
    data = NULL;
done:
    free(data);
    return status;
}

lam_status form_factors_size(store *s, size_t *kept, size_t *most, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    size_t rows_of[STORE_MAX_RANK] = {0}, entries[STORE_MAX_RANK] = {0};
    int rank;
    form_factor_storage how = STORAGE_ROWS;
    TRY(form_factors_storage(s, &how, error));
    const bool rows = how == STORAGE_ROWS;
    if (how == STORAGE_BLOCKS) {
        TRY(block_factors_stored(s, kept, most, error));
        goto done;
    }
    TRY(store_array_info(s, GROUP "/indptr", &type, &rank, rows_of, error));
    TRY(store_array_info(s, GROUP "/data", &type, &rank, entries, error));
    const size_t entry = sizeof(uint32_t) + sizeof(float), row = sizeof(uint64_t) + 3 * sizeof(double);
    *kept = (rows ? 1 : 2) * entries[0] * entry + rows_of[0] * row;
    *most = *kept + (rows ? 0 : entries[0] * entry + rows_of[0] * 2 * sizeof(uint64_t));
done:
    return status;
}

static lam_status open_blocks(store *s, lam_form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    f->blocks = memory_allocate(1, sizeof *f->blocks, "form factors", error);
    f->row_norms = memory_allocate(f->n, sizeof *f->row_norms, "form factors", error);
    if (f->blocks == NULL || f->row_norms == NULL) TRY(LAM_ERR_MEMORY);
    double most;
    TRY(glass_row_most_of(s, &most, error));
    TRY(kept_blocks_load(s, f->n, f->area, most * (1 + rounded), f->blocks, f->row_sums, f->row_norms,
                         error));
done:
    return status;
}

lam_status form_factors_open(store *s, lam_form_factors **out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factor_storage how = STORAGE_ROWS;
    lam_form_factors *made = NULL;
    csr held = {.n = 0};
    size_t n = 0;
    bool rows = true;
    if (!store_has(s, GROUP)) {
        *out = NULL;
        return LAM_OK;
    }
    made = memory_allocate(1, sizeof *made, "form factors", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    TRY(read_area(s, &n, &made->area, error));
    made->n = n;
    made->row_sums = memory_allocate(n, sizeof *made->row_sums, "form factors", error);
    if (made->row_sums == NULL) TRY(LAM_ERR_MEMORY);
    TRY(form_factors_storage(s, &how, error));
    if (how == STORAGE_BLOCKS) {
        TRY(open_blocks(s, made, error));
        *out = made;
        made = NULL;
        goto done;
    }
    TRY(form_factor_rows_read(s, n, made->area, NULL, &held, &rows, made->row_sums, error));
    if (rows) {
        made->F = held;
        held = (csr){.n = 0};
    } else {
        TRY(expand(&held, made->area, &made->F, error));
    }
    TRY(describe_rows(made, error));
    *out = made;
    made = NULL;
done:
    csr_free(&held);
    lam_form_factors_close(made);
    return status;
}

lam_status form_factors_of_rows(csr *F, const double *area, lam_form_factors **out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = F->n;
    lam_form_factors *made = memory_allocate(1, sizeof *made, "form factors", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    made->area = memory_allocate(n, sizeof *made->area, "form factors", error);
    made->row_sums = memory_allocate(n, sizeof *made->row_sums, "form factors", error);
    if (made->area == NULL || made->row_sums == NULL) TRY(LAM_ERR_MEMORY);
    made->n = n;
    memcpy(made->area, area, n * sizeof *area);
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) made->row_sums[i] += (double)F->data[p];
    made->F = *F;
    *F = (csr){.n = 0};
    TRY(describe_rows(made, error));
    *out = made;
    made = NULL;
done:
    csr_free(F);
    lam_form_factors_close(made);
    return status;
}

lam_status form_factors_of_blocks(plane_tree *tree, block_factors *f, lam_form_factors **out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = f->n;
    lam_form_factors *made = memory_allocate(1, sizeof *made, "form factors", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    made->n = n;
    made->area = memory_allocate(n, sizeof *made->area, "form factors", error);
    made->row_sums = memory_allocate(n, sizeof *made->row_sums, "form factors", error);
    made->row_norms = memory_allocate(n, sizeof *made->row_norms, "form factors", error);
    made->blocks = memory_allocate(1, sizeof *made->blocks, "form factors", error);
    if (made->area == NULL || made->row_sums == NULL || made->row_norms == NULL || made->blocks == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) made->area[f->order[p]] = f->area[p];
    TRY(kept_blocks_make(tree, f, 1 + rounded, made->blocks, made->row_sums, made->row_norms, error));
    *out = made;
    made = NULL;
done:
    block_factors_free(f);
    plane_tree_free(tree);
    lam_form_factors_close(made);
    return status;
}

lam_status lam_form_factors_open(const char *path, lam_form_factors **out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    if (path == NULL || out == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the form factors are needed");
    TRY(store_open(path, &s, error));
    TRY(form_factors_open(s, out, error));
done:
    store_close(s);
    return status;
}

void lam_form_factors_close(lam_form_factors *f) {
    if (f == NULL) return;
    csr_free(&f->F);
    free(f->area);
    free(f->row_sums);
    free(f->row_norms);
    if (f->blocks != NULL) kept_blocks_free(f->blocks);
    free(f->blocks);
    free(f);
}

size_t lam_form_factors_bytes(const lam_form_factors *f) {
    if (f->blocks != NULL) return kept_blocks_bytes(f->blocks);
    return (size_t)f->F.indptr[f->F.n] * (sizeof *f->F.indices + sizeof *f->F.data) +
           (f->F.n + 1) * sizeof *f->F.indptr;
}
