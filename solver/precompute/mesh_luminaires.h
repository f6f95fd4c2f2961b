/* The light of luminaires by which a mesh is divided. */
#ifndef LAMBERT_PRECOMPUTE_MESH_LUMINAIRES_H
#define LAMBERT_PRECOMPUTE_MESH_LUMINAIRES_H

#include "solver/adapt/coarse_light.h"
#include "solver/direct/direct_sampler.h"
#include "solver/precompute/parts.h"

/* It stays where it is made. The faces are a copy, as those of the scene are divided meanwhile. */
typedef struct mesh_luminaires {
    mesh faces;
    direct_sampler *sampler; /* NULL: there are no luminaires */
    gather_direct direct;
} mesh_luminaires;

/* Freed by mesh_luminaires_free, also after an error. Errors: those of direct_sampler_create. */
lam_status mesh_luminaires_make(const precompute_scene *scene, mesh_luminaires *out, lam_error *error);
void mesh_luminaires_free(mesh_luminaires *l);

/* Of luminaires; NULL: there are none. */
const gather_direct *mesh_luminaires_light(const mesh_luminaires *l);

#endif
