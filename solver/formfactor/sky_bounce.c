#include "solver/formfactor/sky_bounce.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GROUP STORE_SKY

/* A row of /sky/tiles is a tile. */
enum { TILE_COLUMNS = 9 };
_Static_assert(sizeof(sky_tile) == TILE_COLUMNS * sizeof(double), "a tile is nine numbers");

lam_status sky_bounce_create(const char *tiling, char up, double ground_albedo, size_t n, sky_bounce *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    sky_bounce s = {.n = n, .ground_albedo = ground_albedo};
    size_t count;
    if (!(ground_albedo >= 0 && ground_albedo <= 1))
        FAIL(error, LAM_ERR_ARGUMENT, "--ground-albedo %g: must be from 0 to 1", ground_albedo);
    TRY(sky_tiling_create(tiling, up, &s.tiling, error));
    if (!size_multiply(s.tiling.n_tiles, n, &count))
        FAIL(error, LAM_ERR_MEMORY, "%zu tiles of sky over %zu elements are too many", s.tiling.n_tiles, n);
    s.first_bounce = memory_allocate(count, sizeof *s.first_bounce, "first bounce of the sky", error);
    s.ground = memory_allocate(n, sizeof *s.ground, "first bounce of the sky", error);
    if (s.first_bounce == NULL || s.ground == NULL) TRY(LAM_ERR_MEMORY);
    *out = s;
    s = (sky_bounce){0};
done:
    sky_bounce_free(&s);
    return status;
}

void sky_bounce_free(sky_bounce *s) {
    sky_tiling_free(&s->tiling);
    free(s->first_bounce);
    free(s->ground);
    *s = (sky_bounce){0};
}

void sky_bounce_add(const sky_bounce *s, const float direction[3][SKY_PACKET], unsigned leaving,
                    const double weight[SKY_PACKET], double *sums) {
    uint32_t tile[SKY_PACKET];
    sky_tiling_find(&s->tiling, direction, tile);
    for (int i = 0; i < SKY_PACKET; i++)
        if ((leaving >> i & 1) != 0) sums[tile[i]] += weight[i];
}

void sky_bounce_put(sky_bounce *s, size_t element, double *sums, double whole) {
    const size_t m = s->tiling.n_tiles;
    for (size_t t = 0; t < m; t++)
        if (sums[t] > 0) s->first_bounce[t * s->n + element] = (float)(sums[t] / whole);
    s->ground[element] = sums[m] / whole;
    memset(sums, 0, (m + 1) * sizeof *sums);
}

/* The ground, an unoccluded infinite diffuse plane, receives H_g = sum_t c_t L_t, with c_t the tile's
 * integral of the cosine to the zenith, and reflects the radiance a H_g / pi. So H0_i = pi sum_t F_it L_t +
 * pi F_ig a H_g / pi = sum_t pi (F_it + F_ig a c_t / pi) L_t. */
void sky_bounce_close(sky_bounce *s, const double *scale) {
    const size_t n = s->n;
#pragma omp parallel for schedule(static, 4)
    for (size_t t = 0; t < s->tiling.n_tiles; t++) {
        const double back = s->ground_albedo * s->tiling.tiles[t].cosine * M_1_PI;
        float *row = s->first_bounce + t * n;
        for (size_t i = 0; i < n; i++)
            row[i] = (float)(M_PI * scale[i] * ((double)row[i] + s->ground[i] * back));
    }
    free(s->ground);
    s->ground = NULL;
}

lam_status sky_bounce_save(const sky_bounce *b, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = b->tiling.n_tiles;
    const char up[2] = {b->tiling.up, '\0'};
    TRY(store_write(s, GROUP "/tiles", STORE_F64, 2, (size_t[]){m, TILE_COLUMNS}, b->tiling.tiles, error));
    TRY(store_write(s, GROUP "/first_bounce", STORE_F32, 2, (size_t[]){m, b->n}, b->first_bounce, error));
    TRY(store_set_text(s, GROUP, "tiling", b->tiling.name, error));
    TRY(store_set_number(s, GROUP, "ground_albedo", b->ground_albedo, error));
    TRY(store_set_text(s, GROUP, "up", up, error));
    if (b->north != 0) TRY(store_set_number(s, GROUP, "north", b->north, error));
done:
    return status;
}

lam_status sky_north_load(store *s, double *north, lam_error *error) {
    lam_status status = LAM_OK;
    double read = 0;
    if (store_has_attribute(s, GROUP, "north")) TRY(store_get_number(s, GROUP, "north", &read, error));
    if (!(fabs(read) <= 360))
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP " attribute north is %g, must be from -360 to 360",
             store_path(s), read);
    *north = read;
done:
    return status;
}

lam_status sky_bounce_load(store *s, size_t n, sky_bounce *out, lam_error *error) {
    lam_status status = LAM_OK;
    sky_bounce b = {.n = n};
    char *name = NULL, *up = NULL;
    void *tiles = NULL, *data;
    lam_error why = {0};
    TRY(store_get_text(s, GROUP, "tiling", &name, error));
    TRY(store_get_text(s, GROUP, "up", &up, error));
    TRY(store_get_number(s, GROUP, "ground_albedo", &b.ground_albedo, error));
    TRY(sky_north_load(s, &b.north, error));
    if (strlen(up) != 1 || strchr("xyz", up[0]) == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP " attribute up is '%.20s', must be x, y or z", store_path(s),
             up);
    if (!(b.ground_albedo >= 0 && b.ground_albedo <= 1))
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP " attribute ground_albedo is %g, must be from 0 to 1",
             store_path(s), b.ground_albedo);
    status = sky_tiling_create(name, up[0], &b.tiling, &why);
    if (status == LAM_ERR_ARGUMENT)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP " attribute tiling: %s", store_path(s), why.message);
    if (status != LAM_OK) FAIL(error, status, "%s", why.message);
    const size_t m = b.tiling.n_tiles;
    TRY(store_read(s, GROUP "/tiles", STORE_F64, 2, (size_t[]){m, TILE_COLUMNS}, &tiles, error));
    const double *stored = tiles, *made = b.tiling.tiles[0].centre;
    for (size_t k = 0; k < m * TILE_COLUMNS; k++)
        if (!(fabs(stored[k] - made[k]) <= 1e-9))
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/tiles[%zu][%zu] = %.12g, %s has %.12g there",
                 store_path(s), k / TILE_COLUMNS, k % TILE_COLUMNS, stored[k], b.tiling.name, made[k]);
    TRY(store_read(s, GROUP "/first_bounce", STORE_F32, 2, (size_t[]){m, n}, &data, error));
    b.first_bounce = data;
    for (size_t k = 0; k < m * n; k++)
        if (!(b.first_bounce[k] >= 0 && isfinite(b.first_bounce[k])))
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/first_bounce[%zu][%zu] = %g, must be at least 0",
                 store_path(s), k / n, k % n, (double)b.first_bounce[k]);
    *out = b;
    b = (sky_bounce){0};
done:
    free(name);
    free(up);
    free(tiles);
    sky_bounce_free(&b);
    return status;
}
