/* The check of a store's sky. */
#include "solver/scene/glass.h"
#include "solver/verify/verify.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>

/* Light from the sky comes from where a row sees no element: sum_j F_ij + sum_t first_bounce_ti / pi <= 1,
 * for any albedo.
 */
lam_status verify_sky(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    sky_bounce sky = {.n = 0};
    double *sums = NULL;
    if (!e->has_mesh || !store_has(e->s, STORE_SKY)) {
        check_say(c, VERDICT_SKIPPED, e->has_mesh ? "there is none" : "no mesh to compare with");
        return LAM_OK;
    }
    const size_t n = e->m.n;
    const double most = mesh_row_most(&e->m);
    TRY(sky_bounce_load(e->s, n, &sky, error));
    check_say(c, VERDICT_OK, "%s, %zu tiles, ground albedo %g; rows and sky sum to at most %g",
              sky.tiling.name, sky.tiling.n_tiles, sky.ground_albedo, most);
    if (sky.tiling.up != e->m.up)
        check_say(c, VERDICT_BROKEN, "%c is up in the sky, %c in the mesh", sky.tiling.up, e->m.up);
    sums = memory_allocate(n, sizeof *sums, "the light of the sky", error);
    if (sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < sky.tiling.n_tiles; t++)
        for (size_t i = 0; i < n; i++) sums[i] += (double)sky.first_bounce[t * n + i] * M_1_PI;
    for (size_t i = 0; i < n && c->verdict == VERDICT_OK; i++)
        /* Single precision rounds each of the row's and the sky's entries by 6e-8 of itself. */
        if (sums[i] > most - e->row_sums[i] + 1e-6)
            check_say(c, VERDICT_BROKEN, "element %zu receives %.9g of the sky, its row leaves %.9g outside",
                      i, sums[i], most - e->row_sums[i]);
done:
    free(sums);
    sky_bounce_free(&sky);
    return check_failed(c, status, error);
}
