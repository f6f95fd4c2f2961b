/* The cameras of a scene, and the group /cameras of a store, which render and both descriptions of it read.
 */
#ifndef LAMBERT_BASE_SCENE_CAMERAS_H
#define LAMBERT_BASE_SCENE_CAMERAS_H

#include "store/store.h"

/* The most cameras of a scene that are kept. */
#define SCENE_CAMERAS_MOST 512

/* A perspective camera in the axes of the scene: direction and up are unit vectors at right angles. */
typedef struct scene_camera {
    char name[256]; /* UTF-8 */
    double eye[3];  /* m */
    double direction[3], up[3];
    double fov; /* vertical, degrees, within 1 to 170 */
} scene_camera;

/* Makes direction a unit vector and up one at right angles to it. False, with *c as it was, where that is not
 * possible or eye or fov are no usable numbers. */
bool scene_camera_settle(scene_camera *c);

/* The camera of this name, or NULL. */
const scene_camera *scene_camera_find(size_t n, const scene_camera *cameras, const char *name);

/* Writes /cameras, or nothing where there are none. */
lam_status scene_cameras_save(size_t n, const scene_camera *cameras, store *s, lam_error *error);

/* Reads and checks them; *out is freed by the caller, NULL where there are none. Errors: LAM_ERR_FORMAT,
 * LAM_ERR_MEMORY. */
lam_status scene_cameras_load(store *s, size_t *n, scene_camera **out, lam_error *error);

#endif
