/* Light with units in a request: "3600lm" for a group, the unit of the answer, and all numbers into it. */
#include "solver/base/options/options.h"
#include "solver/codec/json_parser.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { LIGHT_TEXT = 256 };

/* The numbers of a text, one or C, as the exitance of groups of this area. */
static bool take_numbers(parser *p, const char *text, given_unit unit, double area, float *colour) {
    const size_t C = p->scene->n_channels;
    const double each = given_unit_exitance(unit, area, p->scene->lights);
    double values[LIGHT_TEXT / 2];
    size_t found = 0;
    lam_error error;
    if (option_numbers("", text, sizeof values / sizeof *values, false, values, &found, &error) != LAM_OK)
        return parser_refuse(p, PROBLEM_BAD_VALUE,
                             "%s begins with \"%s\", must be numbers between commas before the unit",
                             parser_here(p), text);
    if (found != 1 && found != C)
        return parser_refuse(p, PROBLEM_WRONG_LENGTH,
                             "%s holds %zu values, must be 1 or one for each of %zu channels", parser_here(p),
                             found, C);
    for (size_t c = 0; c < C; c++) {
        const double exitance = values[found == 1 ? 0 : c] * each;
        if (exitance < 0 && !p->scene->signs)
            return parser_refuse(p, PROBLEM_BAD_VALUE, "%s = %g, must not be negative", parser_here(p),
                                 values[found == 1 ? 0 : c]);
        if (!(fabs(exitance) <= (double)FLT_MAX))
            return parser_refuse(p, PROBLEM_BAD_VALUE,
                                 "%s = %g, must be within the range of single precision (3.4e38)",
                                 parser_here(p), values[found == 1 ? 0 : c]);
        colour[c] = (float)exitance;
    }
    return true;
}

bool parser_read_light(parser *p, size_t n_groups, const uint32_t *groups, float *colour) {
    json_slice text;
    given_unit unit;
    char numbers[LIGHT_TEXT];
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    const size_t length = given_unit_split(text.bytes, text.length, &unit);
    const int shown = text.length > 80 ? 80 : (int)text.length;
    if (unit == GIVEN_PLAIN || length >= sizeof numbers || memchr(text.bytes, 0, length) != NULL)
        return parser_refuse(
            p, PROBLEM_UNKNOWN_WORD,
            "%s = \"%.*s\", must be a number, or a text of numbers and a unit: " GIVEN_UNIT_WORDS,
            parser_here(p), shown, text.bytes);
    if (p->scene->groups->area == NULL)
        return parser_refuse(p, PROBLEM_WRONG_KIND, "%s: a unit is for groups of a scene", parser_here(p));
    const double area = group_index_area(p->scene->groups, n_groups, groups);
    if (given_unit_is_flux(unit) && !(area > 0))
        return parser_refuse(p, PROBLEM_BAD_VALUE, "%s = \"%.*s\": the group has no area that could emit",
                             parser_here(p), shown, text.bytes);
    memcpy(numbers, text.bytes, length);
    numbers[length] = '\0';
    if (given_unit_kind(unit, p->scene->lights) != p->scene->lights) p->request->told.lights = true;
    return take_numbers(p, numbers, unit, area, colour);
}

bool parser_read_unit(parser *p) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "\"lx\", \"klx\", \"fc\" or \"W/m2\"")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    return answer_unit_find(text.bytes, text.length, &p->request->told.unit) ||
           parser_refuse(p, PROBLEM_UNKNOWN_WORD, "%s = \"%.*s\", must be lx, klx, fc or W/m2",
                         parser_here(p), text.length > 80 ? 80 : (int)text.length, text.bytes);
}

bool parser_read_photometric(parser *p) {
    bool photometric;
    if (!parser_expect(p, JSON_BOOLEAN, "true or false")) return false;
    if (!json_read_boolean(&p->r, &photometric)) return parser_fault(p);
    p->sky_given = true;
    p->sky_lights = photometric ? LIGHT_PHOTOMETRIC : LIGHT_RADIOMETRIC;
    return true;
}

/* False where a number leaves the range of single precision. */
static bool scale(float *x, size_t count, double factor) {
    bool good = true;
    for (size_t i = 0; factor != 1 && x != NULL && i < count; i++) {
        x[i] = (float)((double)x[i] * factor);
        good = good && fabsf(x[i]) <= FLT_MAX;
    }
    return good;
}

bool parser_convert(parser *p) {
    const codec_scene *scene = p->scene;
    radiosity_request *request = p->request;
    const size_t C = scene->n_channels;
    const bool lamps = request->n_spots + request->n_dense + request->emitters.n + request->luminaires.n > 0;
    const bool skies = request->sky.values != NULL;
    const light_kind sky = p->sky_given ? p->sky_lights : scene->lights;
    if (p->sky_given && !skies)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "photometric is of the radiances of a sky, and the body holds none");
    /* Light of both kinds together is photometric. */
    const light_kind of = skies && sky == LIGHT_PHOTOMETRIC ? sky : scene->lights;
    if ((lamps && of != scene->lights) || (skies && of != sky)) request->told.lights = true;
    if (!light_conversion_make(of, request->told.unit, C, &request->told))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "unit: the scene has %zu channels, whose luminance is not known; ask for W/m2",
                             C);
    const double factor = request->told.factor, of_lamps = factor * light_kind_factor(scene->lights, of);
    bool good = scale(request->E, request->n_dense * C * scene->n, of_lamps);
    good = scale(request->colours, request->n_spots * C, of_lamps) && good;
    good = scale(request->emitters.values, request->emitters.n * C * scene->n_emitters, of_lamps) && good;
    good =
        scale(request->luminaires.values, request->luminaires.n * C * scene->n_luminaires, of_lamps) && good;
    good = scale(request->sky.values, request->sky.n * C * scene->n_tiles,
                 factor * light_kind_factor(sky, of)) &&
           good;
    return good || parser_refuse(p, PROBLEM_BAD_VALUE,
                                 "unit: the light passes the range of single precision (3.4e38) in it");
}
