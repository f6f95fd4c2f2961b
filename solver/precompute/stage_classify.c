/* A scene's form factors, roughly, and what they say of the scene. */
#include "solver/precompute/element_geometry.h"
#include "solver/precompute/precompute_state.h"

#include <math.h>

/* Rays of all elements together, and of one: more say little that matters here. */
static const double rays_of_all = 0x1p28, rays_least = 256, rays_most = 4096;

/* As many rays as their number allows: a power of two. */
static size_t rays_for(size_t n) {
    const double each = fmin(fmax(rays_of_all / (double)n, rays_least), rays_most);
    return (size_t)exp2(floor(log2(each)));
}

lam_status precompute_classify(const precompute_options *options, terminal *t, scene_class *out,
                               size_t *rays_used, lam_error *error) {
    lam_status status = LAM_OK;
    precompute_options o = *options;
    work w = {.options = &o,
              .t = t,
              .progress = terminal_progress(t),
              .memory = work_memory(options),
              .holds = true};
    element_geometry geometry = {0};
    o.form_factors.quality = "draft";
    TRY(o.from_store ? work_load_store(&w, error) : work_load_scene(&w, error));
    TRY(terminal_check(error));
    TRY(work_prepare_mesh(&w, error));
    TRY(terminal_check(error));
    *rays_used = 0;
    if (!o.from_store) {
        if (o.form_factors.rays == CHOICE_AUTO) {
            o.form_factors.rays = rays_for(w.m.n);
            w.recipe = choice_recipe(&o.form_factors, false);
        }
        TRY(work_trace(&w, error));
        *rays_used = w.recipe.rays;
    }
    const emitter_source emitters = work_emitters(&w);
    build_problem problem = work_problem(&w, &emitters);
    TRY(element_geometry_add(&w.m, &geometry, &problem, error));
    const classify_options look = {.epsilon = o.epsilon,
                                   .threshold = o.threshold,
                                   .memory = work_left(&w),
                                   .seed = o.seed,
                                   .thorough = true,
                                   .progress = &w.progress};
    TRY(classify_scene(&problem, &look, out, error));
    const double noise = recipe_noise(&w.f.recipe);
    if (noise > o.epsilon)
        terminal_warn(t, "the rank at --epsilon %g counts the noise %.2g of %zu rays: give more --rays",
                      o.epsilon, noise, w.f.recipe.rays);
done:
    element_geometry_free(&geometry);
    work_free(&w);
    return status;
}
