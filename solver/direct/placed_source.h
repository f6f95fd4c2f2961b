/* A luminaire in a scene as a source of light: its intensity in the scene's directions, with all constant
 * factors but dim, and the irradiance of a point that sees all of it. Must not know what hides it. */
#ifndef LAMBERT_DIRECT_PLACED_SOURCE_H
#define LAMBERT_DIRECT_PLACED_SOURCE_H

#include "solver/direct/opening_cells.h"
#include "solver/luminaire/placed.h"

typedef struct placed_source {
    const luminaire *photometry;
    double at[3], frame[3][3]; /* x, y and z of the luminaire in the scene */
    double factor;             /* of candela: maintenance * flux / lumens of the file * TILT */
    double peak;               /* cd, with the factor */
    bool dark[2];              /* it sends nothing below, above the plane across its z */
    double finest;             /* radians: the angle in which the intensity may change by half its peak */
    opening_faces opening;
} placed_source;

/* up: 'x', 'y' or 'z', the axis of the scene that points up. The list must outlive it. */
void placed_source_set(const placed_luminaires *list, const placed_luminaire *l, char up, placed_source *out);

/* The factor of TILT, 1 where the file has none: linear between its angles, and that of the nearest angle
 * beyond them. Its angle is that of the lamp (luminaire_tilt). */
double placed_tilt_factor(const luminaire *l, const placed_luminaire *placed, char up);

/* The angle between a lamp and its place while the luminaire hangs, degrees: what TILT is given for. */
double placed_lamp_angle(const luminaire *l, const placed_luminaire *placed, char up);

/* A point or a direction in the frame of the luminaire, and back. */
void placed_source_inwards(const placed_source *s, const double point[3], double own[3]);
void placed_source_turn(const placed_source *s, const double direction[3], double own[3]);
void placed_source_outwards(const placed_source *s, const double own[3], double point[3]);

/* The intensity in a direction of the frame, a unit vector, cd at dim 1. */
double placed_source_intensity(const placed_source *s, const double direction[3]);

/* The irradiance of a point x across the way from a cell, I / d^2, lx; towards: the unit vector from x to the
 * cell. All in the frame; 0 where x lies on the cell. */
double placed_source_normal(const placed_source *s, const opening_cell *cell, const double x[3],
                            double towards[3]);

/* True for a point of the frame that no light of the opening goes to: on the dark side of all of it. */
bool placed_source_is_dark(const placed_source *s, const double x[3]);

/* The irradiance of a surface at x with a normal, both in the frame, that sees all of the opening. kept:
 * for points side by side. */
double placed_source_irradiance(const placed_source *s, const double x[3], const double normal[3],
                                kept_cells *kept);

#endif
