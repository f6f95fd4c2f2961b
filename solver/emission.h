/* Emissions from a command line or a file: --emit GROUP=V[,V,V] and --emission FILE.npy|.json. */
#ifndef LAMBERT_SOLVER_EMISSION_H
#define LAMBERT_SOLVER_EMISSION_H

#include "solver/options.h"
#include "solver/scene/mesh.h"

/* A batch of emissions: E is [n_vectors][C][n] in mesh order, W/m^2, never negative. */
typedef struct emission {
    size_t n_vectors;
    bool batch; /* given as a batch (also of one), so answered as one */
    float *E;
} emission;

void emission_free(emission *e);

/* One vector by group names: each item is GROUP=V or GROUP=V,V,V, V one per channel; the others are 0. A name
 * matches its group, else (an object of several materials) every group `name.material`; a later item replaces
 * an earlier one. Errors: LAM_ERR_ARGUMENT names the item. */
lam_status emission_from_groups(const mesh *m, const option_list *items, emission *out, lam_error *error);

/* Whether every item is well formed, whatever the store: otherwise it is wrong usage. */
lam_status emission_check_items(const option_list *items, lam_error *error);

/* A file. NPY: <f4 or <f8 of shape [n], [C][n] or a batch of them ([m][C][n]; also [m][n] with one channel).
 * JSON: such an array, the contract's EMISSION, or an object with `emission` or `emissions`.
 * Errors name the file, the place, the value and the limit. */
lam_status emission_read(const char *path, const mesh *m, emission *out, lam_error *error);

/* The scene's own emission as one vector. */
lam_status emission_of_scene(const mesh *m, emission *out, lam_error *error);

/* Whichever of the three the command line asks for: groups when there are items, else the file, else the
 * scene's own, which is *own. */
lam_status emission_choose(const mesh *m, const option_list *items, const char *path, emission *out,
                           bool *own, lam_error *error);

/* Calls visit(context, g) for each group that name means; returns how many. */
size_t emission_match_groups(const mesh *m, const char *name, void (*visit)(void *context, size_t group),
                             void *context);

#endif
