#include "solver/light/sunlight.h"

#include "solver/base/parallel.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/shadow/sun_ground.h"
#include "solver/shadow/sun_shares.h"
#include "store/groups.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void sunlight_free(sunlight *s) {
    free(s->suns);
    sun_rays_free(s->rays);
    sensor_sun_free(s->sensors);
    sky_tiling_free(&s->tiling);
    free(s->ground);
    free(s->given);
    free(s->given_at);
    *s = (sunlight){0};
}

lam_status sunlight_create(store *s, const mesh *m, year_sun *suns, size_t n_vectors, size_t n_points,
                           size_t n_wanted, const uint32_t *wanted, const lam_sky *in_tiles, sunlight *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    sunlight made = {
        .n_vectors = n_vectors, .n = m->n, .suns = suns, .sky = in_tiles, .sensors_alone = n_points == 0};
    sky_bounce bounce = {.n = 0};
    made.ground = memory_allocate(m->n, sizeof *made.ground, "the light of the ground", error);
    if (made.ground == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sky_bounce_load(s, m->n, &bounce, error));
    sun_ground_find(&bounce.tiling, bounce.ground_albedo, bounce.first_bounce, m->n,
                    (const float(*)[3])m->normal, made.ground);
    made.tiling = bounce.tiling;
    bounce.tiling = (sky_tiling){0};
    if (n_points > 0) TRY(sun_rays_create(m, n_points, SUN_SEED, n_wanted, wanted, &made.rays, error));
    *out = made;
    made = (sunlight){0};
done:
    sky_bounce_free(&bounce);
    sunlight_free(&made);
    return status;
}

lam_status sunlight_at_sensors(sunlight *s, store *of, const mesh *m, const lam_sensors *sensors,
                               lam_error *error) {
    return sensor_sun_create(of, m, sensors, &s->tiling, &s->sensors, error);
}

lam_status sky_tiling_of_store(store *s, sky_tiling *out, lam_error *error) {
    lam_status status = LAM_OK;
    char *name = NULL, *up = NULL;
    TRY(store_get_text(s, STORE_SKY, "tiling", &name, error));
    TRY(store_get_text(s, STORE_SKY, "up", &up, error));
    TRY(sky_tiling_create(name, up[0], out, error));
done:
    free(name);
    free(up);
    return status;
}

bool sunlight_shines(const sunlight *s, size_t vector) {
    return s->given != NULL || s->suns[vector].horizontal > 0;
}

bool sunlight_in_tile(const sunlight *s, size_t vector, size_t *tile, double *radiance) {
    if (s->sky == NULL || s->given != NULL || !sunlight_shines(s, vector)) return false;
    *tile = year_sun_tile(&s->tiling, s->suns[vector].direction);
    *radiance = s->suns[vector].horizontal / s->tiling.tiles[*tile].cosine;
    return true;
}

/* H less what the tile that holds the sun gives directly. */
static void take_tile(const sunlight *s, const year_sun *sun, float *H, float *work) {
    const size_t tile = year_sun_tile(&s->tiling, sun->direction);
    float *L = work + s->n;
    memset(L, 0, s->tiling.n_tiles * sizeof *L);
    L[tile] = (float)(sun->horizontal / s->tiling.tiles[tile].cosine);
    lam_sky_irradiance(s->sky, 1, L, work);
    for (size_t i = 0; i < s->n; i++) H[i] -= work[i];
}

size_t sunlight_work(const sunlight *s) {
    return s->n + s->tiling.n_tiles;
}

/* Turns the shares V n . s that the rays found into irradiances. */
static void finish(const sunlight *s, const year_sun *sun, float *H, float *work) {
    for (size_t i = 0; i < s->n; i++)
        H[i] = (float)((double)H[i] * sun->normal + (double)s->ground[i] * sun->horizontal);
    if (s->sky != NULL) take_tile(s, sun, H, work);
}

/* H [n_vectors][elements, or sensors]: what the sun gives each, of what it gives a plane normal to it. */
static void find_shares(const sunlight *s, bool at_sensors, size_t n_vectors, const size_t *vectors,
                        float *H) {
    const size_t width = at_sensors ? s->sensors->n : s->n;
    double direction[SUNLIGHT_MOST][3];
    float *rows[SUNLIGHT_MOST] = {NULL};
    size_t n = 0;
    assert(n_vectors <= SUNLIGHT_MOST);
    memset(H, 0, n_vectors * width * sizeof *H);
    for (size_t k = 0; k < n_vectors; k++) {
        if (!sunlight_shines(s, vectors[k])) continue;
        for (int d = 0; d < 3; d++)
            direction[n][s->tiling.axis[d]] = (double)s->tiling.sign[d] * s->suns[vectors[k]].direction[d];
        rows[n++] = H + k * width;
    }
    if (at_sensors)
        sun_places_find(s->sensors->places, s->sensors->tree, parallel_threads(), n,
                        (const double(*)[3])direction, rows);
    else
        sun_rays_cast(s->rays, n, (const double(*)[3])direction, rows);
}

void sunlight_irradiance(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H, float *work) {
    if (s->given != NULL) {
        for (size_t k = 0; k < n_vectors; k++) memcpy(H + k * s->n, s->given, s->n * sizeof *H);
        return;
    }
    find_shares(s, false, n_vectors, vectors, H);
    for (size_t k = 0; k < n_vectors; k++)
        if (sunlight_shines(s, vectors[k])) finish(s, &s->suns[vectors[k]], H + k * s->n, work);
}

void sunlight_sensors(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H) {
    if (s->given_at != NULL) {
        const size_t n = s->n_given_at;
        for (size_t k = 0; k < n_vectors; k++) memcpy(H + k * n, s->given_at, n * sizeof *H);
        return;
    }
    const sensor_sun *at = s->sensors;
    find_shares(s, true, n_vectors, vectors, H);
    for (size_t k = 0; k < n_vectors; k++) {
        const year_sun *sun = &s->suns[vectors[k]];
        size_t tile = 0;
        double radiance = 0;
        if (!sunlight_shines(s, vectors[k])) continue;
        const bool in_tile = sunlight_in_tile(s, vectors[k], &tile, &radiance);
        for (size_t i = 0; i < at->n; i++) {
            const double tiles = in_tile ? (double)at->sky[tile * at->n + i] * radiance : 0;
            H[k * at->n + i] = (float)((double)H[k * at->n + i] * sun->normal +
                                       (double)at->ground[i] * sun->horizontal - tiles);
        }
    }
}

void sunlight_direct(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H) {
    const bool at_sensors = s->sensors != NULL;
    const size_t width = at_sensors ? s->sensors->n : s->n;
    find_shares(s, at_sensors, n_vectors, vectors, H);
    for (size_t k = 0; k < n_vectors; k++)
        for (size_t i = 0; i < width; i++)
            H[k * width + i] = (float)((double)H[k * width + i] * s->suns[vectors[k]].normal);
}

/* Adds rows [n][width] to sum [width]. */
static void add_rows(size_t n, size_t width, const float *rows, double *sum) {
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < width; i++) sum[i] += (double)rows[k * width + i];
}

/* sum / n, in single precision. */
static lam_status take_mean(size_t width, const double *sum, size_t n, float **out, lam_error *error) {
    *out = memory_allocate(width, sizeof **out, "the sun of a year", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < width; i++) (*out)[i] = (float)(sum[i] / (double)n);
    return LAM_OK;
}

lam_status sunlight_mean(const sunlight *s, const progress *steps, sunlight *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_at = s->sensors != NULL ? s->sensors->n : 0, most = n_at > s->n ? n_at : s->n;
    sunlight made = {
        .n_vectors = 1, .n = s->n, .sky = s->sky, .n_given_at = n_at, .sensors_alone = s->sensors_alone};
    double *sum = memory_allocate(s->n, sizeof *sum, "the sun of a year", error);
    double *at = memory_allocate(n_at, sizeof *at, "the sun of a year", error);
    float *H = memory_allocate(SUNLIGHT_MOST, most * sizeof *H, "the sun of a year", error);
    float *work = memory_allocate(sunlight_work(s), sizeof *work, "the sun of a year", error);
    if (sum == NULL || at == NULL || H == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t first = 0; first < s->n_vectors; first += SUNLIGHT_MOST) {
        size_t now = 0, vectors[SUNLIGHT_MOST];
        for (size_t v = first; v < s->n_vectors && v < first + SUNLIGHT_MOST; v++)
            if (sunlight_shines(s, v)) vectors[now++] = v;
        if (progress_cancelled(steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(steps, "rays to the sun", (double)first / (double)s->n_vectors);
        if (!s->sensors_alone) {
            sunlight_irradiance(s, now, vectors, H, work);
            add_rows(now, s->n, H, sum);
        }
        if (n_at > 0) {
            sunlight_sensors(s, now, vectors, H);
            add_rows(now, n_at, H, at);
        }
    }
    TRY(take_mean(s->n, sum, s->n_vectors, &made.given, error));
    if (n_at > 0) TRY(take_mean(n_at, at, s->n_vectors, &made.given_at, error));
    *out = made;
    made = (sunlight){0};
done:
    sunlight_free(&made);
    free(sum);
    free(at);
    free(H);
    free(work);
    return status;
}
