/* Figures of the eyes among the sensors of an answer: UGR with the part of each luminaire, and DGPs. */
#ifndef LAMBERT_VERBS_SOLVE_EYES_H
#define LAMBERT_VERBS_SOLVE_EYES_H

#include "solver/light/emission.h"
#include "solver/sensor/eye_sun.h"
#include "solver/verbs/solve_sensors.h"

#include <jansson.h>

/* Why an eye has no UGR. */
typedef enum ugr_reason {
    UGR_RATED,
    UGR_NO_LUX,        /* the answer is in another unit, or its channels have no luminance */
    UGR_NO_VALUE,      /* the eye has none */
    UGR_NO_LUMINAIRE,  /* none gives light, or the store does not say how eyes see them */
    UGR_FORBIDDEN,     /* one of them has no opening, or is too large for the formula */
    UGR_NONE_COUNTS,   /* all are hidden, outside of the field of view or too small */
    UGR_NO_BACKGROUND, /* no other light comes to the eye */
    UGR_REASONS
} ugr_reason;

/* An eye under one light. */
typedef struct eye_figures {
    ugr_reason reason;
    size_t luminaire;  /* that forbids it */
    double ugr;        /* NAN without */
    double background; /* L_b, cd/m2; NAN where the eye has no value */
    double dgps;       /* NAN where there is no sky */
    bool sun;          /* its disc is seen */
} eye_figures;

/* The light by which eyes are rated. */
typedef struct eyes_asked {
    const lam_sensors *all;
    const emission *light;
    const double (*suns)[3]; /* [n_vectors], the way to the sun; NULL: it is not known */
    eye_sun *sight;          /* beside it */
    size_t n_luminaires;
    float *direct;  /* [C][receivers], lx: of luminaires, in the vector below */
    double *dimmer; /* [luminaires], of luminance */
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
