#include "support/room.h"

#include "solver/scene/surfaces.h"

room room_create(const double size[3], unsigned divisions, float rho, size_t n_channels) {
    room r = {.m = box_mesh(size, divisions, rho)};
    const size_t n = r.m.n;
    lam_error error = {0};
    r.F = box_form_factors(size, divisions, r.m.area);
    r.order = malloc(n * sizeof *r.order);
    free(r.m.reflectance);
    r.m.reflectance = malloc(n_channels * n * sizeof(float));
    ck_assert(r.order != NULL && r.m.reflectance != NULL);
    r.m.n_channels = n_channels;
    for (size_t i = 0; i < n_channels * n; i++) r.m.reflectance[i] = rho * (1 - .1f * (float)(i / n));
    ck_assert_msg(mesh_z_order(&r.m, r.order, &error) == LAM_OK, "%s", error.message);
    r.problem = (build_problem){
        .n = n, .n_channels = n_channels, .area = r.m.area, .reflectance = r.m.reflectance, .order = r.order};
    size_t n_surfaces;
    r.centre = malloc(n * sizeof *r.centre);
    r.surface = malloc(n * sizeof *r.surface);
    ck_assert(r.centre != NULL && r.surface != NULL);
    for (size_t i = 0; i < n; i++) mesh_centroid(&r.m, i, r.centre[i]);
    ck_assert_msg(mesh_surfaces(&r.m, r.surface, &n_surfaces, &error) == LAM_OK, "%s", error.message);
    r.problem.centre = (const double(*)[3])r.centre;
    r.problem.normal = (const float(*)[3])r.m.normal;
    r.problem.surface = r.surface;
    return r;
}

const build_problem *room_problem(room *r) {
    r->problem.F = &r->F;
    return &r->problem;
}

void room_free(room *r) {
    mesh_free(&r->m);
    csr_free(&r->F);
    free(r->order);
    free(r->centre);
    free(r->surface);
}

double *room_dense(const csr *F) {
    double *dense = calloc(F->n * F->n, sizeof *dense);
    ck_assert_ptr_nonnull(dense);
    for (size_t i = 0; i < F->n; i++)
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
            dense[i * F->n + F->indices[p]] = (double)F->data[p];
    return dense;
}
