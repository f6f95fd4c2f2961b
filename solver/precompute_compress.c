/* The form factors of a precompute compressed, where that takes less. */
#include "solver/element_geometry.h"
#include "solver/precompute_work.h"

#include <omp.h>
#include <stdlib.h>

/* As form_factors_save would write them. */
static double bytes_of_rows(const work *w) {
    const double entries = (double)w->f.F.indptr[w->m.n] * (sizeof(uint32_t) + sizeof(float));
    return w->m.n > FORM_FACTORS_ROWS_MOST ? entries / 2 : entries;
}

lam_status work_compress(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &w->m;
    const double threshold = compress_threshold(w->options->epsilon, recipe_noise(&w->f.recipe));
    build_problem problem = {.n = 0};
    element_geometry geometry = {0};
    char compressed[32], plain[32];
    bool *shines = memory_allocate(m->n_groups, sizeof *shines, "form factors", error);
    if (shines == NULL) TRY(LAM_ERR_MEMORY);
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
                                  .threshold = threshold,
                                  .n_threads = (size_t)omp_get_max_threads(),
                                  .progress = &w->progress};
    TRY(compress_form_factors(&input, &w->compressed, error));
    const double kept = (double)compressed_bytes(&w->compressed), rows = bytes_of_rows(w);
    forecast_format_bytes(kept, compressed);
    forecast_format_bytes(rows, plain);
    if (kept >= rows) {
        compressed_free(&w->compressed);
        terminal_warn(w->t, "form factors compressed take %s, as they are %s: they are kept so", compressed,
                      plain);
    } else {
        terminal_log(
            w->t,
            "form factors compressed: %.3g numbers an element from %.2g on, %s of %s; first light of %zu "
            "groups",
            (double)w->compressed.S.indptr[m->n] / (double)m->n, threshold, compressed, plain,
            w->compressed.n_lit);
    }
done:
    element_geometry_free(&geometry);
    free(shines);
    return status;
}
