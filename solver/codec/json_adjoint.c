/* The body of an adjoint request: two vectors, read as emissions are. */
#include "solver/codec/adjoint.h"
#include "solver/codec/json_parser.h"

#include <string.h>

void adjoint_request_free(adjoint_request *request) {
    radiosity_request_free(&request->cotangent);
    radiosity_request_free(&request->light);
    *request = (adjoint_request){0};
}

const char *gradient_name(gradient_kind kind) {
    static const char *const names[GRADIENT_COUNT] = {"emission", "reflectance", "sky",
                                                      "emitters", "groups",      "luminaires"};
    return names[kind];
}

/* Checks that the store has the gradient. */
static bool check_gradient(parser *p, gradient_kind kind) {
    const codec_scene *scene = p->scene;
    switch (kind) {
    case GRADIENT_EMISSION:
        return true;
    case GRADIENT_REFLECTANCE:
        return scene->n_emitters == 0 ||
               parser_refuse(p, PROBLEM_NOT_IN_STORE,
                             "%s: a store of few emitters has no gradient by reflectance", parser_here(p));
    case GRADIENT_GROUPS:
        return scene->n_emitters == 0 ||
               parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: a store of few emitters has no gradient by groups",
                             parser_here(p));
    case GRADIENT_SKY:
    case GRADIENT_LUMINAIRES:
        if (scene->n_emitters > 0 && kind == GRADIENT_SKY)
            return parser_refuse(
                p, PROBLEM_NOT_IN_STORE,
                "%s: a store of few emitters has the gradients by emitters and luminaires only",
                parser_here(p));
        if (kind == GRADIENT_LUMINAIRES)
            return scene->n_luminaires > 0 ||
                   parser_refuse(p, PROBLEM_NOT_IN_STORE,
                                 "%s: the store has no luminaires; precompute it with --luminaires",
                                 parser_here(p));
        return scene->n_tiles > 0 ||
               parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no sky; precompute it with --sky",
                             parser_here(p));
    default:
        return scene->n_emitters > 0 ||
               parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no precomputed emitters",
                             parser_here(p));
    }
}

static bool read_gradient_name(parser *p, adjoint_request *request) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "the name of a gradient")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    for (int kind = 0; kind < GRADIENT_COUNT; kind++) {
        const char *name = gradient_name((gradient_kind)kind);
        if (strlen(name) != text.length || memcmp(name, text.bytes, text.length) != 0) continue;
        for (size_t k = 0; k < request->n_named; k++)
            if (request->named[k] == (gradient_kind)kind)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s = \"%s\", which was listed before",
                                     parser_here(p), name);
        request->named[request->n_named++] = (gradient_kind)kind;
        return check_gradient(p, (gradient_kind)kind);
    }
    return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                         "%s = \"%.*s\", must be emission, reflectance, sky, emitters, groups or luminaires",
                         parser_here(p), text.length > 80 ? 80 : (int)text.length, text.bytes);
}

/* ["emission", ...] */
static bool read_gradient(parser *p, adjoint_request *request) {
    const size_t mark = p->pointer_length;
    if (!parser_expect(p, JSON_ARRAY,
                       "an array of emission, reflectance, sky, emitters, groups or luminaires"))
        return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (size_t index = 0; json_next_element(&p->r); index++) {
        parser_point_index(p, index);
        if (!read_gradient_name(p, request)) return false;
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return request->n_named > 0 ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s is empty, must name a gradient", parser_here(p));
}

enum { COTANGENT, COTANGENTS, QUANTITY, GRADIENT, EMISSION, N_NAMES };

static bool read_member(parser *p, size_t which, void *to) {
    adjoint_request *const request = to;
    if (which == QUANTITY) {
        p->quantity_given = true;
        return parser_read_quantity(p, &request->quantity);
    }
    if (which == GRADIENT) return read_gradient(p, request);
    p->request = which == EMISSION ? &request->light : &request->cotangent;
    if (which != COTANGENTS) return parser_read_emission(p);
    p->request->batch = true;
    return parser_read_emissions(p);
}

static bool read_body(parser *p, adjoint_request *request) {
    static const char *const names[] = {"cotangent", "cotangents", "quantity", "gradient", "emission"};
    const unsigned either = 1u << COTANGENT | 1u << COTANGENTS;
    const parser_body body = {names, N_NAMES, read_member, request};
    unsigned seen;
    if (!parser_read_body(p, &body, &seen)) return false;
    if ((seen & either) == 0) return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body holds no cotangent");
    if ((seen & either) == either)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "the body holds both cotangent and cotangents, must hold one of them");
    for (size_t k = 0; k < request->n_named; k++)
        if (request->named[k] == GRADIENT_REFLECTANCE && (seen & 1u << EMISSION) == 0)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "the gradient by reflectance needs an emission, the body holds none");
    return true;
}

/* Decides which gradients the answer holds, from those that are named. */
static void settle(const codec_scene *scene, adjoint_request *request) {
    if (request->n_named == 0) request->named[request->n_named++] = GRADIENT_EMISSION;
    for (size_t k = 0; k < request->n_named; k++) {
        const bool emission = request->named[k] == GRADIENT_EMISSION;
        if (emission && scene->n_emitters > 0) request->named[k] = GRADIENT_EMITTERS;
        request->wanted |= 1u << request->named[k];
        if (emission && scene->n_emitters == 0 && scene->n_tiles > 0) request->wanted |= 1u << GRADIENT_SKY;
        if (emission && scene->n_luminaires > 0) request->wanted |= 1u << GRADIENT_LUMINAIRES;
    }
}

/* Sensors receive irradiance, which is gathered from the radiosity of all elements. */
static bool settle_sensors(parser *p, adjoint_request *request) {
    request->cotangent.at_sensors = request->cotangent.sensors.values != NULL;
    if (!request->cotangent.at_sensors) return true;
    p->pointer_length = 0;
    if (p->quantity_given && request->quantity != LAM_IRRADIANCE) {
        parser_point_key(p, "quantity", 8);
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                             "%s is %s, and sensors receive irradiance alone; leave it out", parser_here(p),
                             codec_quantity_name(request->quantity));
    }
    request->quantity = LAM_RADIOSITY;
    if (request->cotangent.n_spots > 0 || request->cotangent.n_dense > 0)
        return parser_refuse(
            p, PROBLEM_WRONG_MEMBERS,
            "cotangents: those of sensors and those of elements have quantities of their own; "
            "send two requests");
    float *last;
    return request->cotangent.sensors.n == request->cotangent.n_rhs ||
           radiosity_request_sensors(&request->cotangent, p->scene, &last, p->why);
}

bool codec_read_adjoint_json(const codec_scene *scene, const char *text, size_t length,
                             adjoint_request *request, problem *why) {
    parser p;
    request->cotangent.any_sign = true;
    const bool good =
        parser_begin(&p, scene, text, length, &request->cotangent, why) && read_body(&p, request);
    if (!parser_end(&p, good && settle_sensors(&p, request)) ||
        !radiosity_request_expand(&request->cotangent, scene, why))
        return false;
    settle(scene, request);
    return !adjoint_wants(request, GRADIENT_REFLECTANCE) ||
           radiosity_request_expand(&request->light, scene, why);
}

bool codec_read_adjoint_npy(const codec_scene *scene, const char *bytes, size_t length,
                            adjoint_request *request, problem *why) {
    request->cotangent.any_sign = true;
    if (!codec_read_npy(scene, bytes, length, &request->cotangent, why)) return false;
    settle(scene, request);
    return true;
}
