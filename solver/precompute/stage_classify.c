/* lambert classify: few rays per element, and all methods weighed by them. */
#include "solver/precompute/stages.h"

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
    precompute_parts p = parts_begin(&o, t);
    precompute_job *const job = &p.job;
    const mesh *const m = &p.scene.m;
    const form_factors *const f = &p.factors.f;
    build_problem problem;
    job->holds = true;
    o.form_factors = source_place(&source_rays);
    o.quality = QUALITY_DRAFT;
    TRY(o.from_store ? stage_load_store(job, &p.scene, &p.plan, &p.factors, error)
                     : stage_load_scene(job, &p.scene, error));
    TRY(terminal_check(error));
    TRY(stage_prepare_mesh(job, &p.scene, &p.plan, error));
    TRY(stage_choose_plan(job, &p.scene, &p.plan, error));
    TRY(terminal_check(error));
    *rays_used = 0;
    if (!o.from_store) {
        if (o.rays == OPTION_AUTO) p.plan.recipe.rays = rays_for(m->n);
        TRY(stage_factors(job, &p.scene, &p.plan, &p.factors, error));
        *rays_used = f->recipe.rays;
    }
    const build_options how = build_options_of(job, &p.scene, &p.factors, &p.course);
    TRY(problem_of(&p.scene, &p.factors, METHOD_GEOMETRY | METHOD_SURFACES, &problem, error));
    TRY(choose_method(&problem, &how, true, out, error));
    *n = m->n;
    out->problem = NULL;
    out->options = NULL;
    const double noise = recipe_noise(&f->recipe);
    if (noise > o.build.epsilon)
        terminal_warn(t, "the rank at --epsilon %g counts the noise %.2g of %zu rays: give more --rays",
                      o.build.epsilon, noise, f->recipe.rays);
done:
    parts_free(&p);
    return status;
}
