#include "solver/base/receiver_weight.h"

#include "solver/base/harmonics.h"
#include "solver/base/vector3.h"

#include <math.h>

/* Harmonic 0 to 8 of a probe is the kind from this on. */
enum { KIND_HARMONIC = 4 };

unsigned receiver_weight_order(unsigned kind) {
    return kind >= KIND_HARMONIC ? (kind - KIND_HARMONIC) % HARMONICS : 0;
}

/* Y in the axes of a probe. */
static double harmonic(unsigned kind, const double axis[3], const double look[3], const double direction[3]) {
    double own[3], Y[HARMONICS];
    harmonics_turn(axis, look, direction, own);
    harmonics_at(own, Y);
    return Y[receiver_weight_order(kind)];
}

double receiver_weight_density(unsigned kind, const double axis[3], const double look[3],
                               const double direction[3]) {
    const double along = dot3(direction, axis), sine = sqrt(fmax(0, 1 - along * along));
    if (kind >= KIND_HARMONIC) return harmonic(kind, axis, look, direction) / M_PI;
    switch (kind) {
    case 0:
        return fmax(along, 0) / M_PI;
    case 1:
        return sine / (M_PI * M_PI);
    /* sin(e) cos(a) = direction . look */
    case 2:
        return fmax(sine + dot3(direction, look), 0) / (M_PI * M_PI);
    default:
        return 1 / (4 * M_PI);
    }
}

/* Over a half of all directions the integral of 1 is 2 pi, that of the direction -pi up, and those of second
 * order are 0. */
static double harmonic_below(const placed_receiver *r, const double up[3]) {
    const unsigned order = receiver_weight_order(r->kind);
    const double Y = harmonic(r->kind, r->axis, r->look, up);
    return order == 0 ? 2 * Y : order < 4 ? -Y : 0;
}

double receiver_weight_below(const placed_receiver *r, const double up[3]) {
    if (r->kind >= KIND_HARMONIC) return harmonic_below(r, up);
    switch (r->kind) {
    case 0:
        return (1 - dot3(r->axis, up)) / 2;
    /* sin(e) is the same in opposite directions, and the integral of direction over half of them is pi. */
    case 2:
        return .5 - dot3(r->look, up) / M_PI;
    default:
        return .5;
    }
}
