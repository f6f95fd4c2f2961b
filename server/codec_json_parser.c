#include "server/codec_json_parser.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

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

bool parser_refuse(parser *p, unsigned status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->why->detail, sizeof p->why->detail, format, arguments);
    va_end(arguments);
    p->why->status = status;
    p->pointer[p->pointer_length] = '\0';
    memcpy(p->why->pointer, p->pointer, p->pointer_length + 1);
    return false;
}

const char *parser_here(parser *p) {
    p->pointer[p->pointer_length] = '\0';
    return p->pointer_length == 0 ? "the body" : p->pointer + 1;
}

bool parser_fault(parser *p) {
    if (p->r.no_memory) return problem_set(p->why, 503, "not enough memory to read the body");
    return problem_set(p->why, 400, "the body is not JSON: %s, at byte %zu", p->r.fault,
                       (size_t)(p->r.at - p->r.start));
}

bool parser_closed(parser *p) {
    return p->r.fault == NULL || parser_fault(p);
}

bool parser_expect(parser *p, json_kind kind, const char *what) {
    json_kind found = json_peek(&p->r);
    if (found == JSON_NOTHING) return parser_fault(p);
    return found == kind || parser_refuse(p, 422, "%s must be %s", parser_here(p), what);
}

bool parser_next_member(parser *p, json_slice *key) {
    if (!json_next_member(&p->r, key)) {
        parser_closed(p);
        return false;
    }
    if (memchr(key->bytes, '\0', key->length) != NULL) {
        parser_point_key(p, key->bytes, strnlen(key->bytes, key->length));
        return parser_refuse(p, 422, "a NUL in a key of %s", parser_here(p));
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

bool parser_known_member(parser *p, const json_slice *key, const char *const *names, size_t count,
                         unsigned *seen, size_t *which) {
    *which = find_name(key, names, count);
    parser_point_key(p, key->bytes, key->length);
    if (*which == count)
        return parser_refuse(p, 422, "%s is not a member that can stand here", parser_here(p));
    if (*seen & 1u << *which) return parser_refuse(p, 422, "%s is given twice", parser_here(p));
    *seen |= 1u << *which;
    return true;
}

bool parser_allocate(parser *p, void **memory, size_t count, size_t size) {
    if (*memory == NULL) *memory = memory_allocate(count, size, "sparse emission", NULL);
    return *memory != NULL || problem_set(p->why, 503, "not enough memory for a sparse emission");
}
