#include "solver/formfactor/pairs/recipe_pairs.h"

#include "solver/formfactor/pairs/pairs.h"

#include <math.h>

/* Segments for all pairs that are partly hidden (of near ones as many as rays): an element's share is as many
 * as finer plain rays would be, the more the finer the accuracy by the law of their error, and a small scene
 * has enough to keep it. */
static double segments_most(size_t n, double accuracy) {
    const double an_element = 32768, enough = 64e6, normal = 7e-5;
    return fmax(an_element * (double)n, enough) * pow(normal / accuracy, 4. / 3);
}

/* Few elements need few segments to be as accurate as asked; half a second more makes their factors, which
 * are large, nearly ten times better. */
static const double segments_least = 8e6;

lam_status recipe_pairs_find(const mesh *m, const visibility *v, const form_factor_options *options,
                             double threshold, form_factors *f, csr *G, lam_error *error) {
    const recipe *r = &options->recipe;
    const bool near = threshold > 0;
    const pairs_options how = {.tolerance = recipe_tolerance(r),
                               .accuracy = recipe_accuracy(r),
                               .segments = VISIBILITY_PACKET,
                               .segments_least = near ? 0 : segments_least,
                               .segments_most =
                                   near ? (double)m->n * (double)r->rays : segments_most(m->n, r->accuracy),
                               .threshold = threshold,
                               .keep_hidden = near,
                               .seed = r->seed,
                               .progress = options->progress,
                               .stage = options->stage,
                               .scratch = options->scratch,
                               .scratch_name = options->scratch_name,
                               .recipe = r};
    return pairs_exchange(m, v, &how, G, &f->pairs, &f->rows_kept, error);
}
