/* The error of an answer for its own emission, by the laws of what a store states (operator/stated). No I/O.
 */
#ifndef LAMBERT_OPERATOR_STATED_ANSWER_ERROR_H
#define LAMBERT_OPERATOR_STATED_ANSWER_ERROR_H

#include "solver/operator/groups/group_statistics.h"
#include "solver/operator/stated/emitters_law.h"
#include "solver/operator/stated/error_law.h"

/* An answer: its emission, the direct light of its sky, sun and luminaires, and its values in mesh order or
 * of some elements. */
typedef struct error_answer {
    lam_quantity quantity;
    const float *E, *H0;      /* [C][n]; NULL: none */
    size_t count;             /* of elements */
    const uint32_t *selected; /* [count]; NULL: the first count elements */
    const float *values;      /* [C][count], or, where they are whole, [C][n] in mesh order */
    bool whole;
    emission_size size, sky; /* of the emission, and of the sky: of tiles in place of elements */
    emission_size reflected; /* of the part of size that E has not: what elements send on of the direct light
                                of sun and luminaires */
    lit_luminaires luminaires;
    const float *L;      /* [C][n_tiles], radiances of the sky; NULL: none */
    const float *L_sent; /* [C][n_tiles], of tiles whose bounced light alone is in it; NULL: none */
    double lost2;        /* with L_sent: (sum A E)^2 + sum (A E)^2 of light that is lost by that; 0: none */
} error_answer;

/* Adds channel c to the sizes: of what elements emit, E [n], and send on of direct light H [n], W/m^2 (NULL:
 * of none); and to the power of luminaires, whose part in H is lamps [n] (NULL: none). work: [2][n]. */
void error_answer_add_channel(error_answer *of, const error_scene *scene, size_t c, const float *E,
                              const float *H, const float *lamps, float *work);

/* The parts of the headline (headline.h), over all light that surfaces reflect, |B - E|, the direct light
 * of a sky with it, of irradiance over |H|, of the indirect light over itself. The direct light of positions
 * is known and left out. */
typedef struct stated_parts {
    double rest; /* of operator and form factors; where nothing is reflected over |B|; not finite where that
                    is 0, too */
    double mesh; /* of constants on elements; negative: not stated */
    double sun;  /* of the way in which an answer takes the sun of a year; 0: it takes none */
    double rows; /* of the sampling of the rows of sensors; 0: of elements */
} stated_parts;

/* The root of the sum of their squares: the headline. */
double stated_of_parts(const stated_parts *parts);

/* The root of the mean squared error over the light that is left where that error is taken out of the light
 * of the answer, in squares; not finite where none is. */
typedef struct answer_error {
    double relative; /* |B~ - B| / |B|, of irradiance |H~ - H| / |H| */
    double indirect; /* |B~ - B| / |B - E - rho H0|, of irradiance |H~ - H| / |H - H0| */
    double emitters; /* effective number */
    stated_parts parts;
} answer_error;

/* The sizes of the light of an answer; whole of it is freed by the caller with whole_light_free, also when
 * memory is short: false. */
bool answer_sizes_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                     light_sizes *sizes);

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
    stated_parts parts; /* of its mean */
} name_error;

/* names, errors [n_names]; the texts of errors are left. Cost: O(C count). False when memory is short. */
bool name_errors_of(const error_by_group *e, const error_scene *scene, const error_answer *of, size_t n_names,
                    const reduce_name *names, name_error *errors);

/* The same of one name, by its means, [C] each, of the quantity, of the emission, and of the direct light of
 * sky and luminaires, of which the last two are over all elements. Cost: O(C groups of the name), and under a
 * sky n_tiles times as much, under luminaires k times. */
typedef struct name_means {
    lam_quantity quantity;
    emission_size size, sky;
    whole_light whole; /* of size; a view */
    lit_luminaires luminaires;
    const float *L; /* [C][n_tiles]; NULL: no sky */
    double buried;  /* share of the area of the name that the value leaves out: no light reaches it */
    const double *value, *emission, *direct;
} name_means;
name_error name_error_of_means(const error_by_group *e, const reduce_name *name, const name_means *means);

/* The error of an answer to a mixture. The size of the emission in `of` is not used; of elements that are
 * selected, those of a group have the error that its elements have on average. O(C count + s^2), the second
 * for each group that is first asked for. */
answer_error emitters_error_of(const emitters_error *e, const error_scene *scene, const error_answer *of,
                               emitters_mix *mix);

/* The error of one name of a reduction, by the mean [C] of the quantity over it. Errors of the means of
 * several groups add up. O(C s) for each group of the name, and s^2 as above. */
name_error emitters_error_of_name(const emitters_error *e, size_t n_channels, lam_quantity quantity,
                                  const reduce_name *name, emitters_mix *mix, const double *mean);

#endif
