#include "support/box_problem.h"

fixture fixture_box(const double size[3], unsigned divisions, float reflectance) {
    fixture f = {.m = box_mesh(size, divisions, reflectance)};
    f.F = box_form_factors(size, divisions, f.m.area);
    f.order = malloc(f.m.n * sizeof *f.order);
    lam_error error = {0};
    ck_assert_msg(mesh_z_order(&f.m, f.order, &error) == LAM_OK, "%s", error.message);
    return f;
}

const build_problem *problem_of(fixture *f) {
    f->problem = (build_problem){.n = f->m.n,
                                 .n_channels = f->m.n_channels,
                                 .area = f->m.area,
                                 .reflectance = f->m.reflectance,
                                 .F = &f->F,
                                 .order = f->order};
    return &f->problem;
}

void fixture_free(fixture *f) {
    mesh_free(&f->m);
    csr_free(&f->F);
    free(f->order);
}
