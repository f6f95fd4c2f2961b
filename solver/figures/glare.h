/* Discomfort glare of luminaires at an eye, the unified glare rating (CIE 117:1995):
 *     UGR = 8 log10((.25 / L_b) sum L^2 w / p^2),    L^2 w = I^2 / (A_p r^2),
 * and of daylight, the simplified glare probability (Wienold 2009). Knows neither scenes nor stores. */
#ifndef LAMBERT_FIGURES_GLARE_H
#define LAMBERT_FIGURES_GLARE_H

#include <stdbool.h>

/* A luminaire as an eye sees it, at dim 1. */
typedef struct glare_source {
    double intensity; /* I towards the eye, cd */
    double area;      /* A_p of its opening, if nothing hides it, m2; 0: it has none */
    double distance;  /* r from the eye to its middle, m */
    double position;  /* p; 0: outside of the field of view */
    double seen;      /* the mean over the opening of the square of what is passed, 0 to 1: the visible share
                         where no panes are between */
} glare_source;

enum { GLARE_NUMBERS = 5 };

/* Guth's index of the position of a source: 1 in the line of sight, and larger the less it dazzles,
 *     p = exp((35.2 - .31889 t - 1.22 exp(-2 t / 9)) 10^-3 s + (21 + .26667 t - .002963 t^2) 10^-5 s^2),
 * s the angle from the line of sight and t that from the upright, about it, in degrees (IES Lighting
 * Handbook). Guth has the upper half of the field alone; below the line of sight it is 1 + .8 R, from R = .6
 * on 1 + 1.2 R, at most R = 3, R = tan s (Iwata and Tokura 1997). view, up and towards (from the eye to the
 * source) are unit vectors. 0 behind the eye, and for a view that is upright, which has no upper half. */
double glare_position(const double view[3], const double up[3], const double towards[3]);

/* Why a source counts or does not. */
typedef enum glare_verdict {
    GLARE_COUNTS,
    GLARE_NO_LIGHT,   /* it sends none to the eye */
    GLARE_OUTSIDE,    /* outside of the field of view, p of 16 or more */
    GLARE_HIDDEN,     /* by the scene */
    GLARE_NO_OPENING, /* it has no luminance */
    GLARE_SMALL,      /* the part that is seen is below 3e-4 sr */
    GLARE_LARGE       /* or above .1 sr */
} glare_verdict;

glare_verdict glare_judge(const glare_source *s);

/* Where a source has no luminance, or is too large for the formula, there is no rating, as it would be too
 * low. */
bool glare_forbids(glare_verdict verdict);

/* The solid angle of its part that is seen, sr; 0 without an opening. */
double glare_solid_angle(const glare_source *s);

/* L^2 w / p^2 of a source that counts, cd^2/m^4 sr, at a dimmer: I is proportional to it. */
double glare_weight(const glare_source *s, double dimmer);

/* UGR of a sum of weights over the background L_b = E_indirect / pi, cd/m2: both must be above 0. */
double glare_rating(double sum, double background);

/* DGPs = 6.22e-5 E_v + .184 of the illuminance at the eye, lx, while it sees no sun (Wienold 2009). */
double glare_simplified(double illuminance);

#endif
