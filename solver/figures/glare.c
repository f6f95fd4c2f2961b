#include "solver/figures/glare.h"

#include "solver/base/vector3.h"

#include <math.h>

static const double degrees_of_radian = 180 / M_PI;

/* Limits of CIE 117: solid angles, sr, and the index of a source at the rim of the field of view. */
static const double smallest = 3e-4, largest = .1, rim = 16;

/* Iwata and Tokura: R grows no more beyond this. */
static const double farthest = 3;

double glare_position(const double view[3], const double up[3], const double towards[3]) {
    const double along = dot3(towards, view), tilt = dot3(up, view);
    double upright[3], across[3];
    for (int d = 0; d < 3; d++) upright[d] = up[d] - tilt * view[d];
    const double length = sqrt(dot3(upright, upright));
    if (!(along > 1e-9) || !(length > 1e-6)) return 0;
    for (int d = 0; d < 3; d++) across[d] = towards[d] - along * view[d];
    const double off = sqrt(dot3(across, across)), height = dot3(towards, upright) / length;
    if (height < 0) {
        const double R = fmin(off / along, farthest);
        return 1 + (R < .6 ? .8 : 1.2) * R;
    }
    const double s = atan2(off, along) * degrees_of_radian,
                 t = off > 0 ? acos(fmin(1, height / off)) * degrees_of_radian : 0;
    return exp((35.2 - .31889 * t - 1.22 * exp(-2 * t / 9)) * 1e-3 * s +
               (21 + .26667 * t - .002963 * t * t) * 1e-5 * s * s);
}

double glare_solid_angle(const glare_source *s) {
    return s->distance > 0 ? s->area * s->seen / (s->distance * s->distance) : 0;
}

glare_verdict glare_judge(const glare_source *s) {
    if (!(s->intensity > 0)) return GLARE_NO_LIGHT;
    if (!(s->position > 0 && s->position < rim)) return GLARE_OUTSIDE;
    if (!(s->seen > 0)) return GLARE_HIDDEN;
    if (!(s->area > 0)) return GLARE_NO_OPENING;
    const double angle = glare_solid_angle(s);
    return angle < smallest ? GLARE_SMALL : angle > largest ? GLARE_LARGE : GLARE_COUNTS;
}

bool glare_forbids(glare_verdict verdict) {
    return verdict == GLARE_NO_OPENING || verdict == GLARE_LARGE;
}

double glare_weight(const glare_source *s, double dimmer) {
    const double I = s->intensity * dimmer, r = s->distance, p = s->position;
    return I * I * s->seen / (s->area * r * r * p * p);
}

double glare_rating(double sum, double background) {
    return 8 * log10(.25 / background * sum);
}

double glare_simplified(double illuminance) {
    return 6.22e-5 * illuminance + .184;
}
