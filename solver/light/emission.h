/* Emissions from a command line or a file: --emit GROUP=V[,V,V] and --emission FILE.npy|.json. */
#ifndef LAMBERT_LIGHT_EMISSION_H
#define LAMBERT_LIGHT_EMISSION_H

#include "lambert/lambert.h"
#include "solver/base/options.h"
#include "solver/scene/mesh.h"

/* A batch of emissions: E is [n_vectors][C][n] in mesh order, W/m^2, never negative. */
typedef struct emission {
    size_t n_vectors;
    bool batch;  /* given as a batch (also of one), so answered as one */
    bool steady; /* E and W are one vector, which goes with every sky of L: a year need not repeat it */
    float *E;
    float *L; /* [n_vectors][C][m], radiances of the tiles of the store's sky, W/(m^2 sr); NULL: no sky */
    float *W; /* [n_vectors][C][s], weights of the store's emitters, beside E and L; NULL: none given */
    const struct sunlight *sun; /* [n_vectors], on every channel, beside L; borrowed, NULL: none */
} emission;

void emission_free(emission *e);

/* One vector by group names: each item is GROUP=V or GROUP=V,V,V, V one per channel; the others are 0. A name
 * matches its group, else (an object of several materials) every group `name.material`; a later item replaces
 * an earlier one. Errors: LAM_ERR_ARGUMENT names the item. */
lam_status emission_from_groups(const mesh *m, const option_list *items, emission *out, lam_error *error);

/* Whether every item is well formed, whatever the store: otherwise it is wrong usage. */
lam_status emission_check_items(const option_list *items, lam_error *error);

/* What a store offers beside its elements: tiles of a sky, emitters; 0: none. */
typedef struct emission_sources {
    size_t n_tiles, n_emitters;
} emission_sources;

/* A file. NPY: <f4 or <f8 of shape [n], [C][n] or a batch of them ([b][C][n]; also [b][n] with one channel).
 * JSON: such an array, the contract's EMISSION, or an object with `emission` or `emissions`.
 * Errors name the file, the place, the value and the limit. */
lam_status emission_read(const char *path, const mesh *m, emission_sources there, emission *out,
                         lam_error *error);
lam_status emission_read_npy(const char *path, const mesh *m, emission *out, lam_error *error);

/* Puts e under the sky of an NPY file: [m], [C][m] or a batch of them; one sky goes with every emission, one
 * emission with every sky (steady), else there must be as many. */
lam_status emission_add_sky(emission *e, const char *path, const mesh *m, size_t n_tiles, lam_error *error);

/* The same for a batch of skies L [n_skies][n_tiles], which is copied, the same in every channel; what is the
 * word for it in messages. */
lam_status emission_add_skies(emission *e, const char *what, const mesh *m, size_t n_tiles, size_t n_skies,
                              const float *L, lam_error *error);

/* A value of a file that must be light: finite, not negative. */
lam_status emission_check_value(const char *path, size_t vector, size_t index, double value, float *out,
                                lam_error *error);

/* *values is [n_vectors][C][width], zero; freed with free(). */
lam_status emission_allocate(const char *path, size_t n_channels, size_t width, size_t n_vectors,
                             float **values, lam_error *error);

/* The scene's own emission as one vector. */
lam_status emission_of_scene(const mesh *m, emission *out, lam_error *error);

/* What a command line asks for. */
typedef struct emission_wish {
    const option_list *items; /* --emit */
    const char *path;         /* --emission, or NULL */
    const char *sky;          /* --sky, or NULL */
    bool other;               /* a light that is added later: without any of these none is of the scene */
} emission_wish;

/* Groups when there are items, else the file, else none beside a sky, else the scene's own, which is *own.
 */
lam_status emission_choose(const mesh *m, emission_sources there, const emission_wish *wish, emission *out,
                           bool *own, lam_error *error);

/* Those of a store's operator and sky, which may be NULL. */
emission_sources emission_sources_of(const lam_operator *op, const lam_sky *sky);

/* Calls visit(context, g) for each group that name means; returns how many. */
size_t emission_match_groups(const mesh *m, const char *name, void (*visit)(void *context, size_t group),
                             void *context);

#endif
