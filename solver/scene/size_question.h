/* Questions about a scene that is probably read in a wrong unit or lies on its side. */
#ifndef LAMBERT_SCENE_SIZE_QUESTION_H
#define LAMBERT_SCENE_SIZE_QUESTION_H

#include "solver/base/length_unit.h"
#include "solver/scene/mesh.h"

/* The unit that the file of a scene is probably in, which was read in metres, by its height and width: a room
 * or a house in millimetres, centimetres or feet. NULL where metres are as likely. O(n_vertices). */
const length_unit *mesh_likely_unit(const mesh *m);

/* The axis that a scene probably stands on, 'y' or 'z', where it is not its own: that of faces of groups
 * which are called floor or ceiling, or, without these, that of its shortest side, if most of its area faces
 * along it and lamps do not look along its own. 0: its own. O(n). */
char mesh_likely_up(const mesh *m);

#endif
