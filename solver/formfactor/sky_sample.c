#include "solver/formfactor/sky_sample.h"

#include "solver/formfactor/rays/rays.h"

#include <stdlib.h>

lam_status sky_sample_make(const mesh *m, const uint32_t *order, const sky_bounce *like,
                           const form_factor_options *options, sky_bounce *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    packed_rows counts = {0};
    sky_bounce made = {.n = 0};
    double *scale = memory_allocate(m->n, 3 * sizeof *scale, "the sky for the judge", error);
    form_factor_options how = *options;
    how.recipe.method = RECIPE_RAYS;
    how.without_rows = true;
    how.bounce = &made;
    if (scale == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sky_bounce_create(like->tiling.name, m->up, like->ground_albedo, m->n, &made, error));
    TRY(visibility_create(m, &v, error));
    TRY(rays_count(m, v, order, &how, &counts, scale + m->n, scale + 2 * m->n, error));
    for (size_t i = 0; i < m->n; i++) scale[i] = 1;
    sky_bounce_close(&made, scale);
    *out = made;
    made = (sky_bounce){.n = 0};
done:
    packed_rows_free(&counts);
    sky_bounce_free(&made);
    visibility_destroy(v);
    free(scale);
    return status;
}
