#include "solver/light/sun_way.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ELEMENTS = 64, VECTORS = 1024, REFERENCE_POINTS = 16 };

void sun_way_free(sun_way *w) {
    free(w->elements);
    free(w->off);
    *w = (sun_way){.n = 0};
}

/* Some of the suns that shine, evenly spread: *some is freed with free(). The share of those in all vectors
 * that are taken out of all is *share. */
static lam_status choose_suns(const year_sun *suns, size_t n, year_sun **some, size_t *n_some, double *share,
                              lam_error *error) {
    size_t sunny = 0, k = 0, taken = 0;
    for (size_t v = 0; v < n; v++) sunny += suns[v].horizontal > 0;
    *n_some = sunny < VECTORS ? sunny : VECTORS;
    *share = (double)sunny / (double)n;
    *some = memory_allocate(*n_some + 1, sizeof **some, "the suns", error);
    if (*some == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < n && taken < *n_some; v++) {
        if (!(suns[v].horizontal > 0)) continue;
        if (k * *n_some / sunny == taken) (*some)[taken++] = suns[v];
        k++;
    }
    *n_some = taken;
    return LAM_OK;
}

/* The mean direct light of these suns by rays, H [elements of the mesh]. Takes a copy of suns. */
static lam_status by_rays(store *s, const mesh *m, const year_sun *suns, size_t n, size_t n_points,
                          const sun_way *w, const progress *steps, float *H, lam_error *error) {
    lam_status status = LAM_OK;
    sunlight all = {0}, mean = {0};
    year_sun *copy = memory_allocate(n, sizeof *copy, "the suns", error);
    if (copy == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(copy, suns, n * sizeof *copy);
    TRY(sunlight_create(s, m, copy, n, n_points, w->n, w->elements, NULL, &all, error));
    TRY(sunlight_mean(&all, steps, &mean, error));
    memcpy(H, mean.given, m->n * sizeof *H);
done:
    sunlight_free(&all);
    sunlight_free(&mean);
    return status;
}

/* The same by the tiles that hold them. */
static lam_status by_tiles(store *s, const lam_sky *sky, const year_sun *suns, size_t n, float *H,
                           lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    float *L = memory_allocate(lam_sky_tiles(sky), sizeof *L, "the suns", error);
    if (L == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sky_tiling_of_store(s, &tiling, error));
    for (size_t v = 0; v < n; v++) {
        const size_t t = year_sun_tile(&tiling, suns[v].direction);
        if (t < lam_sky_tiles(sky)) L[t] += (float)(suns[v].horizontal / tiling.tiles[t].cosine / (double)n);
    }
    lam_sky_irradiance(sky, 1, L, H);
done:
    free(L);
    sky_tiling_free(&tiling);
    return status;
}

lam_status sun_way_measure(store *s, const mesh *m, const lam_sky *sky, const year_sun *suns,
                           size_t n_vectors, size_t n_points, size_t n_selected, const uint32_t *selected,
                           const progress *steps, sun_way *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t all = selected != NULL ? n_selected : m->n;
    sun_way w = {.n = all < ELEMENTS ? all : ELEMENTS, .exact = n_points > 0};
    year_sun *some = NULL;
    size_t n_some = 0;
    double share = 0;
    float *H = memory_allocate(2, m->n * sizeof *H, "the suns", error);
    w.elements = memory_allocate(w.n + 1, sizeof *w.elements, "the suns", error);
    w.off = memory_allocate(w.n + 1, sizeof *w.off, "the suns", error);
    if (H == NULL || w.elements == NULL || w.off == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < w.n; k++) {
        const size_t place = k * all / w.n;
        w.elements[k] = selected != NULL ? selected[place] : (uint32_t)place;
    }
    TRY(choose_suns(suns, n_vectors, &some, &n_some, &share, error));
    if (n_some == 0) w.n = 0;
    if (w.n > 0) {
        TRY(by_rays(s, m, some, n_some, REFERENCE_POINTS, &w, steps, H, error));
        TRY(n_points > 0 ? by_rays(s, m, some, n_some, n_points, &w, steps, H + m->n, error)
                         : by_tiles(s, sky, some, n_some, H + m->n, error));
    }
    for (size_t k = 0; k < w.n; k++) {
        const uint32_t i = w.elements[k];
        w.off[k] = share * ((double)H[m->n + i] - (double)H[i]);
    }
    *out = w;
    w = (sun_way){.n = 0};
done:
    sun_way_free(&w);
    free(some);
    free(H);
    return status;
}

double sun_way_error(const sun_way *w, const mesh *m, lam_quantity quantity, const float *values,
                     double scale, size_t n_together) {
    double off2 = 0, all2 = 0;
    for (size_t k = 0; k < w->n; k++)
        for (size_t c = 0; c < m->n_channels; c++) {
            const size_t i = w->elements[k];
            const double value = (double)values[c * m->n + i];
            const double off =
                scale * w->off[k] * (quantity == LAM_IRRADIANCE ? 1 : (double)m->reflectance[c * m->n + i]);
            off2 += m->area[i] * off * off;
            all2 += m->area[i] * value * value;
        }
    if (!(all2 > 0)) return 0;
    return sqrt(off2 / all2 / (w->exact ? (double)n_together : 1));
}
