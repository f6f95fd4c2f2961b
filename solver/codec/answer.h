/* Vectors to the bytes of an answer, in as many parts as the solve has passes. No I/O. */
#ifndef LAMBERT_CODEC_ANSWER_H
#define LAMBERT_CODEC_ANSWER_H

#include "lambert/lambert.h"
#include "solver/base/photometry.h"
#include "solver/codec/headline.h"
#include "solver/codec/media.h"
#include "solver/codec/problem.h"
#include "solver/operator/stated/answer_error.h"

typedef struct answer_shape {
    size_t n; /* elements of the scene */
    size_t n_channels;
    size_t n_rhs;
    bool batch;
    size_t n_values; /* numbers of a vector in a channel: of all elements or faces, or of those selected, or
                        of sensors */
    bool gaps;       /* NaN stands for a number that there is none of: null in JSON */
} answer_shape;

/* The members of a JSON answer beside its vectors. */
typedef struct answer_notes {
    const char *scene;
    lam_quantity quantity;
    const char *unit;     /* of the numbers; NULL: it is not stated */
    const char *sum_unit; /* of the sum of a year, of which unit is that of the hours; NULL: there is none */
    const char *converted_by; /* the text of their light_conversion; NULL or "": they were not converted */
    bool has_error;
    double relative_mean, indirect_mean; /* not finite: there is nothing that they could be relative to */
    headline head;                       /* known only with has_error */
    const char *error_light; /* the light that the error is of: "own", the answer's; "lights" of the scene or
                                "single" elements, whatever the answer's is */
    double emitters;         /* effective number, of "own" */
    size_t n_name_errors;
    const name_error *name_errors; /* of "own": of the names that are reduced */
    bool of_sensors;               /* of "own": that error is of sensors, and so are its names */
    const char *error_of; /* the elements that the error is of, "receivers" or "all", where a store was built
                             for receivers; NULL: it was built for all */
    const char *error_from; /* "sources" where a store was built for these and they alone emit; "others": not
                               they alone, and no error is stated; NULL: it was built for any emission */
    const char *at; /* the word for the places of numbers, "faces" of the scene file, "corners" or "sensors";
                       NULL: elements */
    bool by_luminance; /* a coloured sky lights a store of one channel by its luminance */
    bool has_time;
    double parse_ms, solve_ms, encode_ms;
    /* [n_rhs] of a refined answer, in place of the store's error, else NULL: the bound on the error of every
     * number of a vector, and the multiplications by the form factors that it took. */
    const double *certificates;
    const size_t *iterations;
    const size_t *limited; /* [n_rhs]: elements that were below zero, in all channels; NULL: not stated */
} answer_notes;

/* The numbers that are of vectors: certificates and iterations of a refined answer, the elements that were
 * limited; one each, or one for each vector of a batch. False when memory is short. */
bool answer_of_vectors(buffer *b, size_t n_rhs, bool batch, const answer_notes *notes);

/* The beginning of any JSON answer, up to and with its quantity, and its end: error, time and the closing
 * brace. False when memory is short. */
bool answer_head(buffer *b, size_t n, size_t n_channels, const answer_notes *notes);
bool answer_tail(buffer *b, const answer_notes *notes);

/* Puts the unit of an answer of a request, and its conversion, which text holds, into notes. */
void answer_note_unit(const light_conversion *told, lam_quantity quantity, char text[LIGHT_CONVERSION_TEXT],
                      answer_notes *notes);

/* Three channels to their luminance, in place: of x [n_rows][3][n] to [n_rows][n]. Certificates [n_rows], of
 * every channel, are also of their mean; they grow by its rounding. NULL: there are none. */
void answer_luminance(size_t n_rows, size_t n, float *x);
void answer_luminance_double(size_t n_rows, size_t n, double *x, double *certificates);

/* Checks that an answer is within single precision; 422. */
bool answer_check(const float *x, size_t count, problem *why);
/* The same within the range of an encoding; with gaps NaN may stand for a number. */
bool answer_check_as(const float *x, size_t count, bool gaps, const media_accept *as, problem *why);

/* Appends x [C][n], or [n] for one channel. False with *why as the next. */
bool answer_rows(buffer *b, const media_accept *as, size_t n_channels, size_t n, bool gaps, const float *x,
                 problem *why);

/* Appends the beginning of an answer, then vectors first ... first + count of x [count][C][n_values], then
 * its end. False with *why: 422 when a value is beyond what the encoding holds, 503 when memory is short. */
bool answer_begin(buffer *b, const answer_shape *shape, const media_accept *as, const answer_notes *notes,
                  problem *why);
/* The memory of an answer whose values are computed where they are sent from, as floats that answer_placed
 * makes halves of where these are asked for; 0 where the encoding has no place for floats. */
size_t answer_placed_bytes(const answer_shape *shape, const media_accept *as);
/* Room behind answer_begin's bytes for the values of such an answer, [n_rhs][C][n_values]; answer_placed, in
 * place of answer_add, then takes them. NULL where memory is short. */
float *answer_place(buffer *b, const answer_shape *shape);
bool answer_placed(buffer *b, const answer_shape *shape, const media_accept *as, problem *why);

bool answer_add(buffer *b, const answer_shape *shape, const media_accept *as, size_t first, size_t count,
                const float *x, problem *why);
/* The same of refined answers. *rounding rises to the largest rounding error of a number. */
bool answer_add_doubles(buffer *b, const answer_shape *shape, const media_accept *as, size_t first,
                        size_t count, const double *x, double *rounding, problem *why);
bool answer_end(buffer *b, const answer_shape *shape, const media_accept *as, const answer_notes *notes,
                problem *why);

#endif
