/* The corners that the elements of a scene share, and the plan of light there (solver/operator/corners): made
 * from the mesh of its store when they are first needed, and kept. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_CORNERS_H
#define LAMBERT_SERVER_SCENE_SCENE_CORNERS_H

#include "server/scene/memory_ledger.h"
#include "solver/operator/corners/corner_plan.h"
#include "solver/operator/corners/corner_store.h"

typedef struct scene scene;
typedef struct scene_corners scene_corners;

/* For a store, not for a variant, whose elements are those of its store. The scene outlives it. Errors:
 * LAM_ERR_MEMORY. */
lam_status scene_corners_create(const scene *of, memory_ledger *ledger, scene_corners **out,
                                lam_error *error);

/* NULL is allowed. */
void scene_corners_destroy(scene_corners *c);

/* The plan, which lives as long as c. The first call opens the store again and makes it, some 3 us an
 * element, while others wait. Errors: LAM_ERR_IO (also if the file was replaced), LAM_ERR_DAMAGED,
 * LAM_ERR_FORMAT, LAM_ERR_MEMORY (also of the ledger), LAM_ERR_ARGUMENT (corner_weights_find). */
lam_status scene_corners_get(scene_corners *c, const corner_plan **plan, lam_error *error);

/* Bytes taken of the ledger; does not wait. NULL is allowed. */
size_t scene_corners_held(scene_corners *c);

/* Bytes that reading a mesh and finding its corners take at most, all together. */
size_t corner_work_bytes(size_t n, size_t n_vertices);

#endif
