/* codec_read_json: one pass over the request, straight into its vectors. */
#include "solver/codec/json_parser.h"

/* ["floor", ...]: the elements of the first in mesh order, then of the next. */
static bool read_selected_groups(parser *p, index_list *selected) {
    const group_index *groups = p->scene->groups;
    size_t mark = p->pointer_length, index = 0;
    if (!parser_expect(p, JSON_ARRAY, "an array of group names")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (; json_next_element(&p->r); index++) {
        json_slice name;
        const uint32_t *found = NULL;
        size_t n_found;
        parser_point_index(p, index);
        if (!parser_read_group(p, &name, &found, &n_found)) return false;
        for (size_t k = 0; k < n_found; k++) {
            uint32_t first = groups->start[found[k]], count = groups->start[found[k] + 1] - first;
            if (count > p->scene->n - selected->count)
                return parser_refuse(p, 422, "%s: more than the %zu elements of the scene", parser_here(p),
                                     p->scene->n);
            if (!parser_append(p, selected, groups->elements + first, count)) return false;
        }
        p->pointer_length = mark;
    }
    return parser_closed(p);
}

static bool read_select_members(parser *p, index_list *selected) {
    static const char *const names[] = {"elements", "groups"};
    size_t mark = p->pointer_length, which;
    unsigned seen = 0;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with elements or groups")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, 2, &seen, &which)) return false;
        if (seen == 3) break;
        if (!(which == 0 ? parser_read_elements(p, selected, false) : read_selected_groups(p, selected)))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->pointer_length = mark;
    return seen == 1 || seen == 2 ||
           parser_refuse(p, 422, "%s must hold either elements or groups", parser_here(p));
}

static bool read_select(parser *p) {
    index_list selected = {0};
    /* A list of no elements is a list too. */
    const bool good = parser_append(p, &selected, NULL, 0) && read_select_members(p, &selected);
    p->request->select = true;
    p->request->selected = selected.values;
    p->request->n_selected = selected.count;
    return good;
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
        if (p->scene->only_linear && (which == SELECT || which == TOLERANCE)) return parser_not_linear(p);
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
            good = parser_read_quantity(p, &p->request->quantity);
            break;
        case REDUCE:
            good = parser_read_reduce(p);
            break;
        case TOLERANCE:
            good = read_tolerance(p);
            break;
        default:
            good = parser_refuse(p, 501, "%s is not supported yet", parser_here(p));
        }
        if (!good) return false;
        p->pointer_length = 0;
        if (p->request->reduce.on && p->request->select)
            return parser_refuse(p, 422, "the body holds both select and reduce, must hold one of them");
    }
    if (p->why->status != 0) return false;
    if (!json_finish(&p->r)) return parser_fault(p);
    return (seen & both) != 0 || parser_refuse(p, 422, "the body holds neither emission nor emissions");
}

/* The elements of a reduction that adjoint rows do not answer. */
static bool select_reduced(const codec_scene *scene, radiosity_request *request, problem *why) {
    request->select = true;
    return reduce_elements(&request->reduce, scene->groups, &request->selected, &request->n_selected) ||
           problem_set(why, 503, "not enough memory for the groups of reduce");
}

bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why) {
    parser p;
    reduce_request *reduce = &request->reduce;
    bool good = parser_begin(&p, scene, text, length, request, why) && read_body(&p) && parser_fill_sides(&p);
    if (!parser_end(&p, good)) return false;
    if (request->tolerance > 0 || reduce->n_names > scene->max_rows) reduce->linear = false;
    if (scene->only_linear && !reduce->linear) return parser_not_linear(&p);
    if (reduce->on && !reduce->linear && !select_reduced(scene, request, why)) return false;
    return (reduce->linear && request->n_dense == 0) || radiosity_request_expand(request, scene, why);
}
