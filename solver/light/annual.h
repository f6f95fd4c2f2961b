/* Figures of a year for each element: sums over the hours, and the share of hours that are bright enough.
 * Knows no files. */
#ifndef LAMBERT_LIGHT_ANNUAL_H
#define LAMBERT_LIGHT_ANNUAL_H

#include "solver/base/progress.h"
#include "solver/light/emission_apply.h"
#include "solver/light/sunlight.h"

enum { ANNUAL_MOST = 16, ANNUAL_NAME = 40 };

/* One figure of the values x_h of all hours h, of which h counts where it is occupied:
 *   sum              sum_h x_h hours / 1000, over all of them: kWh/m2 of W/m2, klx h of lx
 *   autonomy=X       share of the counted hours in which x >= X
 *   useful=LOW,HIGH  share of the counted hours in which LOW <= x <= HIGH, both bounds within
 *   daylit=X         hours in which x >= X over the hours of daylight, half of those of a whole year
 *                    (EN 17037: 4,380 of 8,760), at most 1
 *   sun=X            the counted hours, h, in which the irradiance by the sun itself, without sky, ground and
 *                    bounces, is above X
 *   sun=X,H          1 where these are more than H hours, else 0: the mean over points is the share of them
 * Sources: daylight autonomy: Reinhart, Mardaljevic, Rogers 2006, Leukos 3(1):7-31; useful daylight
 * illuminance: Nabil, Mardaljevic 2005, Lighting Research and Technology 37(1):41-59; sun=1000,250 of 8 to 18
 * h is the condition of ASE (IES LM-83). */
typedef struct annual_figure {
    bool is_sum, is_sun, of_daylight; /* neither of the first two: a share */
    double low, high;                 /* of shares; autonomy: high is infinite; of sun low is X */
    double most;                      /* of sun: H; below 0: the hours themselves are wanted */
    char name[ANNUAL_NAME];
} annual_figure;

typedef struct annual_options {
    size_t n_figures;
    annual_figure figures[ANNUAL_MOST];
    double hours;         /* that a vector stands for */
    double from, to;      /* hours of the day: vectors count whose middle is from <= t < to; 0 and 24: all */
    const double *middle; /* [vectors], hours of the day; NULL: vectors follow each other from midnight on */
    bool luminance;       /* figures are of the luminance of three channels, and have one */
    const emission *mean; /* of annual_mean_find; NULL: it is found where sums need it */
} annual_options;

/* Adds the figure of an item: sum, autonomy=X, useful=LOW,HIGH, daylit=X, sun=X or sun=X,H. LAM_ERR_ARGUMENT
 * names the item. */
lam_status annual_add(annual_options *w, const char *item, lam_error *error);

/* Reads FROM-TO, whole hours from 0 to 24. */
lam_status annual_parse_occupied(const char *text, annual_options *w, lam_error *error);

/* True when a figure is a share of the hours. */
bool annual_has_shares(const annual_options *w);

/* True when a figure is of the sun itself. */
bool annual_has_sun(const annual_options *w);

/* True when a figure is a sum. */
bool annual_has_sum(const annual_options *w);

/* The mean of all vectors, as one. */
typedef struct annual_mean {
    emission light; /* its sun is the one below */
    sunlight sun;
} annual_mean;

/* *out must not move while it is used; freed by annual_mean_free. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED.
 */
lam_status annual_mean_find(const emission *light, const lam_operator *op, const lam_sky *sky,
                            const progress *steps, annual_mean *out, lam_error *error);
void annual_mean_free(annual_mean *m);

/* The vectors behind the figures. */
typedef struct annual_summary {
    size_t n;       /* vectors */
    size_t counted; /* of them in the hours that count */
    size_t lit;     /* with any light at all */
} annual_summary;

/* *values is [n_figures][C][n], C = 1 with luminance, freed with free(): the figures of the answers to all
 * vectors; with selected (not NULL) of these elements only, and 0 elsewhere. The mean vector is solved for
 * the sum, which is linear; for shares all lit vectors that count, a few at a time. Where these are more than
 * the tiles of the sky, and the emission beside it is steady, each tile is solved once, and hours are sums of
 * tiles and of one answer to their sun where it is exact, limited as one. Cost: one answer for sums;
 * for shares one a lit and counted vector, or one a tile and an exact sun and a product of [tiles][n] a
 * vector, two where answers are below zero; memory O(n), or O(n tiles) of at most 1 GiB. Errors:
 * LAM_ERR_ARGUMENT (not whole days, where hours of the day are asked for; no whole year for daylit; figures
 * of the sun where the light has no exact one), LAM_ERR_CANCELLED, LAM_ERR_MEMORY. */
lam_status annual_apply(const annual_options *w, const emission *light, const lam_operator *op,
                        const lam_sky *sky, lam_quantity quantity, size_t n_selected,
                        const uint32_t *selected, const progress *steps, float **values,
                        annual_summary *summary, lam_error *error);

#endif
