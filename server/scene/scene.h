/* A store that is served, or a variant of one. Immutable except for its health and for what it keeps of
 * answers (adjoint rows, its mesh); reference-counted. Large arrays are mapped, all others are read. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_H
#define LAMBERT_SERVER_SCENE_SCENE_H

#include "lambert/lambert.h"
#include "server/scene/matrix_cache.h"
#include "server/scene/refined.h"
#include "server/scene/row_cache.h"
#include "server/scene/scene_corners.h"
#include "server/scene/scene_elements.h"
#include "server/scene/scene_mesh.h"
#include "server/scene/scene_sun.h"
#include "server/scene/scene_texts.h"
#include "server/scene/sensor_columns.h"
#include "solver/codec/request.h"
#include "solver/codec/sensor_names.h"
#include "solver/codec/stated_notes.h"
#include "solver/operator/groups/groups.h"
#include "solver/operator/limiter.h"
#include "store/store_map.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

/* The state of the comparison of mapped arrays with their checksums. */
typedef struct scene_health scene_health;

typedef struct scene scene;
struct scene {
    atomic_size_t references;
    char *name; /* as served */
    char *path;
    store_identity identity;
    scene *base;     /* of a variant, held: path, groups, areas, sky, luminaires, sensors, health and factors
                        belong to     it.     NULL: this is a store */
    uint64_t number; /* of a variant, from 1: in the order in which they were made; set by the catalog */
    size_t n;
    size_t n_channels;
    lam_operator *op;
    const float *reflectance; /* [C][n], of op */
    group_index groups;       /* measured */
    light_kind lights;
    group_index emitters;            /* by name */
    face_index faces;                /* of the scene file; empty: the store does not know them */
    const double *area;              /* [n], m^2 */
    store_view areas;                /* they hold it, mapped or in memory */
    double *group_emission;          /* [n_groups][C], the scene's own (group_emission_read) */
    lam_limiter limiter;             /* of answers below zero; it borrows groups and areas */
    lam_sky *sky;                    /* NULL: none */
    char sky_tiling[32];             /* the name of its tiles; "": not known. A variant has none of its own */
    char sky_up;                     /* 'x', 'y' or 'z' */
    double sky_north;                /* degrees of its model; 0 where it states none */
    lam_luminaires *luminaires;      /* NULL: none */
    luminaire_names luminaire_names; /* these by name */
    lam_sensors *sensors;            /* NULL: none */
    group_index sensor_sets;         /* these by name */
    scene_sun *sun;        /* over the sky; NULL: its tiles are not known. Of a variant that of its store */
    weather_file weather;  /* beside the file; its text is in texts. A variant has none of its own */
    size_t n_emitters;     /* 0: the store answers any emission */
    uint64_t bytes;        /* of /operator as stored; of a variant, of the cores alone */
    uint64_t memory;       /* bytes counted against --max-memory, without work areas */
    size_t work_bytes;     /* largest work area of a thread that solves */
    char *description;     /* the JSON of GET /v1/scenes/NAME */
    scene_texts texts;     /* that clients ask for */
    stated_errors errors;  /* of the store; of a variant none */
    bool *group_read;      /* [n_groups]: all its elements are receivers; NULL where the store is for all */
    bool *group_emits;     /* [n_groups]: all its elements are sources; NULL where any emission is answered */
    memory_ledger *ledger; /* of memory taken later; or NULL */
    row_cache *rows;       /* adjoint rows for linear reductions; any thread */
    sensor_columns *columns;  /* of its sensors; NULL without them */
    matrix_cache *matrices;   /* of derivatives of elements */
    refined *refined;         /* the refiner of its answers, made when first needed */
    scene_mesh *mesh;         /* its elements as glTF, made when first asked for */
    scene_elements *elements; /* its elements as columns, made when first asked for */
    scene_corners *corners;   /* that its elements share, found when first asked for. A variant has none */
    store_map *map;           /* held; NULL: nothing is mapped */
    scene_health *health;
    scene *next_to_verify; /* private to verifier.c, as the next one */
    bool to_verify;
};

typedef struct scene_options {
    const char *path, *name;
    bool verify;            /* first compare the whole file with its checksums */
    uint64_t verify_below;  /* or, where mapped arrays take fewer bytes, first compare these */
    uint64_t memory;        /* limit of its memory in bytes; UINT64_MAX: none */
    memory_ledger *ledger;  /* or NULL; outlives the scene */
    scene *before;          /* the present scene of this path and name, or NULL */
    size_t threads;         /* for one answer, at most */
    const stop_check *stop; /* or NULL; asked at least every 50 ms, and before each MiB that is read */
} scene_options;

/* Opens a store. The file is closed before this returns, except for its mapped arrays. Headers, checksums of
 * checksums, /mesh and all arrays that are not mapped are verified here; mapped arrays are left to
 * scene_verify, unless the options have them compared here. If the file is still that of options->before, of
 * which no damage is known, that scene is returned. Errors: as store_open and operator_load; LAM_ERR_MEMORY
 * names the sizes if it does not fit; LAM_ERR_CANCELLED once `stop` says so. Each names the path. */
lam_status scene_open(const scene_options *options, scene **out, lam_error *error);

/* Bytes that the scene has taken of its ledger since it was opened. Any thread. */
uint64_t scene_grown(const scene *s);

/* Drops what it computed and can compute again but for a refiner and the plan of corners. Any thread. */
void scene_drop_computed(const scene *s);

/* Bytes of the work areas of n_threads threads. */
uint64_t scene_work_memory(size_t n_threads, size_t work_bytes);

/* Makes a variant of base, which it holds. op (taken over, also on an error) is base's operator for other
 * reflectances; groups is the JSON object of these, for the description. A variant has no error figures:
 * those of the base were measured under other reflectances. Any thread. Errors: LAM_ERR_MEMORY. */
lam_status scene_open_variant(scene *base, const char *name, const char *groups, lam_operator *op,
                              scene **out, lam_error *error);

/* Puts the error of the store for what is asked into notes: that of receivers where nothing else is asked,
 * and none where others than sources emit. O(n_selected) of a store for receivers, O(emission) of one for
 * sources. Any thread. */
void scene_note_error(const scene *s, const radiosity_request *request, answer_notes *notes);

/* A view of the scene for errors by group. */
error_scene scene_for_errors(const scene *s);

/* Replaces that error by the one of the answer's own emission and sky, where the store states errors by
 * group: of a batch the largest over its vectors. E of the request holds every vector; values are
 * [n_rhs][C][count] of all elements or of those selected, H0 the direct light of sky and sun or NULL, sun
 * [n_suns][n] the part of a sun in it, of its direct light, W
 * [n_rhs][C][s] the weights of all that shines in a store of emitters, else NULL. *names
 * (freed with free() after the answer is written) belongs to the notes. O(n_rhs C n). False when memory is
 * short. */
bool scene_note_own_error(const scene *s, const radiosity_request *request, const float *H0, const float *sun,
                          const float *W, const float *values, answer_notes *notes, name_error **names);

/* The error of an answer at sensors, of the receivers of all its names and of those of each, in place of that
 * of the store: of a batch the largest. B are radiosities [n_rhs][C][n], sun [n_suns][n] and at_sensors
 * [n_suns][receivers] what suns give directly, or NULL. W and *names as in scene_note_own_error.
 * Where nothing is stated the notes say why. O(n_rhs C (n + stored weights)). False when memory is short. */
bool scene_note_sensor_error(const scene *s, const radiosity_request *request, const float *H0,
                             const float *sun, const float *at_sensors, const float *W, const float *B,
                             answer_notes *notes, name_error **names);

/* The error of an answer of a store of emitters that states their covariance, for weights W [n_rhs][C][s].
 * O(n_rhs (C n s + g s^2)). False when memory is short. */
bool scene_note_emitters_error(const scene *s, const radiosity_request *request, const float *W,
                               const float *values, answer_notes *notes, name_error **names);

/* The same of a linear reduction, name by name; means are [n_rhs][C]; buried is the share of the name's area
 * that they leave out. The notes refer to it until it is freed. False when memory is short. */
typedef struct mean_errors {
    name_error *names;    /* [n_names]; NULL: that of the store stays */
    emission_size *sizes; /* [n_rhs] */
    whole_light *whole;   /* [n_vectors], of n_rhs; NULL: nothing of it is known */
    size_t n_vectors;
    double *emission;                 /* [2][n_rhs][C], of a store of emitters [C], work */
    const luminaire_sums *luminaires; /* of the scene; NULL: the request has no dimmers */
    /* These are needed where the request has weights of emitters; NULL: it has none. */
    float *E;     /* [C][n], work */
    double *sums; /* [n_rhs][C][n_groups], of A E of groups */
    float *L;     /* [n_rhs][C][m], radiances with those of the request's sky; NULL: no emitter is of a sky */
} mean_errors;
bool scene_mean_errors_begin(const scene *s, const radiosity_request *request, answer_notes *notes,
                             mean_errors *out);
bool scene_mean_errors_add(const scene *s, const radiosity_request *request, size_t k, double buried,
                           const double *means, mean_errors *to, answer_notes *notes);
void mean_errors_free(mean_errors *e);

/* The message of an error of this scene for clients: without the path of its store, which is none of theirs.
 * Points into the message. */
const char *scene_message(const scene *s, const char *message);

/* Adds a reference, to be dropped by scene_release. Any thread. */
scene *scene_acquire(scene *s);
void scene_release(scene *s);

/* Compares mapped arrays with their checksums, again where they were compared before; something is mapped.
 * After LAM_ERR_DAMAGED the scene is out of service. One thread at a time, while others solve. Errors: as
 * store_map_verify. */
lam_status scene_verify(scene *s, const stop_check *stop, lam_error *error);

/* True if mapped arrays were compared, with whatever result, or nothing is mapped. Any thread. */
bool scene_verified(const scene *s);

/* When mapped arrays were found sound last, in seconds of Unix time; 0: never. Any thread. */
long long scene_verified_at(const scene *s);

/* True for the first caller in a minute. Any thread. */
bool scene_may_doubt(const scene *s);

/* True if the scene is out of service: a block differs from its checksum or cannot be read any more, or the
 * file was written to. An answer is valid only if this is still false after it was computed. why names file,
 * array and MiB; *news (or NULL) is true for the first caller. Any thread. */
bool scene_damaged(const scene *s, lam_error *why, bool *news);

#endif
