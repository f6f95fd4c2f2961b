/* Emissions of a command line or of files: --emit GROUP=V[,V,V][UNIT], --emission FILE.npy|.json and --sky
 * FILE.npy|.mtx|.smx. The room codec knows the formats; this one knows files, options and batches. */
#ifndef LAMBERT_LIGHT_EMISSION_H
#define LAMBERT_LIGHT_EMISSION_H

#include "lambert/lambert.h"
#include "solver/base/options/options.h"
#include "solver/base/photometry.h"
#include "solver/codec/luminaire_names.h"
#include "solver/operator/groups/groups.h"
#include "solver/scene/mesh.h"

/* A batch of emissions: E is [n_vectors][C][n] in mesh order, W/m^2 or lm/m^2; NULL: W or D is all there is.
 */
typedef struct emission {
    size_t n_vectors;
    bool batch;  /* given as a batch (also of one), so answered as one */
    bool steady; /* E, W and D are one vector, which goes with every sky of L: a year need not repeat it */
    float *E;
    float *
        L; /* [n_vectors][C][m], radiances of the tiles of the store's sky, W/(m^2 sr) or cd/m^2; NULL: no sky
            */
    float *W; /* [n_vectors][C][s], weights of the store's emitters, beside E and L; NULL: none given */
    float *D; /* [n_vectors][C][k], dimmers of luminaires, beside all of these; NULL: all are dark */
    const lam_luminaires *luminaires; /* of the store, which D is for; borrowed, NULL: it has none */
    light_kind lights;                /* of all numbers */
    bool converted;                   /* some were given in the other kind */
    bool efficacies;                  /* its sky is solar radiation, by luminous efficacies */
    bool by_luminance;                /* L is the luminance of a coloured sky, for a grey store */
    const struct sunlight *sun;       /* [n_vectors], on every channel, beside L; borrowed, NULL: none */
    const lam_limiter *limiter; /* of answers below zero; borrowed, NULL: they are those of the linear map */
    const lam_sensors *sensors; /* answers are irradiances at these; borrowed, NULL: they are of elements */
} emission;

void emission_free(emission *e);

/* The scene that emissions are for. Freed by emission_scene_free. */
typedef struct emission_scene {
    const mesh *m; /* borrowed */
    group_index groups;
    group_index emitters;             /* by name, once emission_scene_sources was called */
    size_t n_tiles, n_emitters;       /* of the store's sky and operator; 0: none. The last emitters are the
                                         luminaires */
    char tiling[32];                  /* of the sky; "": not known */
    const lam_luminaires *luminaires; /* borrowed; NULL: the store has none */
    luminaire_names names;            /* of these */
} emission_scene;

/* Without sky and emitters; the caller sets them, or emission_scene_sources does. O(n + g log g). Errors:
 * LAM_ERR_MEMORY, LAM_ERR_FORMAT. */
lam_status emission_scene_create(const mesh *m, emission_scene *out, lam_error *error);
void emission_scene_free(emission_scene *scene);

/* Takes the tiles, emitters and luminaires of a store's operator, its sky and its luminaires, which may be
 * NULL both and outlive the scene. Errors: LAM_ERR_MEMORY. */
lam_status emission_scene_sources(emission_scene *scene, const lam_operator *op, const lam_sky *sky,
                                  const lam_luminaires *luminaires, lam_error *error);

/* Every element of the groups that name means emits values [C], or 1 in every channel where values is NULL;
 * E is [C][n]. LAM_ERR_ARGUMENT for an unknown name: the message begins with what and suggests a name. */
lam_status emission_fill_group(const emission_scene *scene, const char *what, const char *name,
                               const double *values, float *E, lam_error *error);

/* One vector by names of groups, or of emitters of a store of few, which then is W: each item is NAME=V or
 * NAME=V,V,V, one V per channel; the others are dark. A unit may stand behind the last V (photometry.h), but
 * of weights of emitters: a flux is that of all that the name means, and is spread evenly over its area. A
 * later item replaces an earlier one. Errors: LAM_ERR_ARGUMENT names the item. */
lam_status emission_from_groups(const emission_scene *scene, const option_list *items, emission *out,
                                lam_error *error);

/* The name of an item and its values [C], as exitances of the store's kind of light, or as weights without a
 * unit; both are freed with free(). converted is set where they were given in the other kind. Errors:
 * LAM_ERR_ARGUMENT names the item. */
lam_status emission_read_item(const emission_scene *scene, const char *item, char **name, double **values,
                              bool *converted, lam_error *error);

/* Checks the form of every item, which needs no store: an error is wrong usage. */
lam_status emission_check_items(const option_list *items, lam_error *error);

/* Puts the luminaires of some items beside every vector of e: NAME=V or NAME=V,V,V, one dimmer for each
 * channel, of a luminaire or a group of them; the others are dark. A later item replaces an earlier one.
 * Errors: LAM_ERR_ARGUMENT names the item. The form of items alone is checked by emission_check_dims. */
lam_status emission_dim(const emission_scene *scene, const option_list *items, emission *e, lam_error *error);
lam_status emission_check_dims(const option_list *items, lam_error *error);

/* Puts all luminaires beside the one vector of e, dimmed as their list says; nothing where there are none. */
lam_status emission_dim_as_listed(const emission_scene *scene, emission *e, lam_error *error);

/* Weights of emitters that are luminaires become dimmers, beside those that e has; of other emitters they
 * stay weights. Errors: LAM_ERR_MEMORY. */
lam_status emission_part_luminaires(const emission_scene *scene, emission *e, lam_error *error);

/* Reads a file. NPY: <f4 or <f8 of shape (n), (C, n) or a batch (b, C, n), and (b, n) for one channel. JSON:
 * the contract's EMISSION, or an object with one as `emission` or with a batch of them as `emissions`.
 * Values are negative only with signs, and where the store answers any emission. Errors name the file, the
 * place, the value and the limit. */
lam_status emission_read(const char *path, const emission_scene *scene, bool signs, emission *out,
                         lam_error *error);

/* Reads the frames of an animation, always a batch: JSON as above; NPY of shape (f, n) or (f, C, n), and of a
 * scene with s emitters also their weights, (f, s) or (f, C, s); or, for the word EMISSION_EMITTERS, every
 * emitter alone, in order. Weights make W without E. Errors as emission_read, and LAM_ERR_ARGUMENT for the
 * word where there are no emitters. */
#define EMISSION_EMITTERS "emitters"
lam_status emission_read_frames(const char *path, const emission_scene *scene, emission *out,
                                lam_error *error);

/* Puts e under the sky of an NPY file, shaped as an emission of m tiles, or of a matrix of Radiance (.mtx,
 * .smx) on the tiles of the scene. One sky goes with every emission, one emission with every sky (steady);
 * else there must be as many of both. A coloured sky lights a grey store by its luminance, that of Radiance
 * (photometry.h), and sets by_luminance: an NPY file of it is [b][3][m]. An NPY file is
 * of the store's kind of light, or photometric; a matrix is radiometric, and becomes photometric where that
 * is asked. */
lam_status emission_add_sky(emission *e, const char *path, const emission_scene *scene, bool photometric,
                            lam_error *error);

/* The same for a batch of skies L [n_skies][m], which is copied to every channel; path names it in messages.
 */
lam_status emission_add_skies(emission *e, const char *path, const mesh *m, size_t n_tiles, size_t n_skies,
                              const float *L, lam_error *error);

/* *values is [n_vectors][C][width], zero; freed with free(). path names it in messages. */
lam_status emission_allocate(const char *path, size_t n_channels, size_t width, size_t n_vectors,
                             float **values, lam_error *error);

/* The scene's own light as one vector: that of its elements, and of its luminaires as listed. */
lam_status emission_of_scene(const emission_scene *scene, emission *out, lam_error *error);

/* True where neither the elements of the first n_vectors vectors nor the luminaires of the first give light;
 * n: elements. */
bool emission_is_dark(const emission *e, size_t n, size_t n_channels, size_t n_vectors);

/* The options of a command line that are about light. */
typedef struct emission_options {
    const option_list *items; /* --emit */
    const option_list *dims;  /* --dim */
    const char *path;         /* --emission, or NULL */
    const char *frames;       /* for emission_read_frames in place of both, or NULL */
    const char *sky;          /* --sky, or NULL */
    bool photometric;         /* the sky is, whatever the store is */
    bool signs;               /* the emission of path may be negative, where the store answers any emission */
    bool other;               /* light is added later: the scene's own is not the preset */
} emission_options;

/* Frames when there are any, else groups when there are items, else the file, else none beside a sky or
 * luminaires, else the scene's own, which sets *own.
 */
lam_status emission_choose(const emission_scene *scene, const emission_options *options, emission *out,
                           bool *own, lam_error *error);

#endif
