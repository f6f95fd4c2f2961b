#include "server/scene/direct_light.h"

#include "solver/operator/luminaire_light.h"
#include "solver/operator/sky_light.h"

#include <string.h>

size_t scene_tiles(const scene *s) {
    return s->sky != NULL ? lam_sky_tiles(s->sky) : 0;
}

size_t scene_luminaires(const scene *s) {
    return s->luminaires != NULL ? lam_luminaires_count(s->luminaires) : 0;
}

void direct_light_find(const scene *s, const radiosity_request *request, size_t first, size_t count,
                       float *H0) {
    const size_t before = first * s->n_channels, rows = count * s->n_channels;
    if (request->sky.values != NULL)
        lam_sky_irradiance(s->sky, rows, request->sky.values + before * lam_sky_tiles(s->sky), H0);
    else
        memset(H0, 0, rows * s->n * sizeof *H0);
    if (request->luminaires.values != NULL)
        lam_luminaires_irradiance(s->luminaires, count,
                                  request->luminaires.values + before * scene_luminaires(s), H0);
}

/* The values of the rows of a request from the first on, of this width. */
static const double *widen(const side_rows *side, size_t first, size_t rows, size_t width, double *to) {
    for (size_t k = 0; k < rows * width; k++) to[k] = (double)side->values[first * width + k];
    return to;
}

void direct_light_find_double(const scene *s, const radiosity_request *request, size_t first, size_t count,
                              double *work, double *H0) {
    const size_t before = first * s->n_channels, rows = count * s->n_channels;
    const size_t m = scene_tiles(s), k = scene_luminaires(s);
    if (request->sky.values != NULL)
        sky_irradiance_double(s->sky, rows, widen(&request->sky, before, rows, m, work), H0);
    else
        memset(H0, 0, rows * s->n * sizeof *H0);
    if (request->luminaires.values != NULL)
        luminaires_irradiance_double(s->luminaires, count, widen(&request->luminaires, before, rows, k, work),
                                     H0);
}

size_t direct_light_work(const scene *s, const radiosity_request *request) {
    const size_t m = request->sky.values != NULL ? scene_tiles(s) : 0,
                 k = request->luminaires.values != NULL ? scene_luminaires(s) : 0;
    return m > k ? m : k;
}
