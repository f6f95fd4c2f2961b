/* The errors that a store states for answers, and the elements that they hold for. */
#ifndef LAMBERT_CODEC_STATED_ERRORS_H
#define LAMBERT_CODEC_STATED_ERRORS_H

#include "solver/codec/answer.h"
#include "solver/codec/answer_error.h"
#include "solver/codec/headline.h"
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

/* The elements of an answer, beside those that a store was built for. */
typedef struct answer_scope {
    bool receivers_only; /* nothing but the light of receivers is in the answer */
    bool strange;        /* an element emits that is no source, or a sky, or luminaires where they are none */
    bool sky;            /* a sky alone shines */
} answer_scope;

/* Puts the error of an answer, the elements that it is of, and those that emit, into notes. The error of
 * receivers stands in no other answer, and no error in a strange one. */
void stated_errors_note(const stated_errors *e, answer_scope scope, answer_notes *notes);

/* The headline of a store, of the scene's own lights and luminaires, else of a sky, else of one group that is
 * lit alone, else, of a scene of one group, of light that all elements emit: *light is "lights", "sky",
 * "groups" or "random". Not known where nothing was measured. */
headline stated_headline(const error_report *report, const mesh_figures *mesh, const own_figures *own,
                         const char **light);

#endif
