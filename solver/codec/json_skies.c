/* The body of a request for skies, {"sky": SKY} or {"skies": [SKY, ...]}. A SKY is a name, or an object. And
 * those for positions of the sun and for rows of weather, which share its members. */
#include "solver/codec/json_parser.h"
#include "solver/codec/sky_request.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef enum member_kind { MEMBER_TEXT, MEMBER_NUMBER, MEMBER_FLAG, MEMBER_OBJECT } member_kind;

/* A member of an object. Numbers lie from least to most. */
typedef struct member {
    const char *name;
    member_kind kind;
    size_t offset;
    double least, most;
    const struct member *inside; /* of an object: all of its members must be there */
    size_t n_inside;
} member;

#define FIELD(field) offsetof(sky_request, field)
static const member sun_members[] = {{"azimuth", MEMBER_NUMBER, FIELD(azimuth), -360, 360, NULL, 0},
                                     {"altitude", MEMBER_NUMBER, FIELD(altitude), -90, 90, NULL, 0}};
#define IN_PLACE(field) offsetof(request_place, field)
static const member place_members[] = {{"latitude", MEMBER_NUMBER, IN_PLACE(latitude), -90, 90, NULL, 0},
                                       {"longitude", MEMBER_NUMBER, IN_PLACE(longitude), -180, 180, NULL, 0},
                                       {"zone", MEMBER_NUMBER, IN_PLACE(zone), -14, 14, NULL, 0}};
enum {
    NAME,
    DIRECT,
    DIRECT_HORIZONTAL,
    DIFFUSE,
    WEATHER,
    DEW_POINT,
    LUX_OUTSIDE,
    SUN,
    PLACE,
    DATE,
    HOUR,
    NORTH,
    YEAR,
    GAPS,
    SKY_MEMBERS = 18
};
static const member sky_members[SKY_MEMBERS] = {
    [NAME] = {"name", MEMBER_TEXT, FIELD(name), 0, 0, NULL, 0},
    [DIRECT] = {"direct", MEMBER_NUMBER, FIELD(direct), 0, 3000, NULL, 0},
    [DIRECT_HORIZONTAL] = {"direct_horizontal", MEMBER_NUMBER, FIELD(direct_horizontal), 0, 3000, NULL, 0},
    [DIFFUSE] = {"diffuse", MEMBER_NUMBER, FIELD(diffuse), 0, 3000, NULL, 0},
    [WEATHER] = {"weather", MEMBER_FLAG, 0, 0, 0, NULL, 0},
    [DEW_POINT] = {"dew_point", MEMBER_NUMBER, FIELD(dew_point), -100, 100, NULL, 0},
    [LUX_OUTSIDE] = {"lux_outside", MEMBER_NUMBER, FIELD(lux_outside), 1e-6, 1e6, NULL, 0},
    [SUN] = {"sun", MEMBER_OBJECT, 0, 0, 0, sun_members, 2},
    [PLACE] = {"place", MEMBER_OBJECT, FIELD(place), 0, 0, place_members, 3},
    [DATE] = {"date", MEMBER_TEXT, FIELD(date), 0, 0, NULL, 0},
    [HOUR] = {"hour", MEMBER_NUMBER, FIELD(hour), 0, 8760, NULL, 0},
    [NORTH] = {"north", MEMBER_NUMBER, FIELD(north), -360, 360, NULL, 0},
    [YEAR] = {"year", MEMBER_NUMBER, FIELD(year), 1900, 2100, NULL, 0},
    [GAPS] = {"gaps", MEMBER_TEXT, FIELD(gaps), 0, 0, NULL, 0},
    {"photometric", MEMBER_FLAG, FIELD(photometric), 0, 0, NULL, 0},
    {"sun_in_tiles", MEMBER_FLAG, FIELD(sun_in_tiles), 0, 0, NULL, 0},
    {"sun_spread", MEMBER_FLAG, FIELD(sun_spread), 0, 0, NULL, 0},
    {"dark", MEMBER_FLAG, FIELD(dark), 0, 0, NULL, 0}};

static bool read_text(parser *p, char *to) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "a text")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    if (text.length == 0 || text.length >= SKY_REQUEST_TEXT || memchr(text.bytes, '\0', text.length) != NULL)
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                             "%s has %zu bytes, must be a text of 1 to %d without NUL", parser_here(p),
                             text.length, SKY_REQUEST_TEXT - 1);
    memcpy(to, text.bytes, text.length);
    to[text.length] = '\0';
    return true;
}

static bool read_number(parser *p, const member *m, double *to) {
    double value = 0;
    if (!parser_expect(p, JSON_NUMBER, "a number")) return false;
    if (!json_read_double(&p->r, &value)) return parser_fault(p);
    if (!(value >= m->least && value <= m->most))
        return parser_refuse(p, PROBLEM_BAD_VALUE, "%s = %.10g, must be from %g to %g", parser_here(p), value,
                             m->least, m->most);
    *to = value;
    return true;
}

static bool read_flag(parser *p, bool *to) {
    if (!parser_expect(p, JSON_BOOLEAN, "true or false")) return false;
    return json_read_boolean(&p->r, to) || parser_fault(p);
}

/* The members of a SKY that are objects hold numbers alone; offsets are those in `to`. */
static bool read_inside(parser *p, const member *of, void *to) {
    const char *names[3];
    unsigned seen = 0;
    size_t which;
    json_slice key;
    const size_t mark = p->pointer_length;
    for (size_t k = 0; k < of->n_inside; k++) names[k] = of->inside[k].name;
    if (!parser_expect(p, JSON_OBJECT, "an object")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, of->n_inside, &seen, &which)) return false;
        if (!read_number(p, &of->inside[which], (double *)(void *)((char *)to + of->inside[which].offset)))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    for (size_t k = 0; k < of->n_inside; k++)
        if ((seen & 1u << k) == 0)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s lacks %s", parser_here(p), names[k]);
    return true;
}

static bool has(unsigned seen, int which) {
    return (seen & 1u << which) != 0;
}

static bool check_year(parser *p, double year) {
    return year == floor(year) ||
           parser_refuse(p, PROBLEM_BAD_VALUE, "%s: year = %.10g, must be a whole number", parser_here(p),
                         year);
}

/* Checks which members stand together; the sources know what each of them needs. */
static bool check_members(parser *p, unsigned seen, bool by_weather, sky_request *sky) {
    const int sources = has(seen, NAME) + has(seen, DIFFUSE) + (has(seen, WEATHER) && by_weather);
    if (sources != 1)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold one of name, diffuse, and weather: true",
                             parser_here(p));
    sky->source = has(seen, NAME) ? SKY_BY_NAME : has(seen, DIFFUSE) ? SKY_BY_LIGHT : SKY_BY_WEATHER;
    static const struct {
        int member;
        unsigned sources; /* that it goes with */
    } goes[] = {{DIRECT, 1u << SKY_BY_LIGHT},
                {DIRECT_HORIZONTAL, 1u << SKY_BY_LIGHT},
                {DEW_POINT, 1u << SKY_BY_LIGHT},
                {LUX_OUTSIDE, 1u << SKY_BY_NAME | 1u << SKY_BY_LIGHT},
                {SUN, 1u << SKY_BY_NAME | 1u << SKY_BY_LIGHT},
                {PLACE, 1u << SKY_BY_NAME | 1u << SKY_BY_LIGHT},
                {YEAR, 1u << SKY_BY_NAME | 1u << SKY_BY_LIGHT},
                {GAPS, 1u << SKY_BY_WEATHER}};
    for (size_t k = 0; k < sizeof goes / sizeof goes[0]; k++)
        if (has(seen, goes[k].member) && (goes[k].sources & 1u << sky->source) == 0)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s: %s does not go with %s", parser_here(p),
                                 sky_members[goes[k].member].name,
                                 sky_members[has(seen, NAME)      ? NAME
                                             : has(seen, DIFFUSE) ? DIFFUSE
                                                                  : WEATHER]
                                     .name);
    if (has(seen, DIRECT) && has(seen, DIRECT_HORIZONTAL))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s holds both direct and direct_horizontal, must hold one of them",
                             parser_here(p));
    if (has(seen, YEAR) && !has(seen, PLACE))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s: year goes with place", parser_here(p));
    if (has(seen, YEAR) && !check_year(p, sky->year)) return false;
    if (has(seen, DATE) && has(seen, HOUR))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s holds both date and hour, must hold one of them",
                             parser_here(p));
    if (has(seen, SUN) && (has(seen, PLACE) || has(seen, DATE) || has(seen, HOUR)))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s holds sun, and place, date or hour, must hold one way only", parser_here(p));
    return true;
}

static bool read_sky(parser *p, sky_request *sky) {
    const char *names[SKY_MEMBERS];
    unsigned seen = 0;
    size_t which;
    json_slice key;
    bool by_weather = false;
    const size_t mark = p->pointer_length;
    *sky = (sky_request){.sun_in_tiles = true, .photometric = p->scene->lights == LIGHT_PHOTOMETRIC};
    double *const numbers[] = {&sky->direct,
                               &sky->direct_horizontal,
                               &sky->diffuse,
                               &sky->dew_point,
                               &sky->lux_outside,
                               &sky->azimuth,
                               &sky->altitude,
                               &sky->place.latitude,
                               &sky->place.longitude,
                               &sky->place.zone,
                               &sky->hour,
                               &sky->north,
                               &sky->year};
    for (size_t k = 0; k < sizeof numbers / sizeof numbers[0]; k++) *numbers[k] = NAN;
    for (size_t k = 0; k < SKY_MEMBERS; k++) names[k] = sky_members[k].name;
    if (json_peek(&p->r) == JSON_TEXT) return read_text(p, sky->name);
    if (!parser_expect(p, JSON_OBJECT, "a name or an object")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, SKY_MEMBERS, &seen, &which)) return false;
        const member *m = &sky_members[which];
        void *to = (char *)sky + m->offset;
        if (!(which == WEATHER           ? read_flag(p, &by_weather)
              : m->kind == MEMBER_TEXT   ? read_text(p, to)
              : m->kind == MEMBER_NUMBER ? read_number(p, m, to)
              : m->kind == MEMBER_FLAG   ? read_flag(p, to)
                                         : read_inside(p, m, to)))
            return false;
        p->pointer_length = mark;
    }
    return p->why->status == 0 && check_members(p, seen, by_weather, sky);
}

static bool read_list(parser *p, sky_request *skies, size_t *n) {
    const size_t mark = p->pointer_length;
    if (!parser_expect(p, JSON_ARRAY, "an array of skies")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (*n = 0; json_next_element(&p->r); ++*n) {
        if (*n == SKY_REQUEST_MOST)
            return parser_refuse(p, PROBLEM_TOO_MUCH, "%s holds more than %d skies", parser_here(p),
                                 SKY_REQUEST_MOST);
        parser_point_index(p, *n);
        if (!read_sky(p, &skies[*n])) return false;
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return *n > 0 || parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s is empty, must hold a sky", parser_here(p));
}

/* The skies of a body. */
typedef struct sky_list {
    sky_request *skies;
    size_t n;
} sky_list;

static bool read_skies_member(parser *p, size_t which, void *to) {
    sky_list *const list = to;
    list->n = 1;
    return which == 0 ? read_sky(p, list->skies) : read_list(p, list->skies, &list->n);
}

static bool read_body(parser *p, sky_request *skies, size_t *n) {
    static const char *const names[] = {"sky", "skies"};
    sky_list list = {skies, 0};
    const parser_body body = {names, 2, read_skies_member, &list};
    unsigned seen;
    if (!parser_read_body(p, &body, &seen)) return false;
    *n = list.n;
    return seen == 1 || seen == 2 ||
           parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body must hold one of sky and skies");
}

bool codec_read_skies_json(const codec_scene *scene, const char *text, size_t length, sky_request *skies,
                           size_t *n_skies, problem *why) {
    parser p;
    return parser_end(&p, parser_begin(&p, scene, text, length, NULL, why) && read_body(&p, skies, n_skies));
}

static bool read_hours(parser *p, sun_request *out) {
    static const member hour = {"hours", MEMBER_NUMBER, 0, 0, 8760, NULL, 0};
    const size_t mark = p->pointer_length;
    if (!parser_expect(p, JSON_ARRAY, "an array of hours of a year")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    while (json_next_element(&p->r)) {
        if (out->n_hours == SUN_REQUEST_MOST)
            return parser_refuse(p, PROBLEM_TOO_MUCH, "%s holds more than %d hours", parser_here(p),
                                 SUN_REQUEST_MOST);
        parser_point_index(p, out->n_hours);
        if (!read_number(p, &hour, &out->hours[out->n_hours])) return false;
        out->n_hours++;
        p->pointer_length = mark;
    }
    return parser_closed(p);
}

enum { AT_PLACE, AT_HOURS, AT_YEAR, SUN_BODY };

static bool read_sun_member(parser *p, size_t which, void *to) {
    sun_request *const out = to;
    if (which == AT_PLACE) return read_inside(p, &sky_members[PLACE], &out->place);
    if (which == AT_HOURS) return read_hours(p, out);
    return read_number(p, &sky_members[YEAR], &out->year) && check_year(p, out->year);
}

static bool read_sun_body(parser *p, sun_request *out) {
    static const char *const names[] = {[AT_PLACE] = "place", [AT_HOURS] = "hours", [AT_YEAR] = "year"};
    const parser_body body = {names, SUN_BODY, read_sun_member, out};
    unsigned seen;
    return parser_read_body(p, &body, &seen) &&
           ((has(seen, AT_PLACE) && has(seen, AT_HOURS)) ||
            parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body must hold place and hours"));
}

bool codec_read_sun_json(const codec_scene *scene, const char *text, size_t length, sun_request *out,
                         problem *why) {
    parser p;
    *out = (sun_request){.year = 2001, .hours = out->hours};
    return parser_end(&p, parser_begin(&p, scene, text, length, NULL, why) && read_sun_body(&p, out));
}

static bool read_weather_text(parser *p, weather_request *out) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "the text of a weather file")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    if (text.length == 0) return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s is empty", parser_here(p));
    out->text = malloc(text.length);
    if (out->text == NULL)
        return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for a text of %zu bytes",
                           text.length);
    memcpy(out->text, text.bytes, text.length);
    out->length = text.length;
    return true;
}

enum { AT_GAPS, AT_TEXT, WEATHER_BODY };

static bool read_weather_member(parser *p, size_t which, void *to) {
    weather_request *const out = to;
    return which == AT_TEXT ? read_weather_text(p, out) : read_text(p, out->gaps);
}

static bool read_weather_body(parser *p, bool beside, weather_request *out) {
    static const char *const names[] = {[AT_GAPS] = "gaps", [AT_TEXT] = "text"};
    const parser_body body = {names, WEATHER_BODY - beside, read_weather_member, out};
    unsigned seen;
    return parser_read_body(p, &body, &seen) &&
           (beside || has(seen, AT_TEXT) ||
            parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body lacks text, that of a weather file"));
}

bool codec_read_weather_json(const codec_scene *scene, bool beside, const char *body, size_t length,
                             weather_request *out, problem *why) {
    parser p;
    *out = (weather_request){.text = NULL};
    const bool good = parser_end(&p, parser_begin(&p, scene, body, length, NULL, why) &&
                                         read_weather_body(&p, beside, out));
    if (!good) {
        free(out->text);
        out->text = NULL;
    }
    return good;
}
