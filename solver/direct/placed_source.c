#include "solver/direct/placed_source.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* Cells for a place of an element at most: a panel of 1.2 x .3 m needs 144 of them from .3 m on. */
enum { CELLS_MOST = 144 };

static const double degrees_of_radian = 180 / M_PI;

static int axis_of(char up) {
    return up == 'x' ? 0 : up == 'y' ? 1 : 2;
}

double placed_lamp_angle(const luminaire *l, const placed_luminaire *placed, char up) {
    const int k = axis_of(up);
    if (l->tilt.geometry == 1) return acos(fmin(1, fmax(-1, placed->z[k]))) * degrees_of_radian;
    const double *lamp = l->tilt.geometry == 2 ? placed->x : placed->y;
    return asin(fmin(1, fabs(lamp[k]))) * degrees_of_radian;
}

double placed_tilt_factor(const luminaire *l, const placed_luminaire *placed, char up) {
    const luminaire_tilt *t = &l->tilt;
    if (t->n == 0) return 1;
    const double angle = placed_lamp_angle(l, placed, up);
    size_t k = 0;
    if (!(angle > t->angles[0])) return t->factors[0];
    if (angle >= t->angles[t->n - 1]) return t->factors[t->n - 1];
    while (t->angles[k + 1] < angle) k++;
    const double share = (angle - t->angles[k]) / (t->angles[k + 1] - t->angles[k]);
    return (1 - share) * t->factors[k] + share * t->factors[k + 1];
}

/* The least angle in which the table may change by half its peak, by its steps. Steps along the planes are
 * shorter by the sine of gamma; of types A and B they count as they are. */
static double finest_angle(const luminaire *l, double peak) {
    double steepest = 0; /* of the peak, for a degree */
    for (size_t p = 0; p < l->n_planes; p++)
        for (size_t a = 0; a < l->n_angles; a++) {
            const double *I = &l->candela[p * l->n_angles + a];
            if (a + 1 < l->n_angles)
                steepest = fmax(steepest, fabs(I[1] - I[0]) / (l->angles[a + 1] - l->angles[a]));
            const double shrink = l->type == LUMINAIRE_C ? sin(l->angles[a] / degrees_of_radian) : 1;
            if (p + 1 < l->n_planes && shrink > .05)
                steepest = fmax(steepest,
                                fabs(I[l->n_angles] - I[0]) / ((l->planes[p + 1] - l->planes[p]) * shrink));
        }
    return steepest > 0 ? .5 * peak / steepest / degrees_of_radian : INFINITY;
}

/* True where no direction below the horizon of the luminaire, or above it, has any light. Between two angles
 * of the table both of them count. */
static bool is_dark(const luminaire *l, bool above) {
    if (l->type != LUMINAIRE_C) { /* the angle that is turned, whose tangent has the way down below */
        const size_t n = l->type == LUMINAIRE_B ? l->n_angles : l->n_planes;
        const double *turned = l->type == LUMINAIRE_B ? l->angles : l->planes;
        return above && turned[0] >= -90 && turned[n - 1] <= 90;
    }
    for (size_t a = 0; a < l->n_angles; a++) {
        const double before = l->angles[a > 0 ? a - 1 : 0],
                     after = l->angles[a + 1 < l->n_angles ? a + 1 : a];
        if (above ? !(after > 90) : !(before < 90)) continue;
        for (size_t p = 0; p < l->n_planes; p++)
            if (l->candela[p * l->n_angles + a] > 0) return false;
    }
    return true;
}

void placed_source_set(const placed_luminaires *list, const placed_luminaire *l, char up,
                       placed_source *out) {
    const placed_file *file = &list->files[l->file];
    double C, gamma;
    *out = (placed_source){.photometry = &file->photometry};
    memcpy(out->at, l->at, sizeof out->at);
    memcpy(out->frame[0], l->x, sizeof l->x);
    memcpy(out->frame[1], l->y, sizeof l->y);
    memcpy(out->frame[2], l->z, sizeof l->z);
    const double flux = isnan(l->flux) || !(file->lumens > 0) ? 1 : l->flux / file->lumens;
    out->factor = l->maintenance * flux * placed_tilt_factor(&file->photometry, l, up);
    const double peak = luminaire_peak(&file->photometry, &C, &gamma);
    out->peak = peak * out->factor;
    out->finest = finest_angle(&file->photometry, peak);
    for (int above = 0; above < 2; above++) out->dark[above] = is_dark(&file->photometry, above);
    opening_faces_set(&file->photometry.opening, l->is_point, out->finest, &out->opening);
}

void placed_source_turn(const placed_source *s, const double direction[3], double own[3]) {
    for (int k = 0; k < 3; k++) own[k] = dot3(s->frame[k], direction);
}

void placed_source_inwards(const placed_source *s, const double point[3], double own[3]) {
    double to[3];
    subtract3(point, s->at, to);
    placed_source_turn(s, to, own);
}

void placed_source_outwards(const placed_source *s, const double own[3], double point[3]) {
    for (int d = 0; d < 3; d++)
        point[d] = s->at[d] + own[0] * s->frame[0][d] + own[1] * s->frame[1][d] + own[2] * s->frame[2][d];
}

double placed_source_intensity(const placed_source *s, const double direction[3]) {
    const double across = sqrt(direction[0] * direction[0] + direction[1] * direction[1]);
    const bool turns = s->photometry->symmetry != SYMMETRY_ROTATIONAL && across > 0;
    const double C = turns ? atan2(direction[1], direction[0]) * degrees_of_radian : 0,
                 gamma = atan2(across, -direction[2]) * degrees_of_radian;
    return s->factor * luminaire_candela(s->photometry, C, gamma);
}

double placed_source_normal(const placed_source *s, const opening_cell *cell, const double x[3],
                            double towards[3]) {
    double direction[3];
    subtract3(cell->at, x, towards);
    const double square = dot3(towards, towards), length = sqrt(square);
    if (!(square > 1e-18)) return 0;
    for (int d = 0; d < 3; d++) {
        towards[d] /= length;
        direction[d] = -towards[d];
    }
    const double part = opening_part(&s->opening, cell, direction);
    return part > 0 ? part * placed_source_intensity(s, direction) / square : 0;
}

bool placed_source_is_dark(const placed_source *s, const double x[3]) {
    const double half = s->opening.size[2] / 2;
    return (s->dark[0] && x[2] <= -half) || (s->dark[1] && x[2] >= half);
}

double placed_source_irradiance(const placed_source *s, const double x[3], const double normal[3],
                                kept_cells *kept) {
    if (placed_source_is_dark(s, x)) return 0;
    const size_t n = opening_cells_keep(&s->opening, x, CELLS_MOST, kept);
    const opening_cell *cells = kept->cells;
    double sum = 0;
    for (size_t k = 0; k < n; k++) {
        double to[3], towards[3];
        subtract3(cells[k].at, x, to);
        if (!(dot3(to, normal) > 0)) continue; /* it costs no intensity */
        const double across = placed_source_normal(s, &cells[k], x, towards);
        sum += across * fmax(0, dot3(towards, normal)); /* I cos / d^2 */
    }
    return sum;
}
