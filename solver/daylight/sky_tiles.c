#include "solver/daylight/sky_tiles.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TREGENZA_BANDS = 7 };
static const uint32_t tregenza_counts[TREGENZA_BANDS] = {30, 30, 24, 24, 18, 12, 6};

/* A parsed name. */
typedef struct tiling_plan {
    size_t split;          /* of tregenza bands; 0: a grid */
    size_t sectors, bands; /* of a grid */
} tiling_plan;

/* Reads digits, a number from 1 to most; returns the text behind them, or NULL. */
static const char *read_count(const char *text, size_t most, size_t *out) {
    size_t value = 0;
    const char *at = text;
    for (; *at >= '0' && *at <= '9' && value <= most; at++) value = 10 * value + (size_t)(*at - '0');
    if (at == text || value < 1 || value > most) return NULL;
    *out = value;
    return at;
}

static lam_status read_name(const char *name, tiling_plan *out, lam_error *error) {
    lam_status status = LAM_OK;
    tiling_plan plan = {0};
    const char *rest;
    if (strcmp(name, "tregenza") == 0) {
        plan.split = 1;
    } else if (strncmp(name, "reinhart:", 9) == 0) {
        rest = read_count(name + 9, SKY_REINHART_MOST, &plan.split);
        if (rest == NULL || *rest != '\0')
            FAIL(error, LAM_ERR_ARGUMENT, "%.60s: must be reinhart:MF with MF from 1 to %d", name,
                 SKY_REINHART_MOST);
    } else if (strncmp(name, "grid:", 5) == 0) {
        rest = read_count(name + 5, SKY_SECTORS_MOST, &plan.sectors);
        if (rest != NULL && *rest == 'x') rest = read_count(rest + 1, SKY_BANDS_MOST, &plan.bands);
        if (rest == NULL || *rest != '\0' || plan.bands == 0)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "%.60s: must be grid:AxB with A sectors from 1 to %d, B bands to %d", name, SKY_SECTORS_MOST,
                 SKY_BANDS_MOST);
    } else {
        FAIL(error, LAM_ERR_ARGUMENT, "%.60s: must be none, tregenza, reinhart:MF or grid:AxB", name);
    }
    *out = plan;
done:
    return status;
}

/* Sets the axis of the scene, and the sign along it, of east, north and up. */
static void turn(sky_tiling *s, char up) {
    static const struct {
        char up;
        int axis[3];
        float sign[3];
    } ways[] = {{'x', {1, 2, 0}, {1, 1, 1}}, {'y', {0, 2, 1}, {1, -1, 1}}, {'z', {0, 1, 2}, {1, 1, 1}}};
    const size_t way = up == 'x' ? 0 : up == 'y' ? 1 : 2;
    s->up = ways[way].up;
    memcpy(s->axis, ways[way].axis, sizeof s->axis);
    memcpy(s->sign, ways[way].sign, sizeof s->sign);
}

/* A tile between the altitudes a0, a1 and of the azimuthal width da has the solid angle da (sin a1 - sin a0);
 * the cosine to the zenith, sin a, integrates to da (sin^2 a1 - sin^2 a0) / 2 over it. */
static void place_tile(const sky_tiling *s, const double altitude[2], const double azimuth[2], bool cap,
                       sky_tile *t) {
    const double low = sin(altitude[0]), high = sin(altitude[1]), width = azimuth[1] - azimuth[0];
    const double middle = cap ? M_PI / 2 : .5 * (altitude[0] + altitude[1]);
    const double towards = .5 * (azimuth[0] + azimuth[1]), flat = cap ? 0 : cos(middle);
    const double local[3] = {flat * sin(towards), flat * cos(towards), sin(middle)};
    memcpy(t->altitude, altitude, sizeof t->altitude);
    memcpy(t->azimuth, azimuth, sizeof t->azimuth);
    t->solid_angle = width * (high - low);
    t->cosine = .5 * width * (high + low) * (high - low);
    for (int d = 0; d < 3; d++) t->centre[s->axis[d]] = (double)s->sign[d] * local[d];
}

lam_status sky_tiling_create(const char *name, char up, sky_tiling *out, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling s = {0};
    tiling_plan plan = {0};
    TRY(read_name(name, &plan, error));
    if (plan.split == 1 && name[0] == 't')
        snprintf(s.name, sizeof s.name, "tregenza");
    else if (plan.split > 0)
        snprintf(s.name, sizeof s.name, "reinhart:%u", (unsigned)plan.split);
    else
        snprintf(s.name, sizeof s.name, "grid:%ux%u", (unsigned)plan.sectors, (unsigned)plan.bands);
    turn(&s, up);
    const bool cap = plan.split > 0;
    s.n_bands = cap ? TREGENZA_BANDS * plan.split + 1 : plan.bands;
    /* The radius of the cap is half of a band's height. */
    const double height = M_PI / 2 / ((double)s.n_bands - (cap ? .5 : 0));
    s.bands_per_radian = (float)(1 / height);
    s.bands = memory_allocate(s.n_bands, sizeof *s.bands, "the tiles of the sky", error);
    if (s.bands == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t b = 0; b < s.n_bands; b++) {
        s.bands[b].first = (uint32_t)s.n_tiles;
        s.bands[b].count = !cap                 ? (uint32_t)plan.sectors
                           : b == s.n_bands - 1 ? 1
                                                : tregenza_counts[b / plan.split] * (uint32_t)plan.split;
        s.n_tiles += s.bands[b].count;
    }
    s.tiles = memory_allocate(s.n_tiles, sizeof *s.tiles, "the tiles of the sky", error);
    if (s.tiles == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t b = 0; b < s.n_bands; b++) {
        const bool last = b == s.n_bands - 1;
        const double altitude[2] = {(double)b * height, last ? M_PI / 2 : (double)(b + 1) * height};
        const double width = 2 * M_PI / s.bands[b].count;
        for (uint32_t k = 0; k < s.bands[b].count; k++) {
            const double azimuth[2] = {(k - .5) * width, (k + .5) * width};
            place_tile(&s, altitude, azimuth, cap && last, &s.tiles[s.bands[b].first + k]);
        }
    }
    *out = s;
    s = (sky_tiling){0};
done:
    sky_tiling_free(&s);
    return status;
}

void sky_tiling_free(sky_tiling *s) {
    free(s->tiles);
    free(s->bands);
    *s = (sky_tiling){0};
}

/* Vectors of four floats, as every x86-64 has (SSE2). */
enum { LANES = 4 };
typedef float lanes __attribute__((vector_size(LANES * sizeof(float))));
typedef int32_t lane_mask __attribute__((vector_size(LANES * sizeof(float))));

static inline lanes choose(lane_mask where, lanes a, lanes b) {
    return (lanes)((where & (lane_mask)a) | (~where & (lane_mask)b));
}

static inline lanes magnitude(lanes x) {
    return choose(x < 0, -x, x);
}

/* atan2(y, x) to 2e-7, by the minimax polynomial of atan(t)/t in t^2 on [0, 1]. Scalar atan2f takes a tenth
 * of the time of a ray. */
static inline lanes angle_of(lanes y, lanes x) {
    const lanes ax = magnitude(x), ay = magnitude(y), least = {1e-30f, 1e-30f, 1e-30f, 1e-30f};
    const lane_mask steep = ay > ax;
    const lanes larger = choose(steep, ay, ax), smaller = choose(steep, ax, ay);
    const lanes t = smaller / choose(larger > least, larger, least), s = t * t;
    lanes angle =
        t * (0.99999994f +
             s * (-0.333320946f +
                  s * (0.199713752f +
                       s * (-0.140294194f +
                            s * (0.0994275957f +
                                 s * (-0.0599047169f + s * (0.0245571267f + s * -0.00478045596f)))))));
    angle = choose(steep, (float)(M_PI / 2) - angle, angle);
    angle = choose(x < 0, (float)M_PI - angle, angle);
    return choose(y < 0, -angle, angle);
}

void sky_tiling_find(const sky_tiling *s, const float direction[3][SKY_PACKET], uint32_t tile[SKY_PACKET]) {
    const float *const up = direction[s->axis[2]];
    float altitude[SKY_PACKET], turn[SKY_PACKET];
    for (int first = 0; first < SKY_PACKET; first += LANES) {
        lanes e, n, u, flat;
        memcpy(&e, direction[s->axis[0]] + first, sizeof e);
        memcpy(&n, direction[s->axis[1]] + first, sizeof n);
        memcpy(&u, up + first, sizeof u);
        e *= s->sign[0];
        n *= s->sign[1];
        u *= s->sign[2];
        flat = e * e + n * n;
        for (int i = 0; i < LANES; i++) flat[i] = sqrtf(flat[i]);
        const lanes high = angle_of(u, flat), turned = angle_of(e, n) * (float)(.5 * M_1_PI);
        memcpy(altitude + first, &high, sizeof high);
        memcpy(turn + first, &turned, sizeof turned);
    }
    for (int i = 0; i < SKY_PACKET; i++) {
        if (!(s->sign[2] * up[i] >= 0)) {
            tile[i] = (uint32_t)s->n_tiles;
            continue;
        }
        const size_t band = (size_t)(altitude[i] * s->bands_per_radian);
        const sky_band *b = &s->bands[band < s->n_bands ? band : s->n_bands - 1];
        /* Whole tiles from the west end of the first one, -count/2 ... count/2, modulo count. */
        const int count = (int)b->count;
        const float from = turn[i] * (float)count + .5f;
        int k = (int)from;
        k -= (float)k > from;
        k += k < 0 ? count : 0;
        k -= k >= count ? count : 0;
        tile[i] = b->first + (uint32_t)k;
    }
}
