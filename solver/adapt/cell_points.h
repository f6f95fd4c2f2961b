/* Points of a cell and the light that was found there. The parts of a cell inherit its points, so that a cut
 * rests on more of them than were asked for. */
#ifndef LAMBERT_ADAPT_CELL_POINTS_H
#define LAMBERT_ADAPT_CELL_POINTS_H

#include "solver/adapt/gather.h"

/* Coordinates in the plane of a face, m; x runs along its longest edge. */
typedef struct face_plane {
    double origin[3], x[3], y[3];
} face_plane;

face_plane face_plane_of(const mesh *m, size_t face);
void face_plane_at(const face_plane *plane, const double place[3], double out[2]);

/* Above 0 where `at` is to the left of the way from one place of a plane to another. */
static inline float left_of(const float from[2], const float to[2], float x, float y) {
    return (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]);
}

/* n points of which `room` fit; the arrays are one block, which x owns. The weights of a look's points are
 * their shares of its area, times their number: points of several looks are one sample. */
typedef struct cell_points {
    size_t n, room, values;
    float *x, *y, *weight; /* [room] */
    float *H;              /* [values][GATHER_HALVES][room] */
} cell_points;

void cell_points_free(cell_points *p);

/* Bytes of a point. */
size_t cell_points_bytes(size_t values);

/* Makes room for `more` points beside those it has, of which the last `kept` stay at most. Errors:
 * LAM_ERR_MEMORY. */
lam_status cell_points_reserve(cell_points *p, size_t values, size_t kept, size_t more, lam_error *error);

/* Copies of the points to the left of a way and of the others, into two empty ones. Errors: LAM_ERR_MEMORY.
 */
lam_status cell_points_part(const cell_points *p, const float from[2], const float to[2], cell_points *left,
                            cell_points *right, lam_error *error);

#endif
