/* The emissions of a request: dense, sparse, by group, by sky, by luminaire. */
#include "solver/base/array_grow.h"
#include "solver/base/photometry.h"
#include "solver/codec/json_parser.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static inline float least_value(const parser *p) {
    return p->request->any_sign || (p->scene->signs && !p->in_side) ? -FLT_MAX : 0.0f;
}

static bool bad_value(parser *p, float value) {
    int length = p->r.number.length > 40 ? 40 : (int)p->r.number.length;
    const char *more = p->r.number.length > 40 ? "..." : "";
    if (!isfinite(value))
        return parser_refuse(p, PROBLEM_BAD_VALUE,
                             "%s = %.*s%s, must be within the range of single precision (3.4e38)",
                             parser_here(p), length, p->r.number.bytes, more);
    return parser_refuse(p, PROBLEM_BAD_VALUE, "%s = %.*s%s, must not be negative", parser_here(p), length,
                         p->r.number.bytes, more);
}

/* One emission value. */
static inline bool read_value(parser *p, float *value) {
    if (json_peek(&p->r) != JSON_NUMBER) return parser_expect(p, JSON_NUMBER, "a number");
    if (!json_read_float(&p->r, value)) return parser_fault(p);
    return (*value >= least_value(p) && *value <= FLT_MAX) || bad_value(p, *value);
}

bool parser_read_rest_of_row(parser *p, float *row, size_t count, const char *of_what) {
    const float least = least_value(p);
    size_t i = json_read_plain_floats(&p->r, row, count);
    for (; json_next_element(&p->r); i++, i += json_read_plain_floats(&p->r, row + i, count - i)) {
        if (i == count)
            return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds more than %zu values, one for each %s",
                                 parser_here(p), count, of_what);
        if (json_peek(&p->r) != JSON_NUMBER) {
            parser_point_index(p, i);
            return parser_expect(p, JSON_NUMBER, "a number");
        }
        if (!json_read_float(&p->r, &row[i])) return parser_fault(p);
        if (!(row[i] >= least && row[i] <= FLT_MAX)) {
            parser_point_index(p, i);
            return bad_value(p, row[i]);
        }
    }
    if (!parser_closed(p)) return false;
    return i == count ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds %zu values, must be %zu, one for each %s",
                         parser_here(p), i, count, of_what);
}

bool parser_read_rows(parser *p, float *rows, size_t count, size_t stride, const char *of_what) {
    const size_t C = p->scene->n_channels, mark = p->pointer_length;
    size_t c = 0;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    if (json_look(&p->r) != JSON_ARRAY) {
        if (!parser_read_rest_of_row(p, rows, count, of_what)) return false;
        for (c = 1; c < C; c++) memcpy(rows + c * stride, rows, count * sizeof *rows);
        return true;
    }
    for (; json_next_element(&p->r); c++, p->pointer_length = mark) {
        if (c == C)
            return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds more than %zu rows, one for each channel",
                                 parser_here(p), C);
        parser_point_index(p, c);
        if (!parser_expect(p, JSON_ARRAY, "an array of numbers")) return false;
        if (!json_enter_array(&p->r)) return parser_fault(p);
        if (!parser_read_rest_of_row(p, rows + c * stride, count, of_what)) return false;
    }
    if (!parser_closed(p)) return false;
    return c == C ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds %zu rows, must be %zu, one for each channel",
                         parser_here(p), c, C);
}

bool parser_read_colour(parser *p, float *colour) {
    size_t C = p->scene->n_channels;
    if (json_peek(&p->r) == JSON_ARRAY) {
        if (!json_enter_array(&p->r)) return parser_fault(p);
        return parser_read_rest_of_row(p, colour, C, "channel");
    }
    if (json_peek(&p->r) != JSON_NUMBER)
        return parser_expect(p, JSON_NUMBER, "a number or one for each channel");
    if (!read_value(p, &colour[0])) return false;
    for (size_t c = 1; c < C; c++) colour[c] = colour[0];
    return true;
}

/* The words of messages. */
static const struct index_words {
    const char *one, *many, *index, *list;
} index_words[] = {
    [INDEX_ELEMENTS] = {"an element", "elements", "an element index", "an array of element indices"},
    [INDEX_FACES] = {"a face", "faces", "the number of a face", "an array of numbers of faces"},
};

/* Checks an index that was just read, and with once that it was not listed before. */
static bool check_index(parser *p, index_kind kind, double index, size_t count, bool once) {
    const size_t n = kind == INDEX_FACES ? p->scene->faces->n_faces : p->scene->n;
    if (!(index >= 0.0 && index < (double)n && index == floor(index))) {
        int length = p->r.number.length > 40 ? 40 : (int)p->r.number.length;
        return parser_refuse(p, PROBLEM_BAD_INDEX, "%s = %.*s, must be an integer from 0 to %zu",
                             parser_here(p), length, p->r.number.bytes, n - 1);
    }
    if (count == n)
        return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s: more than the %zu %ss of the scene",
                             parser_here(p), n, index_words[kind].many);
    if (!once) return true;
    switch (index_set_add(&p->seen, (uint32_t)index)) {
    case INDEX_SET_ADDED:
        return true;
    case INDEX_SET_KNOWN:
        return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s = %.0f, %s that was listed before", parser_here(p),
                             index, index_words[kind].one);
    case INDEX_SET_NO_MEMORY:
        break;
    }
    return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for a list of indices");
}

bool parser_read_indices(parser *p, index_kind kind, bool once, index_list *indices) {
    const size_t mark = p->pointer_length;
    indices->count = 0;
    if (once) index_set_clear(&p->seen);
    if (!parser_expect(p, JSON_ARRAY, index_words[kind].list)) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    while (json_next_element(&p->r)) {
        double index;
        parser_point_index(p, indices->count);
        if (!parser_expect(p, JSON_NUMBER, index_words[kind].index)) return false;
        if (!json_read_double(&p->r, &index)) return parser_fault(p);
        if (!check_index(p, kind, index, indices->count, once)) return false;
        if (!parser_append(p, indices, &(uint32_t){(uint32_t)index}, 1)) return false;
        p->pointer_length = mark;
    }
    return parser_closed(p);
}

/* [v...] of the sparse form: each a number or C of them. */
static bool read_values(parser *p, size_t *count) {
    size_t n = p->scene->n, C = p->scene->n_channels, mark = p->pointer_length;
    *count = 0;
    if (!parser_expect(p, JSON_ARRAY, "an array of values")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    while (json_next_element(&p->r)) {
        if (*count == n)
            return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds more values than there are elements",
                                 parser_here(p));
        if (*count == p->values_capacity && array_grow(&p->values, &p->values_capacity, *count + 1,
                                                       C * sizeof *p->values, "values", NULL) != LAM_OK)
            return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for a sparse emission");
        parser_point_index(p, *count);
        if (!parser_read_colour(p, p->values + *count * C)) return false;
        p->pointer_length = mark;
        (*count)++;
    }
    return parser_closed(p);
}

/* Adds the place of the value being read to a refusal. */
static bool refused_here(parser *p) {
    memcpy(p->why->pointer, p->pointer, p->pointer_length);
    p->why->pointer[p->pointer_length] = '\0';
    return false;
}

/* {"mean": v} or {"sum": v}: a weight of the figure of a group, whose spots are shared by *area. */
static bool read_figure_weight(parser *p, size_t n_groups, const uint32_t *groups, double *area) {
    static const char *const names[] = {"mean", "sum"};
    const size_t mark = p->pointer_length;
    unsigned seen = 0;
    size_t which;
    json_slice key;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        const bool first = seen == 0;
        if (!parser_known_member(p, &key, names, 2, &seen, &which)) return false;
        if (!first) break;
        *area = which == 1 ? 1 : group_index_area(p->scene->groups, n_groups, groups);
        if (!parser_read_colour(p, p->colour)) return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->pointer_length = mark;
    if (seen != 1 && seen != 2)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold mean or sum", parser_here(p));
    return *area > 0 || parser_refuse(p, PROBLEM_BAD_VALUE, "%s: the group has no area that figures take in",
                                      parser_here(p));
}

/* {"lamp": v, ...} */
static bool read_groups(parser *p) {
    const group_index *groups = p->scene->groups;
    const size_t mark = p->pointer_length;
    json_slice key;
    index_set_clear(&p->seen);
    if (!parser_expect(p, JSON_OBJECT, "an object of group names and values")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        const uint32_t *found = NULL;
        parser_point_key(p, key.bytes, key.length);
        size_t n_found;
        if (!parser_find_group(p, &key, &found, &n_found)) return false;
        const bool light = !p->request->any_sign && json_peek(&p->r) == JSON_TEXT,
                   figure = p->request->any_sign && p->scene->area != NULL && json_peek(&p->r) == JSON_OBJECT;
        double area = 0;
        if (!(light    ? parser_read_light(p, n_found, found, p->colour)
              : figure ? read_figure_weight(p, n_found, found, &area)
                       : parser_read_colour(p, p->colour)))
            return false;
        for (size_t k = 0; k < n_found; k++) {
            const index_set_result added = index_set_add(&p->seen, found[k]);
            if (added == INDEX_SET_KNOWN)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s: the group %s is given twice",
                                     parser_here(p), groups->names[found[k]]);
            if (added == INDEX_SET_NO_MEMORY)
                return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for a sparse emission");
            if (!radiosity_request_spot(p->request, p->scene, found[k], true, p->colour, p->why))
                return refused_here(p);
            radiosity_request_share(p->request, area);
        }
        p->pointer_length = mark;
    }
    return p->why->status == 0;
}

bool parser_read_radiance(parser *p, float *colour) {
    const size_t mark = p->pointer_length;
    float rgb[3] = {0};
    size_t k = 0;
    if (p->scene->n_channels != 1 || json_peek(&p->r) != JSON_ARRAY) return parser_read_colour(p, colour);
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (; json_next_element(&p->r); k++) {
        if (k == 3)
            return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds more than 3 values", parser_here(p));
        parser_point_index(p, k);
        if (!read_value(p, &rgb[k])) return false;
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    if (k != 1 && k != 3)
        return parser_refuse(p, PROBLEM_WRONG_LENGTH,
                             "%s holds %zu values, must be one for the channel, or red, green and blue",
                             parser_here(p), k);
    const bool grey = k == 1 || (rgb[0] == rgb[1] && rgb[1] == rgb[2]);
    colour[0] = grey ? rgb[0] : (float)luminance_of_radiance((double)rgb[0], (double)rgb[1], (double)rgb[2]);
    p->request->by_luminance = p->request->by_luminance || !grey;
    return true;
}

typedef bool read_item(parser *p, float *colour);

/* Inside an array that was not entered yet: width items into row [C][width]. */
static bool read_side(parser *p, size_t width, const char *each, read_item *read, float *row) {
    const size_t C = p->scene->n_channels, mark = p->pointer_length;
    size_t t = 0;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    for (; json_next_element(&p->r); t++) {
        if (t == width)
            return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds more than %zu values, one for each %s",
                                 parser_here(p), width, each);
        parser_point_index(p, t);
        if (!read(p, p->colour)) return false;
        for (size_t c = 0; c < C; c++) row[c * width + t] = p->colour[c];
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return t == width ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds %zu values, must be %zu, one for each %s",
                         parser_here(p), t, width, each);
}

/* One radiance a tile. */
static bool read_sky(parser *p) {
    float *L;
    if (p->scene->n_tiles == 0)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no sky; precompute it with --sky",
                             parser_here(p));
    if (!parser_expect(p, JSON_ARRAY, "an array of radiances")) return false;
    if (!radiosity_request_sky(p->request, p->scene, &L, p->why)) return refused_here(p);
    return read_side(p, p->scene->n_tiles, "tile", parser_read_radiance, L);
}

/* Sources that have values by name: the numbers of those that a name means, and the name of a number. */
typedef struct named_sources {
    const char *one;
    size_t width;
    char **names; /* [width] */
    bool (*find)(parser *p, const json_slice *name, const uint32_t **found, size_t *n_found);
} named_sources;

/* {"pose-1": w, ...} into row [C][width]: the others are 0. */
static bool read_by_name(parser *p, const named_sources *of, float *row) {
    const size_t C = p->scene->n_channels, mark = p->pointer_length;
    json_slice key;
    index_set_clear(&p->seen);
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        const uint32_t *found = NULL;
        size_t n_found;
        parser_point_key(p, key.bytes, key.length);
        if (!of->find(p, &key, &found, &n_found)) return false;
        if (!parser_read_colour(p, p->colour)) return false;
        for (size_t k = 0; k < n_found; k++) {
            const index_set_result added = index_set_add(&p->seen, found[k]);
            if (added == INDEX_SET_KNOWN)
                return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s: the %s %s is given twice", parser_here(p),
                                     of->one, of->names[found[k]]);
            if (added == INDEX_SET_NO_MEMORY)
                return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for values of %ss", of->one);
            for (size_t c = 0; c < C; c++) row[c * of->width + found[k]] = p->colour[c];
        }
        p->pointer_length = mark;
    }
    return p->why->status == 0;
}

static bool find_emitters(parser *p, const json_slice *name, const uint32_t **found, size_t *n_found) {
    return parser_find_in(p, p->scene->emitters, name, found, n_found);
}

/* One weight for each emitter, or weights by name. */
static bool read_emitters(parser *p) {
    float *W;
    if (p->scene->n_emitters == 0)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: the store has no precomputed emitters",
                             parser_here(p));
    const bool named = p->scene->emitters != NULL && json_peek(&p->r) == JSON_OBJECT;
    if (!named && !parser_expect(p, JSON_ARRAY, "an array of weights, or an object of names and weights"))
        return false;
    if (!radiosity_request_emitters(p->request, p->scene, &W, p->why)) return refused_here(p);
    if (!named) return read_side(p, p->scene->n_emitters, "emitter", parser_read_colour, W);
    const named_sources of = {"emitter", p->scene->n_emitters, p->scene->emitters->names, find_emitters};
    return read_by_name(p, &of, W);
}

/* Dimmers by the names of luminaires, or of groups of them. */
static bool read_luminaires(parser *p) {
    const codec_scene *scene = p->scene;
    float *D;
    if (scene->n_luminaires == 0)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE,
                             "%s: the store has no luminaires; precompute it with --luminaires",
                             parser_here(p));
    if (!parser_expect(p, JSON_OBJECT, "an object of names and dimmers")) return false;
    if (!radiosity_request_luminaires(p->request, scene, &D, p->why)) return refused_here(p);
    const named_sources of = {"luminaire", scene->n_luminaires, scene->luminaires->each.names,
                              parser_find_luminaires};
    return read_by_name(p, &of, D);
}

/* Weights of emitters that are luminaires become dimmers, beside those that are given as such. */
static bool part_luminaires(parser *p) {
    const codec_scene *scene = p->scene;
    const size_t s = scene->n_emitters, k = scene->n_luminaires;
    float *W, *D;
    bool any = false;
    if (!radiosity_request_emitters(p->request, scene, &W, p->why)) return refused_here(p);
    for (size_t w = 0; w < scene->n_channels * s; w++) any = any || (w % s >= s - k && W[w] != 0);
    if (!any) return true;
    if (!radiosity_request_luminaires(p->request, scene, &D, p->why)) return refused_here(p);
    for (size_t c = 0; c < scene->n_channels; c++)
        for (size_t j = 0; j < k; j++) {
            D[c * k + j] += W[c * s + s - k + j];
            W[c * s + s - k + j] = 0;
        }
    return true;
}

/* The members of an emission that is an object. */
enum { ELEMENTS, VALUES, GROUPS, SKY, SUN, EMITTERS, LUMINAIRES, SENSORS, N_NAMES };

/* The members that stand beside the emission of elements, and have no sign. */
static bool read_beside(parser *p, size_t which) {
    p->in_side = true;
    const bool good = which == SKY        ? read_sky(p)
                      : which == SUN      ? parser_read_sun(p)
                      : which == EMITTERS ? read_emitters(p)
                                          : read_luminaires(p);
    p->in_side = false;
    return good;
}

static bool read_emission_object(parser *p) {
    static const char *const names[] = {"elements", "values",   "groups",     "sky",
                                        "sun",      "emitters", "luminaires", "sensors"};
    const size_t C = p->scene->n_channels, mark = p->pointer_length;
    size_t n_values = 0, which;
    unsigned seen = 0;
    json_slice key;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        bool good = parser_known_member(p, &key, names, N_NAMES, &seen, &which);
        if (!good) return false;
        if (p->request->any_sign && which >= SKY && which != SENSORS)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "%s: a cotangent is of elements, groups or sensors", parser_here(p));
        if (!p->request->any_sign && which == SENSORS)
            return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                                 "%s: sensors receive light and emit none; select or reduce names them",
                                 parser_here(p));
        switch (which) {
        case ELEMENTS:
            good = parser_read_indices(p, INDEX_ELEMENTS, true, &p->elements);
            break;
        case VALUES:
            good = read_values(p, &n_values);
            break;
        case GROUPS:
            good = read_groups(p);
            break;
        case SENSORS:
            good = parser_read_sensor_weights(p);
            break;
        default:
            good = read_beside(p, which);
        }
        if (!good) return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    const bool sparse = (seen & (1u << ELEMENTS | 1u << VALUES)) != 0;
    const bool groups = (seen & 1u << GROUPS) != 0, emitters = (seen & 1u << EMITTERS) != 0;
    const bool alone = (seen & (1u << SKY | 1u << SUN | 1u << LUMINAIRES)) != 0;
    const bool sensors = (seen & 1u << SENSORS) != 0;
    const int ways = sparse + groups + emitters + sensors;
    if (p->request->any_sign && ways != 1)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s must hold either elements and values, or groups, or sensors",
                             parser_here(p));
    if (ways > 1 || (ways == 0 && !alone))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS,
                             "%s must hold either elements and values or groups or emitters, or a sky, a sun "
                             "or luminaires",
                             parser_here(p));
    if (emitters && !part_luminaires(p)) return false;
    if (sparse && ((seen & 1u << ELEMENTS) == 0 || (seen & 1u << VALUES) == 0))
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s must hold both elements and values",
                             parser_here(p));
    if (!sparse) return true;
    if (p->elements.count != n_values)
        return parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s holds %zu elements and %zu values, must be as many",
                             parser_here(p), p->elements.count, n_values);
    for (size_t i = 0; i < n_values; i++)
        if (!radiosity_request_spot(p->request, p->scene, p->elements.values[i], false, p->values + i * C,
                                    p->why))
            return refused_here(p);
    return true;
}

bool parser_read_emission(parser *p) {
    float *E;
    json_kind kind = json_peek(&p->r);
    if (kind == JSON_NOTHING) return parser_fault(p);
    if (kind != JSON_ARRAY && kind != JSON_OBJECT)
        return parser_refuse(p, PROBLEM_WRONG_KIND, "%s must be an array of numbers or an object",
                             parser_here(p));
    if (!radiosity_request_add(p->request, p->scene, p->why)) return refused_here(p);
    if (kind == JSON_OBJECT) return read_emission_object(p);
    if (p->scene->only_linear) return parser_not_linear(p);
    if (!radiosity_request_dense(p->request, p->scene, &E, p->why)) return refused_here(p);
    return parser_read_rows(p, E, p->scene->n, p->scene->n, "element");
}

bool parser_read_emissions(parser *p) {
    size_t mark = p->pointer_length;
    if (!parser_expect(p, JSON_ARRAY, "an array of emissions")) return false;
    if (!json_enter_array(&p->r)) return parser_fault(p);
    while (json_next_element(&p->r)) {
        parser_point_index(p, p->request->n_rhs);
        if (!parser_read_emission(p)) return false;
        p->pointer_length = mark;
    }
    if (!parser_closed(p)) return false;
    return p->request->n_rhs > 0 ||
           parser_refuse(p, PROBLEM_WRONG_LENGTH, "%s is empty, must hold an emission", parser_here(p));
}
