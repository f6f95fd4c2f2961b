/* Figures over groups of elements (group_statistics.h) in place of vectors, as requests ask for them. Over
 * sets of sensors all areas are 1, and receivers without a value have no part. Ratings of eyes (UGR), which
 * are no numbers of a set, are found and written by who asks for them. No I/O. */
#ifndef LAMBERT_CODEC_GROUP_FIGURES_H
#define LAMBERT_CODEC_GROUP_FIGURES_H

#include "solver/codec/buffer.h"
#include "solver/codec/problem.h"
#include "solver/operator/groups/group_statistics.h"

#define REDUCE_NAMES_MAX 1024    /* groups in one request */
enum { REDUCE_LIMITS_MAX = 16 }; /* of shares */

enum { REDUCE_FIGURES_MAX = REDUCE_UGR + REDUCE_LIMITS_MAX };

/* Starts zeroed; freed by reduce_request_free. */
typedef struct reduce_request {
    bool on;
    bool linear; /* means and sums of groups alone, which adjoint rows answer; or of sensors, by columns */
    buffer texts;
    reduce_name *names;
    size_t n_names, names_capacity;
    reduce_statistic with[REDUCE_FIGURES_MAX]; /* in the order asked, one share for each limit */
    double at_least[REDUCE_FIGURES_MAX];       /* of each the limit of a share, else 0 */
    size_t n_with;
    bool of_sensors; /* names are of sets of sensors */
} reduce_request;

void reduce_request_free(reduce_request *r);

/* The contract's word for a statistic. */
const char *reduce_statistic_name(reduce_statistic statistic);

/* Adds the statistic of a word. 422: an unknown word, or one given twice. */
bool reduce_request_with(reduce_request *r, const char *word, size_t length, problem *why);

/* Adds a share for each limit, n_limits of them from 1 to REDUCE_LIMITS_MAX, before statistic `at` of those
 * added. */
void reduce_request_shares(reduce_request *r, size_t at, size_t n_limits, const double *limits);

/* Adds the ratings of eyes. */
void reduce_request_ugr(reduce_request *r);
bool reduce_has_ugr(const reduce_request *r);

/* Adds a name and the groups that it means. 422: a name given twice, or too many; 503. */
bool reduce_request_add(reduce_request *r, const char *name, size_t length, const uint32_t *groups,
                        size_t n_groups, problem *why);

/* The elements of all names, those of a group once however many names mean it: *elements (the caller frees)
 * in the order of groups, then mesh order. False when memory is short. */
bool reduce_elements(const reduce_request *r, const group_index *groups, uint32_t **elements, size_t *count);

/* Numbers of an answer to n_rhs vectors of C channels: [n_names][n_with][n_rhs][C]. NULL when memory is
 * short; the caller frees. */
double *reduce_figures(const reduce_request *r, size_t n_rhs, size_t n_channels);

/* The text of name k. */
const char *reduce_text(const reduce_request *r, size_t k);

/* The figure of name k, statistic s of `with`, vector v and channel c. */
double *reduce_figure(const reduce_request *r, size_t k, size_t s, size_t n_rhs, size_t v, size_t n_channels,
                      size_t c, double *figures);

/* Fills the figures of vectors first ... first + count of n_rhs. x is [count][C][n_values]; area [n] in mesh
 * order, or NULL for 1 of each. NaN where a figure has no value: no area, a mean of 0, or no number. False
 * when memory is short. */
bool reduce_vectors(const reduce_request *r, const group_index *groups, const double *area, size_t n_channels,
                    size_t n_rhs, size_t first, size_t count, reduce_values x, double *figures);

/* Fills the means and sums of name k from its means [n_rhs][C]; area is that of its elements. */
void reduce_means(const reduce_request *r, size_t k, size_t n_channels, size_t n_rhs, double area,
                  const double *means, double *figures);

/* Appends {"desk":{"mean":...},...}, or only what stands between the outer braces: a number for one channel,
 * C of them for more, one level deeper for a batch; null for NaN. False when memory is short. */
bool reduce_write(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch, const double *figures,
                  buffer *b);
bool reduce_write_names(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch,
                        const double *figures, buffer *b);

/* Writes a part of the text of reduce_write_names: `first` ... `first` + `count` of the figures of
 * reduce_vectors_written, each of one vector. Ratings of eyes are null there; who has them writes them
 * between what stands before and after a figure. */
size_t reduce_vectors_written(const reduce_request *r, size_t n_rhs);
bool reduce_write_some(const reduce_request *r, size_t n_channels, size_t n_rhs, bool batch,
                       const double *figures, size_t first, size_t count, buffer *b);

bool reduce_write_before(const reduce_request *r, size_t n_rhs, bool batch, size_t at, buffer *b);
bool reduce_write_after(const reduce_request *r, size_t n_rhs, bool batch, size_t at, buffer *b);

/* The place of a figure of reduce_vectors_written. */
typedef struct reduce_place {
    size_t name, statistic, vector; /* statistic: of `with` */
} reduce_place;
reduce_place reduce_place_of(const reduce_request *r, size_t n_rhs, size_t at);

/* Appends the figure of one vector: a number, or [C] of them; null for NaN. False when memory is short. */
bool reduce_write_channels(buffer *b, const double *values, size_t n_channels);

#endif
