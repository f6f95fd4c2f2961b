/* `select` and `at`: the places that an answer is of. */
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
    if (which == SELECT_SENSORS || which == SELECT_PROBES) {
        p->request->at_probes = which == SELECT_PROBES;
        return parser_read_sensor_sets(p);
    }
    if (which == SELECT_ELEMENTS) return parser_read_indices(p, INDEX_ELEMENTS, false, selected);
    if (which == SELECT_GROUPS) return read_selected_groups(p, selected);
    return knows_faces(p) && parser_read_indices(p, INDEX_FACES, true, &p->faces);
}

static bool read_select_members(parser *p, index_list *selected) {
    static const char *const names[] = {[SELECT_ELEMENTS] = "elements",
                                        [SELECT_GROUPS] = "groups",
                                        [SELECT_FACES] = "faces",
                                        [SELECT_SENSORS] = "sensors",
                                        [SELECT_PROBES] = "probes"};
    size_t mark = p->pointer_length, which, count = 0;
    unsigned seen = 0;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with elements, groups, faces, sensors or probes"))
        return false;
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
    return count == 1 ||
           parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                         "%s must hold one of elements, groups, faces, sensors and probes", parser_here(p));
}

bool parser_read_select(parser *p) {
    index_list selected = {0};
    /* A list of no elements is a list too. */
    const bool good = parser_append(p, &selected, NULL, 0) && read_select_members(p, &selected);
    p->request->select = true;
    p->request->selected = selected.values;
    p->request->n_selected = selected.count;
    return good;
}

bool parser_read_at(parser *p) {
    static const char *const words[] = {
        [AT_ELEMENTS] = "elements", [AT_FACES] = "faces", [AT_CORNERS] = "corners"};
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "\"elements\", \"faces\" or \"corners\"")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    for (place_word at = AT_ELEMENTS; at <= AT_CORNERS; at++)
        if (text.length == strlen(words[at]) && memcmp(text.bytes, words[at], text.length) == 0) p->at = at;
    if (p->at == AT_UNSAID)
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD, "%s = \"%.*s\", must be elements, faces or corners",
                             parser_here(p), text.length > 80 ? 80 : (int)text.length, text.bytes);
    if (p->at != AT_ELEMENTS && p->scene->only_linear) return parser_not_linear(p);
    return p->at != AT_FACES || knows_faces(p);
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

/* Sensors receive irradiance, which is gathered from the radiosity of all elements. */
static bool settle_sensors(parser *p) {
    radiosity_request *request = p->request;
    const char *member = request->reduce.on ? "reduce" : "select",
               *what = request->at_probes ? "probes" : "sensors";
    if (p->at != AT_UNSAID)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "the body holds both at and %s of %s; leave at out",
                             member, what);
    if (p->quantity_given && (request->at_probes || request->quantity != LAM_IRRADIANCE)) {
        parser_point_key(p, "quantity", 8);
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD, "%s is %s, and %s alone; leave it out", parser_here(p),
                             codec_quantity_name(request->quantity),
                             request->at_probes ? "probes have coefficients of radiance"
                                                : "sensors receive irradiance");
    }
    request->quantity = LAM_RADIOSITY;
    request->at_sensors = true;
    request->select = false;
    return true;
}

/* Light at corners comes from all elements around them. */
static bool settle_corners(parser *p) {
    radiosity_request *request = p->request;
    parser_point_key(p, "at", 2);
    request->at_corners = p->at == AT_CORNERS;
    if (!request->at_corners) return true;
    if (request->select)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s is corners, which select does not name: leave select out; the corners of a "
                             "group are those of its part of mesh?corners",
                             parser_here(p));
    if (request->tolerance > 0)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s is corners, and a tolerance certifies values of elements: leave one of them "
                             "out",
                             parser_here(p));
    p->pointer_length = 0;
    return true;
}

bool parser_settle_places(parser *p) {
    radiosity_request *request = p->request;
    const bool selects = request->select && p->selects == SELECT_FACES;
    p->pointer_length = 0;
    if (request->reduce.of_sensors) return settle_sensors(p);
    if (!settle_corners(p)) return false;
    p->pointer_length = 0;
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
