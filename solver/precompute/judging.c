#include "solver/precompute/judging.h"

#include "solver/formfactor/pairs/first_light.h"

lam_status judging_run(const judging *j, const lam_operator *op, error_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors half[2] = {{.row_sums = NULL}, {.row_sums = NULL}}, mean = {.row_sums = NULL};
    first_light *first = NULL;
    for (int h = 0; h < 2; h++) {
        const form_factor_options how = {.recipe = j->halves[h],
                                         .progress = j->progress,
                                         .stage = j->stages[h],
                                         .scratch = j->scratch,
                                         .scratch_name = j->scratch_names[h],
                                         .large = j->large};
        TRY(form_factors_make(j->m, j->order, &how, &half[h], error));
        if (j->sampled != NULL) j->sampled(j->context, &half[h]);
    }
    TRY(form_factors_mean(&half[0], &half[1], &mean, error));
    /* The direct illumination of one element by rays is mostly noise. */
    if (recipe_noise(&j->f->recipe) > 0) TRY(first_light_create(j->m, j->first_light_seed, &first, error));
    const judge_input input = {
        .problem = j->problem,
        .row_sums = j->f->row_sums,
        .emission = j->m->emission,
        .own = factor_product_of_rows(j->problem->F),
        .independent = factor_product_of_rows(&mean.F),
        .halves = {factor_product_of_rows(&half[0].F), factor_product_of_rows(&half[1].F)},
        .first_light = first != NULL ? first_light_for_judge : NULL,
        .first_light_context = first,
        .probes = j->probes,
        .seed = j->probes_seed,
        .progress = j->progress};
    TRY(judge_operator(op, &input, out, error));
done:
    first_light_destroy(first);
    form_factors_free(&half[0]);
    form_factors_free(&half[1]);
    form_factors_free(&mean);
    return status;
}
