/* Figures of the eyes among the sensors of an answer: UGR with the part of each luminaire, and DGPs. */
#ifndef LAMBERT_VERBS_SOLVE_EYES_H
#define LAMBERT_VERBS_SOLVE_EYES_H

#include "solver/figures/eye_rating.h"
#include "solver/light/emission.h"
#include "solver/sensor/eye_sun.h"
#include "solver/verbs/solve_sensors.h"

#include <jansson.h>

/* An eye under one light. */
typedef struct eye_figures {
    eye_rating rating;
    double dgps; /* NAN where there is no sky */
    bool sun;    /* its disc is seen */
} eye_figures;

/* The light by which eyes are rated. */
typedef struct eyes_asked {
    const lam_sensors *all;
    const emission *light;
    const double (*suns)[3]; /* [n_vectors], the way to the sun; NULL: it is not known */
    eye_sun *sight;          /* beside it */
    size_t n_luminaires;
    double *dimmer; /* [luminaires], of luminance, in the vector below */
    size_t vector;
} eyes_asked;

/* True where an answer may have figures of eyes: it is one of lights, not of a year. */
bool eyes_are_rated(const solution *s);

/* m: the scene; suns [n_vectors]: the ways to the sun in its axes, 0 without, or NULL. Freed by eyes_free,
 * also after an error. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status eyes_open(const lam_sensors *all, const mesh *m, const emission *light, const double (*suns)[3],
                     eyes_asked *out, lam_error *error);
void eyes_free(eyes_asked *e);

/* Rates an eye, a receiver, in the answer to a vector. */
eye_figures eyes_rate(eyes_asked *e, const solution *s, size_t vector, size_t receiver);

/* {"ugr", "background", "dgps", "sun_seen"} of an eye, with "why" in place of a number, and with parts
 * "luminaires":
 * [{"name", "part", ...}], those that count, the largest first. NULL: not enough memory. */
json_t *eyes_json(eyes_asked *e, const solution *s, size_t vector, size_t receiver, bool parts);

/* Prints the eyes of a set, a line for each vector and eye. */
void eyes_print(eyes_asked *e, const solution *s, const char *name, size_t first, size_t count);

#endif
