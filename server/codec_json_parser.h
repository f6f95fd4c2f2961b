/* What the parts of codec_read_json share: where they are in a request, and how they refuse it. Private to
 * the codec. Every function that returns false has filled why. */
#ifndef LAMBERT_SERVER_CODEC_JSON_PARSER_H
#define LAMBERT_SERVER_CODEC_JSON_PARSER_H

#include "server/codec_json_reader.h"
#include "server/codec_request.h"

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

/* Goes into a member, or an array's element; the caller restores pointer_length. What does not fit is left
 * out. */
void parser_point_key(parser *p, const char *key, size_t length);
void parser_point_index(parser *p, size_t index);

/* The pointer as a reader of the message would say it: "emission/groups/lamp". */
const char *parser_here(parser *p);

/* Refuses what is being read; the text itself, when it is not JSON. */
bool parser_refuse(parser *p, unsigned status, const char *format, ...) __attribute__((format(printf, 3, 4)));
bool parser_fault(parser *p);

/* Over the end of an array or object whose loop has ended. */
bool parser_closed(parser *p);

/* Whether a value of this kind comes next. */
bool parser_expect(parser *p, json_kind kind, const char *what);

/* The next member of an object; false at its end or on a refusal. */
bool parser_next_member(parser *p, json_slice *key);

/* Goes into a member of an object whose members are known; seen is a bit for each. */
bool parser_known_member(parser *p, const json_slice *key, const char *const *names, size_t count,
                         unsigned *seen, size_t *which);

/* Memory that is kept until the request is read; zeroed where it was NULL. */
bool parser_allocate(parser *p, void **memory, size_t count, size_t size);

/* [...] of element indices, each below n, at most n of them; those of an emission only once each. */
bool parser_read_elements(parser *p, uint32_t *elements, size_t *count, bool once);

/* The value of `emission`, and of `emissions`. */
bool parser_read_emission(parser *p);
bool parser_read_emissions(parser *p);

#endif
