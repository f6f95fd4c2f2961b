/* Makes form factors as rows by the source of a recipe; make_blocks.c makes them by blocks. */
#include "solver/formfactor/formfactor.h"

#include "solver/base/clock.h"
#include "solver/formfactor/glass/pane_factors.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/rays/hemicube.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/source.h"
#include "solver/linalg/csr.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status form_factors_make(const mesh *m, const uint32_t *order, const form_factor_options *asked,
                             form_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    form_factor_options own = *asked;
    const form_factor_options *const options = &own;
    const factor_source *const source = recipe_source(&asked->recipe);
    const pane_samples through = panes_beside(&options->recipe);
    form_factors f = {.recipe = options->recipe};
    TRY(recipe_check(&options->recipe, error));
    if (source->make == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s of form factors are no rows; give another --form-factors",
             source->name);
    f.leaving = memory_allocate(m->n, sizeof *f.leaving, "form factors", error);
    f.absorbed = memory_allocate(m->n, sizeof *f.absorbed, "form factors", error);
    if (f.leaving == NULL || f.absorbed == NULL) TRY(LAM_ERR_MEMORY);
    if (asked->sky != NULL)
        TRY(sky_bounce_create(asked->sky, m->up, asked->ground_albedo, m->n, &f.sky, error));
    own.bounce = asked->sky != NULL ? &f.sky : NULL;
    own.n_aimed = &f.n_aimed;
    TRY(visibility_create(m, &v, error));
    TRY(source->make(m, v, order, options, &f, error));
    if (asked->sky != NULL) TRY(leaving_to_sky(&f, m, error));
    TRY(panes_add(m, v, order, options, &through, &f, error));
    if (!options->upper) TRY(form_factors_expand(&f, m->area, error));
    *out = f;
    f = (form_factors){0};
done:
    visibility_destroy(v);
    form_factors_free(&f);
    return status;
}

lam_status form_factors_try_rays(const mesh *m, const uint32_t *order, ray_trial *out, lam_error *error) {
    enum { ELEMENTS = 256, RAYS = 512, LONG_ENOUGH = 32 };
    static const double trial_seconds = .04;
    lam_status status = LAM_OK;
    visibility *v = NULL;
    TRY(visibility_create(m, &v, error));
    rays_cast_some(m, v, order, ELEMENTS, VISIBILITY_PACKET); /* starts threads and fills caches */
    const double started = clock_seconds(), used = clock_processor_seconds();
    *out = (ray_trial){.rays = 0};
    for (int k = 0; k < LONG_ENOUGH && out->seconds < trial_seconds; k++) {
        rays_cast_some(m, v, order, ELEMENTS, RAYS);
        out->rays += ELEMENTS * RAYS;
        out->seconds = fmax(clock_seconds() - started, 1e-6);
    }
    out->processor_seconds = fmax(clock_processor_seconds() - used, 1e-6);
done:
    visibility_destroy(v);
    return status;
}

/* The rows of some elements before the two estimates of a pair are merged, freed by packed_rows_free. */
static lam_status find_some(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                            const progress *steps, const char *stage, packed_rows *rows, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    hemicube h = {0};
    double *outside = memory_allocate(m->n, 2 * sizeof *outside, "rows of form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    const form_factor_options options = {
        .recipe = *how, .progress = steps, .stage = stage, .only_first = count};
    const bool cubes = recipe_can(how, SOURCE_RESOLUTION);
    if (!cubes && !recipe_can(how, SOURCE_RAYS))
        FAIL(error, LAM_ERR_ARGUMENT, "elements seen: must be counted by rays or by hemicubes");
    if (count < 1 || count > m->n)
        FAIL(error, LAM_ERR_ARGUMENT, "elements seen: by %zu of %zu elements; must be by 1 to all", count,
             m->n);
    TRY(visibility_create(m, &v, error));
    if (cubes) {
        TRY(hemicube_create(how->resolution, &h, error));
        TRY(hemicube_trace(&h, m, v, elements, &options, rows, outside, outside + m->n, error));
    } else {
        TRY(rays_count(m, v, elements, &options, rows, outside, outside + m->n, error));
    }
done:
    free(outside);
    hemicube_free(&h);
    visibility_destroy(v);
    return status;
}

lam_status form_factors_count_seen(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                   const progress *steps, const char *stage, size_t *seen, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows rows = {0};
    TRY(find_some(m, how, elements, count, steps, stage, &rows, error));
    for (size_t k = 0; k < count; k++) seen[k] = rows.rows[elements[k]].n_entries;
done:
    packed_rows_free(&rows);
    return status;
}

lam_status form_factors_some_rows(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                  const progress *steps, const char *stage, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows rows = {0};
    csr made = {.n = m->n};
    TRY(find_some(m, how, elements, count, steps, stage, &rows, error));
    made.indptr = memory_allocate(m->n + 1, sizeof *made.indptr, "rows of form factors", error);
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) made.indptr[elements[k] + 1] = rows.rows[elements[k]].n_entries;
    TRY(csr_begin_rows(&made, "rows of form factors", error));
    const double each = rows.kind == ROW_COUNTS ? 1 / (double)how->rays : 1;
    for (size_t k = 0; k < count; k++) {
        const packed_row *row = &rows.rows[elements[k]];
        const uint8_t *from = row->bytes;
        uint32_t column = 0, gap;
        float value;
        for (size_t p = 0; p < row->n_entries; p++) {
            from = row_get(rows.kind, from, &gap, &value);
            column += gap;
            made.indices[made.indptr[elements[k]]] = column++;
            made.data[made.indptr[elements[k]]++] = (float)(each * (double)value);
        }
    }
    csr_end_rows(&made);
    *out = made;
    made = (csr){0};
done:
    csr_free(&made);
    packed_rows_free(&rows);
    return status;
}
