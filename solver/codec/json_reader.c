#include "solver/codec/json_reader.h"

#include "solver/base/utf8.h"
#include "solver/codec/json_mark.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

bool json_fail(json_reader *r, const char *fault) {
    if (r->fault == NULL) r->fault = fault;
    return false;
}

void json_begin(json_reader *r, const char *text, size_t length) {
    *r = (json_reader){.start = text, .at = text, .end = text + length};
    r->at += json_mark_length(text, length, &r->fault);
}

void json_end(json_reader *r) {
    free(r->scratch);
    r->scratch = NULL;
    r->scratch_capacity = 0;
}

static inline void skip_space(json_reader *r) {
    const char *at = r->at;
    while (at < r->end && (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t')) at++;
    r->at = at;
}

json_kind json_look(json_reader *r) {
    if (r->fault != NULL) return JSON_NOTHING;
    skip_space(r);
    if (r->at == r->end) return JSON_NOTHING;
    switch (*r->at) {
    case '{':
        return JSON_OBJECT;
    case '[':
        return JSON_ARRAY;
    case '"':
        return JSON_TEXT;
    case 't':
    case 'f':
        return JSON_BOOLEAN;
    case 'n':
        return JSON_NULL;
    default:
        return *r->at == '-' || (*r->at >= '0' && *r->at <= '9') ? JSON_NUMBER : JSON_NOTHING;
    }
}

json_kind json_peek(json_reader *r) {
    json_kind kind = json_look(r);
    if (kind != JSON_NOTHING) return kind;
    if (r->at == r->end)
        json_fail(r, "the text ends where a value is expected");
    else
        json_fail(r, *r->at == 'N' || *r->at == 'I' ? "NaN and Infinity are not JSON numbers"
                                                    : "a value is expected");
    return JSON_NOTHING;
}

static bool enter(json_reader *r, json_kind kind) {
    if (json_peek(r) != kind) return json_fail(r, "another kind of value is expected");
    if (r->depth == JSON_MAX_DEPTH) return json_fail(r, "nested more than 64 deep");
    r->depth++;
    r->at++;
    r->first = true;
    return true;
}

/* Over the comma before the next item; false at the closing bracket, which is consumed, or on a fault. */
static bool next(json_reader *r, char closing) {
    if (r->fault != NULL) return false;
    skip_space(r);
    if (r->at == r->end) return json_fail(r, "the text ends inside an array or object");
    if (*r->at == closing) {
        r->at++;
        r->depth--;
        r->first = false;
        return false;
    }
    if (!r->first) {
        if (*r->at != ',')
            return json_fail(r, closing == ']' ? "',' or ']' is expected" : "',' or '}' is expected");
        r->at++;
        skip_space(r);
        if (r->at < r->end && *r->at == closing) return json_fail(r, "a comma before a closing bracket");
    }
    r->first = false;
    return true;
}

bool json_enter_array(json_reader *r) {
    return enter(r, JSON_ARRAY);
}

bool json_next_element(json_reader *r) {
    return next(r, ']');
}

bool json_enter_object(json_reader *r) {
    return enter(r, JSON_OBJECT);
}

bool json_next_member(json_reader *r, json_slice *key) {
    if (!next(r, '}')) return false;
    skip_space(r);
    if (r->at == r->end || *r->at != '"') return json_fail(r, "a key in double quotes is expected");
    if (!json_read_text(r, key)) return false;
    skip_space(r);
    if (r->at == r->end || *r->at != ':') return json_fail(r, "':' is expected behind a key");
    r->at++;
    return true;
}

static bool read_hex4(const char *at, const char *end, unsigned *value) {
    if (end - at < 4) return false;
    *value = 0;
    for (int i = 0; i < 4; i++) {
        char c = at[i];
        unsigned digit;
        if (c >= '0' && c <= '9')
            digit = (unsigned)(c - '0');
        else if (c >= 'a' && c <= 'f')
            digit = (unsigned)(c - 'a') + 10;
        else if (c >= 'A' && c <= 'F')
            digit = (unsigned)(c - 'A') + 10;
        else
            return false;
        *value = *value * 16 + digit;
    }
    return true;
}

static char *put_utf8(char *to, unsigned code) {
    if (code < 0x80) {
        *to++ = (char)code;
    } else if (code < 0x800) {
        *to++ = (char)(0xC0 | code >> 6);
        *to++ = (char)(0x80 | (code & 0x3F));
    } else if (code < 0x10000) {
        *to++ = (char)(0xE0 | code >> 12);
        *to++ = (char)(0x80 | (code >> 6 & 0x3F));
        *to++ = (char)(0x80 | (code & 0x3F));
    } else {
        *to++ = (char)(0xF0 | code >> 18);
        *to++ = (char)(0x80 | (code >> 12 & 0x3F));
        *to++ = (char)(0x80 | (code >> 6 & 0x3F));
        *to++ = (char)(0x80 | (code & 0x3F));
    }
    return to;
}

/* One escape at r->at (behind the backslash) to *to. */
static bool read_escape(json_reader *r, char **to) {
    static const char letters[] = "\"\\/bfnrt", values[] = "\"\\/\b\f\n\r\t";
    if (r->at == r->end) return json_fail(r, "a text without its closing quote");
    const char *found = *r->at == '\0' ? NULL : strchr(letters, *r->at);
    if (found != NULL) {
        *(*to)++ = values[found - letters];
        r->at++;
        return true;
    }
    unsigned code, low;
    if (*r->at != 'u') return json_fail(r, "an unknown escape");
    if (!read_hex4(r->at + 1, r->end, &code)) return json_fail(r, "\\u needs four hexadecimal digits");
    r->at += 5;
    if (code >= 0xD800 && code <= 0xDFFF) {
        if (code > 0xDBFF || r->end - r->at < 6 || r->at[0] != '\\' || r->at[1] != 'u' ||
            !read_hex4(r->at + 2, r->end, &low) || low < 0xDC00 || low > 0xDFFF)
            return json_fail(r, "half a surrogate pair");
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        r->at += 6;
    }
    *to = put_utf8(*to, code);
    return true;
}

bool json_read_text(json_reader *r, json_slice *text) {
    if (json_peek(r) != JSON_TEXT) return json_fail(r, "a text is expected");
    const char *begin = ++r->at;
    bool escaped = false;
    for (;;) {
        if (r->at == r->end) return json_fail(r, "a text without its closing quote");
        unsigned char c = (unsigned char)*r->at;
        if (c == '"') break;
        if (c < 0x20) return json_fail(r, "a control character inside a text");
        size_t step = 1;
        if (c == '\\') {
            escaped = true;
            step = 2;
            if (r->end - r->at < 2) return json_fail(r, "a text without its closing quote");
        } else if (c >= 0x80) {
            step = utf8_sequence(r->at, r->end);
            if (step == 0) return json_fail(r, "a text that is not valid UTF-8");
        }
        r->at += step;
    }
    const char *close = r->at;
    if (!escaped) {
        *text = (json_slice){begin, (size_t)(close - begin)};
        r->at = close + 1;
        return true;
    }
    /* An escape is never shorter than the bytes that it stands for. */
    size_t room = (size_t)(close - begin);
    if (room > r->scratch_capacity) {
        char *scratch = realloc(r->scratch, room);
        if (scratch == NULL) {
            r->no_memory = true;
            return json_fail(r, "not enough memory for a text");
        }
        r->scratch = scratch;
        r->scratch_capacity = room;
    }
    char *to = r->scratch;
    for (r->at = begin; r->at < close;) {
        if (*r->at != '\\') {
            *to++ = *r->at++;
            continue;
        }
        r->at++;
        if (!read_escape(r, &to)) return false;
    }
    *text = (json_slice){r->scratch, (size_t)(to - r->scratch)};
    r->at = close + 1;
    return true;
}

static bool read_word(json_reader *r, const char *word) {
    size_t length = strlen(word);
    if ((size_t)(r->end - r->at) < length || memcmp(r->at, word, length) != 0)
        return json_fail(r, "true, false, null or another value is expected");
    r->at += length;
    return true;
}

bool json_read_boolean(json_reader *r, bool *value) {
    if (json_peek(r) != JSON_BOOLEAN) return json_fail(r, "true or false is expected");
    *value = *r->at == 't';
    return read_word(r, *value ? "true" : "false");
}

bool json_read_null(json_reader *r) {
    if (json_peek(r) != JSON_NULL) return json_fail(r, "null is expected");
    return read_word(r, "null");
}

bool json_skip(json_reader *r) {
    json_slice text;
    bool boolean;
    switch (json_peek(r)) {
    case JSON_OBJECT:
        if (!json_enter_object(r)) return false;
        while (json_next_member(r, &text))
            if (!json_skip(r)) return false;
        return r->fault == NULL;
    case JSON_ARRAY:
        if (!json_enter_array(r)) return false;
        while (json_next_element(r))
            if (!json_skip(r)) return false;
        return r->fault == NULL;
    case JSON_TEXT:
        return json_read_text(r, &text);
    case JSON_NUMBER:
        return json_skip_number(r);
    case JSON_BOOLEAN:
        return json_read_boolean(r, &boolean);
    case JSON_NULL:
        return json_read_null(r);
    case JSON_NOTHING:
        break;
    }
    return false;
}

bool json_finish(json_reader *r) {
    if (r->fault != NULL) return false;
    skip_space(r);
    if (r->at != r->end) return json_fail(r, "something stands behind the end of the value");
    return true;
}
