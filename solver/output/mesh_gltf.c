#include "solver/output/mesh_gltf.h"

_Static_assert(MESH_NO_VERTEX == GLTF_NO_VERTEX, "triangles are marked alike");

gltf_mesh mesh_gltf(const mesh *m, const char *name, const group_index *groups, scene_glass *glass) {
    *glass = (scene_glass){.of = m->glass, .by_angle = m->glass_by_angle};
    return (gltf_mesh){.name = name,
                       .n_vertices = m->n_vertices,
                       .n = m->n,
                       .n_channels = m->n_channels,
                       .vertices = (const double(*)[3])m->vertices,
                       .elements = (const uint32_t(*)[4])m->elements,
                       .normal = (const float(*)[3])m->normal,
                       .area = m->area,
                       .reflectance = m->reflectance,
                       .emission = m->emission,
                       .face = m->faces.of,
                       .groups = groups,
                       .glass = m->glass != NULL ? glass : NULL,
                       .up = m->up};
}
