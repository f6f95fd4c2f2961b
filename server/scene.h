/* One store, read whole and ready to answer: immutable but for the rows it keeps, counted by who uses it. */
#ifndef LAMBERT_SERVER_SCENE_H
#define LAMBERT_SERVER_SCENE_H

#include "lambert/lambert.h"
#include "server/adjoint_rows.h"
#include "server/groups.h"
#include "server/refined.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct scene {
    atomic_size_t references;
    char *name; /* as served */
    char *path;
    size_t n;
    size_t n_channels;
    lam_operator *op;
    const float *reflectance; /* [C][n], of op */
    group_index groups;
    double *area;      /* [n], m^2 */
    lam_sky *sky;      /* NULL: none */
    size_t n_emitters; /* 0: the store answers any emission */
    uint64_t bytes;    /* of /operator as stored */
    char *description; /* the JSON of GET /v1/scenes/NAME */
    bool has_error;    /* the store's total error, of its own lights or else of single elements */
    double relative_mean, indirect_mean;
    adjoint_rows *rows; /* what reduces by a product; any thread */
    refined *refined;   /* what refining its answers takes, found when it is first asked for */
} scene;

/* Reads the store at path; its file is closed again before this returns. name NULL: the store's own.
 * With verify everything in the file is compared with its checksums, also what is not read.
 * stores outlives the scene: whoever opens a store holds it, the caller of this too.
 * Errors: as store_open and operator_load; each names the path. */
lam_status scene_open(const char *path, const char *name, bool verify, pthread_mutex_t *stores, scene **out,
                      lam_error *error);

/* Another user; every one gives it back with scene_release. Any thread. */
scene *scene_acquire(scene *s);
void scene_release(scene *s);

#endif
