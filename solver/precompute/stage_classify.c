/* lambert classify: few rays per element, and all methods weighed by them. */
#include "solver/precompute/precompute_state.h"

#include <math.h>

/* Rays of all elements together, and of one: more rays change a choice rarely. */
static const double rays_of_all = 0x1p28, rays_least = 256, rays_most = 4096;

/* As many rays as their number allows: a power of two. */
static size_t rays_for(size_t n) {
    const double each = fmin(fmax(rays_of_all / (double)n, rays_least), rays_most);
    return (size_t)exp2(floor(log2(each)));
}

lam_status precompute_classify(const precompute_options *options, terminal *t, decision *out, size_t *n,
                               size_t *rays_used, lam_error *error) {
    lam_status status = LAM_OK;
    precompute_options o = *options;
    precompute_state state = state_begin(&o, t);
    build_problem problem;
    state.holds = true;
    o.form_factors = FACTORS_RAYS;
    o.quality = QUALITY_DRAFT;
    TRY(o.from_store ? stage_load_store(&state, error) : stage_load_scene(&state, error));
    TRY(terminal_check(error));
    TRY(stage_prepare_mesh(&state, error));
    TRY(terminal_check(error));
    *rays_used = 0;
    if (!o.from_store) {
        if (o.rays == OPTION_AUTO)
            state.recipe = (recipe){.source = &source_rays, .rays = rays_for(state.m.n), .seed = o.seed};
        TRY(stage_form_factors(&state, error));
        *rays_used = state.recipe.rays;
    }
    const build_options how = state_build_options(&state);
    TRY(state_problem(&state, METHOD_GEOMETRY | METHOD_SURFACES, &problem, error));
    TRY(choose_method(&problem, &how, true, out, error));
    *n = state.m.n;
    out->problem = NULL;
    out->options = NULL;
    const double noise = recipe_noise(&state.f.recipe);
    if (noise > o.build.epsilon)
        terminal_warn(t, "the rank at --epsilon %g counts the noise %.2g of %zu rays: give more --rays",
                      o.build.epsilon, noise, state.f.recipe.rays);
done:
    state_free(&state);
    return status;
}
