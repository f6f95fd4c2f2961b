#include "solver/precompute/element_geometry.h"

#include "solver/scene/surfaces.h"

#include <stdlib.h>

lam_status element_geometry_add(const mesh *m, element_geometry *g, build_problem *problem,
                                lam_error *error) {
    lam_status status = LAM_OK;
    element_geometry made = {0};
    size_t n_surfaces;
    made.centre = memory_allocate(m->n, sizeof *made.centre, "centroids", error);
    made.surface = memory_allocate(m->n, sizeof *made.surface, "surfaces", error);
    if (made.centre == NULL || made.surface == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) mesh_centroid(m, i, made.centre[i]);
    TRY(mesh_surfaces(m, made.surface, &n_surfaces, error));
    problem->centre = (const double(*)[3])made.centre;
    problem->normal = (const float(*)[3])m->normal;
    problem->surface = made.surface;
    *g = made;
    made = (element_geometry){0};
done:
    element_geometry_free(&made);
    return status;
}

void element_geometry_free(element_geometry *g) {
    free(g->centre);
    free(g->surface);
    *g = (element_geometry){0};
}
