/* The images of a mesh as files that a store keeps. */
#ifndef LAMBERT_SCENE_IMPORT_PICTURE_FILES_H
#define LAMBERT_SCENE_IMPORT_PICTURE_FILES_H

#include "solver/scene/texture.h"

/* Keeps the images of reflectances as JPEG, of 4 million pixels at most, with their places on the elements,
 * which must be final, and lets the textures go. Errors: LAM_ERR_MEMORY, with the textures kept. */
lam_status mesh_keep_pictures(mesh *m, lam_error *error);

#endif
