/* codec_read_json and codec_read_emissions: one pass over the text, straight into vectors. */
#include "solver/codec/json_parser.h"

#include <string.h>

static bool read_tolerance(parser *p) {
    double *value = &p->request->tolerance;
    if (!parser_expect(p, JSON_NUMBER, "a number above 0 and below 1")) return false;
    if (!json_read_double(&p->r, value)) return parser_fault(p);
    return (*value > 0 && *value < 1) ||
           parser_refuse(p, PROBLEM_BAD_VALUE, "%s = %.9g, must be above 0 and below 1", parser_here(p),
                         *value);
}

static bool read_limit(parser *p) {
    bool limits;
    if (!parser_expect(p, JSON_BOOLEAN, "true or false")) return false;
    if (!json_read_boolean(&p->r, &limits)) return parser_fault(p);
    p->request->linear_map = !limits;
    return true;
}

/* The members that hold emissions, in a request and in a file. */
enum { EMISSION, EMISSIONS, EITHER = 1u << EMISSION | 1u << EMISSIONS };

static bool read_lights(parser *p, size_t which, unsigned seen) {
    if ((seen & EITHER) == EITHER) {
        p->pointer_length = 0;
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s holds both emission and emissions, must hold one of them",
                             codec_source(p->scene));
    }
    if (which == EMISSION) return parser_read_emission(p);
    p->request->batch = true;
    return parser_read_emissions(p);
}

static bool read_body(parser *p) {
    static const char *const names[] = {"emission", "emissions", "select", "quantity", "tolerance",
                                        "reduce",   "limit",     "at",     "unit",     "photometric"};
    enum { SELECT = EMISSIONS + 1, QUANTITY, TOLERANCE, REDUCE, LIMIT, AT, UNIT, PHOTOMETRIC, N_NAMES };
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        bool good = parser_known_member(p, &key, names, N_NAMES, &seen, &which);
        if (!good) return false;
        if (p->scene->only_linear && (which == SELECT || which == TOLERANCE)) return parser_not_linear(p);
        switch (which) {
        case SELECT:
            good = parser_read_select(p);
            break;
        case QUANTITY:
            p->quantity_given = true;
            good = parser_read_quantity(p, &p->request->quantity);
            break;
        case REDUCE:
            good = parser_read_reduce(p);
            break;
        case TOLERANCE:
            good = read_tolerance(p);
            break;
        case LIMIT:
            good = read_limit(p);
            break;
        case AT:
            good = parser_read_at(p);
            break;
        case UNIT:
            good = parser_read_unit(p);
            break;
        case PHOTOMETRIC:
            good = parser_read_photometric(p);
            break;
        default:
            good = read_lights(p, which, seen);
        }
        if (!good) return false;
        p->pointer_length = 0;
        if (p->request->reduce.on && p->request->select)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "the body holds both select and reduce, must hold one of them");
        if (p->request->reduce.on && p->at == AT_FACES)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "the body holds both reduce, whose figures are not of faces, and at faces; "
                                 "leave one of them out");
        if (p->request->reduce.on && p->at == AT_CORNERS)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "the body holds both reduce, whose figures are of elements, and at corners; "
                                 "leave one of them out");
    }
    if (p->why->status != 0) return false;
    if (!json_finish(&p->r)) return parser_fault(p);
    return (seen & EITHER) != 0 ||
           parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body holds neither emission nor emissions");
}

/* True where all light is that of whole groups, of luminaires and of tiles: sensors know each by a column. */
static bool is_of_columns(const radiosity_request *request) {
    bool whole = request->n_dense == 0 && request->n_suns == 0;
    for (size_t k = 0; whole && k < request->n_spots; k++) whole = request->spots[k].whole_group;
    return whole;
}

bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why) {
    parser p;
    reduce_request *reduce = &request->reduce;
    bool good = parser_begin(&p, scene, text, length, request, why) && read_body(&p) &&
                parser_settle_places(&p) && parser_convert(&p) && parser_fill_sides(&p);
    if (!parser_end(&p, good)) return false;
    if (reduce->of_sensors)
        reduce->linear = reduce->on && request->tolerance == 0 && is_of_columns(request);
    else if (request->tolerance > 0 || request->n_suns > 0 || reduce->n_names > scene->max_rows)
        reduce->linear = false;
    if (scene->only_linear && !reduce->linear) return parser_not_linear(&p);
    if (reduce->on && !reduce->linear && !reduce->of_sensors && !parser_select_reduced(scene, request, why))
        return false;
    return (reduce->linear && request->n_dense == 0) || radiosity_request_expand(request, scene, why);
}

/* {"emission": ...} or {"emissions": [...]}. */
static bool read_file_object(parser *p) {
    static const char *const names[] = {"emission", "emissions"};
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, 2, &seen, &which)) return false;
        if (!read_lights(p, which, seen)) return false;
        p->pointer_length = 0;
    }
    return p->why->status == 0;
}

/* True when the text is an object that begins with one of the two members. */
static bool holds_lights(const char *text, size_t length) {
    json_reader r;
    json_slice key;
    json_begin(&r, text, length);
    const bool found = json_look(&r) == JSON_OBJECT && json_enter_object(&r) && json_next_member(&r, &key) &&
                       ((key.length == 8 && memcmp(key.bytes, "emission", 8) == 0) ||
                        (key.length == 9 && memcmp(key.bytes, "emissions", 9) == 0));
    json_end(&r);
    return found;
}

static bool read_file(parser *p, bool object) {
    if (!(object ? read_file_object(p) : parser_read_emission(p))) return false;
    return json_finish(&p->r) ? parser_fill_sides(p) : parser_fault(p);
}

bool codec_read_emissions(const codec_scene *scene, const char *text, size_t length,
                          radiosity_request *request, problem *why) {
    parser p;
    const bool good =
        parser_begin(&p, scene, text, length, request, why) && read_file(&p, holds_lights(text, length));
    return parser_end(&p, good) && radiosity_request_expand(request, scene, why);
}
