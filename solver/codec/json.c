/* codec_read_json and codec_read_emissions: one pass over the text, straight into vectors. */
#include "solver/codec/json_parser.h"

#include <stdlib.h>
#include <string.h>

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
                return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s: more than the %zu elements of the scene",
                                     parser_here(p), p->scene->n);
            if (!parser_append(p, selected, groups->elements + first, count)) return false;
            if (!parser_append(p, &p->groups, &found[k], 1)) return false;
        }
        p->pointer_length = mark;
    }
    return parser_closed(p);
}

/* Refuses a place among the faces of the file where the store does not know them. */
static bool knows_faces(parser *p) {
    const face_index *faces = p->scene->faces;
    return (faces != NULL && faces->n_faces > 0) ||
           parser_refuse(p, PROBLEM_NOT_IN_STORE,
                         "%s: the store does not know the faces of its scene file, as older ones do not; "
                         "precompute the scene again",
                         parser_here(p));
}

static bool read_selected(parser *p, select_word which, index_list *selected) {
    if (which == SELECT_ELEMENTS) return parser_read_indices(p, INDEX_ELEMENTS, false, selected);
    if (which == SELECT_GROUPS) return read_selected_groups(p, selected);
    return knows_faces(p) && parser_read_indices(p, INDEX_FACES, true, &p->faces);
}

static bool read_select_members(parser *p, index_list *selected) {
    static const char *const names[] = {
        [SELECT_ELEMENTS] = "elements", [SELECT_GROUPS] = "groups", [SELECT_FACES] = "faces"};
    size_t mark = p->pointer_length, which, count = 0;
    unsigned seen = 0;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with elements, groups or faces")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (count < 2 && parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, SELECT_WORDS, &seen, &which)) return false;
        if (++count == 2) break;
        p->selects = (select_word)which;
        if (!read_selected(p, p->selects, selected)) return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->pointer_length = mark;
    return count == 1 || parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                       "%s must hold one of elements, groups and faces", parser_here(p));
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

/* "faces" */
static bool read_at(parser *p) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "\"elements\" or \"faces\"")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    if (text.length == 8 && memcmp(text.bytes, "elements", 8) == 0) {
        p->at = AT_ELEMENTS;
        return true;
    }
    if (text.length != 5 || memcmp(text.bytes, "faces", 5) != 0)
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD, "%s = \"%.*s\", must be elements or faces",
                             parser_here(p), text.length > 80 ? 80 : (int)text.length, text.bytes);
    p->at = AT_FACES;
    return p->scene->only_linear ? parser_not_linear(p) : knows_faces(p);
}

/* The faces of the groups that are selected, group by group. */
static bool find_faces(parser *p) {
    const group_index *groups = p->scene->groups;
    index_set_clear(&p->seen);
    for (size_t k = 0; k < p->groups.count; k++) {
        const uint32_t g = p->groups.values[k], first = groups->start[g];
        uint32_t *found = NULL;
        size_t n = 0;
        bool good = face_index_of(p->scene->faces, groups->start[g + 1] - first, groups->elements + first,
                                  &found, &n) &&
                    parser_append(p, &p->faces, found, n);
        for (size_t f = 0; good && f < n; f++) {
            const index_set_result added = index_set_add(&p->seen, found[f]);
            if (added == INDEX_SET_KNOWN) {
                free(found);
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s: the faces of group %s are selected twice",
                                     parser_here(p), groups->names[g]);
            }
            good = added == INDEX_SET_ADDED;
        }
        free(found);
        if (!good) return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for the faces of groups");
        if (n == 0)
            return parser_refuse(p, PROBLEM_UNKNOWN_GROUP,
                                 "%s: the group %s has backs alone, and an answer at faces is of fronts",
                                 parser_here(p), groups->names[g]);
    }
    return true;
}

/* Once the whole body is read: the faces of an answer of faces, and their elements. */
static bool settle_faces(parser *p) {
    radiosity_request *request = p->request;
    const bool selects = request->select && p->selects == SELECT_FACES;
    parser_point_key(p, "select", 6);
    if (selects && p->at == AT_ELEMENTS)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s holds faces, and at is elements: leave at out, or select elements or groups",
                             parser_here(p));
    request->at_faces = selects || p->at == AT_FACES;
    if (request->at_faces && request->select && p->selects == SELECT_ELEMENTS)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s holds elements, and at is faces: select faces or groups", parser_here(p));
    if (request->at_faces && request->select) {
        if (!selects && !find_faces(p)) return false;
        const face_choice choice = {p->faces.count, p->faces.values};
        free(request->selected);
        request->selected = NULL;
        request->n_selected = 0;
        if (!face_choice_elements(p->scene->faces, &choice, &request->selected, &request->n_selected))
            return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for the elements of faces");
        request->faces = p->faces.values;
        request->n_faces = p->faces.count;
        p->faces = (index_list){.values = NULL};
    }
    p->pointer_length = 0;
    return true;
}

/* ["desk", ...] */
static bool read_reduced_groups(parser *p) {
    const size_t mark = p->pointer_length;
    reduce_request *reduce = &p->request->reduce;
    if (!parser_expect(p, JSON_ARRAY, "an array of group names")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (size_t index = 0; json_next_element(&p->r); index++) {
        json_slice name;
        const uint32_t *found = NULL;
        size_t n_found;
        problem why = {0};
        parser_point_index(p, index);
        if (!parser_read_group(p, &name, &found, &n_found)) return false;
        if (!reduce_request_add(reduce, name.bytes, name.length, found, n_found, &why))
            return parser_refuse(p, why.kind, "%s: %.200s", parser_here(p), why.detail);
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return reduce->n_names > 0 || parser_refuse(p, PROBLEM_WRONG_LENGTH,
                                                "%s is empty, must hold the name of a group", parser_here(p));
}

/* ["mean", ...] */
static bool read_with(parser *p) {
    const size_t mark = p->pointer_length;
    reduce_request *reduce = &p->request->reduce;
    if (!parser_expect(p, JSON_ARRAY, "an array of names of figures")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (size_t index = 0; json_next_element(&p->r); index++) {
        json_slice word;
        problem why = {0};
        parser_point_index(p, index);
        if (!parser_expect(p, JSON_TEXT, "the name of a figure")) return false;
        if (!json_read_text(&p->r, &word)) return parser_fault(p);
        if (!reduce_request_with(reduce, word.bytes, word.length, &why))
            return parser_refuse(p, why.kind, "%s: %.200s", parser_here(p), why.detail);
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return reduce->n_with > 0 ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH,
                         "%s is empty, must hold mean, sum, min, max, uniformity or variance",
                         parser_here(p));
}

static bool read_reduce(parser *p) {
    static const char *const names[] = {"groups", "with"};
    const size_t mark = p->pointer_length;
    size_t which;
    unsigned seen = 0;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with groups and with")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, 2, &seen, &which)) return false;
        if (!(which == 0 ? read_reduced_groups(p) : read_with(p))) return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->request->reduce.on = true;
    return seen == 3 ||
           parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold both groups and with", parser_here(p));
}

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
            good = read_select(p);
            break;
        case QUANTITY:
            good = parser_read_quantity(p, &p->request->quantity);
            break;
        case REDUCE:
            good = read_reduce(p);
            break;
        case TOLERANCE:
            good = read_tolerance(p);
            break;
        case LIMIT:
            good = read_limit(p);
            break;
        case AT:
            good = read_at(p);
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
                                 "the body holds both reduce, whose figures are of groups, and at faces; "
                                 "leave one of them out");
    }
    if (p->why->status != 0) return false;
    if (!json_finish(&p->r)) return parser_fault(p);
    return (seen & EITHER) != 0 ||
           parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body holds neither emission nor emissions");
}

/* The elements of a reduction that adjoint rows do not answer. */
static bool select_reduced(const codec_scene *scene, radiosity_request *request, problem *why) {
    request->select = true;
    return reduce_elements(&request->reduce, scene->groups, &request->selected, &request->n_selected) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the groups of reduce");
}

bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why) {
    parser p;
    reduce_request *reduce = &request->reduce;
    bool good = parser_begin(&p, scene, text, length, request, why) && read_body(&p) && settle_faces(&p) &&
                parser_convert(&p) && parser_fill_sides(&p);
    if (!parser_end(&p, good)) return false;
    if (request->tolerance > 0 || request->n_suns > 0 || reduce->n_names > scene->max_rows)
        reduce->linear = false;
    if (scene->only_linear && !reduce->linear) return parser_not_linear(&p);
    if (reduce->on && !reduce->linear && !select_reduced(scene, request, why)) return false;
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
