/* Answers of an operator to emissions, a few vectors at a time, so that a year need not be in memory at once.
 */
#ifndef LAMBERT_LIGHT_EMISSION_APPLY_H
#define LAMBERT_LIGHT_EMISSION_APPLY_H

#include "solver/light/emission.h"

#define EMISSION_PASS_MOST 64

/* An operator and its sky (NULL: none) with room to answer some vectors of an emission. All are borrowed. */
typedef struct emission_pass {
    const emission *light;
    const lam_operator *op;
    const lam_sky *sky;
    lam_quantity quantity;
    size_t n_selected;
    const uint32_t *selected; /* NULL: every element */
    size_t most;              /* vectors in one go, at most EMISSION_PASS_MOST */
    size_t work_bytes;
    void *work, *limiter_work;
    size_t limited[EMISSION_PASS_MOST]; /* of the vectors of the last go: elements that were below zero, in
                                         * all channels */
    float *E, *L, *H0, *W, *D;          /* of one go; NULL where the operator takes none */
    float *B;                           /* [most][C][elements], radiosity behind that of sensors; else NULL */
    float *seen; /* [most][C][tiles], the sky of few emitters at sensors; NULL where none is of the sky */
    float *sun, *sun_work; /* [most][elements]; NULL without one on elements */
    float *sun_at;         /* [most][sensors]; NULL without one at sensors */
    bool sun_is_all;       /* nothing but the sun at sensors gives light */
} emission_pass;

/* Numbers of an answer in a channel: of elements, or of sensors. */
size_t emission_width(const emission *light, const lam_operator *op);

/* Allocates for passes of at most `most` vectors. With selected only these elements are answered, which is
 * less work; they must be all elements of some groups where the emission has a limiter. Of sensors the
 * quantity is irradiance, and all elements are answered. Freed by emission_pass_free. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_UNSUPPORTED (sensors of an operator that knows no light there). Sensors under an exact sun need
 * sunlight_at_sensors. */
lam_status emission_pass_create(const emission *light, const lam_operator *op, const lam_sky *sky,
                                lam_quantity quantity, size_t n_selected, const uint32_t *selected,
                                size_t most, emission_pass *out, lam_error *error);
void emission_pass_free(emission_pass *p);

/* Answers the n vectors of these numbers, at most `most`: out is [n][C][elements], [n][C][n_selected] or, of
 * sensors, [n][C][sensors].
 * Errors: LAM_ERR_ARGUMENT (an emission that is not a sum of the store's emitters), LAM_ERR_MEMORY. */
lam_status emission_pass_solve(emission_pass *p, size_t n, const size_t *vectors, float *out,
                               lam_error *error);

/* Limits answers to n vectors, as emission_pass_solve gives them, which were summed from answers that are not
 * limited; not of an operator of few emitters. Cost: the light of the sky, and of suns. */
void emission_pass_limit(emission_pass *p, size_t n, const size_t *vectors, float *out);

/* *values is [n_vectors][C][n], or [sensors] for n, freed with free(): the answer to each vector under its
 * sky; with selected (not NULL) of these elements only, and 0 elsewhere. limited [n_vectors], unless NULL,
 * gets the elements of each that were below zero. stop, which may be NULL, is asked between passes and ends
 * the work with its status. */
lam_status emission_apply(const emission *e, const lam_operator *op, const lam_sky *sky,
                          lam_quantity quantity, size_t n_selected, const uint32_t *selected,
                          lam_status (*stop)(lam_error *error), float **values, size_t *limited,
                          lam_error *error);

/* The input of refining the n vectors of these numbers: E and H0 [n][C][elements] in double. *H0_there is
 * false where there is no H0. An operator of few emitters also gives its indirect light, start
 * [n][C][elements]. Errors as emission_pass_solve; LAM_ERR_UNSUPPORTED for the sun on such an operator. */
lam_status emission_pass_light(emission_pass *p, size_t n, const size_t *vectors, double *E, double *H0,
                               bool *H0_there, float *start, lam_error *error);

/* Puts answers of selected elements in their places: from [n_rows][n_selected] to [n_rows][n]. */
void emission_scatter(size_t n_rows, size_t n, size_t n_selected, const uint32_t *selected, const float *from,
                      float *to);

#endif
