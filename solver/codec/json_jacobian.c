/* The body of a request for a matrix of derivatives. */
#include "solver/codec/jacobian.h"
#include "solver/codec/json_parser.h"

#include <string.h>

void jacobian_request_free(jacobian_request *request) {
    radiosity_request_free(&request->of);
    *request = (jacobian_request){.n_by = 0};
}

const char *jacobian_name(lam_by kind) {
    static const char *const names[JACOBIAN_KINDS] = {"luminaires", "groups", "sky", "emitters"};
    return names[kind];
}

/* Lights of a kind that the store has. */
static size_t lights_of(const codec_scene *scene, lam_by kind) {
    if (kind == LAM_BY_LUMINAIRES) return scene->n_luminaires;
    if (kind == LAM_BY_EMITTERS) return scene->n_emitters;
    if (scene->n_emitters > 0) return 0;
    return kind == LAM_BY_GROUPS ? scene->groups->n_groups : scene->n_tiles;
}

static bool refuse_kind(parser *p, lam_by kind) {
    if (kind == LAM_BY_EMITTERS)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no precomputed emitters",
                             parser_here(p));
    if (p->scene->n_emitters > 0 && kind != LAM_BY_LUMINAIRES)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE,
                             "%s: a store of few emitters has derivatives by emitters and luminaires only",
                             parser_here(p));
    return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no %s; precompute it with --%s",
                         parser_here(p), jacobian_name(kind), jacobian_name(kind));
}

static bool read_by_name(parser *p, jacobian_request *request) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "luminaires, groups, sky or emitters")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    for (int kind = 0; kind < JACOBIAN_KINDS; kind++) {
        const char *name = jacobian_name((lam_by)kind);
        if (strlen(name) != text.length || memcmp(name, text.bytes, text.length) != 0) continue;
        for (size_t k = 0; k < request->n_by; k++)
            if (request->by[k] == (lam_by)kind)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s = \"%s\", which was listed before",
                                     parser_here(p), name);
        if (lights_of(p->scene, (lam_by)kind) == 0) return refuse_kind(p, (lam_by)kind);
        request->by[request->n_by++] = (lam_by)kind;
        return true;
    }
    return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                         "%s = \"%.*s\", must be luminaires, groups, sky or emitters", parser_here(p),
                         text.length > 80 ? 80 : (int)text.length, text.bytes);
}

/* ["luminaires", ...] */
static bool read_by(parser *p, jacobian_request *request) {
    const size_t mark = p->pointer_length;
    if (!parser_expect(p, JSON_ARRAY, "an array of luminaires, groups, sky or emitters")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (size_t index = 0; json_next_element(&p->r); index++) {
        parser_point_index(p, index);
        if (!read_by_name(p, request)) return false;
        p->pointer_length = mark;
    }
    return parser_closed(p) &&
           (request->n_by > 0 ||
            parser_refuse(p, PROBLEM_WRONG_LENGTH,
                          "%s is empty, must hold luminaires, groups, sky or emitters", parser_here(p)));
}

/* [0, 17, ...] */
static bool read_elements(parser *p) {
    index_list elements = {0};
    const bool good =
        parser_append(p, &elements, NULL, 0) && parser_read_indices(p, INDEX_ELEMENTS, false, &elements);
    p->request->select = true;
    p->request->selected = elements.values;
    p->request->n_selected = elements.count;
    return good && (elements.count > 0 ||
                    parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s is empty, must hold the number of an element",
                                  parser_here(p)));
}

/* {"sensors": [...]}, {"groups": [...]} or {"elements": [...]} */
static bool read_of(parser *p, jacobian_request *request) {
    static const char *const names[] = {[JACOBIAN_AT_SENSORS] = "sensors",
                                        [JACOBIAN_OF_GROUPS] = "groups",
                                        [JACOBIAN_OF_ELEMENTS] = "elements"};
    const size_t mark = p->pointer_length;
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with sensors, groups or elements")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        const bool first = seen == 0;
        if (!parser_known_member(p, &key, names, 3, &seen, &which)) return false;
        if (!first) {
            p->pointer_length = mark;
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold one of sensors, groups and elements",
                                 parser_here(p));
        }
        request->kind = (jacobian_of)which;
        if (!(which == JACOBIAN_AT_SENSORS  ? parser_read_sensor_sets(p)
              : which == JACOBIAN_OF_GROUPS ? parser_read_group_names(p)
                                            : read_elements(p)))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    return seen != 0 || parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold sensors, groups or elements",
                                      parser_here(p));
}

enum { OF, BY, QUANTITY, N_NAMES };

static bool read_member(parser *p, size_t which, void *to) {
    jacobian_request *request = to;
    if (which == OF) return read_of(p, request);
    if (which == BY) return read_by(p, request);
    p->quantity_given = true;
    return parser_read_quantity(p, &request->of.quantity);
}

/* Sensors have irradiance alone. */
static bool settle_quantity(parser *p, jacobian_request *request) {
    if (request->kind != JACOBIAN_AT_SENSORS) return true;
    if (p->quantity_given && request->of.quantity != LAM_IRRADIANCE) {
        parser_point_key(p, "quantity", 8);
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                             "%s is %s, and sensors receive irradiance alone; leave it out", parser_here(p),
                             codec_quantity_name(request->of.quantity));
    }
    request->of.quantity = LAM_IRRADIANCE;
    return true;
}

size_t jacobian_rows(const jacobian_request *request) {
    switch (request->kind) {
    case JACOBIAN_AT_SENSORS:
        return request->of.n_receivers;
    case JACOBIAN_OF_GROUPS:
        return request->of.reduce.n_names;
    default:
        return request->of.n_selected;
    }
}

bool codec_read_jacobian_json(const codec_scene *scene, const char *text, size_t length,
                              jacobian_request *request, problem *why) {
    static const char *const names[] = {"of", "by", "quantity"};
    const parser_body body = {names, N_NAMES, read_member, request};
    parser p;
    unsigned seen = 0;
    bool good =
        parser_begin(&p, scene, text, length, &request->of, why) && parser_read_body(&p, &body, &seen);
    if (good && (seen & 1u << OF) == 0)
        good = parser_refuse(&p, PROBLEM_WRONG_MEMBERS, "the body does not say what the derivatives are of");
    good = good && settle_quantity(&p, request);
    for (int kind = 0; good && (seen & 1u << BY) == 0 && kind < JACOBIAN_KINDS; kind++)
        if (lights_of(scene, (lam_by)kind) > 0) request->by[request->n_by++] = (lam_by)kind;
    return parser_end(&p, good);
}
