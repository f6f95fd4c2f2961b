/* The error that constants on elements leave of the light of skies: of an even one, of a cloudy one, and of
 * single tiles, as of the sun's. */
#ifndef LAMBERT_PRECOMPUTE_MESH_ERROR_SKIES_H
#define LAMBERT_PRECOMPUTE_MESH_ERROR_SKIES_H

#include "solver/precompute/parts.h"

/* States it for any emission: 0 is the emission of a scene that a sky lights. States nothing where no sky
 * lights the scene, or the operator takes no other light than that of its emitters. Cost: about that of
 * mesh_error twice. Errors: those of mesh_error. */
lam_status mesh_error_add_skies(const precompute_job *job, const precompute_scene *scene,
                                const precompute_factors *factors, made_operator *made, lam_error *error);

#endif
