/* codec_read_json: one pass over the request, straight into its vectors. */
#include "server/codec_json_reader.h"
#include "server/codec_request.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct parser {
    json_reader r;
    const codec_scene *scene;
    radiosity_request *request;
    problem *why;
    char pointer[sizeof((problem *)0)->pointer]; /* of the value being read */
    size_t pointer_length;
    /* Sparse emissions, kept from one to the next. */
    uint32_t *elements; /* [n] */
    float *values;      /* [n][C] */
    float *colour;      /* [C] */
    bool *group_set;    /* [n_groups] */
    bool *element_set;  /* [n] */
} parser;

/* --- where we are, and what is wrong there ------------------------------------------------------------ */

/* Goes into a member; the caller restores pointer_length. What does not fit is left out. */
static void point_key(parser *p, const char *key, size_t length) {
    size_t at = p->pointer_length;
    if (at + 2 * length + 2 > sizeof p->pointer) return;
    p->pointer[at++] = '/';
    for (size_t i = 0; i < length; i++) {
        if (key[i] == '~' || key[i] == '/') {
            p->pointer[at++] = '~';
            p->pointer[at++] = key[i] == '~' ? '0' : '1';
        } else {
            p->pointer[at++] = key[i];
        }
    }
    p->pointer_length = at;
}

static void point_index(parser *p, size_t index) {
    char text[24];
    int length = snprintf(text, sizeof text, "%zu", index);
    point_key(p, text, (size_t)length);
}

static bool refuse(parser *p, unsigned status, const char *format, ...) __attribute__((format(printf, 3, 4)));
static bool refuse(parser *p, unsigned status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->why->detail, sizeof p->why->detail, format, arguments);
    va_end(arguments);
    p->why->status = status;
    p->pointer[p->pointer_length] = '\0';
    memcpy(p->why->pointer, p->pointer, p->pointer_length + 1);
    return false;
}

/* The pointer as a reader of the message would say it: "emission/groups/lamp". */
static const char *here(parser *p) {
    p->pointer[p->pointer_length] = '\0';
    return p->pointer_length == 0 ? "the body" : p->pointer + 1;
}

static bool fault(parser *p) {
    if (p->r.no_memory) return problem_set(p->why, 503, "not enough memory to read the body");
    return problem_set(p->why, 400, "the body is not JSON: %s, at byte %zu", p->r.fault,
                       (size_t)(p->r.at - p->r.start));
}

/* Over the end of an array or object whose loop has ended. */
static bool closed(parser *p) {
    return p->r.fault == NULL || fault(p);
}

/* Whether a value of this kind comes next. */
static bool expect(parser *p, json_kind kind, const char *what) {
    json_kind found = json_peek(&p->r);
    if (found == JSON_NOTHING) return fault(p);
    return found == kind || refuse(p, 422, "%s must be %s", here(p), what);
}

/* The next member of an object; false at its end or on a refusal. */
static bool next_member(parser *p, json_slice *key) {
    if (!json_next_member(&p->r, key)) {
        closed(p);
        return false;
    }
    if (memchr(key->bytes, '\0', key->length) != NULL) {
        point_key(p, key->bytes, strnlen(key->bytes, key->length));
        return refuse(p, 422, "a NUL in a key of %s", here(p));
    }
    return true;
}

/* Which of the names a key is; their number when none. */
static size_t find_name(const json_slice *key, const char *const *names, size_t count) {
    size_t i = 0;
    while (i < count && (strlen(names[i]) != key->length || memcmp(names[i], key->bytes, key->length) != 0))
        i++;
    return i;
}

/* Goes into a member of an object whose members are known; seen is a bit for each. */
static bool known_member(parser *p, const json_slice *key, const char *const *names, size_t count,
                         unsigned *seen, size_t *which) {
    *which = find_name(key, names, count);
    point_key(p, key->bytes, key->length);
    if (*which == count) return refuse(p, 422, "%s is not a member that can stand here", here(p));
    if (*seen & 1u << *which) return refuse(p, 422, "%s is given twice", here(p));
    *seen |= 1u << *which;
    return true;
}

/* --- numbers ------------------------------------------------------------------------------------------ */

static inline bool is_emission(float value) {
    return value >= 0.0f && value <= FLT_MAX;
}

static bool bad_value(parser *p, float value) {
    int length = p->r.number.length > 40 ? 40 : (int)p->r.number.length;
    const char *more = p->r.number.length > 40 ? "..." : "";
    if (!isfinite(value))
        return refuse(p, 422, "%s = %.*s%s, must be within the range of single precision (3.4e38)", here(p),
                      length, p->r.number.bytes, more);
    return refuse(p, 422, "%s = %.*s%s, an emission must not be negative", here(p), length, p->r.number.bytes,
                  more);
}

/* One emission value. */
static inline bool read_value(parser *p, float *value) {
    if (json_peek(&p->r) != JSON_NUMBER) return expect(p, JSON_NUMBER, "a number");
    if (!json_read_float(&p->r, value)) return fault(p);
    return is_emission(*value) || bad_value(p, *value);
}

/* Inside an array that was entered: count values, then its end. */
static bool read_rest_of_row(parser *p, float *row, size_t count, const char *of_what) {
    size_t i = 0;
    for (; json_next_element(&p->r); i++) {
        if (i == count)
            return refuse(p, 422, "%s holds more than %zu values, one for each %s", here(p), count, of_what);
        if (json_peek(&p->r) != JSON_NUMBER) {
            point_index(p, i);
            return expect(p, JSON_NUMBER, "a number");
        }
        if (!json_read_float(&p->r, &row[i])) return fault(p);
        if (!is_emission(row[i])) {
            point_index(p, i);
            return bad_value(p, row[i]);
        }
    }
    if (!closed(p)) return false;
    return i == count ||
           refuse(p, 422, "%s holds %zu values, must be %zu, one for each %s", here(p), i, count, of_what);
}

/* A number for all channels, or one each. */
static bool read_colour(parser *p, float *colour) {
    size_t C = p->scene->n_channels;
    if (json_peek(&p->r) == JSON_ARRAY) {
        if (!json_enter_array(&p->r)) return fault(p);
        return read_rest_of_row(p, colour, C, "channel");
    }
    if (json_peek(&p->r) != JSON_NUMBER) return expect(p, JSON_NUMBER, "a number or one for each channel");
    if (!read_value(p, &colour[0])) return false;
    for (size_t c = 1; c < C; c++) colour[c] = colour[0];
    return true;
}

/* [...] of element indices, each below n, at most n of them; those of an emission only once each. */
static bool read_elements(parser *p, uint32_t *elements, size_t *count, bool once) {
    size_t n = p->scene->n, mark = p->pointer_length;
    *count = 0;
    if (!expect(p, JSON_ARRAY, "an array of element indices")) return false;
    if (!json_enter_array(&p->r)) return fault(p);
    bool good = true;
    while (json_next_element(&p->r)) {
        double index;
        point_index(p, *count);
        good = expect(p, JSON_NUMBER, "an element index");
        if (!good) break;
        if (!json_read_double(&p->r, &index)) return fault(p);
        if (!(index >= 0.0 && index < (double)n && index == floor(index))) {
            int length = p->r.number.length > 40 ? 40 : (int)p->r.number.length;
            good = refuse(p, 422, "%s = %.*s, must be an integer from 0 to %zu", here(p), length,
                          p->r.number.bytes, n - 1);
            break;
        }
        size_t element = (size_t)index;
        if (*count == n || (once && p->element_set[element])) {
            good = *count == n
                       ? refuse(p, 422, "%s: more than the %zu elements of the scene", here(p), n)
                       : refuse(p, 422, "%s = %zu, an element that was listed before", here(p), element);
            break;
        }
        if (once) p->element_set[element] = true;
        elements[(*count)++] = (uint32_t)element;
        p->pointer_length = mark;
    }
    if (once)
        for (size_t i = 0; i < *count; i++) p->element_set[elements[i]] = false;
    return good && closed(p);
}

/* --- emissions ---------------------------------------------------------------------------------------- */

static bool allocate(parser *p, void **memory, size_t count, size_t size) {
    if (*memory == NULL) *memory = memory_allocate(count, size, "sparse emission", NULL);
    return *memory != NULL || problem_set(p->why, 503, "not enough memory for a sparse emission");
}

/* [e0, e1, ...] or C rows of it. */
static bool read_dense(parser *p, float *E) {
    size_t n = p->scene->n, C = p->scene->n_channels, mark = p->pointer_length, rows = 0;
    if (!json_enter_array(&p->r)) return fault(p);
    if (json_look(&p->r) != JSON_ARRAY) {
        if (!read_rest_of_row(p, E, n, "element")) return false;
        for (size_t c = 1; c < C; c++) memcpy(E + c * n, E, n * sizeof *E);
        return true;
    }
    while (json_next_element(&p->r)) {
        if (rows == C) return refuse(p, 422, "%s holds more than %zu rows, one for each channel", here(p), C);
        point_index(p, rows);
        if (!expect(p, JSON_ARRAY, "an array of numbers")) return false;
        if (!json_enter_array(&p->r)) return fault(p);
        if (!read_rest_of_row(p, E + rows * n, n, "element")) return false;
        p->pointer_length = mark;
        rows++;
    }
    if (!closed(p)) return false;
    return rows == C ||
           refuse(p, 422, "%s holds %zu rows, must be %zu, one for each channel", here(p), rows, C);
}

/* [v...] of the sparse form: each a number or C of them. */
static bool read_values(parser *p, size_t *count) {
    size_t n = p->scene->n, C = p->scene->n_channels, mark = p->pointer_length;
    *count = 0;
    if (!expect(p, JSON_ARRAY, "an array of values")) return false;
    if (!json_enter_array(&p->r)) return fault(p);
    while (json_next_element(&p->r)) {
        if (*count == n) return refuse(p, 422, "%s holds more values than there are elements", here(p));
        point_index(p, *count);
        if (!read_colour(p, p->values + *count * C)) return false;
        p->pointer_length = mark;
        (*count)++;
    }
    return closed(p);
}

/* {"lamp": v, ...} */
static bool read_groups(parser *p, float *E) {
    const group_index *groups = p->scene->groups;
    size_t n = p->scene->n, C = p->scene->n_channels, mark = p->pointer_length;
    json_slice key;
    if (!expect(p, JSON_OBJECT, "an object of group names and values") ||
        !allocate(p, (void **)&p->group_set, groups->n_groups, sizeof *p->group_set))
        return false;
    memset(p->group_set, 0, groups->n_groups * sizeof *p->group_set);
    if (!json_enter_object(&p->r)) return fault(p);
    while (next_member(p, &key)) {
        const uint32_t *found = NULL;
        point_key(p, key.bytes, key.length);
        size_t n_found = group_index_find(groups, key.bytes, key.length, &found);
        if (n_found == 0) return refuse(p, 422, "%s: the scene has no group of this name", here(p));
        if (!read_colour(p, p->colour)) return false;
        for (size_t k = 0; k < n_found; k++) {
            uint32_t g = found[k];
            if (p->group_set[g])
                return refuse(p, 422, "%s: the group %s is given twice", here(p), groups->names[g]);
            p->group_set[g] = true;
            for (size_t c = 0; c < C; c++)
                for (uint32_t i = groups->start[g]; i < groups->start[g + 1]; i++)
                    E[c * n + groups->elements[i]] = p->colour[c];
        }
        p->pointer_length = mark;
    }
    return p->why->status == 0;
}

static bool read_emission_object(parser *p, float *E) {
    static const char *const names[] = {"elements", "values", "groups", "sky", "emitters"};
    enum { ELEMENTS, VALUES, GROUPS, SKY, EMITTERS, N_NAMES };
    size_t n = p->scene->n, C = p->scene->n_channels, mark = p->pointer_length;
    size_t n_elements = 0, n_values = 0, which;
    unsigned seen = 0;
    json_slice key;
    if (!json_enter_object(&p->r)) return fault(p);
    while (next_member(p, &key)) {
        bool good = known_member(p, &key, names, N_NAMES, &seen, &which);
        if (!good) return false;
        switch (which) {
        case ELEMENTS:
            good = allocate(p, (void **)&p->elements, n, sizeof *p->elements) &&
                   allocate(p, (void **)&p->element_set, n, sizeof *p->element_set) &&
                   read_elements(p, p->elements, &n_elements, true);
            break;
        case VALUES:
            good = allocate(p, (void **)&p->values, n, C * sizeof *p->values) && read_values(p, &n_values);
            break;
        case GROUPS:
            good = read_groups(p, E);
            break;
        case SKY:
            good = p->scene->has_sky ? refuse(p, 501, "%s: a sky as emission is not supported yet", here(p))
                                     : refuse(p, 422, "%s: the store has no sky", here(p));
            break;
        default:
            good = p->scene->has_emitters
                       ? refuse(p, 501, "%s: precomputed emitters are not supported yet", here(p))
                       : refuse(p, 422, "%s: the store has no precomputed emitters", here(p));
        }
        if (!good) return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    bool sparse = (seen & (1u << ELEMENTS | 1u << VALUES)) != 0, groups = (seen & 1u << GROUPS) != 0;
    if (sparse == groups) return refuse(p, 422, "%s must hold either elements and values or groups", here(p));
    if (sparse && ((seen & 1u << ELEMENTS) == 0 || (seen & 1u << VALUES) == 0))
        return refuse(p, 422, "%s must hold both elements and values", here(p));
    if (n_elements != n_values)
        return refuse(p, 422, "%s holds %zu elements and %zu values, must be as many", here(p), n_elements,
                      n_values);
    for (size_t i = 0; i < n_elements; i++)
        for (size_t c = 0; c < C; c++) E[c * n + p->elements[i]] = p->values[i * C + c];
    return true;
}

static bool read_emission(parser *p) {
    float *E;
    json_kind kind = json_peek(&p->r);
    if (kind == JSON_NOTHING) return fault(p);
    if (kind != JSON_ARRAY && kind != JSON_OBJECT)
        return refuse(p, 422, "%s must be an array of numbers or an object", here(p));
    if (!radiosity_request_add(p->request, p->scene, &E, p->why)) {
        memcpy(p->why->pointer, p->pointer, p->pointer_length);
        p->why->pointer[p->pointer_length] = '\0';
        return false;
    }
    return kind == JSON_ARRAY ? read_dense(p, E) : read_emission_object(p, E);
}

static bool read_emissions(parser *p) {
    size_t mark = p->pointer_length;
    if (!expect(p, JSON_ARRAY, "an array of emissions")) return false;
    if (!json_enter_array(&p->r)) return fault(p);
    while (json_next_element(&p->r)) {
        point_index(p, p->request->n_rhs);
        if (!read_emission(p)) return false;
        p->pointer_length = mark;
    }
    if (!closed(p)) return false;
    return p->request->n_rhs > 0 || refuse(p, 422, "%s is empty, must hold an emission", here(p));
}

/* --- the other members -------------------------------------------------------------------------------- */

/* ["floor", ...]: the elements of the first in mesh order, then of the next. */
static bool read_selected_groups(parser *p) {
    const group_index *groups = p->scene->groups;
    radiosity_request *request = p->request;
    size_t mark = p->pointer_length, index = 0;
    if (!expect(p, JSON_ARRAY, "an array of group names")) return false;
    if (!json_enter_array(&p->r)) return fault(p);
    for (; json_next_element(&p->r); index++) {
        json_slice name;
        const uint32_t *found = NULL;
        point_index(p, index);
        if (!expect(p, JSON_TEXT, "a group name")) return false;
        if (!json_read_text(&p->r, &name)) return fault(p);
        size_t n_found = group_index_find(groups, name.bytes, name.length, &found);
        if (n_found == 0)
            return refuse(p, 422, "%s = \"%.*s\", the scene has no group of this name", here(p),
                          name.length > 80 ? 80 : (int)name.length, name.bytes);
        for (size_t k = 0; k < n_found; k++) {
            uint32_t first = groups->start[found[k]], count = groups->start[found[k] + 1] - first;
            if (count > p->scene->n - request->n_selected)
                return refuse(p, 422, "%s: more than the %zu elements of the scene", here(p), p->scene->n);
            memcpy(request->selected + request->n_selected, groups->elements + first,
                   count * sizeof *request->selected);
            request->n_selected += count;
        }
        p->pointer_length = mark;
    }
    return closed(p);
}

static bool read_select(parser *p) {
    static const char *const names[] = {"elements", "groups"};
    size_t mark = p->pointer_length, which;
    unsigned seen = 0;
    json_slice key;
    if (!expect(p, JSON_OBJECT, "an object with elements or groups") ||
        !allocate(p, (void **)&p->request->selected, p->scene->n, sizeof *p->request->selected))
        return false;
    p->request->select = true;
    if (!json_enter_object(&p->r)) return fault(p);
    while (next_member(p, &key)) {
        if (!known_member(p, &key, names, 2, &seen, &which)) return false;
        if (seen == 3) break;
        if (!(which == 0 ? read_elements(p, p->request->selected, &p->request->n_selected, false)
                         : read_selected_groups(p)))
            return false;
        p->pointer_length = mark;
    }
    if (p->why->status != 0) return false;
    p->pointer_length = mark;
    return seen == 1 || seen == 2 || refuse(p, 422, "%s must hold either elements or groups", here(p));
}

static bool read_quantity(parser *p) {
    json_slice text;
    if (!expect(p, JSON_TEXT, "\"radiosity\", \"irradiance\" or \"indirect\"")) return false;
    if (!json_read_text(&p->r, &text)) return fault(p);
    for (int q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++) {
        const char *name = codec_quantity_name((lam_quantity)q);
        if (strlen(name) == text.length && memcmp(name, text.bytes, text.length) == 0) {
            p->request->quantity = (lam_quantity)q;
            return true;
        }
    }
    return refuse(p, 422, "%s = \"%.*s\", must be radiosity, irradiance or indirect", here(p),
                  text.length > 80 ? 80 : (int)text.length, text.bytes);
}

static bool read_body(parser *p) {
    static const char *const names[] = {"emission", "emissions", "select", "quantity", "tolerance", "reduce"};
    enum { EMISSION, EMISSIONS, SELECT, QUANTITY, TOLERANCE, REDUCE, N_NAMES };
    unsigned seen = 0, both = 1u << EMISSION | 1u << EMISSIONS;
    size_t which;
    json_slice key;
    if (!expect(p, JSON_OBJECT, "an object")) return false;
    if (!json_enter_object(&p->r)) return fault(p);
    while (next_member(p, &key)) {
        bool good = known_member(p, &key, names, N_NAMES, &seen, &which);
        if (!good) return false;
        if ((seen & both) == both) {
            p->pointer_length = 0;
            return refuse(p, 422, "the body holds both emission and emissions, must hold one of them");
        }
        switch (which) {
        case EMISSION:
            good = read_emission(p);
            break;
        case EMISSIONS:
            p->request->batch = true;
            good = read_emissions(p);
            break;
        case SELECT:
            good = read_select(p);
            break;
        case QUANTITY:
            good = read_quantity(p);
            break;
        default:
            good = refuse(p, 501, "%s is not supported yet", here(p));
        }
        if (!good) return false;
        p->pointer_length = 0;
    }
    if (p->why->status != 0) return false;
    if (!json_finish(&p->r)) return fault(p);
    return (seen & both) != 0 || refuse(p, 422, "the body holds neither emission nor emissions");
}

bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why) {
    parser p = {.scene = scene, .request = request, .why = why};
    *why = (problem){0};
    json_begin(&p.r, text, length);
    bool good = allocate(&p, (void **)&p.colour, scene->n_channels, sizeof *p.colour) && read_body(&p);
    json_end(&p.r);
    if (!good && (why->status == 422 || why->status == 501)) {
        /* What is not JSON at all is told first, wherever its fault lies. */
        json_begin(&p.r, text, length);
        if (!json_skip(&p.r) || !json_finish(&p.r)) fault(&p);
        json_end(&p.r);
    }
    free(p.elements);
    free(p.values);
    free(p.colour);
    free(p.group_set);
    free(p.element_set);
    return good;
}
