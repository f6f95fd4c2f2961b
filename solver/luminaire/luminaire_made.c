#include "solver/luminaire/luminaire_made.h"

#include "solver/base/scene/punctual_lights.h"
#include "solver/luminaire/luminaire_source.h"

#include <assert.h>
#include <math.h>

/* The error of a linear interpolation, in parts of the peak. */
static const double most_error = 1e-4;

/* A rotational table of n_angles, all of them 0, of a luminaire that has one set of lamps, of which nothing
 * is known. */
static lam_status make_table(size_t n_angles, luminaire *out, lam_error *error) {
    lam_status status = LAM_OK;
    luminaire l = {.format = LUMINAIRE_FORMULA,
                   .type = LUMINAIRE_C,
                   .absolute = true,
                   .symmetry = SYMMETRY_ROTATIONAL,
                   .measured_tilt = NAN,
                   .output_ratio = NAN,
                   .opening = {.shape = OPENING_POINT},
                   .n_sets = 1};
    TRY(luminaire_allocate_table(&l, "a light", 1, n_angles, error));
    l.sets = memory_allocate(1, sizeof *l.sets, "a light", error);
    if (l.sets == NULL) TRY(LAM_ERR_MEMORY);
    l.sets->number = 1;
    l.sets->lumens = l.sets->watts = NAN;
    *out = l;
    l = (luminaire){.n_planes = 0};
done:
    luminaire_free(&l);
    return status;
}

lam_status luminaire_of_point(double intensity, luminaire *out, lam_error *error) {
    lam_status status = LAM_OK;
    assert(intensity >= 0 && intensity <= LUMINAIRE_CANDELA_MOST);
    TRY(make_table(2, out, error));
    out->angles[1] = 180;
    out->candela[0] = out->candela[1] = intensity;
done:
    return status;
}

/* cos a - cos b, also of angles whose cosines are the same to rounding. */
static double difference(double a, double b) {
    return 2 * sin((a + b) / 2) * sin((b - a) / 2);
}

/* The angle from which on the light grows weaker. It is not inner where the edge is as narrow as it may be,
 * and 0 where that is wider than the cone: cos full = min(1, cos outer + max(.001, cos inner - cos outer)).
 */
static double end_of_full_light(double inner, double outer) {
    if (difference(inner, outer) >= PUNCTUAL_EDGE) return inner;
    return acos(fmin(1, cos(outer) + PUNCTUAL_EDGE));
}

/* The intervals from full to outer. With D = cos full - cos outer and s = (cos t - cos outer) / D the light
 * is s^2, in parts of its peak, of which (s^2)'' = 2 (sin^2 t / D^2 - s cos t / D),   |(s^2)''| <= 2
 * max(sin^2 outer / D^2, 1 / D). An interval of length h is off by at most h^2 / 8 of it: h = 2 sqrt(error /
 * max(...)). D is at least (outer - full) sin outer / 2, by the concave sine, and .4 (outer - full)^2: there
 * are no more than 100. */
static size_t intervals_of(double full, double outer) {
    const double D = difference(full, outer), slope = sin(outer) / D;
    const double h = 2 * sqrt(most_error / fmax(slope * slope, 1 / D));
    return (size_t)ceil(fmax(1, (outer - full) / h));
}

lam_status luminaire_of_spot(double intensity, double inner, double outer, luminaire *out, lam_error *error) {
    lam_status status = LAM_OK;
    assert(intensity >= 0 && intensity <= LUMINAIRE_CANDELA_MOST);
    assert(inner >= 0 && inner <= outer);
    assert(outer >= PUNCTUAL_OUTER_LEAST && outer <= PUNCTUAL_OUTER_MOST);
    const double full = end_of_full_light(inner, outer), D = fmax(PUNCTUAL_EDGE, difference(inner, outer));
    const size_t n = intervals_of(full, outer), first = full > 0 ? 1 : 0;
    TRY(make_table(first + n + 2, out, error));
    for (size_t k = 0; k <= n; k++) {
        const double gamma = full + (outer - full) * (double)k / (double)n;
        const double s = fmin(1, fmax(0, difference(gamma, outer) / D));
        out->angles[first + k] = gamma * (180 / M_PI);
        out->candela[first + k] = intensity * s * s;
    }
    out->candela[0] = out->candela[first]; /* of 0 degrees */
    out->angles[first + n] = outer * (180 / M_PI);
    out->candela[first + n] = 0;
    out->angles[first + n + 1] = 180;
done:
    return status;
}
