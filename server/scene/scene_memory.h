/* The memory that a store will take as a scene, found by its sizes before anything is read. */
#ifndef LAMBERT_SERVER_SCENE_MEMORY_H
#define LAMBERT_SERVER_SCENE_MEMORY_H

#include "store/store.h"

/* *memory: bytes of the operator in memory, of the sky, of luminaires, of the mesh and of errors, mapped or
 * read; *operator_bytes: those of /operator in the file. Errors: those of store_group_bytes and
 * store_get_text. */
lam_status scene_memory_of(store *s, uint64_t *memory, uint64_t *operator_bytes, lam_error *error);

/* The bytes that are read beside that and freed again before the scene is open: of groups by element or of
 * emission, the names as they are stored, parts of faces, receivers and sources; where there are buried
 * elements, these and areas, for the description. Errors: those of store_group_bytes. */
lam_status scene_memory_passing(store *s, uint64_t *memory, lam_error *error);

#endif
