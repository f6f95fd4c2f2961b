/* The luminous opening of a luminaire as faces, and their cells as a receiver needs them: small beside their
 * distance from it. All is in the frame of the luminaire, whose origin is the middle of the opening.
 *
 * A flat opening sends I(direction) from each place, in equal parts of its area. Of a body each place sends
 * what a body of one radiance in each direction would: I(direction) (n . direction) dA / A(direction), with
 * the projected area A of all faces. So a sphere of uniform intensity gives pi L (R / d)^2 cos, as it must,
 * and a box sends its light downwards from its lower face. */
#ifndef LAMBERT_DIRECT_OPENING_CELLS_H
#define LAMBERT_DIRECT_OPENING_CELLS_H

#include "solver/luminaire/luminaire.h"

typedef enum opening_face_kind { FACE_PLANE, FACE_DISC, FACE_TUBE, FACE_BALL } opening_face_kind;

/* A map of the unit square. axis: half the sides of a plane, or the radii; of a tube the third is half its
 * length. The vector of its area points outwards. */
typedef struct opening_face {
    opening_face_kind kind;
    double middle[3], axis[3][3];
} opening_face;

enum { OPENING_FACES = 6 };

/* n_faces 0: a point. A flat one has one face, which sends light to both sides. */
typedef struct opening_faces {
    bool flat;
    size_t n_faces;
    opening_face faces[OPENING_FACES];
    double upto[OPENING_FACES]; /* the share of the area of faces 0 ... k, the last 1 */
    double size[3];             /* of the box about it, along x, y and z */
    double step;                /* the length of a pair of cells over their distance from a receiver */
} opening_faces;

/* A place of an opening. share: the part of its light, of a flat opening or where one cell stands for all; 0:
 * the light of a body, by area, its vector of area in m^2. */
typedef struct opening_cell {
    double at[3], area[3], share;
} opening_cell;

/* finest: radians in which the intensity may change by half its peak. */
void opening_faces_set(const luminaire_opening *opening, bool is_point, double finest, opening_faces *out);

/* Cells that one receiver has at most. */
enum { OPENING_CELLS = 1024 };

/* The cells for a receiver at x, at most `most` and OPENING_CELLS; their number. They lie in pairs, Gauss's
 * rule of two places, of a length of a third of the distance from x: they are nearer to the integral, by 2e-4
 * of it, than cells of a tenth in whose middle the light is taken, by 2e-3. A luminaire of a narrow beam has
 * shorter ones, and a receiver that is so near that there would be too many has longer ones. Of an extended
 * opening there are at least `least` cells, 1, 16 or 256. Cost: O(cells). */
size_t opening_cells(const opening_faces *o, const double x[3], size_t least, size_t most,
                     opening_cell *cells);

/* The cells of the last receiver. A flat opening that is far enough away to stay whole has cells that depend
 * on their number along both sides alone, so that receivers side by side mostly share them. */
typedef struct kept_cells {
    const opening_faces *of; /* NULL: there are none yet */
    size_t n, pairs[2];
    opening_cell cells[OPENING_CELLS];
} kept_cells;

/* opening_cells with a least of 1 into k->cells, bit for bit; k->of is NULL at first, and outlives k. */
size_t opening_cells_keep(const opening_faces *o, const double x[3], size_t most, kept_cells *k);

/* A place at (u, w) of the unit square, as a cell: places are as dense as the area, or nearly so. */
void opening_place(const opening_faces *o, double u, double w, opening_cell *out);

/* The part of the intensity that a cell sends into a direction, a unit vector. */
double opening_part(const opening_faces *o, const opening_cell *cell, const double direction[3]);

/* The area of the opening as a direction, a unit vector, sees it, m^2: of a flat one either side, of a body
 * the fronts of its faces. 0 of a point and of a line. */
double opening_projected(const opening_faces *o, const double direction[3]);

/* The distance of x from the box about the opening, 0 inside. */
double opening_distance(const opening_faces *o, const double x[3]);

#endif
