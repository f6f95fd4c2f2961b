/* One store, ready to answer, or a variant of one: immutable but for its health and the rows it keeps,
 * counted by who uses it. Its large arrays are mapped, all else is read. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_H
#define LAMBERT_SERVER_SCENE_SCENE_H

#include "lambert/lambert.h"
#include "server/scene/refined.h"
#include "server/scene/row_cache.h"
#include "solver/codec/groups.h"
#include "store/store_map.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

/* Whether what is mapped is known to be what was written. */
typedef struct scene_health scene_health;

typedef struct scene scene;
struct scene {
    atomic_size_t references;
    char *name;   /* as served */
    bool renamed; /* the name was given, it is not the store's own */
    char *path;
    store_identity identity;
    scene *base; /* of a variant: held; its path, groups, areas, sky, health and factors are lent. NULL: of a
                    store */
    size_t n;
    size_t n_channels;
    lam_operator *op;
    const float *reflectance; /* [C][n], of op */
    group_index groups;
    double *area;      /* [n], m^2 */
    lam_sky *sky;      /* NULL: none */
    size_t n_emitters; /* 0: the store answers any emission */
    uint64_t bytes;    /* of /operator as stored; of a variant, of the cores alone */
    uint64_t memory;   /* what it counts for in --max-memory, without work areas */
    size_t work_bytes; /* the work area of a thread that solves, at most */
    char *description; /* the JSON of GET /v1/scenes/NAME */
    bool has_error;    /* the store's total error, of its own lights or else of single elements */
    double relative_mean, indirect_mean;
    memory_ledger *ledger; /* of what is held beyond memory; or NULL */
    row_cache *rows;       /* what reduces by a product; any thread */
    refined *refined;      /* what refining its answers takes, found when it is first asked for */
    store_map *map;        /* held; NULL: nothing is mapped */
    scene_health *health;
    scene *next_to_verify; /* verifier.c's */
};

/* How a store is opened. */
typedef struct scene_options {
    const char *path, *name; /* name NULL: the store's own */
    bool verify;     /* compare everything in the file with its checksums first, also what is not read */
    uint64_t memory; /* what it may count for; UINT64_MAX: anything */
    memory_ledger *ledger;   /* or NULL; outlives the scene */
    scene *before;           /* the scene of this path and name so far, or NULL */
    size_t threads;          /* that one answer may use */
    pthread_mutex_t *stores; /* outlives the scene: whoever opens a store holds it, the caller of this too */
} scene_options;

/* Opens a store; its file is closed again before this returns, but for what is mapped. Verified here: headers
 * and checksums of checksums, /mesh, and whatever is not mapped. What is mapped is left to scene_verify,
 * unless options->verify. When the file is still that of options->before, and no damage of it is known, that
 * is given out again. Errors: as store_open and operator_load; LAM_ERR_MEMORY names the sizes where it does
 * not fit. Each names the path. One thread at a time. */
lam_status scene_open(const scene_options *options, scene **out, lam_error *error);

/* What a scene has come to hold since it was opened, of its ledger. Any thread. */
uint64_t scene_grown(const scene *s);

/* What scenes of these work areas count for. */
uint64_t scene_work_memory(size_t n_threads, size_t work_bytes);

/* A scene beside base, which it holds: op (taken over, also on an error) is base's operator relit; groups is
 * the JSON object of its reflectances, for the description. It has no error figures: those of the base were
 * measured under other reflectances. Any thread. Errors: LAM_ERR_MEMORY. */
lam_status scene_open_variant(scene *base, const char *name, const char *groups, lam_operator *op,
                              scene **out, lam_error *error);

/* Another user; every one gives it back with scene_release. Any thread. */
scene *scene_acquire(scene *s);
void scene_release(scene *s);

/* Compares what is mapped with its checksums; from LAM_ERR_DAMAGED on the scene is damaged. One thread at a
 * time, while others solve. Errors: as store_map_verify. */
lam_status scene_verify(scene *s, const atomic_int *cancel, lam_error *error);

/* Whether what is mapped has been compared (also: with a bad end), or there was no need to. Any thread. */
bool scene_verified(const scene *s);

/* Whether the scene is out of service: a block differs from its checksum or cannot be read any more, or the
 * file was written to. An
 * answer that was made before this said so the last time is not to be trusted. why names file, array and MiB;
 * *news (or NULL) is true for the first who asks. Any thread. */
bool scene_damaged(const scene *s, lam_error *why, bool *news);

#endif
