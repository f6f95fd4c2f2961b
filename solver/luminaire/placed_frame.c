/* Finds the frame of a placed luminaire, and the colour of its light. The colour of a black body follows the
 * cubics of Kim et al. (Design of advanced color temperature control system for HDTV applications, 2002): x
 * is one of 1000 / T, and y is one of x. */
#include "solver/luminaire/placed_parts.h"

#include "solver/base/photometry.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* The sine of the angle between two directions below which they count as one. */
static const double parallel = 1e-6;

/* The part of a unit vector across another, of length 1; false where there is none. */
static bool across(const double of[3], const double along[3], double out[3]) {
    const double part = dot3(of, along);
    for (int d = 0; d < 3; d++) out[d] = of[d] - part * along[d];
    if (!(dot3(out, out) > parallel * parallel)) return false;
    list_normalize(out);
    /* Once more, as much of the first difference may be rounding. */
    const double rest = dot3(out, along);
    for (int d = 0; d < 3; d++) out[d] -= rest * along[d];
    return list_normalize(out);
}

void placed_hang(char up, placed_luminaire *l) {
    const double zero[3] = {0, 0, 0};
    memcpy(l->x, zero, sizeof zero);
    memcpy(l->z, zero, sizeof zero);
    l->x[up == 'x' ? 1 : 0] = 1;
    l->z[up == 'x' ? 0 : up == 'y' ? 1 : 2] = 1;
    cross3(l->z, l->x, l->y);
}

bool placed_aim(const double aim[3], const double *c0, double degrees, char up, placed_luminaire *l) {
    double down[3], wanted[3], x[3], y[3];
    placed_luminaire hung;
    placed_hang(up, &hung);
    memcpy(down, aim, sizeof down);
    memcpy(wanted, c0 != NULL ? c0 : hung.x, sizeof wanted);
    if (!list_normalize(down) || !list_normalize(wanted)) return false;
    if (!across(wanted, down, x)) {
        const double side = dot3(down, hung.x) > 0 ? 1 : -1;
        for (int d = 0; d < 3; d++) wanted[d] = side * hung.z[d];
        if (c0 != NULL || !across(wanted, down, x)) return false;
    }
    for (int d = 0; d < 3; d++) l->z[d] = -down[d];
    cross3(l->z, x, y);
    const double angle = remainder(degrees, 360) * (M_PI / 180), c = cos(angle), s = sin(angle);
    for (int d = 0; d < 3; d++) {
        l->x[d] = c * x[d] + s * y[d];
        l->y[d] = c * y[d] - s * x[d];
    }
    return true;
}

/* v cos a + (k x v) sin a + k (k.v) (1 - cos a), of a unit vector k (Rodrigues). */
static void turned(const double k[3], double c, double s, const double v[3], double out[3]) {
    double side[3];
    cross3(k, v, side);
    const double along = dot3(k, v) * (1 - c);
    for (int d = 0; d < 3; d++) out[d] = c * v[d] + s * side[d] + along * k[d];
}

void placed_turn(const double axis[3], double degrees, char up, placed_luminaire *l) {
    placed_luminaire hung;
    const double angle = remainder(degrees, 360) * (M_PI / 180), c = cos(angle), s = sin(angle);
    double k[3];
    memcpy(k, axis, sizeof k);
    list_normalize(k);
    placed_hang(up, &hung);
    turned(k, c, s, hung.x, l->x);
    turned(k, c, s, hung.y, l->y);
    turned(k, c, s, hung.z, l->z);
}

/* a + u (b + u (c + u d)) */
static double cubic(double u, const double k[4]) {
    return k[0] + u * (k[1] + u * (k[2] + u * k[3]));
}

void placed_planck(double kelvin, double colour[3]) {
    static const double x_warm[4] = {.179910, .8776956, -.2343589, -.2661239},
                        x_cold[4] = {.240390, .2226347, 2.1070379, -3.0258469},
                        y_warmest[4] = {-.20219683, 2.18555832, -1.34811020, -1.1063814},
                        y_warm[4] = {-.16748867, 2.09137015, -1.37418593, -.9549476},
                        y_cold[4] = {-.37001483, 3.75112997, -5.87338670, 3.0817580};
    /* From X, Y, Z to linear Rec. 709 with a white of D65. */
    static const double of_xyz[3][3] = {{3.2404542, -1.5371385, -.4985314},
                                        {-.9692660, 1.8760108, .0415560},
                                        {.0556434, -.2040259, 1.0572252}};
    const double x = cubic(1000 / kelvin, kelvin <= 4000 ? x_warm : x_cold);
    const double y = cubic(x, kelvin <= 2222 ? y_warmest : kelvin <= 4000 ? y_warm : y_cold);
    const double xyz[3] = {x / y, 1, (1 - x - y) / y};
    for (int c = 0; c < 3; c++) colour[c] = fmax(0, dot3(of_xyz[c], xyz));
    const double luminance = luminance_of(colour[0], colour[1], colour[2]);
    for (int c = 0; c < 3; c++) colour[c] /= luminance;
}
