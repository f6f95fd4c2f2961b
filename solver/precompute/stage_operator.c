/* The operator of a precompute and its measured errors. */
#include "solver/base/clock.h"
#include "solver/formfactor/pairs/first_light.h"
#include "solver/precompute/element_geometry.h"
#include "solver/precompute/precision_loss.h"
#include "solver/precompute/precompute_state.h"

#include <math.h>
#include <omp.h>
#include <string.h>

emitter_source work_emitters(const work *w) {
    return (emitter_source){.s = w->emitters.s,
                            .names = (const char *const *)w->emitters.names,
                            .E = w->emitters.light.E,
                            .n_tiles = w->f.sky.tiling.n_tiles,
                            .L = w->emitters.light.L,
                            .first_bounce = w->f.sky.first_bounce};
}

build_problem work_problem(const work *w, const emitter_source *emitters) {
    return (build_problem){.emitters = emitters->s > 0 ? emitters : NULL,
                           .n = w->m.n,
                           .n_channels = w->m.n_channels,
                           .area = w->m.area,
                           .reflectance = w->m.reflectance,
                           .F = &w->f.F,
                           .order = w->order,
                           .noise = recipe_noise(&w->f.recipe)};
}

size_t work_left(const work *w) {
    const csr *F = &w->f.F;
    const double rows = F->place != NULL || F->indptr == NULL ? 0 : (double)F->indptr[w->m.n] * 8;
    return (size_t)fmax(1, w->memory - rows - 400 * (double)w->m.n);
}

lam_status work_build(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    const emitter_source emitters = work_emitters(w);
    build_problem problem = work_problem(w, &emitters);
    element_geometry geometry = {0};
    budget_rule rule = BUDGET_SQUARES;
    sparse_correction correction = SPARSE_DELTA;
    if (!budget_rule_find(o->budget, &rule))
        FAIL(error, LAM_ERR_ARGUMENT, "--budget %.40s: unknown; use squares, sums or frobenius", o->budget);
    if (!sparse_correction_find(o->correction, &correction))
        FAIL(error, LAM_ERR_ARGUMENT, "--correction %.40s: unknown; use none, delta or discarded",
             o->correction);
    const build_options how = {.method = o->method,
                               .factorizer = o->factorizer,
                               .epsilon = o->epsilon,
                               .budget = {.rule = rule, .alpha = o->alpha},
                               .levels = o->levels == PRECOMPUTE_AUTO ? -1 : (int)o->levels,
                               .rank = o->rank,
                               .coherence = o->coherence,
                               .min_area = o->min_area,
                               .proximity = o->proximity,
                               .threshold = o->threshold,
                               .correction = correction,
                               .memory = work_left(w),
                               .keep_factors = o->keep_factors,
                               .low_rank = work_is_low_rank(o),
                               .seed = o->seed,
                               .progress = &w->progress};
    static const char *const geometric[] = {"2msc", "hierarchical", "auto"};
    for (size_t k = 0; k < sizeof geometric / sizeof *geometric; k++)
        if (strcmp(o->method, geometric[k]) == 0)
            TRY(element_geometry_add(&w->m, &geometry, &problem, error));
    if (w->streamed) {
        problem.F = NULL;
        problem.stream = &w->stream;
    }
    TRY(build_operator(&problem, &how, &w->op, &w->built, error));
    if (w->streamed) {
        form_factors_free(&w->f);
        w->f = ray_rows_take(w->rays);
        ray_rows_destroy(w->rays);
        w->rays = NULL;
    }
    const double noise = recipe_noise(&w->f.recipe);
    const bool patches = w->built.coherence >= 0;
    const bool hierarchical = w->built.uniform_error >= 0;
    const bool tried =
        !patches && !hierarchical && (w->built.factorizer != NULL || w->built.factorize_seconds > 0);
    if (hierarchical) {
        terminal_log(w->t, "%-14s%8.2f s", w->streamed ? "rays, wavelets" : "wavelets",
                     w->built.factorize_seconds);
        terminal_log(w->t, "residual of light all over %.2g, of light that is 1 everywhere %.2g",
                     w->built.probe_residual, w->built.uniform_error);
    }
    if (w->built.factorizer != NULL || patches) {
        terminal_log(w->t, "%-14s%8.2f s", "factorize", w->built.factorize_seconds);
        terminal_log(w->t, "rank %zu of %zu, real norm error %.3g in the %s", w->built.rank, w->m.n,
                     w->built.measured_norm_error,
                     w->built.norm == TRUNCATION_FROBENIUS ? "Frobenius norm" : "2-norm");
    }
    if (tried && o->rank == 0 && o->epsilon < noise)
        terminal_warn(
            w->t,
            "--epsilon %g is below the sampling noise %.2g of %zu rays: what is stored beyond it is "
            "noise; --rays %zu would fit",
            o->epsilon, noise, w->f.recipe.rays, recipe_auto_rays(o->epsilon, 1. / 4));
    terminal_log(w->t, "%-14s%8.2f s", "invert", w->built.invert_seconds);
    terminal_log(w->t, "%s", w->built.reason);
    lam_operator_set_threads(w->op, (size_t)omp_get_max_threads());
    TRY(narrow_replace(&w->op, o->precision, w->m.area, precompute_seed(o->form_factors.seed, 4), w->t,
                       error));
done:
    element_geometry_free(&geometry);
    return status;
}

/* --- errors ----------------------------------------------------------------------------------------------
 */

static void log_figures(terminal *t, const char *name, const error_group *g, bool has_total) {
    if (g->probes == 0) return;
    if (has_total)
        terminal_log(t, "%-8s total relative %.3g, indirect %.3g (noise of the reference %.2g)", name,
                     g->total_relative.mean, g->total_indirect.mean, g->reference_noise);
    terminal_log(t, "%-8s operator relative %.3g, indirect %.3g", name, g->operator_relative.mean,
                 g->operator_indirect.mean);
}

/* Rows that were not held, once more: what an operator leaves out of them is told apart from their noise. */
static lam_status trace_again(work *w, lam_error *error) {
    const form_factor_options how = {
        .recipe = w->recipe, .progress = &w->progress, .stage = "form factors once more for the judge"};
    form_factors again = {.row_sums = NULL};
    const lam_status status = form_factors_make(&w->m, w->order, &how, &again, error);
    w->f.F = again.F;
    again.F = (csr){.n = 0};
    form_factors_free(&again);
    return status;
}

/* Two more samples of F, their mean, and what they say of the operator. */
lam_status work_judge(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    static const char *const stages[2] = {"form factors for the judge, 1 of 2",
                                          "form factors for the judge, 2 of 2"};
    static const char *const files[2] = {"judge-1.rows", "judge-2.rows"};
    form_factors half[2] = {{.row_sums = NULL}, {.row_sums = NULL}}, mean = {.row_sums = NULL};
    const emitter_source emitters = work_emitters(w);
    const build_problem problem = work_problem(w, &emitters);
    uint64_t purpose = 0, seed;
    first_light *first = NULL;
    if (w->streamed) TRY(trace_again(w, error));
    for (int h = 0; h < 2; h++) {
        /* Independent of what was factorized: kept form factors may have any seed. */
        do seed = precompute_seed(w->options->form_factors.seed, ++purpose);
        while (seed == w->f.recipe.seed);
        const form_factor_options how = {.recipe = work_judge_recipe(w, seed),
                                         .progress = &w->progress,
                                         .stage = stages[h],
                                         .scratch = w->scratch,
                                         .scratch_name = files[h],
                                         .large = work_large_place(w)};
        TRY(form_factors_make(&w->m, w->order, &how, &half[h], error));
        work_log_kept(w, &half[h]);
    }
    TRY(form_factors_mean(&half[0], &half[1], &mean, error));
    /* Of rays the light of one element is mostly noise. */
    if (recipe_noise(&w->f.recipe) > 0)
        TRY(first_light_create(&w->m, precompute_seed(w->options->form_factors.seed, 5), &first, error));
    const judge_input input = {.problem = &problem,
                               .row_sums = w->f.row_sums,
                               .emission = w->m.emission,
                               .independent = &mean.F,
                               .halves = {&half[0].F, &half[1].F},
                               .first_light = first != NULL ? first_light_for_judge : NULL,
                               .first_light_context = first,
                               .probes = w->probes,
                               .seed = precompute_seed(w->options->form_factors.seed, 3),
                               .progress = &w->progress};
    TRY(judge_operator(w->op, &input, &w->errors, error));
    log_figures(w->t, "single", &w->errors.single, w->errors.has_total);
    log_figures(w->t, "lights", &w->errors.lights, w->errors.has_total);
    log_figures(w->t, "random", &w->errors.random, w->errors.has_total);
    if (w->options->precision == PANEL_F32)
        TRY(narrow_advise(w->op, &w->errors, w->m.area, precompute_seed(w->options->form_factors.seed, 4),
                          w->t, error));
done:
    first_light_destroy(first);
    form_factors_free(&half[0]);
    form_factors_free(&half[1]);
    form_factors_free(&mean);
    return status;
}
