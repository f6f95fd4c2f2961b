/* Figures over groups of elements, in place of vectors: mean = sum A x / sum A, sum = sum A x, min, max,
 * uniformity = min / mean, variance = sum A (x - mean)^2 / sum A. No I/O. */
#ifndef LAMBERT_CODEC_GROUP_FIGURES_H
#define LAMBERT_CODEC_GROUP_FIGURES_H

#include "solver/codec/buffer.h"
#include "solver/codec/groups.h"
#include "solver/codec/problem.h"

#define REDUCE_NAMES_MAX 1024 /* groups in one request */

typedef enum reduce_statistic {
    REDUCE_MEAN,
    REDUCE_SUM,
    REDUCE_MIN,
    REDUCE_MAX,
    REDUCE_UNIFORMITY,
    REDUCE_VARIANCE,
    REDUCE_COUNT
} reduce_statistic;

/* A name that was asked for, and the groups of the scene that it means (group_index_find). */
typedef struct reduce_name {
    size_t text; /* where it begins in texts; ends with a NUL */
    const uint32_t *groups;
    size_t n_groups;
} reduce_name;

/* Starts zeroed; freed by reduce_request_free. */
typedef struct reduce_request {
    bool on;
    bool linear; /* means and sums alone: adjoint rows answer it */
    buffer texts;
    reduce_name *names;
    size_t n_names;
    reduce_statistic with[REDUCE_COUNT];
    size_t n_with;
} reduce_request;

void reduce_request_free(reduce_request *r);

/* The contract's word for a statistic. */
const char *reduce_statistic_name(reduce_statistic statistic);

/* Takes one more name, and what it means. 422: a name given twice, or too many; 503. */
bool reduce_request_add(reduce_request *r, const char *name, size_t length, const uint32_t *groups,
                        size_t n_groups, problem *why);

/* The elements of all names, those of a group once however many names mean it: *elements (the caller frees)
 * in the order of groups, then mesh order. False when memory is short. */
bool reduce_elements(const reduce_request *r, const group_index *groups, uint32_t **elements, size_t *count);

/* Numbers of an answer to n_rhs vectors of C channels: [n_names][n_with][n_rhs][C]. NULL when memory is
 * short; the caller frees. */
double *reduce_figures(const reduce_request *r, size_t n_rhs, size_t n_channels);

/* Values that are reduced: either of the two. */
typedef struct reduce_values {
    const float *floats;
    const double *doubles;
} reduce_values;

/* Fills the figures of vectors first ... first + count of n_rhs. x is [count][C][n_values], the elements in
 * the order of reduce_elements; area [n] in mesh order. NaN where a figure has no value: no area, or a mean
 * of 0. False when memory is short. */
bool reduce_vectors(const reduce_request *r, const group_index *groups, const double *area, size_t n_channels,
                    size_t n_rhs, size_t first, size_t count, reduce_values x, double *figures);

/* Fills those of name k from its means [n_rhs][C] alone; area is that of its elements. */
void reduce_means(const reduce_request *r, size_t k, size_t n_channels, size_t n_rhs, double area,
                  const double *means, double *figures);

/* Appends {"desk":{"mean":...},...}: a number for one channel, C of them for more, one level deeper for a
 * batch; null for NaN. False when memory is short. */
bool reduce_write(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch, const double *figures,
                  buffer *b);

#endif
