#include "solver/light/light_units.h"

#include <float.h>
#include <math.h>

/* False where a number leaves the range of single precision; *any is set where one is not 0. */
static bool scale(size_t n_vectors, size_t width, double factor, float *x, bool *any) {
    bool good = true;
    for (size_t i = 0; x != NULL && i < n_vectors * width; i++) {
        *any = *any || x[i] != 0;
        x[i] = (float)((double)x[i] * factor);
        good = good && fabsf(x[i]) <= FLT_MAX;
    }
    return good;
}

/* The same of all light but the sky. */
static bool scale_lamps(emission *e, const emission_scene *scene, double factor, bool *any) {
    const size_t C = scene->m->n_channels, n = e->steady ? 1 : e->n_vectors;
    const bool good = scale(n, C * scene->m->n, factor, e->E, any);
    const bool dimmed = e->D == NULL || scale(n, C * lam_luminaires_count(e->luminaires), factor, e->D, any);
    return scale(n, C * scene->n_emitters, factor, e->W, any) && dimmed && good;
}

static bool scale_sky(emission *e, const emission_scene *scene, double factor, bool *any) {
    return scale(e->n_vectors, scene->m->n_channels * scene->n_tiles, factor, e->L, any);
}

void light_units_meet_sky(emission *e, const emission_scene *scene, light_kind sky) {
    bool any = false;
    if (sky == e->lights) return;
    const double factor = light_kind_factor(LIGHT_RADIOMETRIC, LIGHT_PHOTOMETRIC);
    /* Numbers beyond single precision are refused by the conversion that follows. */
    (void)(sky == LIGHT_PHOTOMETRIC ? scale_lamps(e, scene, factor, &any)
                                    : scale_sky(e, scene, factor, &any));
    e->lights = LIGHT_PHOTOMETRIC;
    e->converted = e->converted || any;
}

lam_status light_units_convert(emission *e, const emission_scene *scene, answer_unit unit, sunlight *sun,
                               sun_way *way, light_conversion *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = scene->m->n_channels;
    bool any = false;
    *out = (light_conversion){.lights = e->converted, .efficacies = e->efficacies};
    if (!light_conversion_make(e->lights, unit, C, out))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--unit-out: the store has %zu channels, whose luminance is not known; ask for W/m2", C);
    const double factor = out->factor;
    const bool lamps = scale_lamps(e, scene, factor, &any), skies = scale_sky(e, scene, factor, &any);
    if (!lamps || !skies)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--unit-out: the light passes the range of single precision (3.4e38) in %s",
             light_conversion_unit(out, false));
    for (size_t v = 0; sun != NULL && sun->suns != NULL && v < sun->n_vectors; v++) {
        sun->suns[v].horizontal *= factor;
        sun->suns[v].normal *= factor;
    }
    for (size_t k = 0; way != NULL && k < way->n; k++) way->off[k] *= factor;
done:
    return status;
}
