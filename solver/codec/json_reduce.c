/* The value of `reduce`: which figures of which groups. */
#include "solver/codec/json_parser.h"

#include <string.h>

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
            return parser_refuse(p, why.status, "%s: %.200s", parser_here(p), why.detail);
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return reduce->n_names > 0 ||
           parser_refuse(p, 422, "%s is empty, must hold the name of a group", parser_here(p));
}

static bool read_statistic(parser *p, unsigned *seen) {
    reduce_request *reduce = &p->request->reduce;
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "the name of a figure")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    for (int s = 0; s < REDUCE_COUNT; s++) {
        const char *name = reduce_statistic_name((reduce_statistic)s);
        if (strlen(name) != text.length || memcmp(name, text.bytes, text.length) != 0) continue;
        if (*seen & 1u << s)
            return parser_refuse(p, 422, "%s = \"%s\", which was listed before", parser_here(p), name);
        *seen |= 1u << s;
        reduce->with[reduce->n_with++] = (reduce_statistic)s;
        return true;
    }
    return parser_refuse(p, 422, "%s = \"%.*s\", must be one of mean, sum, min, max, uniformity, variance",
                         parser_here(p), text.length > 80 ? 80 : (int)text.length, text.bytes);
}

/* ["mean", ...] */
static bool read_with(parser *p) {
    const size_t mark = p->pointer_length;
    unsigned seen = 0;
    if (!parser_expect(p, JSON_ARRAY, "an array of names of figures")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (size_t index = 0; json_next_element(&p->r); index++) {
        parser_point_index(p, index);
        if (!read_statistic(p, &seen)) return false;
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    p->request->reduce.linear = (seen & ~(1u << REDUCE_MEAN | 1u << REDUCE_SUM)) == 0;
    return seen != 0 ||
           parser_refuse(p, 422, "%s is empty, must hold mean, sum, min, max, uniformity or variance",
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
    return seen == 3 || parser_refuse(p, 422, "%s must hold both groups and with", parser_here(p));
}
