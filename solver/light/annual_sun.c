#include "solver/light/annual_sun.h"

#include <stdlib.h>
#include <string.h>

/* Counts the vectors in which H [n][all] is above the bound of a figure. */
static void count_above(const annual_figure *f, size_t n, size_t all, const float *H, size_t width,
                        const uint32_t *selected, uint32_t *count) {
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < width; i++)
            count[i] += (double)H[k * all + (selected != NULL ? selected[i] : i)] > f->low;
}

/* Hours, or where they are more than H. */
static void fill(const annual_figure *f, double hours, size_t width, size_t C, const uint32_t *count,
                 float *made) {
    for (size_t c = 0; c < C; c++)
        for (size_t i = 0; i < width; i++) {
            const double sunny = count[i] * hours;
            made[c * width + i] = f->most < 0 ? (float)sunny : sunny > f->most ? 1 : 0;
        }
}

lam_status annual_sun_find(const annual_options *o, const sunlight *sun, size_t n_vectors,
                           const size_t *vectors, size_t width, const uint32_t *selected, size_t C,
                           const progress *steps, float *made, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *count = NULL;
    float *H = NULL;
    size_t some[SUNLIGHT_MOST];
    if (sun == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--annual sun=X: of the sun itself, which --weather has with --sun exact (preset)");
    const size_t all = sun->sensors != NULL ? sun->sensors->n : sun->n;
    count = memory_allocate(o->n_figures, width * sizeof *count, "hours of sun", error);
    H = memory_allocate(SUNLIGHT_MOST, all * sizeof *H, "hours of sun", error);
    if (count == NULL || H == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < n_vectors;) {
        size_t n = 0;
        if (progress_cancelled(steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(steps, "hours of sun", (double)v / (double)n_vectors);
        for (; v < n_vectors && n < SUNLIGHT_MOST; v++)
            if (sunlight_shines(sun, vectors[v])) some[n++] = vectors[v];
        sunlight_direct(sun, n, some, H);
        for (size_t k = 0; k < o->n_figures; k++)
            if (o->figures[k].is_sun)
                count_above(&o->figures[k], n, all, H, width, selected, count + k * width);
    }
    for (size_t k = 0; k < o->n_figures; k++)
        if (o->figures[k].is_sun)
            fill(&o->figures[k], o->hours, width, C, count + k * width, made + k * C * width);
done:
    free(count);
    free(H);
    return status;
}
