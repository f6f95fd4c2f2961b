#include "solver/render/store_view.h"

#include "solver/operator/refine/form_factor_rows.h"
#include "solver/operator/two_mesh.h"
#include "solver/render/tone.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static lam_status load_patches(store *s, lam_operator **op, operator_patches *patches, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *loaded = NULL;
    TRY(operator_load(s, &loaded, error));
    if (!operator_patches_of(loaded, patches))
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: an operator of kind %s has no patches; precompute it with --method 2msc", store_path(s),
             lam_operator_kind(loaded));
    *op = loaded;
    loaded = NULL;
done:
    lam_operator_close(loaded);
    return status;
}

static size_t element_at(const operator_patches *patches, uint64_t position) {
    return patches->order != NULL ? patches->order[position] : (size_t)position;
}

lam_status store_view_coherence(store *s, float **values, float *smallest, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    operator_patches patches;
    float *coherence = NULL, least = 1;
    TRY(load_patches(s, &op, &patches, error));
    if (patches.coherence == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: holds no /operator/coherence; precompute it again", store_path(s));
    coherence = memory_allocate(lam_operator_elements(op), sizeof *coherence, "coherence", error);
    if (coherence == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < patches.k; p++) {
        least = fminf(least, patches.coherence[p]);
        for (uint64_t j = patches.begin[p]; j < patches.begin[p + 1]; j++)
            coherence[element_at(&patches, j)] = patches.coherence[p];
    }
    *values = coherence;
    *smallest = least;
    coherence = NULL;
done:
    free(coherence);
    lam_operator_close(op);
    return status;
}

/* Consecutive patches, often neighbours, get hues a golden section of the circle apart. Two lightnesses
 * distinguish patches whose hues come close again. */
static void color_of(size_t patch, float rgb[3]) {
    const double golden = .6180339887498949, lightness = patch % 2 == 0 ? .92 : .68, saturation = .62;
    const double hue = fmod(golden * (double)patch, 1) * 6;
    for (int c = 0; c < 3; c++) {
        const double from = fabs(fmod(hue + 6 - 2 * c, 6) - 3) - 1; /* distance from this channel's hue */
        const double share = fmin(fmax(from, 0), 1);
        rgb[c] = tone_decode((float)(lightness * (1 - saturation * (1 - share))));
    }
}

lam_status store_view_patches(store *s, float **values, size_t *n_patches, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    operator_patches patches;
    float *colors = NULL;
    TRY(load_patches(s, &op, &patches, error));
    const size_t n = lam_operator_elements(op);
    colors = memory_allocate(n, 3 * sizeof *colors, "colours", error);
    if (colors == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < patches.k; p++) {
        float rgb[3];
        color_of(p, rgb);
        for (uint64_t j = patches.begin[p]; j < patches.begin[p + 1]; j++)
            for (size_t c = 0; c < 3; c++) colors[c * n + element_at(&patches, j)] = rgb[c];
    }
    *values = colors;
    *n_patches = patches.k;
    colors = NULL;
done:
    free(colors);
    lam_operator_close(op);
    return status;
}

lam_status store_view_visible(store *s, size_t n, float **values, double *mean, double *most,
                              lam_error *error) {
    lam_status status = LAM_OK;
    void *ends = NULL, *columns = NULL;
    form_factor_storage how = STORAGE_ROWS;
    float *counts = NULL;
    size_t dims[STORE_MAX_RANK] = {n + 1}, entries[STORE_MAX_RANK] = {SIZE_MAX};
    if (!store_has(s, STORE_FORM_FACTORS))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: keeps no form factors; precompute it with --keep-form-factors",
             store_path(s));
    TRY(form_factors_storage(s, &how, error));
    if (how == STORAGE_BLOCKS)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: blocks of form factors do not tell which elements see each other; precompute it with "
             "--form-factors rays --keep-form-factors",
             store_path(s));
    TRY(store_read(s, STORE_FORM_FACTORS "/indptr", STORE_U64, 1, dims, &ends, error));
    TRY(store_read(s, STORE_FORM_FACTORS "/indices", STORE_U32, 1, entries, &columns, error));
    counts = memory_allocate(n, sizeof *counts, "counts", error);
    if (counts == NULL) TRY(LAM_ERR_MEMORY);
    const uint64_t *row = ends;
    const uint32_t *column = columns;
    const bool upper = how == STORAGE_UPPER; /* an entry is a pair: both see each other */
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = row[i]; e < row[i + 1]; e++) {
            if (row[i + 1] > entries[0] || column[e] >= n)
                FAIL(error, LAM_ERR_FORMAT, "%s: /form_factors: row %zu goes beyond what is there",
                     store_path(s), i);
            counts[i]++;
            if (upper) counts[column[e]]++;
        }
    *mean = *most = 0;
    for (size_t i = 0; i < n; i++) {
        *mean += (double)counts[i] / (double)n;
        *most = (double)counts[i] > *most ? (double)counts[i] : *most;
    }
    *values = counts;
    counts = NULL;
done:
    free(ends);
    free(columns);
    free(counts);
    return status;
}
