#include "support/view.h"
#include "solver/formfactor/source.h"

#define view_ok(call) ck_assert_msg((call) == LAM_OK, "%s", error.message)

view make_view(int which) {
    lam_error error;
    view v = {.name = (const char *[]){"cornell, coloured", "city", "city, two-sided",
                                       "rooms, black floors"}[which]};
    generate_options how = {
        .kind = "city", .variant = 1, .terrain = "flat", .elements = 500, .reflectance = -1, .seed = 1};
    if (which == CORNELL || which == BLACK_FLOOR) how.kind = "cornell";
    v.m = generate_good(&how);
    if (which == TWO_SIDED) view_ok(mesh_make_two_sided(&v.m, &error));
    if (which == BLACK_FLOOR)
        for (size_t i = 0; i < v.m.n * v.m.n_channels; i++)
            if (v.m.normal[i % v.m.n][2] > .5f) v.m.reflectance[i] = 0;
    v.order = test_allocate(v.m.n, sizeof *v.order);
    view_ok(mesh_z_order(&v.m, v.order, &error));
    const form_factor_options options = {.recipe = {.source = &source_rays, .rays = 256, .seed = 3}};
    view_ok(form_factors_make(&v.m, v.order, &options, &v.f, &error));
    return v;
}

void view_free(view *v) {
    form_factors_free(&v->f);
    mesh_free(&v->m);
    free(v->order);
}
