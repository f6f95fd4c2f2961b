/* The sun over a scene, by rays to it (solver/shadow): made from the store when a sun is first asked for, and
 * kept. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_SUN_H
#define LAMBERT_SERVER_SCENE_SCENE_SUN_H

#include "server/scene/memory_ledger.h"
#include "solver/codec/request.h"
#include "store/store.h"

typedef struct scene scene;
typedef struct scene_sun scene_sun;

/* For a scene with its sky, whose open store is s; its variants share it. The scene outlives it. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_FORMAT. */
lam_status scene_sun_create(store *s, const scene *of, scene_sun **out, lam_error *error);

/* NULL is allowed. */
void scene_sun_destroy(scene_sun *sun);

/* Why suns over a scene are not answered, or NULL. */
const char *scene_sun_why_not(const scene *s);

/* Makes what rays need, if it is not there: it opens the store again, and checks that it still is the one of
 * the scene, while others wait. O(n log n + tiles n). Errors: LAM_ERR_IO (also if the file was replaced),
 * LAM_ERR_MEMORY (also of the ledger), LAM_ERR_DAMAGED, LAM_ERR_FORMAT. */
lam_status scene_sun_make(scene_sun *sun, lam_error *error);

/* shares [n]: the irradiance of each element by a sun and by the ground that it lights, of the irradiance of
 * a plane normal to it. All 0 where the sun is below the horizon. After scene_sun_make. Threads of the
 * caller's pool share the work. Cost: n rays times 16, and more where shadows end; O(n) for the sun of the
 * last call. */
void scene_sun_shares(scene_sun *sun, const request_sun *of, float *shares);

/* The same of the receivers of its sensors, shares [receivers], by rays from each of them. Of a scene with
 * sensors. Cost: about a microsecond for each. */
void scene_sun_at_sensors(const scene_sun *sun, const request_sun *of, float *shares);

/* Bytes taken of the ledger. Does not wait. */
size_t scene_sun_held(const scene_sun *sun);

#endif
