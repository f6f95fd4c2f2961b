#include "solver/daylight/year.h"

#include <math.h>
#include <stdlib.h>

/* The distance of sample directions in a tile. The scattering around the sun falls to 1/e in 8 degrees at its
 * steepest.
 */
#define SPACING (3 * M_PI / 180)

static size_t steps_across(double angle) {
    return (size_t)fmax(ceil(angle / SPACING - 1e-9), 1);
}

void year_add_sky(const sky_tiling *s, const perez_sky *p, const sun_position *sun, double diffuse,
                  double *L) {
    const double flat = hypot(sun->direction[0], sun->direction[1]);
    double irradiance = 0;
    for (size_t b = 0; b < s->n_bands; b++) {
        const sky_tile *first = &s->tiles[s->bands[b].first];
        const double low = first->altitude[0], height = first->altitude[1] - low;
        const double width = first->azimuth[1] - first->azimuth[0];
        const size_t rings = steps_across(height), sectors = steps_across(width * cos(low + .5 * height));
        const double all = (sin(first->altitude[1]) - sin(low)) * (double)sectors;
        for (size_t t = s->bands[b].first; t < s->bands[b].first + s->bands[b].count; t++) L[t] = 0;
        for (size_t r = 0; r < rings; r++) {
            /* The solid angle of a ring is proportional to the difference of the sines. */
            const double under = sin(low + height * (double)r / (double)rings);
            const double over = sin(low + height * (double)(r + 1) / (double)rings);
            const double up = .5 * (under + over);
            const double gradation = perez_gradation(p, up) * (over - under) / all;
            const double across = sqrt(1 - up * up) * flat, along = up * sun->direction[2];
            for (size_t t = s->bands[b].first; t < s->bands[b].first + s->bands[b].count; t++)
                for (size_t q = 0; q < sectors; q++) {
                    const double azimuth =
                        s->tiles[t].azimuth[0] + width * ((double)q + .5) / (double)sectors;
                    L[t] += gradation * perez_scattering(p, along + across * cos(azimuth - sun->azimuth));
                }
        }
    }
    for (size_t t = 0; t < s->n_tiles; t++) irradiance += L[t] * s->tiles[t].cosine;
    const double scale = irradiance > 0 ? diffuse / irradiance : 0;
    for (size_t t = 0; t < s->n_tiles; t++) L[t] = irradiance > 0 ? L[t] * scale : diffuse / M_PI;
}

size_t year_sun_tile(const sky_tiling *s, const double sun[3]) {
    float direction[3][SKY_PACKET];
    uint32_t tile[SKY_PACKET];
    for (int d = 0; d < 3; d++)
        for (int i = 0; i < SKY_PACKET; i++) direction[s->axis[d]][i] = s->sign[d] * (float)sun[d];
    sky_tiling_find(s, (const float(*)[SKY_PACKET])direction, tile);
    return tile[0];
}

void year_add_sun(const sky_tiling *s, const double sun[3], double horizontal, double *L) {
    const size_t tile = year_sun_tile(s, sun);
    L[tile] += horizontal / s->tiles[tile].cosine;
}

/* 1 in the direction of the sun, less by the angle to the middle of the tile, 0 from `reach` on. */
static double spread_weight(const sky_tiling *s, const sky_tile *tile, const double sun[3], double reach) {
    double cosine = 0;
    for (int d = 0; d < 3; d++) cosine += tile->centre[s->axis[d]] * (double)s->sign[d] * sun[d];
    return fmax(1 - acos(fmin(fmax(cosine, -1), 1)) / reach, 0);
}

void year_spread_sun(const sky_tiling *s, const double sun[3], double horizontal, double *L) {
    const double reach = 1.5 * sqrt(s->tiles[year_sun_tile(s, sun)].solid_angle);
    double received = 0;
    for (size_t t = 0; t < s->n_tiles; t++)
        received += spread_weight(s, &s->tiles[t], sun, reach) * s->tiles[t].cosine;
    if (!(received > 0)) {
        year_add_sun(s, sun, horizontal, L);
        return;
    }
    for (size_t t = 0; t < s->n_tiles; t++)
        L[t] += spread_weight(s, &s->tiles[t], sun, reach) * horizontal / received;
}

/* One hour: L [n_tiles]. */
static void make_hour(const weather *w, const weather_hour *h, const sky_tiling *s,
                      const year_options *options, double *L, year_sun *seen, year_summary *sum) {
    const sun_position sun = sun_turned(
        sun_at(w->latitude, w->longitude, w->time_zone, h->year, h->month, h->day, h->hour), options->north);
    const bool up = sun.direction[2] > 0;
    double direct = h->direct, horizontal = up ? direct * sun.direction[2] : 0;
    if (w->direct_is_horizontal && up) {
        horizontal = h->direct;
        direct = h->direct / sun.direction[2];
    }
    if (h->direct > 0 && !up) {
        sum->sunless++;
        sum->left_out = fmax(sum->left_out, h->direct);
        direct = 0;
    }
    for (size_t t = 0; t < s->n_tiles; t++) L[t] = 0;
    *seen = (year_sun){.direction = {sun.direction[0], sun.direction[1], sun.direction[2]}};
    if (!(h->diffuse > 0 || horizontal > 0)) return;
    const perez_sky p = perez_sky_of(&sun, direct, h->diffuse);
    const double water = perez_water(h->dew_point);
    const double diffuse_light = h->diffuse * (options->photometric ? perez_diffuse_efficacy(&p, water) : 1);
    const double direct_light = horizontal * (options->photometric ? perez_direct_efficacy(&p, water) : 1);
    if (diffuse_light > 0) year_add_sky(s, &p, &sun, diffuse_light, L);
    if (horizontal > 0) {
        const double most = w->direct_is_horizontal ? PEREZ_SOLAR / (sun.distance * sun.distance) : INFINITY;
        seen->horizontal = direct_light;
        seen->normal = direct_light / horizontal * fmin(direct, most);
    }
    if (direct_light > 0 && options->sun_in_tiles) year_add_sun(s, sun.direction, direct_light, L);
    sum->diffuse += h->diffuse;
    sum->direct += horizontal;
    sum->light += diffuse_light + direct_light;
    sum->lit += diffuse_light + direct_light > 0;
    sum->sunny += horizontal > 0;
}

lam_status year_skies(const weather *w, const sky_tiling *s, const year_options *options,
                      const progress *steps, float *L, year_sun *suns, year_summary *summary,
                      lam_error *error) {
    enum { BETWEEN_REPORTS = 64 };
    lam_status status = LAM_OK;
    year_summary sum = {0};
    year_sun seen;
    double *hour = memory_allocate(s->n_tiles, sizeof *hour, "the tiles of an hour", error);
    if (hour == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < w->n; i++) {
        if (i % BETWEEN_REPORTS == 0) {
            if (progress_cancelled(steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
            progress_report(steps, "skies", (double)i / (double)w->n);
        }
        make_hour(w, &w->hours[i], s, options, hour, &seen, &sum);
        if (suns != NULL) suns[i] = seen;
        for (size_t t = 0; t < s->n_tiles; t++) L[i * s->n_tiles + t] = (float)hour[t];
    }
    *summary = sum;
done:
    free(hour);
    return status;
}
