#include "solver/precompute/mesh_luminaires.h"

#include <stdlib.h>

_Static_assert((int)DIRECT_HALVES == (int)GATHER_HALVES, "samples are in as many halves");

static void add(const void *context, const double normal[3], uint64_t key, size_t n_points,
                const double (*points)[3], size_t stride, double *E) {
    direct_sampler_add(context, normal, key, n_points, points, stride, E);
}

lam_status mesh_luminaires_make(const precompute_scene *scene, mesh_luminaires *out, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *parent = NULL;
    const mesh_refinement as_they_are = {.elements = 1};
    *out = (mesh_luminaires){.sampler = NULL};
    if (scene->luminaires.placed.n == 0) return LAM_OK;
    TRY(mesh_refine_into(&scene->m, &as_they_are, &out->faces, &parent, error));
    /* Names of groups, which luminaires ignore some of, are those of the scene for as long as they are
     * needed. */
    out->faces.n_groups = scene->m.n_groups;
    out->faces.group_names = scene->m.group_names;
    status = direct_sampler_create(&out->faces, &scene->luminaires.placed, &out->sampler, error);
    out->faces.n_groups = 0;
    out->faces.group_names = NULL;
    TRY(status);
    out->direct = (gather_direct){.add = add, .context = out->sampler};
done:
    free(parent);
    return status;
}

void mesh_luminaires_free(mesh_luminaires *l) {
    direct_sampler_free(l->sampler);
    mesh_free(&l->faces);
    *l = (mesh_luminaires){.sampler = NULL};
}

const gather_direct *mesh_luminaires_light(const mesh_luminaires *l) {
    return l->sampler != NULL ? &l->direct : NULL;
}
