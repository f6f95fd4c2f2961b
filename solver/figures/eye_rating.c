#include "solver/figures/eye_rating.h"

#include "solver/base/photometry.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Light beside that of luminaires is none below this part of it: values are in single precision. */
static const double no_light = 1e-5;

void eye_dimmers(size_t n_channels, size_t n_luminaires, const float *D, const double *colours,
                 double *dimmer) {
    for (size_t k = 0; k < n_luminaires; k++) {
        double by[3] = {0};
        for (size_t c = 0; D != NULL && c < n_channels && c < 3; c++)
            by[c] = (double)D[c * n_luminaires + k] * colours[c * n_luminaires + k];
        dimmer[k] = n_channels == 3 ? luminance_of(by[0], by[1], by[2]) : by[0];
    }
}

glare_source eye_source(const eye_view *v, size_t luminaire) {
    const float *x = v->seen + luminaire * v->apart;
    return (glare_source){.intensity = (double)x[0],
                          .area = (double)x[1],
                          .distance = (double)x[2],
                          .position = (double)x[3],
                          .seen = (double)x[4]};
}

/* sum L^2 w / p^2 of all that are lit, and whether there is a rating at all. */
static double sum_glare(const eye_view *v, eye_rating *out) {
    double sum = 0;
    for (size_t k = 0; k < v->n_luminaires; k++) {
        if (!(v->dimmer[k] > 0)) continue;
        const glare_source source = eye_source(v, k);
        const glare_verdict verdict = glare_judge(&source);
        if (glare_forbids(verdict)) {
            out->reason = UGR_FORBIDDEN;
            out->luminaire = k;
            return 0;
        }
        if (verdict == GLARE_COUNTS) sum += glare_weight(&source, v->dimmer[k]);
    }
    if (!(sum > 0)) out->reason = UGR_NONE_COUNTS;
    return sum;
}

static bool is_any_lit(const eye_view *v) {
    size_t k = 0;
    while (k < v->n_luminaires && !(v->dimmer[k] > 0)) k++;
    return k < v->n_luminaires;
}

eye_rating eye_rate(const eye_view *v, bool in_lux, double all, double direct) {
    eye_rating out = {
        .reason = in_lux ? UGR_NO_VALUE : UGR_NO_LUX, .ugr = (double)NAN, .background = (double)NAN};
    if (!in_lux || isnan(all)) return out;
    const double others = all - direct > no_light * all ? all - direct : 0;
    out.background = others / M_PI;
    out.reason = !is_any_lit(v) ? UGR_NO_LUMINAIRE : v->seen == NULL ? UGR_NOT_SEEN : UGR_RATED;
    if (out.reason != UGR_RATED) return out;
    const double sum = sum_glare(v, &out);
    if (out.reason == UGR_RATED && !(others > 0)) out.reason = UGR_NO_BACKGROUND;
    if (out.reason == UGR_RATED) out.ugr = glare_rating(sum, out.background);
    return out;
}

static int by_part(const void *a, const void *b) {
    const glare_part *first = a, *second = b;
    if (first->part != second->part) return first->part > second->part ? -1 : 1;
    return (first->luminaire > second->luminaire) - (first->luminaire < second->luminaire);
}

size_t eye_parts(const eye_view *v, glare_part *out) {
    double sum = 0;
    size_t n = 0;
    for (size_t k = 0; k < v->n_luminaires; k++) {
        if (!(v->dimmer[k] > 0)) continue;
        const glare_source source = eye_source(v, k);
        if (glare_judge(&source) != GLARE_COUNTS) continue;
        out[n] = (glare_part){k, glare_weight(&source, v->dimmer[k])};
        sum += out[n++].part;
    }
    for (size_t i = 0; i < n; i++) out[i].part /= sum;
    if (n > 0) qsort(out, n, sizeof *out, by_part);
    return n;
}

void eye_reason_text(const eye_view *v, const eye_rating *r, const char *name, char text[EYE_REASON_TEXT]) {
    static const char *const words[UGR_REASONS] = {
        [UGR_RATED] = "",
        [UGR_NO_LUX] = "the answer is not in lx",
        [UGR_NO_VALUE] = "the eye lies in a wall or in a luminaire",
        [UGR_NO_LUMINAIRE] = "no luminaire of the store is lit",
        [UGR_NOT_SEEN] = "the store does not hold how eyes see its luminaires: precompute its sensors again",
        [UGR_NONE_COUNTS] = "no luminaire that is lit is seen at 3e-4 sr or more",
        [UGR_NO_BACKGROUND] = "no light comes to the eye but from luminaires directly"};
    if (r->reason != UGR_FORBIDDEN) {
        snprintf(text, EYE_REASON_TEXT, "%s", words[r->reason]);
        return;
    }
    const glare_source source = eye_source(v, r->luminaire);
    if (glare_judge(&source) == GLARE_NO_OPENING)
        snprintf(text, EYE_REASON_TEXT, "luminaire %.64s has no luminous area", name);
    else
        snprintf(text, EYE_REASON_TEXT, "luminaire %.64s fills %.2g sr, must be at most 0.1 sr", name,
                 glare_solid_angle(&source));
}
