/* The form factors of a precompute compressed, where that takes less. */
#include "solver/precompute/element_geometry.h"
#include "solver/precompute/precompute_state.h"

#include <omp.h>
#include <stdlib.h>

/* As form_factors_save would write them. */
static double bytes_of_rows(const work *w) {
    const double entries = (double)w->f.F.indptr[w->m.n] * (sizeof(uint32_t) + sizeof(float));
    return w->m.n > FORM_FACTORS_ROWS_MOST ? entries / 2 : entries;
}

/* The share of the numbers of rows that may be kept: beside them there are bounds and first light. */
static const double worth_it = .9;

lam_status work_compress(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &w->m;
    const double rows = bytes_of_rows(w);
    build_problem problem = {.n = 0};
    element_geometry geometry = {0};
    char compressed[32], plain[32];
    bool *shines = memory_allocate(m->n_groups, sizeof *shines, "form factors", error);
    if (shines == NULL) TRY(LAM_ERR_MEMORY);
    forecast_format_bytes(rows, plain);
    /* The noise of a number is far above any threshold that is of use. */
    if (recipe_noise(&w->f.recipe) > 0) {
        terminal_warn(w->t,
                      "form factors by rays are noise where they are small, and take less as they are: %s",
                      plain);
        goto done;
    }
    for (size_t k = 0; k < m->n * m->n_channels; k++)
        if (m->emission[k] > 0) shines[m->group[k % m->n]] = true;
    TRY(element_geometry_add(m, &geometry, &problem, error));
    const compress_input input = {.F = &w->f.F,
                                  .area = m->area,
                                  .centre = problem.centre,
                                  .normal = problem.normal,
                                  .group = m->group,
                                  .n_groups = m->n_groups,
                                  .shines = shines,
                                  .threshold = compress_threshold(w->options->epsilon),
                                  .most = (size_t)(worth_it * rows / (sizeof(uint32_t) + sizeof(float))) + 1,
                                  .n_threads = (size_t)omp_get_max_threads(),
                                  .progress = &w->progress};
    TRY(compress_form_factors(&input, &w->compressed, error));
    if (w->compressed.n == 0) {
        terminal_warn(w->t, "form factors take less as they are, %s, than compressed for --epsilon %g", plain,
                      w->options->epsilon);
        goto done;
    }
    forecast_format_bytes((double)compressed_bytes(&w->compressed), compressed);
    terminal_log(w->t,
                 "form factors compressed: %.3g numbers an element, %s of %s; first light of %zu groups",
                 (double)w->compressed.S.indptr[m->n] / (double)m->n, compressed, plain, w->compressed.n_lit);
done:
    element_geometry_free(&geometry);
    free(shines);
    return status;
}
