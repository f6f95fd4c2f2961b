#include "solver/light/sky_options.h"

#include "solver/formfactor/sky_bounce.h"
#include "solver/light/weather_light.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static lam_status parse_date(const char *text, void *field, lam_error *error) {
    sky_moment *at = field;
    const lam_status status = moment_parse("--date", text, &at->m, error);
    at->given = status == LAM_OK;
    return status;
}

static lam_status parse_hour(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    sky_moment *at = field;
    double hours = 0;
    TRY(option_number("--hour", text, &hours, error));
    if (!(hours >= 0 && hours < 8760))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--hour %.40s: must be hours from the beginning of the year, from 0 to below 8760", text);
    *at = (sky_moment){.given = true, .m = moment_of_hour(hours)};
done:
    return status;
}

static lam_status parse_place(const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    double v[3];
    sky_place *place = field;
    TRY(option_numbers("--place", text, 3, true, v, NULL, error));
    if (fabs(v[0]) > 90 || fabs(v[1]) > 180 || fabs(v[2]) > 14)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--place %.60s: must be LATITUDE,LONGITUDE,ZONE, from -90 to 90 and -180 to 180 degrees (north "
             "and east "
             "positive), and -14 to 14 hours ahead of UTC",
             text);
    *place = (sky_place){.given = true, .latitude = v[0], .longitude = v[1], .zone = v[2]};
done:
    return status;
}

#define FIELD(member) offsetof(sky_options, member)
const option_row sky_time_rows[] = {
    {.name = "date",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(date),
     .argument = "DATE",
     .parse = parse_date,
     .not_with = "hour",
     .help = "One moment in standard time, as \"21 Mar 12:00\": the row of weather that covers it, or the "
             "time of a "
             "named sky"},
    {.name = "hour",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(hour),
     .argument = "N",
     .parse = parse_hour,
     .help = "The same by hours from the beginning of a year of 365 days: 4380 is 2 July, 12:00"},
    {.name = "north",
     .kind = OPTION_NUMBER,
     .offset = FIELD(north),
     .argument = "DEGREES",
     .otherwise = "that of the store, or 0",
     .least = -360,
     .most = 360,
     .help = "Where north is in the model, from +y (z up) or -z (y up) by east, that is clockwise from "
             "above: at 90 "
             "it is +x. Turns the sun and its sky, of weather and of named skies"},
    {0},
};
const option_row sky_named_rows[] = {
    {.name = "lux-outside",
     .kind = OPTION_NUMBER,
     .offset = FIELD(lux_outside),
     .argument = "LX",
     .otherwise = "10000 for even and overcast, else the light of the sky itself",
     .least = 0,
     .above = true,
     .most = 1e6,
     .help = "--sky NAME: illuminance of a horizontal plane outside, by sky and sun; answers are in lx then"},
    {.name = "place",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(place),
     .argument = "LATITUDE,LONGITUDE,ZONE",
     .parse = parse_place,
     .help = "--sky clear and turbidity:T: where the sun is seen from, degrees north and east, and hours "
             "that standard "
             "time is ahead of UTC"},
    {.name = "photometric",
     .kind = OPTION_FLAG,
     .offset = FIELD(photometric),
     .help = "Weather and named skies in lux, as `lambert sky --photometric`; a --sky FILE.npy is in cd/m2, "
             "and one of Radiance becomes so. Of a store in lm without this option, too, but for FILE.npy"},
    {0},
};

const moment *sky_options_moment(const sky_options *o) {
    return o->date.given ? &o->date.m : o->hour.given ? &o->hour.m : NULL;
}

lam_status sky_options_check(const sky_options *o, const char *name, bool by_weather, bool by_file,
                             lam_error *error) {
    lam_status status = LAM_OK;
    named_sky k = {.model = SKY_EVEN};
    const moment *at = sky_options_moment(o);
    if (name != NULL) TRY(named_sky_parse("--sky", name, &k, error));
    const bool sun = name != NULL && named_sky_needs_sun(&k);
    const char *const alone = o->date.given      ? "date"
                              : o->hour.given    ? "hour"
                              : !isnan(o->north) ? "north"
                                                 : NULL;
    if (name == NULL && o->lux_outside > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--lux-outside is for --sky even, overcast, clear or turbidity:T");
    if (name == NULL && !by_weather && !by_file && o->photometric)
        FAIL(error, LAM_ERR_ARGUMENT, "--photometric is for --weather and --sky");
    if (!sun && !by_weather && alone != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--%s is for weather, and for --sky clear and turbidity:T", alone);
    if (!sun && o->place.given)
        FAIL(error, LAM_ERR_ARGUMENT, "--place is for --sky clear and turbidity:T%s",
             by_weather ? "; weather has its own" : "");
    if (sun && (!o->place.given || at == NULL))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--sky %.40s needs the place of the sun: give --place LATITUDE,LONGITUDE,ZONE and --date \"21 "
             "Jun 12:00\"",
             name);
done:
    return status;
}

lam_status sky_options_north(const sky_options *o, store *s, double *north, lam_error *error) {
    if (isnan(o->north)) return sky_north_load(s, north, error);
    *north = o->north;
    return LAM_OK;
}

lam_status sky_options_make(const sky_options *o, const char *name, double north, const sky_tiling *tiling,
                            bool sun_in_tiles, double *L, year_sun *sun, char said[SKY_SAID],
                            lam_error *error) {
    lam_status status = LAM_OK;
    named_sky k;
    sky_horizontal of;
    sun_position at = {.distance = 1};
    const moment *when = sky_options_moment(o);
    TRY(named_sky_parse("--sky", name, &k, error));
    k.lux_outside = o->lux_outside;
    k.photometric = o->photometric;
    const char *const unit = named_sky_is_photometric(&k) ? "lx" : "W/m2";
    if (named_sky_needs_sun(&k)) {
        const sky_place *p = &o->place;
        at = sun_turned(sun_at(p->latitude, p->longitude, p->zone, 2001, when->month, when->day, when->hour),
                        north);
    }
    TRY(named_sky_make(&k, &at, tiling, sun_in_tiles, L, sun, &of, error));
    if (named_sky_needs_sun(&k))
        snprintf(said, SKY_SAID,
                 "--sky %.40s: the sun is %.1f degrees high; on a horizontal plane outside: diffuse %.6g + "
                 "direct %.6g = "
                 "%.6g %s",
                 name, at.altitude * 180 / M_PI, of.diffuse, of.direct, of.diffuse + of.direct, unit);
    else
        snprintf(said, SKY_SAID, "--sky %.40s: %.6g %s on a horizontal plane outside", name, of.diffuse,
                 unit);
done:
    return status;
}

light_kind sky_options_kind(const sky_options *o, const char *name, light_kind of_store) {
    named_sky k = {.model = SKY_EVEN, .photometric = o->photometric || of_store == LIGHT_PHOTOMETRIC};
    if (name == NULL || named_sky_parse("--sky", name, &k, NULL) != LAM_OK)
        return k.photometric ? LIGHT_PHOTOMETRIC : LIGHT_RADIOMETRIC;
    k.lux_outside = o->lux_outside;
    k.photometric = o->photometric || of_store == LIGHT_PHOTOMETRIC;
    return named_sky_is_photometric(&k) ? LIGHT_PHOTOMETRIC : LIGHT_RADIOMETRIC;
}

lam_status named_light_add(const sky_options *o, const char *name, store *s, const mesh *m,
                           const lam_operator *op, const lam_sky *sky, emission *e, sunlight *sun,
                           char said[SKY_SAID], lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    double *L = NULL, north = 0;
    float *narrow = NULL;
    year_sun shines = {.normal = 0}, *suns = NULL;
    const bool batch = e->batch, few = lam_operator_emitters(op) > 0;
    if (sky == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--sky %.40s: the store has no sky; precompute it with --sky", name);
    TRY(weather_tiling_load(s, sky, &tiling, error));
    TRY(sky_options_north(o, s, &north, error));
    L = memory_allocate(tiling.n_tiles, sizeof *L, "the sky", error);
    narrow = memory_allocate(tiling.n_tiles, sizeof *narrow, "the sky", error);
    if (L == NULL || narrow == NULL) TRY(LAM_ERR_MEMORY);
    sky_options of = *o;
    of.photometric = sky_options_kind(o, name, m->lights) == LIGHT_PHOTOMETRIC;
    TRY(sky_options_make(&of, name, north, &tiling, few || o->sun_in_tiles, L, &shines, said, error));
    for (size_t t = 0; t < tiling.n_tiles; t++) narrow[t] = (float)L[t];
    TRY(emission_add_skies(e, name, m, tiling.n_tiles, 1, narrow, error));
    /* A brightness that is given in lx is light already, and so are skies without a sun. */
    e->efficacies = of.photometric && o->place.given && !(o->lux_outside > 0);
    e->batch = batch;
    if (o->sun_in_tiles || shines.horizontal <= 0) goto done;
    suns = memory_allocate(e->n_vectors, sizeof *suns, "the sun", error);
    if (suns == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < e->n_vectors; v++) suns[v] = shines;
    year_sun *given = suns;
    suns = NULL;
    TRY(sunlight_create(s, m, given, e->n_vectors, o->sun_points > 0 ? o->sun_points : SUN_POINTS, 0, NULL,
                        few ? sky : NULL, sun, error));
    e->sun = sun;
done:
    free(suns);
    free(L);
    free(narrow);
    sky_tiling_free(&tiling);
    return status;
}
