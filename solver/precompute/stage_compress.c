/* The form factors of a precompute compressed, where that takes less. */
#include "solver/precompute/precompute_state.h"

#include <omp.h>
#include <stdlib.h>

/* Bytes of the rows as form_factors_save would write them. */
static double bytes_of_rows(const precompute_state *state) {
    const double entries = (double)state->f.F.indptr[state->m.n] * (sizeof(uint32_t) + sizeof(float));
    return state->m.n > FORM_FACTORS_ROWS_MOST ? entries / 2 : entries;
}

/* Largest share of the entries of rows that compressed form factors may have: beside them they store bounds
 * and first light. */
static const double worth_it = .9;

lam_status stage_compress(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &state->m;
    const double rows = bytes_of_rows(state);
    build_problem problem;
    char compressed[32], plain[32];
    bool *shines = memory_allocate(m->n_groups, sizeof *shines, "form factors", error);
    if (shines == NULL) TRY(LAM_ERR_MEMORY);
    forecast_format_bytes(rows, plain);
    /* The noise of a number is far above any threshold that is of use. */
    if (recipe_noise(&state->f.recipe) > 0) {
        terminal_warn(state->t,
                      "form factors by rays are noise where they are small, and take less as they are: %s",
                      plain);
        goto done;
    }
    for (size_t k = 0; k < m->n * m->n_channels; k++)
        if (m->emission[k] > 0) shines[m->group[k % m->n]] = true;
    TRY(state_problem(state, METHOD_GEOMETRY, &problem, error));
    const compress_input input = {.F = &state->f.F,
                                  .area = m->area,
                                  .centre = problem.centre,
                                  .normal = problem.normal,
                                  .group = m->group,
                                  .n_groups = m->n_groups,
                                  .shines = shines,
                                  .threshold = compress_threshold(state->options->build.epsilon),
                                  .most = (size_t)(worth_it * rows / (sizeof(uint32_t) + sizeof(float))) + 1,
                                  .n_threads = (size_t)omp_get_max_threads(),
                                  .progress = &state->progress};
    TRY(compress_form_factors(&input, &state->compressed, error));
    if (state->compressed.n == 0) {
        terminal_warn(state->t, "form factors take less as they are, %s, than compressed for --epsilon %g",
                      plain, state->options->build.epsilon);
        goto done;
    }
    forecast_format_bytes((double)compressed_bytes(&state->compressed), compressed);
    terminal_log(
        state->t,
        "form factors compressed: %.3g coefficients per element, %s of %s; first light of %zu groups",
        (double)state->compressed.S.indptr[m->n] / (double)m->n, compressed, plain, state->compressed.n_lit);
done:
    free(shines);
    return status;
}
