/* A mesh as the writer of glTF takes it (solver/codec/gltf/gltf.h). */
#ifndef LAMBERT_SOLVER_OUTPUT_MESH_GLTF_H
#define LAMBERT_SOLVER_OUTPUT_MESH_GLTF_H

#include "solver/codec/gltf/gltf.h"
#include "solver/scene/mesh.h"

/* The parts of m that every file shows: neither light nor images. Borrows m, name, groups and *glass, which
 * it fills. O(1). */
gltf_mesh mesh_gltf(const mesh *m, const char *name, const group_index *groups, scene_glass *glass);

#endif
