/* The unified glare rating of an eye by its light and by the luminaires as it sees them: which of them count,
 * and why there is no rating. Knows neither scenes nor stores. */
#ifndef LAMBERT_FIGURES_EYE_RATING_H
#define LAMBERT_FIGURES_EYE_RATING_H

#include "solver/figures/glare.h"

#include <stddef.h>

/* Why an eye has no UGR. */
typedef enum ugr_reason {
    UGR_RATED,
    UGR_NO_LUX,        /* the answer is in another unit, or its channels have no luminance */
    UGR_NO_VALUE,      /* the eye has none */
    UGR_NO_LUMINAIRE,  /* none gives light */
    UGR_NOT_SEEN,      /* the store does not say how eyes see them */
    UGR_FORBIDDEN,     /* one of them has no opening, or is too large for the formula */
    UGR_NONE_COUNTS,   /* all are hidden, outside of the field of view or too small */
    UGR_NO_BACKGROUND, /* no other light comes to the eye */
    UGR_REASONS
} ugr_reason;

/* Luminaires as an eye sees them at dimmer 1: GLARE_NUMBERS each, in the order of glare_source. */
typedef struct eye_view {
    size_t n_luminaires;
    const float *seen;    /* numbers of the first one; NULL: not known */
    size_t apart;         /* floats from a luminaire to the next */
    const double *dimmer; /* [n_luminaires], of luminance */
} eye_view;

typedef struct eye_rating {
    ugr_reason reason;
    size_t luminaire;  /* that forbids it */
    double ugr;        /* NAN without */
    double background; /* L_b, cd/m2; NAN where the eye has no value in lx */
} eye_rating;

/* dimmer [n_luminaires]: the luminance of D [C][n_luminaires] with their colours, factors [C][n_luminaires];
 * 0 where D is NULL. Channels that have no luminance count by the first. */
void eye_dimmers(size_t n_channels, size_t n_luminaires, const float *D, const double *colours,
                 double *dimmer);

glare_source eye_source(const eye_view *v, size_t luminaire);

/* Rates an eye by its illuminances in lx, of all light (NAN: it has no value) and of luminaires directly;
 * where in_lux is false these are in no lx. O(luminaires). */
eye_rating eye_rate(const eye_view *v, bool in_lux, double all, double direct);

/* A luminaire that counts, and its part of the sum. */
typedef struct glare_part {
    size_t luminaire;
    double part;
} glare_part;

/* Finds the luminaires that count for an eye that is rated, the largest part first, and returns their number.
 * out has room for all luminaires. */
size_t eye_parts(const eye_view *v, glare_part *out);

/* Puts the reason into words, or "" where the eye is rated; name is that of the luminaire that forbids it. */
enum { EYE_REASON_TEXT = 256 };
void eye_reason_text(const eye_view *v, const eye_rating *r, const char *name, char text[EYE_REASON_TEXT]);

#endif
