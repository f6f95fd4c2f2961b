/* Convex parts of faces, as straight cuts make them. Private to solver/scene. */
#ifndef LAMBERT_SCENE_FACE_PART_H
#define LAMBERT_SCENE_FACE_PART_H

#include "solver/scene/face_frame.h"
#include "solver/scene/mesh_cells.h"

#define FACE_PART_NONE UINT32_MAX

/* Corners of a part while it is cut; more of them are divided first. */
enum { FACE_PART_CORNERS = 12 };

typedef struct part_corner {
    double flat[2], at[3]; /* in the frame of the face; m */
} part_corner;

/* A convex part of a face. */
typedef struct face_part {
    uint32_t face, n, next; /* next: of the same face, or FACE_PART_NONE */
    part_corner corner[FACE_PART_CORNERS];
} face_part;

/* The whole of a face, in a frame. */
face_part face_part_of(const mesh *m, uint32_t face, const face_frame *frame);

double face_part_area(const face_part *p);

/* Pieces of 3 or 4 corners that a polygon makes. */
size_t face_part_pieces(size_t corners);

/* The distances of corners from a line; those within a tolerance are on it, so that no cut ends beside a
 * corner, but no two that follow each other. False where no corner is left on either side. distance
 * [FACE_PART_CORNERS]. */
bool face_part_sides(const face_part *p, const flat_line *line, double tolerance, double *distance);

/* The parts on the left and on the right; false where one has too many corners. */
bool face_part_divide(const face_part *p, const double *distance, face_part out[2]);

/* Divides a part of more than four corners along the diagonal that leaves the roundest parts, of those that
 * make no more pieces than it must have. */
void face_part_halve(const face_part *p, face_part out[2], size_t diagonal[2]);

/* Appends a part as face_part_pieces(p->n) cells of 3 or 4 corners. */
void face_part_cells(const face_part *p, mesh_cell *cells, size_t *n);

#endif
