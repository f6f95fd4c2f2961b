/* The body of a request for a matrix of derivatives. */
#include "solver/codec/jacobian.h"
#include "solver/codec/json_parser.h"

#include <string.h>

void jacobian_request_free(jacobian_request *request) {
    radiosity_request_free(&request->of);
    *request = (jacobian_request){.n_by = 0};
}

const char *jacobian_name(jacobian_by kind) {
    static const char *const names[JACOBIAN_KINDS] = {"luminaires", "groups", "sky", "emitters"};
    return names[kind];
}

/* Lights of a kind that the store has. */
static size_t lights_of(const codec_scene *scene, jacobian_by kind) {
    if (kind == JACOBIAN_LUMINAIRES) return scene->n_luminaires;
    if (kind == JACOBIAN_EMITTERS) return scene->n_emitters;
    if (scene->n_emitters > 0) return 0;
    return kind == JACOBIAN_GROUPS ? scene->groups->n_groups : scene->n_tiles;
}

static bool refuse_kind(parser *p, jacobian_by kind) {
    if (kind == JACOBIAN_EMITTERS)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no precomputed emitters",
                             parser_here(p));
    if (p->scene->n_emitters > 0 && kind != JACOBIAN_LUMINAIRES)
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
        const char *name = jacobian_name((jacobian_by)kind);
        if (strlen(name) != text.length || memcmp(name, text.bytes, text.length) != 0) continue;
        for (size_t k = 0; k < request->n_by; k++)
            if (request->by[k] == (jacobian_by)kind)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s = \"%s\", which was listed before",
                                     parser_here(p), name);
        if (lights_of(p->scene, (jacobian_by)kind) == 0) return refuse_kind(p, (jacobian_by)kind);
        request->by[request->n_by++] = (jacobian_by)kind;
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

/* {"sensors": [...]} */
static bool read_of(parser *p) {
    static const char *const names[] = {"sensors"};
    const size_t mark = p->pointer_length;
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with sensors")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, 1, &seen, &which) || !parser_read_sensor_sets(p))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    return seen != 0 || parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold sensors", parser_here(p));
}

enum { OF, BY, N_NAMES };

static bool read_member(parser *p, size_t which, void *to) {
    return which == OF ? read_of(p) : read_by(p, to);
}

bool codec_read_jacobian_json(const codec_scene *scene, const char *text, size_t length,
                              jacobian_request *request, problem *why) {
    static const char *const names[] = {"of", "by"};
    const parser_body body = {names, N_NAMES, read_member, request};
    parser p;
    unsigned seen = 0;
    bool good =
        parser_begin(&p, scene, text, length, &request->of, why) && parser_read_body(&p, &body, &seen);
    if (good && (seen & 1u << OF) == 0)
        good = parser_refuse(&p, PROBLEM_WRONG_MEMBERS, "the body does not say what the derivatives are of");
    for (int kind = 0; good && (seen & 1u << BY) == 0 && kind < JACOBIAN_KINDS; kind++)
        if (lights_of(scene, (jacobian_by)kind) > 0) request->by[request->n_by++] = (jacobian_by)kind;
    return parser_end(&p, good);
}
