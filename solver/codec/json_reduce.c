/* `reduce`: figures in place of vectors. */
#include "solver/codec/json_parser.h"

#include <float.h>
#include <string.h>

/* ["desk", ...], of groups or of sets of sensors */
static bool read_reduced(parser *p, bool sensors) {
    const size_t mark = p->pointer_length;
    reduce_request *reduce = &p->request->reduce;
    if (!parser_expect(p, JSON_ARRAY, sensors ? "an array of names of sets" : "an array of group names"))
        return false;
    if (sensors && !parser_knows_sensors(p)) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (size_t index = 0; json_next_element(&p->r); index++) {
        json_slice name;
        const uint32_t *found = NULL;
        size_t n_found;
        problem why = {0};
        parser_point_index(p, index);
        if (!(sensors ? parser_read_sensors(p, &name, &found, &n_found)
                      : parser_read_group(p, &name, &found, &n_found)))
            return false;
        if (!reduce_request_add(reduce, name.bytes, name.length, found, n_found, &why))
            return parser_refuse(p, why.kind, "%s: %.200s", parser_here(p), why.detail);
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    reduce->of_sensors = sensors;
    return reduce->n_names > 0 ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s is empty, must hold the name of a %s", parser_here(p),
                         sensors ? "set of sensors" : "group");
}

bool parser_read_group_names(parser *p) {
    return read_reduced(p, false);
}

bool parser_read_sensor_sets(parser *p) {
    const group_index *sets = p->scene->sensors;
    const reduce_request *reduce = &p->request->reduce;
    index_list receivers = {0};
    if (!read_reduced(p, true)) return false;
    bool good = parser_append(p, &receivers, NULL, 0);
    for (size_t k = 0; good && k < reduce->n_names; k++)
        for (size_t g = 0; good && g < reduce->names[k].n_groups; g++) {
            const uint32_t set = reduce->names[k].groups[g], count = sets->start[set + 1] - sets->start[set];
            good = parser_append(p, &receivers, sets->elements + sets->start[set], count);
        }
    p->request->receivers = receivers.values;
    p->request->n_receivers = receivers.count;
    p->request->at_sensors = true;
    return good;
}

/* True of the word of shares, which have limits of their own, or of ratings, which are of eyes alone. */
static bool is_word(const json_slice *word, reduce_statistic statistic) {
    const char *name = reduce_statistic_name(statistic);
    return word->length == strlen(name) && memcmp(word->bytes, name, word->length) == 0;
}

enum { NO_SHARE = -1 };

/* ["mean", ...]; *share is the place of that word, or NO_SHARE. */
static bool read_with(parser *p, int *share) {
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
        if (is_word(&word, REDUCE_SHARE)) {
            if (*share != NO_SHARE)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s: \"share\" was listed before",
                                     parser_here(p));
            *share = (int)reduce->n_with;
        } else if (is_word(&word, REDUCE_UGR)) {
            if (reduce_has_ugr(reduce))
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s: \"ugr\" was listed before", parser_here(p));
            reduce_request_ugr(reduce);
        } else if (!reduce_request_with(reduce, word.bytes, word.length, &why)) {
            return parser_refuse(p, why.kind,
                                 why.kind == PROBLEM_UNKNOWN_WORD ? "%s: %.200s, share, ugr" : "%s: %.200s",
                                 parser_here(p), why.detail);
        }
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return reduce->n_with > 0 || *share != NO_SHARE ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH,
                         "%s is empty, must hold mean, sum, min, max, uniformity, variance, share or ugr",
                         parser_here(p));
}

/* [300, 500] */
static bool read_limits(parser *p, size_t *count, double limits[REDUCE_LIMITS_MAX]) {
    const size_t mark = p->pointer_length;
    if (!parser_expect(p, JSON_ARRAY, "an array of numbers")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (*count = 0; json_next_element(&p->r); p->pointer_length = mark) {
        double value;
        parser_point_index(p, *count);
        if (*count == REDUCE_LIMITS_MAX)
            return parser_refuse(p, PROBLEM_TOO_MUCH, "%s: more than %d limits; send several requests",
                                 parser_here(p), REDUCE_LIMITS_MAX);
        if (!parser_expect(p, JSON_NUMBER, "a number")) return false;
        if (!json_read_double(&p->r, &value)) return parser_fault(p);
        if (!(value >= 0 && value <= (double)FLT_MAX))
            return parser_refuse(p, PROBLEM_BAD_VALUE, "%s = %.9g, must be from 0 to 3.4e38", parser_here(p),
                                 value);
        for (size_t k = 0; k < *count; k++)
            if (limits[k] == value)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s = %.9g, which was listed before",
                                     parser_here(p), value);
        limits[(*count)++] = value;
    }
    return parser_closed(p) && (*count > 0 || parser_refuse(p, PROBLEM_WRONG_LENGTH,
                                                            "%s is empty, must hold a number of the answer's "
                                                            "unit",
                                                            parser_here(p)));
}

/* Once all members are read. */
static bool settle_reduce(parser *p, int share, size_t n_limits, const double *limits) {
    reduce_request *reduce = &p->request->reduce;
    if ((share != NO_SHARE) != (n_limits > 0))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s: share and at_least go together: %s",
                             parser_here(p),
                             n_limits > 0 ? "add share to with" : "say by at_least what is to be reached");
    for (size_t k = 0; reduce->of_sensors && k < reduce->n_with; k++)
        if (reduce->with[k] == REDUCE_SUM)
            return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                                 "%s: a sum over sensors, which have no area, says nothing; ask for mean",
                                 parser_here(p));
    if (!reduce->of_sensors && reduce_has_ugr(reduce))
        return parser_refuse(p, PROBLEM_UNKNOWN_WORD,
                             "%s: ugr is of eyes; name sets of them by sensors in place of groups",
                             parser_here(p));
    if (share != NO_SHARE) reduce_request_shares(reduce, (size_t)share, n_limits, limits);
    return true;
}

bool parser_read_reduce(parser *p) {
    static const char *const names[] = {"groups", "sensors", "with", "at_least"};
    enum { GROUPS, SENSORS, WITH, AT_LEAST, N_NAMES };
    const size_t mark = p->pointer_length;
    double limits[REDUCE_LIMITS_MAX];
    size_t which, n_limits = 0;
    int share = NO_SHARE;
    unsigned seen = 0;
    json_slice key;
    if (!parser_expect(p, JSON_OBJECT, "an object with groups or sensors, and with")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        bool good = parser_known_member(p, &key, names, N_NAMES, &seen, &which);
        if (good && (seen & 1u << GROUPS) != 0 && (seen & 1u << SENSORS) != 0) {
            p->pointer_length = mark;
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "%s holds both groups and sensors, must hold one of them", parser_here(p));
        }
        if (!good) return false;
        if (!(which == WITH       ? read_with(p, &share)
              : which == AT_LEAST ? read_limits(p, &n_limits, limits)
                                  : read_reduced(p, which == SENSORS)))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->request->reduce.on = true;
    if ((seen & 1u << WITH) == 0 || (seen & (1u << GROUPS | 1u << SENSORS)) == 0)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold with, and groups or sensors",
                             parser_here(p));
    return settle_reduce(p, share, n_limits, limits);
}

bool parser_select_reduced(const codec_scene *scene, radiosity_request *request, problem *why) {
    request->select = true;
    return reduce_elements(&request->reduce, scene->groups, &request->selected, &request->n_selected) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the groups of reduce");
}
