/* Variants: scenes under other reflectances, made one after the other in the background and then served
 * beside the scene that lends them its factors. Knows no HTTP but the statuses that refusals have. */
#ifndef LAMBERT_SERVER_SCENE_VARIANTS_H
#define LAMBERT_SERVER_SCENE_VARIANTS_H

#include "server/scene/catalog.h"
#include "solver/codec/problem.h"

typedef struct variants variants;

/* What has become of the last request for a variant. Served or not is the catalog's affair: one that is built
 * anew is served as it was until then. */
typedef enum variant_state { VARIANT_SETTLED, VARIANT_BUILDING, VARIANT_FAILED } variant_state;

/* Starts the thread that builds, where c allows variants at all. c and all outlive it. */
lam_status variants_start(const config *c, catalog *all, variants **out, lam_error *error);

/* Takes no more and stops what is being built, as soon as that looks (an inversion goes on to its end). */
void variants_close(variants *v);

/* Closes, waits for the thread, frees; NULL is allowed. */
void variants_destroy(variants *v);

/* Queues a variant of base, of which it holds on: to be served as name, with reflectance [C][n] (taken over,
 * also on a refusal), of which groups is the JSON to show. One that waits or is built under the name is
 * dropped in its favour. Any thread. False with *why: 429 when there are --max-variants of other names, 409
 * when a store has the name, 503. */
bool variants_put(variants *v, scene *base, const char *name, float *reflectance, const char *groups,
                  problem *why);

/* Takes a variant out, also one that waits, is built or has failed. Any thread. False with *why: 404, 503. */
bool variants_remove(variants *v, const char *name, problem *why);

/* *why is filled when it has failed. Any thread. */
variant_state variants_state(variants *v, const char *name, problem *why);

#endif
