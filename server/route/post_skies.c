/* POST /v1/scenes/NAME/skies: radiances of the tiles of a store for skies by name, of direct and diffuse
 * light, and of a moment of the weather beside the store, by solver/daylight. A sky of the answer is the
 * `sky` of an emission. */
#include "server/route/routes.h"
#include "server/route/weather_source.h"
#include "solver/codec/answer.h"
#include "solver/codec/json_writer.h"
#include "solver/codec/sky_request.h"
#include "solver/daylight/moment.h"
#include "solver/daylight/named_sky.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (M_PI / 180)

/* Bytes of the answer beside those of tiles, of a number of a tile, and of one that has light of the sun with
 * its index, at most. */
enum { HEAD_BYTES = 768, TILE_BYTES = 18, SUN_TILE_BYTES = 2 * TILE_BYTES };

/* Parts that the skies of a request share. */
typedef struct making {
    const call *in;
    const scene *store;
    sky_tiling tiling;
    double *L, *of_sun; /* of the sky alone, and of its sun */
    float *narrow;
    weather weather;
    char gaps[SKY_REQUEST_TEXT]; /* of the weather that was read; n of it 0: none was */
} making;

static const scene *store_of(const call *in) {
    return in->scene->base != NULL ? in->scene->base : in->scene;
}

/* Refuses sky k of a request. */
static bool refuse(problem *why, problem_kind kind, size_t k, const char *text) {
    return problem_set(why, kind, "sky %zu: %s", k, text);
}

/* Reads the weather beside the store, once for skies that follow each other with one way of gaps. */
static bool read_weather(making *m, const sky_request *sky, size_t k, problem *why) {
    char what[32];
    if (m->weather.n > 0 && strcmp(m->gaps, sky->gaps) == 0) return true;
    weather_free(&m->weather);
    snprintf(what, sizeof what, "sky %zu: ", k);
    if (!weather_source_read_beside(m->in, sky->gaps, what, &m->weather, why)) return false;
    snprintf(m->gaps, sizeof m->gaps, "%s", sky->gaps);
    return true;
}

/* The moment of a sky; false where it names none, or a wrong one. */
static bool find_moment(const sky_request *sky, size_t k, moment *at, problem *why) {
    lam_error error = {.message = ""};
    if (sky->date[0] != '\0')
        return moment_parse("date", sky->date, at, &error) == LAM_OK ||
               refuse(why, PROBLEM_BAD_VALUE, k, error.message);
    if (isnan(sky->hour))
        return refuse(why, PROBLEM_WRONG_MEMBERS, k, "needs a date, as \"21 Jun 12:00\", or an hour");
    if (sky->hour >= 8760) return refuse(why, PROBLEM_BAD_VALUE, k, "hour must be below 8760");
    *at = moment_of_hour(sky->hour);
    return true;
}

/* Light normal to the sun of light on a horizontal plane: at most the extraterrestrial irradiance, as the
 * quotient is unbounded for a rising sun. */
static double normal_of(double horizontal, const sun_position *sun) {
    const double up = sun->direction[2];
    return up > 0 ? fmin(horizontal / up, PEREZ_SOLAR / (sun->distance * sun->distance)) : 0;
}

/* The model of a moment of the weather, and its sun. */
static bool model_of_weather(making *m, const sky_request *sky, size_t k, named_sky *model, sun_position *sun,
                             problem *why) {
    lam_error error = {.message = ""};
    moment at;
    weather_hour h;
    if (!find_moment(sky, k, &at, why) || !read_weather(m, sky, k, why)) return false;
    const weather *w = &m->weather;
    if (moment_find(&at, "weather", w, &h, &error) != LAM_OK)
        return refuse(why, PROBLEM_BAD_VALUE, k, error.message);
    *sun = sun_at(w->latitude, w->longitude, w->time_zone, h.year, h.month, h.day, h.hour);
    *model = (named_sky){.model = SKY_GIVEN,
                         .direct = w->direct_is_horizontal ? normal_of(h.direct, sun) : h.direct,
                         .diffuse = h.diffuse,
                         .dew_point = h.dew_point};
    return true;
}

/* The sun that a request gives, by angles or by place and time. */
static bool sun_of_request(const sky_request *sky, size_t k, sun_position *sun, problem *why) {
    moment at;
    if (!isnan(sky->azimuth)) {
        *sun = sun_of_angles(sky->azimuth, sky->altitude);
        return true;
    }
    if (isnan(sky->place.latitude))
        return refuse(why, PROBLEM_WRONG_MEMBERS, k, "needs its sun: give sun, or place and date or hour");
    if (!find_moment(sky, k, &at, why)) return false;
    *sun = sun_at(sky->place.latitude, sky->place.longitude, sky->place.zone,
                  isnan(sky->year) ? 2001 : (int)sky->year, at.month, at.day, at.hour);
    return true;
}

/* The model of a sky by name or by its light, and, where it needs one, its sun. */
static bool model_of_request(const sky_request *sky, size_t k, named_sky *model, sun_position *sun,
                             problem *why) {
    lam_error error = {.message = ""};
    if (sky->source == SKY_BY_NAME && named_sky_parse("name", sky->name, model, &error) != LAM_OK)
        return refuse(why, PROBLEM_UNKNOWN_WORD, k, error.message);
    if (sky->source == SKY_BY_LIGHT)
        *model = (named_sky){.model = SKY_GIVEN,
                             .direct = isnan(sky->direct) ? 0 : sky->direct,
                             .diffuse = sky->diffuse,
                             .dew_point = sky->dew_point};
    model->lux_outside = isnan(sky->lux_outside) ? 0 : sky->lux_outside;
    if (named_sky_needs_sun(model)) {
        if (!sun_of_request(sky, k, sun, why)) return false;
        if (!isnan(sky->direct_horizontal)) model->direct = normal_of(sky->direct_horizontal, sun);
        return true;
    }
    const bool asks_for_sun = !isnan(sky->azimuth) || !isnan(sky->place.latitude) || !isnan(sky->hour) ||
                              sky->date[0] != '\0' || !isnan(sky->north);
    return !asks_for_sun ||
           refuse(why, PROBLEM_WRONG_MEMBERS, k, "has no sun: leave out sun, place, date, hour and north");
}

/* The tiles that have light of the sun, and their radiance by it. */
static bool write_sun_tiles(const making *m, buffer *b) {
    bool written = buffer_append_text(b, ",\"tiles\":[");
    size_t n = 0;
    for (size_t t = 0; t < m->tiling.n_tiles && written; t++) {
        if (!(m->of_sun[t] > 0)) continue;
        written = buffer_printf(b, n > 0 ? ",%zu" : "%zu", t);
        m->narrow[n++] = (float)m->of_sun[t];
    }
    return written && buffer_append_text(b, "],\"radiance\":") && json_write_floats(b, m->narrow, n);
}

static bool write_sun(const making *m, buffer *b, const sun_position *told, const year_sun *sun) {
    const sky_tiling *tiling = &m->tiling;
    double direction[3];
    for (int d = 0; d < 3; d++) direction[tiling->axis[d]] = (double)tiling->sign[d] * sun->direction[d];
    return buffer_append_text(b, ",\"sun\":{\"azimuth\":") && json_write_double(b, told->azimuth / DEGREE) &&
           buffer_append_text(b, ",\"altitude\":") && json_write_double(b, told->altitude / DEGREE) &&
           buffer_append_text(b, ",\"direction\":") && json_write_doubles(b, direction, 3) &&
           buffer_append_text(b, ",\"normal\":") && json_write_double(b, sun->normal) &&
           write_sun_tiles(m, b) && buffer_append_text(b, "}");
}

/* Sets L, of_sun and narrow, and the sun. */
static bool make_sky(making *m, const sky_request *sky, size_t k, const named_sky *model,
                     const sun_position *at, year_sun *sun, sky_horizontal *of, problem *why) {
    lam_error error = {.message = ""};
    const size_t n = m->tiling.n_tiles;
    memset(m->L, 0, n * sizeof *m->L);
    memset(m->of_sun, 0, n * sizeof *m->of_sun);
    if (sky->dark && named_sky_is_dark(model, at)) {
        *sun = (year_sun){.direction = {at->direction[0], at->direction[1], at->direction[2]}};
        *of = (sky_horizontal){.clearness = NAN, .brightness = NAN};
    } else if (named_sky_make(model, at, &m->tiling, false, m->L, sun, of, &error) != LAM_OK) {
        return refuse(why, PROBLEM_BAD_VALUE, k, error.message);
    }
    if (sun->horizontal > 0 && sky->sun_spread)
        year_spread_sun(&m->tiling, sun->direction, sun->horizontal, m->of_sun);
    else if (sun->horizontal > 0)
        year_add_sun(&m->tiling, sun->direction, sun->horizontal, m->of_sun);
    for (size_t t = 0; t < n; t++) m->narrow[t] = (float)(m->L[t] + (sky->sun_in_tiles ? m->of_sun[t] : 0));
    return true;
}

/* Makes and writes sky k. */
static bool add_sky(making *m, const sky_request *sky, size_t k, buffer *b, problem *why) {
    named_sky model = {.dew_point = NAN};
    sun_position told = {.distance = 1};
    year_sun sun;
    sky_horizontal of;
    if (sky->source == SKY_BY_WEATHER ? !model_of_weather(m, sky, k, &model, &told, why)
                                      : !model_of_request(sky, k, &model, &told, why))
        return false;
    model.photometric = sky->photometric;
    const double north = isnan(sky->north) ? m->store->sky_north : sky->north;
    const sun_position at = sun_turned(told, north);
    if (!make_sky(m, sky, k, &model, &at, &sun, &of, why)) return false;
    const bool written =
        buffer_append_text(b, k > 0 ? ",{\"sky\":" : "{\"sky\":") &&
        json_write_floats(b, m->narrow, m->tiling.n_tiles) &&
        buffer_printf(b, ",\"unit\":\"%s\",\"diffuse\":", named_sky_is_photometric(&model) ? "lx" : "W/m2") &&
        json_write_double(b, of.diffuse) && buffer_append_text(b, ",\"direct\":") &&
        json_write_double(b, of.direct) && buffer_append_text(b, ",\"clearness\":") &&
        json_write_double(b, of.clearness) && buffer_append_text(b, ",\"brightness\":") &&
        json_write_double(b, of.brightness) && buffer_append_text(b, ",\"north\":") &&
        json_write_double(b, north) &&
        (named_sky_needs_sun(&model) ? write_sun(m, b, &told, &sun)
                                     : buffer_append_text(b, ",\"sun\":null")) &&
        buffer_append_text(b, "}");
    return written || problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
}

static bool prepare(making *m, const sky_request *skies, size_t n_skies, buffer *b, problem *why) {
    const scene *s = m->store;
    lam_error error = {.message = ""};
    if (s->sky == NULL || s->sky_tiling[0] == '\0')
        return problem_set(why, PROBLEM_NOT_IN_STORE, "the store has no sky%s; precompute it %s",
                           s->sky != NULL ? " whose tiles it states" : "",
                           s->sky != NULL ? "again" : "with --sky");
    const size_t n = lam_sky_tiles(s->sky);
    size_t most = bytes_times(n_skies, n * TILE_BYTES + HEAD_BYTES);
    for (size_t k = 0; k < n_skies; k++)
        if (skies[k].sun_spread) most = bytes_plus(most, n * SUN_TILE_BYTES);
    const size_t work = n * (2 * sizeof *m->L + sizeof *m->narrow + sizeof(sky_tile));
    if (!request_memory_take(m->in->memory, bytes_plus(most, work), why)) return false;
    m->L = malloc(n * sizeof *m->L);
    m->of_sun = malloc(n * sizeof *m->of_sun);
    m->narrow = malloc(n * sizeof *m->narrow);
    if (m->L == NULL || m->of_sun == NULL || m->narrow == NULL || !buffer_reserve(b, most) ||
        sky_tiling_create(s->sky_tiling, s->sky_up, &m->tiling, &error) != LAM_OK)
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for skies%s%s",
                           error.message[0] != '\0' ? ": " : "", error.message);
    return m->tiling.n_tiles == n ||
           problem_set(why, PROBLEM_NOT_IN_STORE, "the sky of the store has %zu tiles, %s has %zu", n,
                       m->tiling.name, m->tiling.n_tiles);
}

void post_skies(call *in, answer *out) {
    making m = {.in = in, .store = store_of(in)};
    problem why = {0};
    buffer b = {0};
    size_t n = 0;
    sky_request *skies = NULL;
    const codec_scene about = call_codec_scene(in);
    bool good = in->body_type == MEDIA_JSON ||
                problem_set(&why, PROBLEM_MEDIA_TYPE, "Content-Type must be application/json");
    if (good) skies = call_allocate(in, SKY_REQUEST_MOST * sizeof *skies, "skies", &why);
    good = good && skies != NULL && codec_read_skies_json(&about, in->body, in->length, skies, &n, &why) &&
           prepare(&m, skies, n, &b, &why);
    if (good && !(buffer_append_text(&b, "{\"scene\":") && json_write_text(&b, in->scene->name) &&
                  buffer_printf(&b, ",\"tiles\":%zu,\"skies\":[", m.tiling.n_tiles)))
        good = problem_set(&why, PROBLEM_NO_MEMORY, "not enough memory for the answer");
    in->n_rhs = n;
    for (size_t k = 0; good && k < n; k++) good = add_sky(&m, &skies[k], k, &b, &why);
    if (good)
        answer_json(out, &b, buffer_append_text(&b, "]}\n"));
    else
        answer_problem(out, &why);
    buffer_free(&b);
    weather_free(&m.weather);
    sky_tiling_free(&m.tiling);
    free(m.L);
    free(m.of_sun);
    free(m.narrow);
    free(skies);
}
