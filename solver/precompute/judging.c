#include "solver/precompute/judging.h"

#include "solver/formfactor/blocks/block_light.h"
#include "solver/formfactor/pairs/first_light.h"

/* Errors of blocks fall as the square root of their bound, or faster. Where the judge's bound is half that of
 * the blocks that are judged, an error e of its own makes sqrt(2) e of theirs; these are independent, so that
 * the distance of both solutions is sqrt(3) e, or more. */
static const double share_of_distance = .57735026918962576451;

/* Against blocks of half the tolerance, found with other segments, and the first light of few elements by a
 * walk of its own. The blocks that are judged tell the noise of the others. */
static lam_status judge_by_blocks(const judging *j, const lam_operator *op, error_report *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    form_factors about = {.row_sums = NULL};
    block_factors finer = {.n = 0};
    block_light *first = NULL;
    const plane_tree *tree = j->problem->blocks->tree;
    const form_factor_options how = {.recipe = j->halves[0], .progress = j->progress, .stage = j->stages[0]};
    TRY(form_factors_make_blocks(j->m, j->order, tree, j->f, &how, &about, &finer, error));
    TRY(block_light_create(j->m, tree, j->first_light_seed, &first, error));
    const judge_input input = {.problem = j->problem,
                               .row_sums = j->f->row_sums,
                               .emission = j->m->emission,
                               .own = block_factors_product(j->problem->blocks),
                               .independent = block_factors_product(&finer),
                               .other = block_factors_product(j->problem->blocks),
                               .relation = REFERENCE_COARSER,
                               .other_share = share_of_distance,
                               .first_light = block_light_for_judge,
                               .first_light_context = first,
                               .probes = j->probes,
                               .probes_least = j->probes_least,
                               .seed = j->probes_seed,
                               .progress = j->progress};
    TRY(judge_operator(op, &input, out, error));
done:
    block_light_destroy(first);
    form_factors_free(&about);
    block_factors_free(&finer);
    return status;
}

/* True where both samples share the pairs that are projected: rows in a scratch folder are of one sample. */
static bool shares_pairs(const judging *j) {
    return j->halves[0].method == RECIPE_PAIRS && j->scratch == NULL;
}

/* Two independent samples, or a reference and the same disturbed by its noise. */
static lam_status make_halves(const judging *j, form_factors half[2], lam_error *error) {
    lam_status status = LAM_OK;
    if (shares_pairs(j)) {
        const form_factor_options both = {.recipe = j->halves[0], .progress = j->progress};
        return form_factors_make_twice(j->m, j->order, &both, j->halves[1].seed, j->stages, half, error);
    }
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
done:
    return status;
}

lam_status judging_run(const judging *j, const lam_operator *op, error_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors half[2] = {{.row_sums = NULL}, {.row_sums = NULL}};
    first_light *first = NULL;
    if (j->problem->blocks != NULL) return judge_by_blocks(j, op, out, error);
    TRY(make_halves(j, half, error));
    /* The direct illumination of one element by rays is mostly noise. */
    if (recipe_noise(&j->f->recipe) > 0) TRY(first_light_create(j->m, j->first_light_seed, &first, error));
    const judge_input input = {.problem = j->problem,
                               .row_sums = j->f->row_sums,
                               .emission = j->m->emission,
                               .own = factor_product_of_rows(j->problem->F),
                               .independent = factor_product_of_rows(&half[0].F),
                               .other = factor_product_of_rows(&half[1].F),
                               .relation = shares_pairs(j) ? REFERENCE_DISTURBED : REFERENCE_TWIN,
                               .first_light = first != NULL ? first_light_for_judge : NULL,
                               .first_light_context = first,
                               .probes = j->probes,
                               .probes_least = j->probes_least,
                               .seed = j->probes_seed,
                               .progress = j->progress};
    TRY(judge_operator(op, &input, out, error));
done:
    first_light_destroy(first);
    form_factors_free(&half[0]);
    form_factors_free(&half[1]);
    return status;
}
