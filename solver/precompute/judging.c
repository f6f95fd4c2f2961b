#include "solver/precompute/judging.h"

#include "solver/formfactor/pairs/first_light.h"

/* Of two blocks of form factors with this ratio of tolerances the errors, which fall as the square root of
 * them, are as 1 to 1.7: if they are independent, half the distance of the two is the error of the finer one.
 */
static const double tolerance_ratio = 3;

/* Against blocks of a quarter of the tolerance, found with other segments. */
static lam_status judge_by_blocks(const judging *j, const lam_operator *op, error_report *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    form_factors about[2] = {{.row_sums = NULL}, {.row_sums = NULL}};
    block_factors half[2] = {{.n = 0}, {.n = 0}};
    for (int h = 0; h < 2; h++) {
        form_factor_options how = {.recipe = j->halves[h], .progress = j->progress, .stage = j->stages[h]};
        if (h == 1) how.recipe.accuracy *= tolerance_ratio;
        TRY(form_factors_make_blocks(j->m, j->order, j->problem->blocks->tree, true, &how, &about[h],
                                     &half[h], error));
        form_factors_free(&about[h]);
    }
    const judge_input input = {.problem = j->problem,
                               .row_sums = j->f->row_sums,
                               .emission = j->m->emission,
                               .own = block_factors_product(j->problem->blocks),
                               .independent = block_factors_product(&half[0]),
                               .halves = {block_factors_product(&half[0]), block_factors_product(&half[1])},
                               .probes = j->probes,
                               .seed = j->probes_seed,
                               .progress = j->progress};
    TRY(judge_operator(op, &input, out, error));
done:
    for (int h = 0; h < 2; h++) {
        form_factors_free(&about[h]);
        block_factors_free(&half[h]);
    }
    return status;
}

lam_status judging_run(const judging *j, const lam_operator *op, error_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors half[2] = {{.row_sums = NULL}, {.row_sums = NULL}}, mean = {.row_sums = NULL};
    first_light *first = NULL;
    if (j->problem->blocks != NULL) return judge_by_blocks(j, op, out, error);
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
