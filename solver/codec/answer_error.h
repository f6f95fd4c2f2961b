/* The error of an answer for its own emission, from what a store states for each group of its scene
 * (/error/by_group, store/FORMAT.md). No I/O but the reading of a store. */
#ifndef LAMBERT_CODEC_ANSWER_ERROR_H
#define LAMBERT_CODEC_ANSWER_ERROR_H

#include "solver/codec/group_figures.h"
#include "solver/codec/groups.h"
#include "solver/codec/reflecting.h"
#include "store/store.h"

/* The scene of an answer; views of the caller's. */
typedef struct error_scene {
    size_t n, n_channels;
    const double *area;       /* [n] */
    const float *reflectance; /* [C][n] */
    const group_index *groups;
    const bool *read; /* [n], true of receivers; NULL: all are */
} error_scene;

/* An error of P sqrt(one^2 / N^2 + many^2 (1 - 1/N) / N + even^2), [n_bins] each: of the root of the mean
 * square of the elements of a bin, and of its mean. */
typedef struct error_law {
    double *one, *many, *even;
    double *mean_one, *mean_many, *mean_even;
} error_law;

/* An error of sqrt(direct^2 D + tiles^2 S + even^2 P^2) of a sky L: with M the mean of its radiances weighted
 * by the powers Q of the tiles, P = sum_t L_t Q_t, S = sum_t Q_t (L_t - M)^2, and D = rho^2 sum_t f_t (L_t -
 * M)^2 by the mean first bounce f and reflectance rho of a group, or, of its mean, sum A^2 / (sum A)^2 times
 * that. P^2, S and D are summed over channels.
 *
 * Where it is known what single tiles are off by, the square is D + bounced^2 W + tiles^2 S + even^2 P^2 with
 * D = rho^2 sum_t d_t (L_t - M)^2 and W = sum_t w_t (L_t - M)^2: d_t are squares of what the first bounce of
 * a group is off by, of its elements or of its mean, and w_t of the power that a tile sends into the scene.
 */
typedef struct sky_law {
    double direct;
    double *tiles, *even; /* [n_bins] */
    double *mean_tiles, *mean_even;
    double *bounced, *mean_bounced; /* [n_bins]; NULL: a store of before */
} sky_law;

/* A bin is the elements of a group, or of those that are read, and in a second row the others. Zeroed: a
 * store that states nothing by group.
 *
 * Faces that count twice make another error, which is as large as the light: of squares of the light B - E,
 * s^2 + o / 2 of the elements of a group and s^2 + o^2 / 2 of its mean, with s the share of light that
 * repaired row sums are off by, and o the share of the group's area that overlaps others
 * (precompute/overlap_error.c). */
typedef struct error_by_group {
    size_t n_groups, n_bins, n_channels, n_tiles; /* tiles: 0: none of skies is stated */
    error_law law;                                /* of emissions */
    sky_law sky;
    double *area;         /* [n_bins] */
    double *squares;      /* [n_groups], sum A^2 */
    double *reflectance;  /* [C][n_groups], mean */
    reflecting *of_group; /* [n_groups] */
    uint32_t *bin;        /* [n] */
    double repair;        /* s; 0: none */
    double *overlap;      /* [n_groups], o; NULL: none */
    double *sky_power;    /* [C][n_tiles], sum A rho first_bounce */
    double *sky_first;    /* [n_groups][n_tiles], mean first_bounce; NULL: not stored, and sky.direct is 0 */
    double *elements_off, *means_off; /* [n_groups][n_tiles], d_t; NULL: not stored */
    double *power_off;                /* [C][n_tiles], w_t; NULL: a store of before */
} error_by_group;

void error_by_group_free(error_by_group *e);

/* Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY. *out is zeroed where the store has no such figures. */
lam_status error_by_group_read(store *s, const error_scene *scene, error_by_group *out, lam_error *error);

/* The size of an emission, channels stacked: P^2 = sum (sum A E)^2 and sum A^2 E^2. */
typedef struct emission_size {
    double power2, squares;
} emission_size;

/* (sum A E)^2 / sum A^2 E^2; 0 of no emission. */
double emission_size_number(const emission_size *e);

/* Adds a channel, [n]; with the powers of tiles as weights that of a sky, [n_tiles]. */
void emission_size_add(emission_size *e, size_t n, const double *weights, const float *E);

/* The size of both: their powers added up. */
emission_size emission_size_sum(const emission_size *a, const emission_size *b);

/* An answer: its emission, the direct light of its sky, and its values in mesh order or of some elements. */
typedef struct error_answer {
    lam_quantity quantity;
    const float *E, *H0;      /* [C][n]; NULL: none */
    size_t count;             /* of elements */
    const uint32_t *selected; /* [count]; NULL: the first count elements */
    const float *values;      /* [C][count], or, where they are whole, [C][n] in mesh order */
    bool whole;
    emission_size size, sky; /* of the emission, and of the sky: of tiles in place of elements */
    const float *L;          /* [C][n_tiles], radiances of the sky; NULL: none */
    const float *L_sent;     /* [C][n_tiles], of tiles whose bounced light alone is in it; NULL: none */
    double lost2; /* with L_sent: (sum A E)^2 + sum (A E)^2 of light that is lost by that; 0: none */
} error_answer;

/* The root of the mean squared error over the light that is left where that error is taken out of the light
 * of the answer, in squares; not finite where none is. */
typedef struct answer_error {
    double relative; /* |B~ - B| / |B|, of irradiance |H~ - H| / |H| */
    double indirect; /* |B~ - B| / |B - E - rho H0|, of irradiance |H~ - H| / |H - H0| */
    double emitters; /* effective number */
} answer_error;

/* The error of all values where its square is known, sum A |B~ - B|^2 over channels and the values, without a
 * law. O(C count). */
answer_error answer_error_of_square(const error_scene *scene, const error_answer *of, double error2);

/* The error of all values. Cost: O(C count), and under a sky C n_tiles for each group of them. False when
 * memory is short. */
bool answer_error_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                     answer_error *out);

/* The errors of a name of a reduction: of its mean, and of its elements, root mean square, both over the
 * mean reflected light, of irradiance over the mean of H - H0; relative: of its mean over its mean radiosity,
 * or irradiance. */
typedef struct name_error {
    const char *name; /* of the request; set by the caller */
    double mean, elements, relative;
} name_error;

/* errors [n_names], the names of which are left. Cost: O(C count). False when memory is short. */
bool name_errors_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                    const reduce_request *names, name_error *errors);

/* Of squared errors of the mean and of the elements of a name, and of the squares of its mean light. */
name_error name_error_of_squares(double mean2, double elements2, double reflected2, double radiosity2);

/* The same of one name, by its means, [C] each, of the quantity, of the emission, and of the direct light of
 * the sky. Cost: O(C groups of the name), and under a sky n_tiles times as much. */
typedef struct name_means {
    lam_quantity quantity;
    emission_size size, sky;
    const float *L; /* [C][n_tiles]; NULL: no sky */
    const double *value, *emission, *direct;
} name_means;
name_error name_error_of_means(const error_by_group *e, const reduce_name *name, const name_means *means);

#endif
