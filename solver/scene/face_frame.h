/* Faces laid into their own planes, and lines there. Private to solver/scene. */
#ifndef LAMBERT_SCENE_FACE_FRAME_H
#define LAMBERT_SCENE_FACE_FRAME_H

#include "solver/scene/mesh.h"

/* The axes of a face's plane, about its first corner. */
typedef struct face_frame {
    double origin[3], normal[3], u[3], w[3];
} face_frame;

face_frame face_frame_of(const mesh *m, size_t face);
void face_frame_flatten(const face_frame *f, const double point[3], double out[2]);

/* A line in a plane: direction . x = level; the distance of a point is positive on the left of it. */
typedef struct flat_line {
    double across[2], level; /* across: unit */
} flat_line;

flat_line flat_line_through(const double from[2], const double to[2]);

static inline double flat_line_distance(const flat_line *l, const double x[2]) {
    return l->across[0] * x[0] + l->across[1] * x[1] - l->level;
}

#endif
