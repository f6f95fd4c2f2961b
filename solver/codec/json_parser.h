/* The state of reading a request, and its refusals. Private to the codec. Every function that returns false
 * has filled why. */
#ifndef LAMBERT_CODEC_JSON_PARSER_H
#define LAMBERT_CODEC_JSON_PARSER_H

#include "solver/codec/json_reader.h"
#include "solver/codec/request.h"

/* A set of numbers that costs memory for its members, not for its range. Starts zeroed; freed by
 * index_set_free. Holds anything but UINT32_MAX. */
typedef struct index_set {
    uint32_t *slots; /* [size], a power of two; UINT32_MAX: free */
    size_t size, count;
    uint64_t factor; /* of its hash, odd and random: nobody can choose indices that meet in few slots */
} index_set;

typedef enum index_set_result { INDEX_SET_ADDED, INDEX_SET_KNOWN, INDEX_SET_NO_MEMORY } index_set_result;

/* O(1) on average. */
index_set_result index_set_add(index_set *set, uint32_t index);

/* Empties it; what it has room for stays, where that is little. */
void index_set_clear(index_set *set);

void index_set_free(index_set *set);

/* Indices as they are read. */
typedef struct index_list {
    uint32_t *values;
    size_t count, capacity;
} index_list;

/* The word of `at`, and the member of `select`. */
typedef enum place_word { AT_UNSAID, AT_ELEMENTS, AT_FACES, AT_CORNERS } place_word;
typedef enum select_word {
    SELECT_ELEMENTS,
    SELECT_GROUPS,
    SELECT_FACES,
    SELECT_SENSORS,
    SELECT_PROBES,
    SELECT_WORDS
} select_word;

typedef struct parser {
    json_reader r;
    const codec_scene *scene;
    radiosity_request *request;
    problem *why;
    char pointer[sizeof((problem *)0)->pointer]; /* of the value being read */
    size_t pointer_length;
    /* Scratch of sparse vectors, kept from one to the next; never larger than the text read so far. */
    bool in_side; /* in radiances, weights or dimmers, which have no sign */
    index_list elements;
    float *values; /* [values_capacity][C] */
    size_t values_capacity;
    float *colour;  /* [C] */
    index_set seen; /* elements, groups or faces */
    place_word at;
    bool quantity_given;
    bool sky_given; /* the request says what its radiances are: */
    light_kind sky_lights;
    select_word selects;      /* with select */
    index_list groups, faces; /* that are selected */
} parser;

/* Begins to read a text into request. parser_end frees the parser and returns good; when a text is refused,
 * it reads on to its end, because not being JSON goes before any other fault, wherever it lies. */
bool parser_begin(parser *p, const codec_scene *scene, const char *text, size_t length,
                  radiosity_request *request, problem *why);
bool parser_end(parser *p, bool good);

/* Adds dark skies, emitters and luminaires for the vectors behind the last that has any. */
bool parser_fill_sides(parser *p);

/* Goes into a member, or an array's element; the caller restores pointer_length. A key that does not
 * fit is left out. */
void parser_point_key(parser *p, const char *key, size_t length);
void parser_point_index(parser *p, size_t index);

/* The pointer as it stands in messages: "emission/groups/lamp". */
const char *parser_here(parser *p);

/* Refuses the value being read; parser_fault refuses the text, which is not JSON. */
bool parser_refuse(parser *p, problem_kind kind, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
bool parser_fault(parser *p);

/* Refuses a sound request that is not a linear reduction of sparse vectors. */
bool parser_not_linear(parser *p);

/* True behind the end of an array or object; false after a fault in it. */
bool parser_closed(parser *p);

/* Checks that a value of this kind comes next; what names it in the refusal. */
bool parser_expect(parser *p, json_kind kind, const char *what);

/* The next member of an object; false at its end or on a refusal. */
bool parser_next_member(parser *p, json_slice *key);

/* Goes into a member of an object whose members are known; seen is a bit for each. */
bool parser_known_member(parser *p, const json_slice *key, const char *const *names, size_t count,
                         unsigned *seen, size_t *which);

/* Reads the object that is a whole body, whose members are known, each by read(p, which, to). seen: a bit for
 * each that it holds. */
typedef struct parser_body {
    const char *const *names;
    size_t count;
    bool (*read)(parser *p, size_t which, void *to);
    void *to;
} parser_body;
bool parser_read_body(parser *p, const parser_body *body, unsigned *seen);

/* Appends; values is not NULL then, also for none. 503 when memory is short. */
bool parser_append(parser *p, index_list *list, const uint32_t *indices, size_t count);

/* The groups, or luminaires, that a name means, and the groups of the text that comes next; name is valid
 * until the next text is read. */
bool parser_find_in(parser *p, const group_index *index, const json_slice *name, const uint32_t **groups,
                    size_t *n_groups);
bool parser_find_luminaires(parser *p, const json_slice *name, const uint32_t **luminaires,
                            size_t *n_luminaires);
bool parser_find_group(parser *p, const json_slice *name, const uint32_t **groups, size_t *n_groups);
bool parser_read_group(parser *p, json_slice *name, const uint32_t **groups, size_t *n_groups);

/* Refuses a place for sensors where the store has none; and the sets of the text that comes next. */
bool parser_knows_sensors(parser *p);
bool parser_read_sensors(parser *p, json_slice *name, const uint32_t **sets, size_t *n_sets);

/* [...] of indices of the scene, no more than it has elements, or faces; with once each only once. */
typedef enum index_kind { INDEX_ELEMENTS, INDEX_FACES } index_kind;
bool parser_read_indices(parser *p, index_kind kind, bool once, index_list *indices);

/* The value of `quantity`. */
bool parser_read_quantity(parser *p, lam_quantity *quantity);

/* A number for all channels, or one each, into colour [C]; and, inside an array that was entered, count
 * numbers and its end. Numbers are within single precision, and below 0 where the request allows that. */
bool parser_read_colour(parser *p, float *colour);
bool parser_read_rest_of_row(parser *p, float *row, size_t count, const char *of_what);

/* [v0, v1, ...] for all channels or a row for each, into the rows of C, `stride` apart, of count numbers. */
bool parser_read_rows(parser *p, float *rows, size_t count, size_t stride, const char *of_what);

/* The weights of sensors in a cotangent. */
bool parser_read_sensor_weights(parser *p);

/* [NAME, ...] of groups, each once: the names in reduce, which stays off. */
bool parser_read_group_names(parser *p);

/* [NAME, ...] of sets of sensors, each once: their receivers, and the names in reduce, which stays off. */
bool parser_read_sensor_sets(parser *p);

/* A number for all channels or one each, of which none is below 0; of one channel also red, green and blue,
 * which count by their luminance. colour is [C]. */
bool parser_read_radiance(parser *p, float *colour);

/* The values of `select` and `at`; and, once the whole body is read, the faces of an answer of faces and
 * their elements. */
bool parser_read_select(parser *p);
bool parser_read_at(parser *p);
bool parser_settle_places(parser *p);

/* The value of `reduce`; and the elements of a reduction that adjoint rows do not answer, 503 when memory is
 * short. */
bool parser_read_reduce(parser *p);
bool parser_select_reduced(const codec_scene *scene, radiosity_request *request, problem *why);

/* The value of `sun` in an emission, of its vector. */
bool parser_read_sun(parser *p);

/* The value of `emission`, and of `emissions`; of `cotangent`, which has neither sky nor sun nor
 * emitters nor luminaires. */
bool parser_read_emission(parser *p);
bool parser_read_emissions(parser *p);

/* A text such as "3600lm" for some groups, as their exitance colour [C] in the store's kind of light. */
bool parser_read_light(parser *p, size_t n_groups, const uint32_t *groups, float *colour);

/* The values of `unit` and of `photometric`. */
bool parser_read_unit(parser *p);
bool parser_read_photometric(parser *p);

/* Puts all light of a request, whose members are read, into the unit of its answer, which is linear in it. */
bool parser_convert(parser *p);

#endif
