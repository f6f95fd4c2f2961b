#include "solver/formfactor/sky_sample.h"

#include "solver/formfactor/glass/pane_factors.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/source.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status sky_sample_make(const mesh *m, const uint32_t *order, const sky_bounce *like,
                           const form_factor_options *options, sky_bounce *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    packed_rows counts = {0};
    sky_bounce made = {.n = 0};
    double *scale = memory_allocate(m->n, 3 * sizeof *scale, "the sky for the judge", error);
    double *ground = memory_allocate(m->n, sizeof *ground, "the sky for the judge", error);
    form_factor_options how = *options;
    how.recipe.source = &source_rays;
    how.without_rows = true;
    how.bounce = &made;
    const pane_samples through = panes_beside(&how.recipe);
    if (scale == NULL || ground == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sky_bounce_create(like->tiling.name, m->up, like->ground_albedo, m->n, &made, error));
    TRY(visibility_create(m, &v, error));
    TRY(rays_count(m, v, order, &how, &counts, scale + m->n, scale + 2 * m->n, error));
    for (size_t i = 0; i < m->n; i++) scale[i] = 1;
    memcpy(ground, made.ground, m->n * sizeof *ground);
    sky_bounce_close(&made, scale);
    TRY(panes_add_bounce(m, v, order, &how, &through, &made, ground, error));
    made.ground = ground;
    *out = made;
    ground = NULL;
    made = (sky_bounce){.n = 0};
done:
    packed_rows_free(&counts);
    sky_bounce_free(&made);
    visibility_destroy(v);
    free(scale);
    free(ground);
    return status;
}

/* Points of the square to directions even in the solid angle of a tile, in the axes of the scene. */
static void aim(const sky_tiling *tiling, const sky_tile *tile, const double u[VISIBILITY_PACKET],
                const double w[VISIBILITY_PACKET], ray_packet *rays) {
    const double low = sin(tile->altitude[0]), high = sin(tile->altitude[1]);
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        const double z = low + u[k] * (high - low), level = sqrt(fmax(0, 1 - z * z));
        const double azimuth = tile->azimuth[0] + w[k] * (tile->azimuth[1] - tile->azimuth[0]);
        const double local[3] = {level * sin(azimuth), level * cos(azimuth), z}; /* east, north, up */
        for (int d = 0; d < 3; d++) rays->direction[tiling->axis[d]][k] = tiling->sign[d] * (float)local[d];
    }
}

/* The mean over the rays of cos V, V = 1 of those that hit nothing, less what panes hold back. */
static double seen_share(const mesh *m, const visibility *v, const element_sampler *from, size_t element,
                         const sky_tiling *tiling, size_t tile, size_t rays, uint64_t seed) {
    uint32_t self[VISIBILITY_PACKET];
    double sum = 0;
    pair_sampler points;
    for (int k = 0; k < VISIBILITY_PACKET; k++) self[k] = (uint32_t)element;
    pair_sampler_init(&points, seed, element, tile);
    for (uint32_t first = 0; first < rays; first += VISIBILITY_PACKET) {
        double x[4][VISIBILITY_PACKET], cosine[VISIBILITY_PACKET];
        ray_packet packet;
        hit_packet hits;
        bool any = false;
        pair_sampler_packet(&points, first, x);
        aim(tiling, &tiling->tiles[tile], x[2], x[3], &packet);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            float point[3];
            element_sampler_point(from, (float)x[0][k], (float)x[1][k], point);
            cosine[k] = 0;
            for (int d = 0; d < 3; d++) {
                packet.origin[d][k] = point[d];
                cosine[k] += (double)from->frame.normal[d] * (double)packet.direction[d][k];
            }
            any = any || cosine[k] > 0;
        }
        if (!any) continue;
        visibility_cast(v, &packet, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
        pane_path_follow(v, m, &packet, VISIBILITY_PACKET, &hits, cosine, NULL);
        for (int k = 0; k < VISIBILITY_PACKET; k++)
            if (hits.element[k] == VISIBILITY_NOTHING) sum += fmax(0, cosine[k]);
    }
    return sum / (double)rays;
}

/* The light of the tile itself, and that of the ground: pi times the share of the ground times what it
 * reflects, as in sky_bounce_close. */
static float first_bounce_of(const sky_bounce *sampled, size_t element, size_t tile, double seen) {
    const sky_tile *at = &sampled->tiling.tiles[tile];
    const double reflected = sampled->ground[element] * sampled->ground_albedo * at->cosine;
    return (float)(seen * at->solid_angle + reflected);
}

lam_status sky_sample_tiles(const mesh *m, const sky_bounce *sampled, size_t rays, uint64_t seed,
                            size_t n_tiles, const size_t *tiles, float *first, lam_error *error) {
    lam_status status = LAM_OK;
    const sky_tiling *tiling = &sampled->tiling;
    visibility *v = NULL;
    TRY(visibility_create(m, &v, error));
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t i = 0; i < m->n; i++) {
        element_sampler from;
        element_sampler_init(&from, m, v, i, seed);
        for (size_t k = 0; k < n_tiles; k++) {
            const double seen = seen_share(m, v, &from, i, tiling, tiles[k], rays, seed);
            first[k * m->n + i] = first_bounce_of(sampled, i, tiles[k], seen);
        }
    }
done:
    visibility_destroy(v);
    return status;
}

lam_status sky_sample_pairs(const mesh *m, const sky_bounce *sampled, size_t rays, uint64_t seed,
                            size_t count, const size_t *elements, const size_t *tiles, float *first,
                            lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    TRY(visibility_create(m, &v, error));
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t k = 0; k < count; k++) {
        element_sampler from;
        element_sampler_init(&from, m, v, elements[k], seed);
        const double seen = seen_share(m, v, &from, elements[k], &sampled->tiling, tiles[k], rays, seed);
        first[k] = first_bounce_of(sampled, elements[k], tiles[k], seen);
    }
done:
    visibility_destroy(v);
    return status;
}
