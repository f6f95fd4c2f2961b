/* codec_read_json: one pass over the request, straight into its vectors. */
#include "server/codec_json_parser.h"

#include <stdlib.h>
#include <string.h>

/* ["floor", ...]: the elements of the first in mesh order, then of the next. */
static bool read_selected_groups(parser *p) {
    const group_index *groups = p->scene->groups;
    radiosity_request *request = p->request;
    size_t mark = p->pointer_length, index = 0;
    if (!parser_expect(p, JSON_ARRAY, "an array of group names")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (; json_next_element(&p->r); index++) {
        json_slice name;
        const uint32_t *found = NULL;
        parser_point_index(p, index);
        if (!parser_expect(p, JSON_TEXT, "a group name")) return false;
        if (!json_read_text(&p->r, &name)) return parser_fault(p);
        size_t n_found = group_index_find(groups, name.bytes, name.length, &found);
        if (n_found == 0)
            return parser_refuse(p, 422, "%s = \"%.*s\", the scene has no group of this name", parser_here(p),
                                 name.length > 80 ? 80 : (int)name.length, name.bytes);
        for (size_t k = 0; k < n_found; k++) {
            uint32_t first = groups->start[found[k]], count = groups->start[found[k] + 1] - first;
            if (count > p->scene->n - request->n_selected)
                return parser_refuse(p, 422, "%s: more than the %zu elements of the scene", parser_here(p),
                                     p->scene->n);
            memcpy(request->selected + request->n_selected, groups->elements + first,
                   count * sizeof *request->selected);
            request->n_selected += count;
        }
        p->pointer_length = mark;
    }
    return parser_closed(p);
}

static bool read_select(parser *p) {
    static const char *const names[] = {"elements", "groups"};
    size_t mark = p->pointer_length, which;
    unsigned seen = 0;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with elements or groups") ||
        !parser_allocate(p, (void **)&p->request->selected, p->scene->n, sizeof *p->request->selected))
        return false;
    p->request->select = true;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, 2, &seen, &which)) return false;
        if (seen == 3) break;
        if (!(which == 0 ? parser_read_elements(p, p->request->selected, &p->request->n_selected, false)
                         : read_selected_groups(p)))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->pointer_length = mark;
    return seen == 1 || seen == 2 ||
           parser_refuse(p, 422, "%s must hold either elements or groups", parser_here(p));
}

static bool read_quantity(parser *p) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "\"radiosity\", \"irradiance\" or \"indirect\"")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    for (int q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++) {
        const char *name = codec_quantity_name((lam_quantity)q);
        if (strlen(name) == text.length && memcmp(name, text.bytes, text.length) == 0) {
            p->request->quantity = (lam_quantity)q;
            return true;
        }
    }
    return parser_refuse(p, 422, "%s = \"%.*s\", must be radiosity, irradiance or indirect", parser_here(p),
                         text.length > 80 ? 80 : (int)text.length, text.bytes);
}

static bool read_tolerance(parser *p) {
    double *value = &p->request->tolerance;
    if (!parser_expect(p, JSON_NUMBER, "a number above 0 and below 1")) return false;
    if (!json_read_double(&p->r, value)) return parser_fault(p);
    return (*value > 0 && *value < 1) ||
           parser_refuse(p, 422, "%s = %.9g, must be above 0 and below 1", parser_here(p), *value);
}

static bool read_body(parser *p) {
    static const char *const names[] = {"emission", "emissions", "select", "quantity", "tolerance", "reduce"};
    enum { EMISSION, EMISSIONS, SELECT, QUANTITY, TOLERANCE, REDUCE, N_NAMES };
    unsigned seen = 0, both = 1u << EMISSION | 1u << EMISSIONS;
    size_t which;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        bool good = parser_known_member(p, &key, names, N_NAMES, &seen, &which);
        if (!good) return false;
        if ((seen & both) == both) {
            p->pointer_length = 0;
            return parser_refuse(p, 422, "the body holds both emission and emissions, must hold one of them");
        }
        switch (which) {
        case EMISSION:
            good = parser_read_emission(p);
            break;
        case EMISSIONS:
            p->request->batch = true;
            good = parser_read_emissions(p);
            break;
        case SELECT:
            good = read_select(p);
            break;
        case QUANTITY:
            good = read_quantity(p);
            break;
        case TOLERANCE:
            good = read_tolerance(p);
            break;
        default:
            good = parser_refuse(p, 501, "%s is not supported yet", parser_here(p));
        }
        if (!good) return false;
        p->pointer_length = 0;
    }
    if (p->why->status != 0) return false;
    if (!json_finish(&p->r)) return parser_fault(p);
    return (seen & both) != 0 || parser_refuse(p, 422, "the body holds neither emission nor emissions");
}

bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why) {
    parser p = {.scene = scene, .request = request, .why = why};
    *why = (problem){0};
    json_begin(&p.r, text, length);
    bool good = parser_allocate(&p, (void **)&p.colour, scene->n_channels, sizeof *p.colour) && read_body(&p);
    json_end(&p.r);
    float *last;
    /* Vectors behind the last that is under a sky, or has emitters. */
    if (good && request->sky.values != NULL && request->sky.n < request->n_rhs)
        good = radiosity_request_sky(request, scene, &last, why);
    if (good && request->emitters.values != NULL && request->emitters.n < request->n_rhs)
        good = radiosity_request_emitters(request, scene, &last, why);
    if (!good && (why->status == 422 || why->status == 501)) {
        /* What is not JSON at all is told first, wherever its fault lies. */
        json_begin(&p.r, text, length);
        if (!json_skip(&p.r) || !json_finish(&p.r)) parser_fault(&p);
        json_end(&p.r);
    }
    free(p.elements);
    free(p.values);
    free(p.colour);
    free(p.group_set);
    free(p.element_set);
    return good;
}
