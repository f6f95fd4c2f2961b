/* A scene that reflects nothing, whose mesh is judged by its irradiance: as if all surfaces reflected so
 * little that no more than a thousandth of their light is of a second bounce. */
#ifndef LAMBERT_PRECOMPUTE_BLACK_SCENE_H
#define LAMBERT_PRECOMPUTE_BLACK_SCENE_H

#include "solver/scene/mesh.h"

/* Gives every element of a scene that reflects nothing this reflectance; false where some element reflects,
 * which stays as it is. Where elements take theirs from textures, parts of them would be black again: false,
 * too. */
bool black_scene_lighten(mesh *m);

/* Makes all of them black again. */
void black_scene_darken(mesh *m);

#endif
