/* The cotangent of sensors: weights of their values, by the names of sets. */
#include "solver/codec/json_parser.h"

#include <stdlib.h>
#include <string.h>

/* {"values": [...]} of one set, into row [C][s]. */
static bool read_values(parser *p, size_t n_found, const uint32_t *found, float *row) {
    static const char *const names[] = {"values"};
    const group_index *sets = p->scene->sensors;
    const size_t mark = p->pointer_length;
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (n_found != 1)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s means %zu sets, and values are of one: name it in full", parser_here(p),
                             n_found);
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, names, 1, &seen, &which)) return false;
        const size_t first = sets->start[*found], count = sets->start[*found + 1] - first;
        if (!parser_expect(p, JSON_ARRAY, "an array of numbers, one for each sensor") ||
            !parser_read_rows(p, row + first, count, sets->start[sets->n_groups], "sensor"))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    return seen != 0 || parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold values", parser_here(p));
}

/* The weight of each receiver of some sets. */
static bool read_weight(parser *p, size_t n_found, const uint32_t *found, float *row) {
    const group_index *sets = p->scene->sensors;
    const size_t C = p->scene->n_channels, s = sets->start[sets->n_groups];
    if (json_peek(&p->r) == JSON_OBJECT) return read_values(p, n_found, found, row);
    if (!parser_read_colour(p, p->colour)) return false;
    for (size_t k = 0; k < n_found; k++)
        for (uint32_t e = sets->start[found[k]]; e < sets->start[found[k] + 1]; e++)
            for (size_t c = 0; c < C; c++) row[c * s + sets->elements[e]] = p->colour[c];
    return true;
}

bool parser_read_sensor_weights(parser *p) {
    const size_t mark = p->pointer_length;
    json_slice key;
    float *row;
    if (!parser_expect(p, JSON_OBJECT, "an object of names of sets and weights") || !parser_knows_sensors(p))
        return false;
    if (!radiosity_request_sensors(p->request, p->scene, &row, p->why)) return false;
    index_set_clear(&p->seen);
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        const uint32_t *found = NULL;
        size_t n_found;
        parser_point_key(p, key.bytes, key.length);
        if (!parser_find_in(p, p->scene->sensors, &key, &found, &n_found)) return false;
        for (size_t k = 0; k < n_found; k++) {
            const index_set_result added = index_set_add(&p->seen, found[k]);
            if (added == INDEX_SET_KNOWN)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s: the set %s is given twice", parser_here(p),
                                     p->scene->sensors->names[found[k]]);
            if (added == INDEX_SET_NO_MEMORY)
                return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for values of sets");
        }
        if (!read_weight(p, n_found, found, row)) return false;
        p->pointer_length = mark;
    }
    return p->why->status == 0;
}
