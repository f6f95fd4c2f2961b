/* Panes of a scene: groups of faces that let a part of the light pass, straight on, and the law of that part.
 * Both programs read them.
 *
 * A pane of transmittance T at normal incidence passes, of light at the angle t to its normal,
 *     T g(t),    g(t) = min(1, 1.018 cos t (1 + sin^3 t))
 * (Rivero 1958, clear glass). Where a ray crosses p faces one behind the other, each passes the p-th root. */
#ifndef LAMBERT_BASE_SCENE_GLASS_H
#define LAMBERT_BASE_SCENE_GLASS_H

#include "store/store.h"

#include <stdbool.h>

/* A group whose transmittance is 0 is opaque. */
struct group_glass {
    double transmittance; /* at normal incidence, of all faces that a ray crosses together; 0 to 1 */
    double faces;         /* that a ray crosses one behind the other, 1 or more */
};

/* Faces that a ray crosses at most, one behind the other, of one pane. */
enum { GLASS_FACES_MOST = 16 };
/* Panes that a ray crosses at most; behind so many nothing is left of its light. */
enum { PANES_MOST = 64 };

typedef struct scene_glass {
    struct group_glass *of; /* [groups]; NULL: no group is a pane */
    bool by_angle;          /* else g = 1 */
    bool given;             /* --glass said more than the scene file */
} scene_glass;

/* "angle" or "none", the words of stores for the law. */
const char *glass_law_word(const scene_glass *glass);

/* The part of the light that one face passes, of which a ray has this cosine, 0 to 1, to its normal. */
double glass_passes(const struct group_glass *glass, bool by_angle, double cosine);

/* The largest sum of form factors of a row where the panes of n groups are, of one side: each of p panes, one
 * behind the other, receives all that those before it pass, 1 + t + ... + t^p with the largest t that a face
 * passes. 1 without panes. */
double glass_row_most(const struct group_glass *of, size_t n);

/* The same of a store, which may have no panes. Errors: those of scene_glass_load. */
lam_status glass_row_most_of(store *s, double *out, lam_error *error);

/* /mesh/glass of a store of so many groups, with its law; out->of is the caller's, and NULL where there are
 * no panes. Errors: LAM_ERR_FORMAT, LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status scene_glass_load(store *s, size_t n_groups, scene_glass *out, lam_error *error);

/* Writes nothing where there are no panes. */
lam_status scene_glass_save(const scene_glass *glass, size_t n_groups, store *s, lam_error *error);

#endif
