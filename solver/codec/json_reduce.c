/* `reduce`: figures in place of vectors. */
#include "solver/codec/json_parser.h"

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

bool parser_read_reduce(parser *p) {
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

bool parser_select_reduced(const codec_scene *scene, radiosity_request *request, problem *why) {
    request->select = true;
    return reduce_elements(&request->reduce, scene->groups, &request->selected, &request->n_selected) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the groups of reduce");
}
