/* Answers to radiosity requests with `reduce`: figures of groups in place of vectors. */
#ifndef LAMBERT_SERVER_ROUTE_RADIOSITY_FIGURES_H
#define LAMBERT_SERVER_ROUTE_RADIOSITY_FIGURES_H

#include "server/route/call.h"
#include "server/route/eye_figures.h"
#include "solver/codec/answer.h"

/* False with *why if the client does not accept JSON, the only format of figures. */
bool figures_acceptable(const call *in, const radiosity_request *request, problem *why);

/* The figures of an answer until they are written. Starts zeroed. */
typedef struct kept_figures {
    double *numbers;   /* of reduce_figures */
    eye_figures *eyes; /* NULL: no ratings are asked for */
} kept_figures;

/* Bytes that figures take until they are written, and their text, at most. */
size_t figures_bytes(const scene *s, const radiosity_request *request);

/* False when memory is short; freed by figures_free also then. */
bool figures_allocate(const scene *s, const radiosity_request *request, kept_figures *out);
void figures_free(kept_figures *f);

/* Adds vectors first ... first + count, x [count][C][n_selected], or of all receivers, to figures, which of a
 * luminance have one channel: one [C][values] is work then, else NULL. 422 for a value beyond single
 * precision. */
bool figures_add(const scene *s, const radiosity_request *request, size_t first, size_t count, const float *x,
                 float *one, kept_figures *figures, problem *why);

/* reduce_vectors of groups, or of sets of sensors, of which x has all receivers. */
bool figures_reduce(const scene *s, const radiosity_request *request, size_t n_channels, size_t first,
                    size_t count, reduce_values x, kept_figures *figures);

/* Refuses the figure of name k that is not finite. */
bool figures_refuse(const reduce_request *r, size_t k, size_t statistic, problem *why);

/* About how long figures are worked on before others get their turn: a batch has up to a hundred thousand
 * and more, of which each takes up to 2.5 us to write. */
#define FIGURES_STEP_MS 1.0

/* The place that the text of figures has come to; starts zeroed. */
typedef struct figures_text {
    bool begun;
    bool within; /* the ratings of the next figure are begun */
    size_t next; /* of reduce_vectors_written */
} figures_text;

/* Writes the answer, or goes on with it, until the time `until` of clock_ms; *done once it is whole. 422 for
 * a figure that is not finite; 503. */
bool figures_write(const scene *s, const radiosity_request *request, kept_figures *figures, double until,
                   figures_text *at, answer_notes *notes, buffer *b, bool *done, problem *why);

#endif
