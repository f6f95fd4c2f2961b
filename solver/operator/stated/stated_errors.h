/* The errors that a store states for answers, and the elements that they hold for. */
#ifndef LAMBERT_OPERATOR_STATED_STATED_ERRORS_H
#define LAMBERT_OPERATOR_STATED_STATED_ERRORS_H

#include "solver/operator/stated/emitters_law.h"
#include "solver/operator/stated/error_law.h"
#include "store/store.h"

/* The error for the scene's own lights, else for single elements, against the independent sample. */
typedef struct stated_error {
    bool known;
    double relative, indirect;
    double share;      /* of the square, the operator's own part; negative: not told apart */
    const char *light; /* "lights" or "single" */
} stated_error;

/* Zeroed: nothing is stated. */
typedef struct stated_errors {
    stated_error all; /* means over probes, of the light of all elements */
    stated_error sky; /* the same of skies: relative is over the light that they and surfaces give */
    double mesh; /* share of reflected light that constants on elements leave, of the scene's lamps, else of
                    light that all elements emit; negative: not stated */
    double mesh_of_skies;   /* the same of skies, the larger of an even and a cloudy one; likewise */
    stated_error receivers; /* of the light of receivers; known only where the store was built for them */
    bool *read;             /* [n], true of receivers; NULL: the store was built for all elements */
    bool sensors;           /* receivers are read by the light that they send to sensors, too */
    bool *emits;     /* [n], true of sources; NULL: for any emission. All figures are of theirs alone */
    bool luminaires; /* some of these are sources by the light of luminaires that they reflect */
    error_by_group by_group; /* n_bins is 0 where the store states none */
    emitters_error emitters; /* figures.s is 0 where the store states none */
    size_t n;
} stated_errors;

void stated_errors_free(stated_errors *e);

/* Reads those of a store of this scene, `read` of which is not used, with the operator of that store. A
 * figure that is missing or no finite number is not known. Errors: those of importance_load and
 * stated_figures_load; LAM_ERR_MEMORY. */
lam_status stated_errors_read(store *s, const error_scene *scene, const lam_operator *op, stated_errors *out,
                              lam_error *error);

/* The number among count elements that are no receivers; selected NULL: the first count elements. 0 where
 * the store was built for all. O(count). */
size_t stated_errors_others(const stated_errors *e, size_t count, const uint32_t *selected);

/* The number of elements whose light at sensors is only roughly right: 0 where the store was built for these,
 * or for all; else all that are no receivers. O(n). */
size_t stated_errors_others_of_sensors(const stated_errors *e);

/* The number among count elements that are no sources; selected NULL: the first count elements. 0 where the
 * store was built for any emission. O(count). */
size_t stated_errors_strangers(const stated_errors *e, size_t count, const uint32_t *selected);

/* True where a value of E [n_rows][n] is not 0 at an element that is no source. O(n_rows n), or O(1) where
 * the store was built for any emission. */
bool stated_errors_is_strange(const stated_errors *e, size_t n_rows, const float *E);

/* True where the laws by group hold of light with a sky, of so many tiles, or with luminaires. */
bool stated_errors_know(const stated_errors *e, const lam_luminaires *luminaires, size_t n_tiles, bool sky,
                        bool lamps);

/* The size of a sky of radiances L [C][m], as that of an emission is; NULL: there is none. */
emission_size stated_sky_size(const stated_errors *e, size_t n_channels, const float *L);

/* These find what a store holds: the error of a group of probes; that of the scene's own lights, or else of
 * single elements; that of skies; and the shares that constants on elements leave of the light of lamps, else
 * of all elements, and of skies, the larger of an even and a cloudy one: negative where they are not stated.
 */
stated_error stated_error_of_group(const error_group *g, bool of_receivers, const char *light);
stated_error stated_error_of(const error_report *report, bool of_receivers);
stated_error stated_error_of_sky(const error_report *report);
double stated_mesh_of_lights(const mesh_figures *m);
double stated_mesh_of_skies(const mesh_figures *m);

#endif
