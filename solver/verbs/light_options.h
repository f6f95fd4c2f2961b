/* The light of a command line, for solve and render: --emit, --emission, --dim and --sky. */
#ifndef LAMBERT_VERBS_LIGHT_OPTIONS_H
#define LAMBERT_VERBS_LIGHT_OPTIONS_H

#include "solver/base/terminal.h"
#include "solver/light/emission.h"
#include "solver/light/light_units.h"
#include "solver/light/sky_options.h"
#include "solver/operator/limiter.h"
#include "store/store.h"

#define LIGHT_HEADING "light (preset: the emission in the scene)"

typedef struct light_options {
    option_list emit, dim;
    const char *emission, *sky;
    sky_options at;     /* of a named sky, and of weather */
    const char *unit;   /* --unit-out; NULL: that of the light */
    bool weather;       /* there is weather, which the verb adds; no row of the table */
    bool signs;         /* --emission may be negative; no row of the table */
    const char *frames; /* of an animation, in place of --emit and --emission; no row of the table */
} light_options;

/* The rows of a table that fills light_options; those of sky_options.h fill its member `at`. */
extern const option_row light_rows[];

/* The named sky of --sky; NULL: it is a file, or there is none. */
const char *light_named_sky(const light_options *options);

/* Checks what does not depend on the store; an error is wrong usage. Weather and named skies become
 * photometric where the answer is: their W are of all solar radiation, of which 179 lm/W would make too much.
 */
lam_status light_check(light_options *options, lam_error *error);

/* A store's operator, sky and luminaires, and the light that options ask for. */
typedef struct lit_store {
    lam_operator *op;
    lam_sky *sky;               /* NULL: the store has none */
    lam_luminaires *luminaires; /* NULL likewise */
    emission_scene scene;
    emission light;
    lam_limiter limiter;   /* of its answers, which borrows from mesh and scene; light has it */
    bool own;              /* the light is the scene's own */
    sunlight sun;          /* of a named sky; light has it */
    char said[SKY_SAID];   /* of a named sky; "": there is none */
    light_conversion told; /* of its answers, after light_convert */
} lit_store;

/* Loads from an open store with all threads for the operator. `other` is light that the caller adds later, so
 * that the scene's own is not the preset. light_close frees also after an error; *out begins zeroed. */
lam_status light_open(store *s, const mesh *m, const light_options *options, bool other, lit_store *out,
                      lam_error *error);
void light_close(lit_store *lit);

/* Puts the light, once it is whole, into the unit that is asked for, and its conversion into told; sun and
 * way are those of weather, or NULL. Errors: as light_units_convert. */
lam_status light_convert(const light_options *options, sunlight *sun, sun_way *way, lit_store *lit,
                         lam_error *error);

/* Says how bright a named sky is, where a coloured sky lights a grey store, and how light was converted. */
void light_log(const lit_store *lit, terminal *t);

/* Says how many values of answers were below zero, of which each vector had so many. */
void light_log_limited(size_t n_vectors, const size_t *limited, terminal *t);

#endif
