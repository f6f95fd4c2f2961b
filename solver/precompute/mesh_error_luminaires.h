/* The error of the mesh for light of luminaires, their direct light with it: of all of them, as dim as their
 * list says, and of some alone. */
#ifndef LAMBERT_PRECOMPUTE_MESH_ERROR_LUMINAIRES_H
#define LAMBERT_PRECOMPUTE_MESH_ERROR_LUMINAIRES_H

#include "solver/precompute/parts.h"

/* Of more luminaires than LUMINAIRES_LOOKED_AT as many stand for all. Cost: that of mesh_error, and for each
 * of these a packet of segments or more for each of its points. Errors: those of mesh_error and of
 * direct_points_irradiance. */
enum { LUMINAIRES_LOOKED_AT = 32, LUMINAIRES_ALONE = 8 };
lam_status mesh_error_add_luminaires(const precompute_job *job, const precompute_scene *scene,
                                     made_operator *made, lam_error *error);

#endif
