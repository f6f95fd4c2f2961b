#include "solver/codec/json_parser.h"

#include "solver/base/array_grow.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define LEAST_SIZE ((size_t)64)

/* The slot of an index, or the free one where it belongs: the highest bits of its product with the factor,
 * then one after the other. At most half of the slots are taken, so that there is one. */
static size_t slot_of(const index_set *set, uint32_t index) {
    size_t at = (size_t)((uint64_t)index * set->factor >> (64 - __builtin_ctzll(set->size)));
    while (set->slots[at] != UINT32_MAX && set->slots[at] != index) at = (at + 1) & (set->size - 1);
    return at;
}

static uint64_t random_factor(void) {
    uint64_t factor = 0;
    /* Without entropy an address that the system chose has to do. */
    if (getrandom(&factor, sizeof factor, GRND_NONBLOCK) != (ssize_t)sizeof factor)
        factor = (uint64_t)(uintptr_t)&factor * 0x9E3779B97F4A7C15u;
    return factor | 1;
}

static bool grow(index_set *set) {
    index_set larger = {.size = set->size == 0 ? LEAST_SIZE : 2 * set->size,
                        .factor = set->size == 0 ? random_factor() : set->factor};
    larger.slots = malloc(larger.size * sizeof *larger.slots);
    if (larger.slots == NULL) return false;
    memset(larger.slots, 0xff, larger.size * sizeof *larger.slots);
    for (size_t k = 0; k < set->size; k++)
        if (set->slots[k] != UINT32_MAX) larger.slots[slot_of(&larger, set->slots[k])] = set->slots[k];
    larger.count = set->count;
    free(set->slots);
    *set = larger;
    return true;
}

index_set_result index_set_add(index_set *set, uint32_t index) {
    if (2 * set->count >= set->size && !grow(set)) return INDEX_SET_NO_MEMORY;
    const size_t at = slot_of(set, index);
    if (set->slots[at] == index) return INDEX_SET_KNOWN;
    set->slots[at] = index;
    set->count++;
    return INDEX_SET_ADDED;
}

void index_set_clear(index_set *set) {
    /* A batch of short lists behind a long one must not pay for that again with each. */
    if (set->size > 16 * LEAST_SIZE)
        index_set_free(set);
    else if (set->count > 0)
        memset(set->slots, 0xff, set->size * sizeof *set->slots);
    set->count = 0;
}

void index_set_free(index_set *set) {
    free(set->slots);
    *set = (index_set){0};
}

void parser_point_key(parser *p, const char *key, size_t length) {
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

void parser_point_index(parser *p, size_t index) {
    char text[24];
    int length = snprintf(text, sizeof text, "%zu", index);
    parser_point_key(p, text, (size_t)length);
}

bool parser_refuse(parser *p, problem_kind kind, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->why->detail, sizeof p->why->detail, format, arguments);
    va_end(arguments);
    p->why->kind = kind;
    p->why->status = problem_status(kind);
    p->pointer[p->pointer_length] = '\0';
    memcpy(p->why->pointer, p->pointer, p->pointer_length + 1);
    return false;
}

const char *parser_here(parser *p) {
    p->pointer[p->pointer_length] = '\0';
    return p->pointer_length == 0 ? codec_source(p->scene) : p->pointer + 1;
}

bool parser_fault(parser *p) {
    size_t line = 1, column = 1;
    if (p->r.no_memory)
        return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory to read %s", codec_source(p->scene));
    for (const char *at = p->r.start; at < p->r.at; at++) {
        column = *at == '\n' ? 1 : column + 1;
        line += *at == '\n';
    }
    return problem_set(p->why, PROBLEM_NOT_JSON, "%s is not JSON: %s, at byte %zu (line %zu, column %zu)",
                       codec_source(p->scene), p->r.fault, (size_t)(p->r.at - p->r.start), line, column);
}

bool parser_not_linear(parser *p) {
    return problem_set(p->why, PROBLEM_UNAVAILABLE, "no linear reduction of sparse vectors");
}

bool parser_closed(parser *p) {
    return p->r.fault == NULL || parser_fault(p);
}

bool parser_expect(parser *p, json_kind kind, const char *what) {
    json_kind found = json_peek(&p->r);
    if (found == JSON_NOTHING) return parser_fault(p);
    return found == kind || parser_refuse(p, PROBLEM_WRONG_KIND, "%s must be %s", parser_here(p), what);
}

bool parser_next_member(parser *p, json_slice *key) {
    if (!json_next_member(&p->r, key)) {
        parser_closed(p);
        return false;
    }
    if (memchr(key->bytes, '\0', key->length) != NULL) {
        parser_point_key(p, key->bytes, strnlen(key->bytes, key->length));
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "a NUL in a key of %s", parser_here(p));
    }
    return true;
}

/* The number of the name that equals a key; count when there is none. */
static size_t find_name(const json_slice *key, const char *const *names, size_t count) {
    size_t i = 0;
    while (i < count && (strlen(names[i]) != key->length || memcmp(names[i], key->bytes, key->length) != 0))
        i++;
    return i;
}

bool parser_known_member(parser *p, const json_slice *key, const char *const *names, size_t count,
                         unsigned *seen, size_t *which) {
    *which = find_name(key, names, count);
    parser_point_key(p, key->bytes, key->length);
    if (*which == count)
        return parser_refuse(p, PROBLEM_WRONG_MEMBERS, "%s is not a member that can stand here",
                             parser_here(p));
    if (*seen & 1u << *which)
        return parser_refuse(p, PROBLEM_GIVEN_TWICE, "%s is given twice", parser_here(p));
    *seen |= 1u << *which;
    return true;
}

bool parser_append(parser *p, index_list *list, const uint32_t *indices, size_t count) {
    if (array_grow(&list->values, &list->capacity, list->count + count, sizeof *list->values, "indices",
                   NULL) != LAM_OK)
        return problem_set(p->why, PROBLEM_NO_MEMORY, "not enough memory for a list of indices");
    if (count > 0) memcpy(list->values + list->count, indices, count * sizeof *indices);
    list->count += count;
    return true;
}

bool parser_read_group(parser *p, json_slice *name, const uint32_t **groups, size_t *n_groups) {
    if (!parser_expect(p, JSON_TEXT, "a group name")) return false;
    if (!json_read_text(&p->r, name)) return parser_fault(p);
    return parser_find_group(p, name, groups, n_groups);
}

bool parser_knows_sensors(parser *p) {
    const group_index *sets = p->scene->sensors;
    if (p->scene->no_sensors != NULL)
        return parser_refuse(p, PROBLEM_NOT_IN_STORE, "%s: sensors have no values: %s", parser_here(p),
                             p->scene->no_sensors);
    return (sets != NULL && sets->n_groups > 0) ||
           parser_refuse(p, PROBLEM_NOT_IN_STORE,
                         "%s: the store has no sensors; precompute it with --sensors", parser_here(p));
}

bool parser_read_sensors(parser *p, json_slice *name, const uint32_t **sets, size_t *n_sets) {
    if (!parser_expect(p, JSON_TEXT, "the name of a set of sensors")) return false;
    if (!json_read_text(&p->r, name)) return parser_fault(p);
    return parser_find_in(p, p->scene->sensors, name, sets, n_sets);
}

bool parser_find_in(parser *p, const group_index *index, const json_slice *name, const uint32_t **groups,
                    size_t *n_groups) {
    char miss[GROUP_MISS];
    *n_groups = group_index_find(index, name->bytes, name->length, groups);
    if (*n_groups > 0) return true;
    group_index_miss(index, name->bytes, name->length, miss);
    return parser_refuse(p, PROBLEM_UNKNOWN_GROUP, "%s: the scene has %s", parser_here(p), miss);
}

bool parser_find_luminaires(parser *p, const json_slice *name, const uint32_t **luminaires,
                            size_t *n_luminaires) {
    const luminaire_names *names = p->scene->luminaires;
    char miss[GROUP_MISS];
    *n_luminaires = luminaire_names_find(names, name->bytes, name->length, luminaires);
    if (*n_luminaires > 0) return true;
    luminaire_names_miss(names, name->bytes, name->length, miss);
    return parser_refuse(p, PROBLEM_UNKNOWN_GROUP, "%s: the scene has %s", parser_here(p), miss);
}

bool parser_find_group(parser *p, const json_slice *name, const uint32_t **groups, size_t *n_groups) {
    return parser_find_in(p, p->scene->groups, name, groups, n_groups);
}

bool parser_read_quantity(parser *p, lam_quantity *quantity) {
    json_slice text;
    if (!parser_expect(p, JSON_TEXT, "\"radiosity\", \"irradiance\" or \"indirect\"")) return false;
    if (!json_read_text(&p->r, &text)) return parser_fault(p);
    return codec_quantity_find(text.bytes, text.length, quantity) ||
           parser_refuse(p, PROBLEM_UNKNOWN_WORD, "%s = \"%.*s\", must be radiosity, irradiance or indirect",
                         parser_here(p), text.length > 80 ? 80 : (int)text.length, text.bytes);
}

bool parser_begin(parser *p, const codec_scene *scene, const char *text, size_t length,
                  radiosity_request *request, problem *why) {
    *p = (parser){.scene = scene, .request = request, .why = why};
    *why = (problem){0};
    if (request != NULL) request->told.from = scene->lights;
    json_begin(&p->r, text, length);
    p->colour = memory_allocate(scene->n_channels, sizeof *p->colour, "colour", NULL);
    return p->colour != NULL ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to read %s", codec_source(scene));
}

bool parser_fill_sides(parser *p) {
    radiosity_request *request = p->request;
    float *last;
    return (request->sky.values == NULL || request->sky.n == request->n_rhs ||
            radiosity_request_sky(request, p->scene, &last, p->why)) &&
           (request->emitters.values == NULL || request->emitters.n == request->n_rhs ||
            radiosity_request_emitters(request, p->scene, &last, p->why)) &&
           (request->luminaires.values == NULL || request->luminaires.n == request->n_rhs ||
            radiosity_request_luminaires(request, p->scene, &last, p->why));
}

bool parser_read_body(parser *p, const parser_body *body, unsigned *seen) {
    size_t which;
    json_slice key;
    *seen = 0;
    if (!parser_expect(p, JSON_OBJECT, "an object")) return false;
    if (!json_enter_object(&p->r)) return parser_fault(p);
    while (parser_next_member(p, &key)) {
        if (!parser_known_member(p, &key, body->names, body->count, seen, &which)) return false;
        if (!body->read(p, which, body->to)) return false;
        p->pointer_length = 0;
    }
    if (p->why->status != 0) return false;
    return json_finish(&p->r) || parser_fault(p);
}

bool parser_end(parser *p, bool good) {
    json_end(&p->r);
    if (!good && p->why->status == 422) {
        json_begin(&p->r, p->r.start, (size_t)(p->r.end - p->r.start));
        if (!json_skip(&p->r) || !json_finish(&p->r)) parser_fault(p);
        json_end(&p->r);
    }
    free(p->elements.values);
    free(p->groups.values);
    free(p->faces.values);
    free(p->values);
    free(p->colour);
    index_set_free(&p->seen);
    return good;
}
