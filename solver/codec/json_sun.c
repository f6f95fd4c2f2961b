/* The sun of an emission: {"azimuth": degrees, "altitude": degrees, "direct": E, "north": degrees}. */
#include "solver/base/array_grow.h"
#include "solver/codec/json_parser.h"

#include <math.h>
#include <string.h>

enum { AZIMUTH, ALTITUDE, NORTH, DIRECT, SUN_MEMBERS };

static bool read_degrees(parser *p, double most, double *to) {
    if (!parser_expect(p, JSON_NUMBER, "a number of degrees")) return false;
    if (!json_read_double(&p->r, to)) return parser_fault(p);
    return fabs(*to) <= most || parser_refuse(p, PROBLEM_BAD_VALUE, "%s = %.10g, must be from %g to %g",
                                              parser_here(p), *to, -most, most);
}

bool parser_read_sun(parser *p) {
    static const char *const names[] = {
        [AZIMUTH] = "azimuth", [ALTITUDE] = "altitude", [NORTH] = "north", [DIRECT] = "direct"};
    const size_t mark = p->pointer_length;
    request_sun sun = {.north = NAN};
    double *const to[] = {[AZIMUTH] = &sun.azimuth, [ALTITUDE] = &sun.altitude, [NORTH] = &sun.north};
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (p->scene->no_sun != NULL)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: %s", parser_here(p), p->scene->no_sun);
    if (p->scene->only_linear) return parser_not_linear(p);
    if (!parser_expect(p, JSON_OBJECT, "an object with azimuth, altitude and direct")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, SUN_MEMBERS, &seen, &which)) return false;
        if (!(which == DIRECT ? parser_read_radiance(p, p->colour)
                              : read_degrees(p, which == ALTITUDE ? 90 : 360, to[which])))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    for (int k = 0; k < SUN_MEMBERS; k++)
        if (k != NORTH && (seen & 1u << k) == 0)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s lacks %s", parser_here(p), names[k]);
    return radiosity_request_sun(p->request, p->scene, &sun, p->colour, p->why);
}
