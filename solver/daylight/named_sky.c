#include "solver/daylight/named_sky.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool named_sky_is(const char *text) {
    const size_t word = strspn(text, "abcdefghijklmnopqrstuvwxyz");
    return word > 0 && (text[word] == '\0' || text[word] == ':');
}

lam_status named_sky_parse(const char *what, const char *text, named_sky *out, lam_error *error) {
    static const char *const names[] = {"even", "overcast", "clear"};
    static const char turbid[] = "turbidity:";
    named_sky k = {.dew_point = NAN};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(text, names[i]) != 0) continue;
        k.model = (sky_model)i;
        *out = k;
        return LAM_OK;
    }
    if (strncmp(text, turbid, sizeof turbid - 1) == 0) {
        const char *digits = text + sizeof turbid - 1;
        char *end = NULL;
        k.model = SKY_TURBID;
        k.turbidity = strtod(digits, &end);
        if (isdigit((unsigned char)digits[0]) && *end == '\0' &&
            strspn(digits, "0123456789.") == strlen(digits) && k.turbidity >= 1 && k.turbidity <= 20) {
            *out = k;
            return LAM_OK;
        }
        return status_fail(error, LAM_ERR_ARGUMENT, "%s %.40s: the turbidity must be a number from 1 to 20",
                           what, text);
    }
    return status_fail(error, LAM_ERR_ARGUMENT,
                       "%s %.60s: no such sky; named skies are even, overcast, clear and turbidity:T", what,
                       text);
}

bool named_sky_needs_sun(const named_sky *k) {
    return k->model != SKY_EVEN && k->model != SKY_OVERCAST;
}

bool named_sky_is_photometric(const named_sky *k) {
    return k->photometric || k->lux_outside > 0 || !named_sky_needs_sun(k);
}

/* W/m2. */
typedef struct light {
    double direct, diffuse;
} light;

static double outside_of(const sun_position *sun) {
    return PEREZ_SOLAR / (sun->distance * sun->distance);
}

static light clear_light(const sun_position *sun) {
    const double mass = perez_air_mass(M_PI / 2 - sun->altitude);
    const double direct = outside_of(sun) * pow(.7, pow(mass, .678));
    return (light){.direct = direct, .diffuse = .1 * direct};
}

static light turbid_light(const sun_position *sun, double T) {
    const double up = sin(sun->altitude), degrees = sun->altitude * 180 / M_PI;
    /* Kasten and Young 1989. */
    const double m = 1 / (up + .50572 * pow(degrees + 6.07995, -1.6364));
    const double thickness = m <= 20 ? 1 / (6.6296 + m * (1.7513 + m * (-.1202 + m * (.0065 - m * .00013))))
                                     : 1 / (10.4 + .718 * m);
    /* The diffuse light of a sun in the zenith, and its share at this altitude. */
    const double zenith = -.015843 + T * (.030543 + T * .0003797);
    const double a0 = .26463 + T * (-.061581 + T * .0031408);
    const double a1 = 2.0402 + T * (.018945 - T * .011161), a2 = -1.3025 + T * (.039231 + T * .0085079);
    const double share = fmax(a0, .002 / zenith) + up * (a1 + up * a2);
    return (light){.direct = outside_of(sun) * exp(-.8662 * T * m * thickness),
                   .diffuse = fmax(outside_of(sun) * zenith * share, 0)};
}

/* The relative luminance of the two skies without a sun: its mean over a tile, of solid angle w and cosine c,
 * is 1 + 2 c / w. */
static void fill_plain(const sky_tiling *s, bool overcast, double horizontal, double *L) {
    double all = 0;
    for (size_t t = 0; t < s->n_tiles; t++) {
        L[t] = overcast ? 1 + 2 * s->tiles[t].cosine / s->tiles[t].solid_angle : 1;
        all += L[t] * s->tiles[t].cosine;
    }
    for (size_t t = 0; t < s->n_tiles; t++) L[t] *= horizontal / all;
}

/* CIE S 011, type 12, over 1 - 10 exp(-3 pi / 2): luminances are relative. */
static perez_sky cie_clear(void) {
    const double base = 1 - 10 * exp(-3 * M_PI / 2);
    return (perez_sky){.a = -1, .b = -.32, .c = 10 / base, .d = -3, .e = .45 / base};
}

static void scale(double factor, size_t n, double *L, year_sun *sun, sky_horizontal *horizontal) {
    for (size_t t = 0; t < n; t++) L[t] *= factor;
    sun->horizontal *= factor;
    sun->normal *= factor;
    horizontal->diffuse *= factor;
    horizontal->direct *= factor;
}

/* The light of a sky that has a sun; none by a sun below the horizon, whose own skies are dark too. */
static light light_of(const named_sky *k, const sun_position *at) {
    const bool up = at->direction[2] > 0;
    if (k->model == SKY_GIVEN) return (light){.direct = up ? k->direct : 0, .diffuse = k->diffuse};
    if (!up) return (light){.direct = 0};
    return k->model == SKY_CLEAR ? clear_light(at) : turbid_light(at, k->turbidity);
}

bool named_sky_is_dark(const named_sky *k, const sun_position *at) {
    if (!named_sky_needs_sun(k)) return false;
    const light of = light_of(k, at);
    return !(of.direct > 0 || of.diffuse > 0);
}

lam_status named_sky_make(const named_sky *k, const sun_position *at, const sky_tiling *s, bool sun_in_tiles,
                          double *L, year_sun *sun, sky_horizontal *horizontal, lam_error *error) {
    *sun = (year_sun){.normal = 0};
    *horizontal = (sky_horizontal){.clearness = NAN, .brightness = NAN};
    if (!named_sky_needs_sun(k)) {
        horizontal->diffuse = k->lux_outside > 0 ? k->lux_outside : SKY_LUX_OUTSIDE;
        fill_plain(s, k->model == SKY_OVERCAST, horizontal->diffuse, L);
        return LAM_OK;
    }
    const double up = at->direction[2];
    const light of = light_of(k, at);
    if (up <= 0 && k->model != SKY_GIVEN)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "the sky is dark: the sun is %.1f degrees below the horizon",
                           -at->altitude * 180 / M_PI);
    if (named_sky_is_dark(k, at))
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "the sky is dark: it has no diffuse light, and no sun above the horizon");
    const perez_sky p = perez_sky_of(at, of.direct, of.diffuse);
    const bool lux = named_sky_is_photometric(k);
    const double water = perez_water(k->dew_point);
    horizontal->diffuse = of.diffuse * (lux ? perez_diffuse_efficacy(&p, water) : 1);
    horizontal->direct = of.direct * fmax(up, 0) * (lux ? perez_direct_efficacy(&p, water) : 1);
    if (k->model != SKY_CLEAR) {
        horizontal->clearness = p.clearness;
        horizontal->brightness = p.brightness;
    }
    for (size_t t = 0; t < s->n_tiles; t++) L[t] = 0;
    const perez_sky cie = cie_clear();
    if (horizontal->diffuse > 0)
        year_add_sky(s, k->model == SKY_CLEAR ? &cie : &p, at, horizontal->diffuse, L);
    for (int d = 0; d < 3; d++) sun->direction[d] = at->direction[d];
    sun->horizontal = horizontal->direct;
    if (up > 0) sun->normal = horizontal->direct / up;
    if (sun->horizontal > 0 && sun_in_tiles) year_add_sun(s, sun->direction, sun->horizontal, L);
    const double both = horizontal->diffuse + horizontal->direct;
    if (k->lux_outside > 0) scale(k->lux_outside / both, s->n_tiles, L, sun, horizontal);
    return LAM_OK;
}
