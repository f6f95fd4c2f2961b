/* A strict JSON reader (RFC 8259) that is pulled through a text once and never builds a tree.
 * Knows the grammar only: what a text means is its caller's affair. No I/O. */
#ifndef LAMBERT_CODEC_JSON_READER_H
#define LAMBERT_CODEC_JSON_READER_H

#include <stdbool.h>
#include <stddef.h>

#define JSON_MAX_DEPTH 64

typedef enum json_kind {
    JSON_NOTHING, /* a fault: the text ends, or no value starts here */
    JSON_OBJECT,
    JSON_ARRAY,
    JSON_TEXT,
    JSON_NUMBER,
    JSON_BOOLEAN,
    JSON_NULL
} json_kind;

/* Bytes of a text; may hold NULs. Valid UTF-8. */
typedef struct json_slice {
    const char *bytes;
    size_t length;
} json_slice;

/* Every function returns false on a fault; the reader then stays where it is and every further call fails. */
typedef struct json_reader {
    const char *start, *at, *end;
    const char *fault; /* the fault at `at`, static; NULL while there is none */
    bool no_memory;    /* the fault is ours, not the text's */
    bool first;        /* just behind a [ or { */
    unsigned depth;
    json_slice number; /* the last number as written */
    char *scratch;     /* the last text that held escapes */
    size_t scratch_capacity;
} json_reader;

/* text[length] must be NUL and the text outlive the reader. json_end frees what the reader holds. */
void json_begin(json_reader *r, const char *text, size_t length);
void json_end(json_reader *r);

/* The kind of the next value; consumes only white space. */
json_kind json_peek(json_reader *r);

/* The same, but a missing value is not a fault. */
json_kind json_look(json_reader *r);

/* Into an array, then to each element: false behind the last one (or on a fault: look at r->fault). */
bool json_enter_array(json_reader *r);
bool json_next_element(json_reader *r);

/* The same for an object; key is valid until the next text is read. */
bool json_enter_object(json_reader *r);
bool json_next_member(json_reader *r, json_slice *key);

/* A text, its escapes resolved; valid until the next text is read. */
bool json_read_text(json_reader *r, json_slice *text);

/* A number rounded to the nearest value of its type: infinite when it is beyond that. */
bool json_read_float(json_reader *r, float *value);
bool json_read_double(json_reader *r, double *value);
bool json_skip_number(json_reader *r);

/* Reads numbers of an array as long as they follow each other and are written plainly (not negative, 18
 * digits and an exponent of two at most), up to `most`. The floats are the same, several times as fast.
 * Returns how many; the next json_next_element goes on behind them. */
size_t json_read_plain_floats(json_reader *r, float *values, size_t most);

bool json_read_boolean(json_reader *r, bool *value);
bool json_read_null(json_reader *r);

/* Over one whole value of any kind, checking its grammar. */
bool json_skip(json_reader *r);

/* Makes it the fault, unless there is one already; returns false. For the files of the reader. */
bool json_fail(json_reader *r, const char *fault);

/* Nothing but white space may be left. */
bool json_finish(json_reader *r);

#endif
