/* Generated scenes of about 500 elements with form factors by rays: coloured, open, two-sided, partly black.
 */
#ifndef LAMBERT_TESTS_VIEW_H
#define LAMBERT_TESTS_VIEW_H

#include "solver/bench/scenes.h"
#include "solver/formfactor/formfactor.h"
#include "support/dense.h"

#include <check.h>

#define view_ok(call) ck_assert_msg((call) == LAM_OK, "%s", error.message)

typedef struct view {
    const char *name;
    mesh m;
    form_factors f;
    uint32_t *order;
} view;

enum { CORNELL, CITY, TWO_SIDED, BLACK_FLOOR, SCENES };

static inline view make_view(int which) {
    lam_error error;
    view v = {.name = (const char *[]){"cornell, coloured", "city", "city, two-sided",
                                       "rooms, black floors"}[which]};
    generate_options how = {
        .kind = "city", .variant = 1, .terrain = "flat", .elements = 500, .reflectance = -1, .seed = 1};
    if (which == CORNELL || which == BLACK_FLOOR) how.kind = "cornell";
    view_ok(scene_generated(&how, &v.m, &error));
    if (which == TWO_SIDED) view_ok(mesh_make_two_sided(&v.m, &error));
    if (which == BLACK_FLOOR)
        for (size_t i = 0; i < v.m.n * v.m.n_channels; i++)
            if (v.m.normal[i % v.m.n][2] > .5f) v.m.reflectance[i] = 0;
    v.order = test_allocate(v.m.n, sizeof *v.order);
    view_ok(mesh_z_order(&v.m, v.order, &error));
    const form_factor_options options = {.recipe = {.method = RECIPE_RAYS, .rays = 256, .seed = 3}};
    view_ok(form_factors_make(&v.m, v.order, &options, &v.f, &error));
    return v;
}

static inline void view_free(view *v) {
    form_factors_free(&v->f);
    mesh_free(&v->m);
    free(v->order);
}

#undef view_ok

#endif
