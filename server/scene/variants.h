/* Variants: scenes under other reflectances, built one after the other in the background and served beside
 * their base, whose factors they use. Of HTTP it knows the statuses of refusals alone. */
#ifndef LAMBERT_SERVER_SCENE_VARIANTS_H
#define LAMBERT_SERVER_SCENE_VARIANTS_H

#include "server/scene/catalog.h"
#include "solver/codec/problem.h"

typedef struct variants variants;

/* The state of the last request for a variant. The catalog serves the variant of an earlier request until the
 * new one is built. */
typedef enum variant_state { VARIANT_SETTLED, VARIANT_BUILDING, VARIANT_FAILED } variant_state;

/* Starts the thread that builds variants, if c allows any. c and all outlive it. */
lam_status variants_start(const config *c, catalog *all, variants **out, lam_error *error);

/* Refuses further requests and cancels the running build (an inversion goes on to its end). */
void variants_close(variants *v);

/* True while a variant is built. Any thread. */
bool variants_busy(variants *v);

/* Closes, waits for the thread, frees; NULL is allowed. */
void variants_destroy(variants *v);

/* Queues a variant of base, which is held, to be served as name. reflectance [C][n] is taken over, also on a
 * refusal; groups is its JSON for the description. A waiting or running build of this name is dropped. Any
 * thread. False with *why: 429 if there are --max-variants of other names, 409 if a store has the name, 503.
 */
bool variants_put(variants *v, scene *base, const char *name, float *reflectance, const char *groups,
                  problem *why);

/* Takes a variant out of service; one that waits, is being built or has failed is dropped. Any thread. False
 * with *why: 404, 503. */
bool variants_remove(variants *v, const char *name, problem *why);

/* *why is set for VARIANT_FAILED. Any thread. */
variant_state variants_state(variants *v, const char *name, problem *why);

#endif
