/* One store, read whole and ready to answer, or a variant of one: immutable, counted by who uses it. */
#ifndef LAMBERT_SERVER_SCENE_H
#define LAMBERT_SERVER_SCENE_H

#include "lambert/lambert.h"
#include "server/groups.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct scene scene;
struct scene {
    atomic_size_t references;
    char *name; /* as served */
    char *path;
    char *checksum; /* of all that the store holds */
    scene *base;    /* of a variant: held; its path, groups, sky and factors are lent. NULL: of a store */
    size_t n;
    size_t n_channels;
    lam_operator *op;
    group_index groups;
    lam_sky *sky;      /* NULL: none */
    size_t n_emitters; /* 0: the store answers any emission */
    uint64_t bytes;    /* of /operator as stored; of a variant, of the cores alone */
    char *description; /* the JSON of GET /v1/scenes/NAME */
    bool has_error;    /* the store's total error, of its own lights or else of single elements */
    double relative_mean, indirect_mean;
};

/* Reads the store at path; its file is closed again before this returns. name NULL: the store's own.
 * With verify everything in the file is compared with its checksums, also what is not read.
 * Errors: as store_open and operator_load; each names the path. One thread at a time. */
lam_status scene_open(const char *path, const char *name, bool verify, scene **out, lam_error *error);

/* Whether two were read from stores that say and hold the same. */
bool scene_is_same(const scene *one, const scene *other);

/* A scene beside base, which it holds: op (taken over, also on an error) is base's operator relit; groups is
 * the JSON object of its reflectances, for the description. It has no error figures: those of the base were
 * measured under other reflectances. Any thread. Errors: LAM_ERR_MEMORY. */
lam_status scene_open_variant(scene *base, const char *name, const char *groups, lam_operator *op,
                              scene **out, lam_error *error);

/* Another user; every one gives it back with scene_release. Any thread. */
scene *scene_acquire(scene *s);
void scene_release(scene *s);

#endif
