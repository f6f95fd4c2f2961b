/* Points of regular divisions of faces. The points of an edge have the same bits in both faces that share it.
 * Private to solver/scene. */
#ifndef LAMBERT_SCENE_FACE_GRID_H
#define LAMBERT_SCENE_FACE_GRID_H

#include <stddef.h>

/* The point k of m steps from a to b; going from b to a gives the same bits. out may be neither. */
void edge_point(const double a[3], const double b[3], size_t k, size_t m, double out[3]);

/* The point (i of na, j of nb) of the bilinear grid of a quad: i runs from corner 0 to 1, j from 0 to 3. */
void grid_point(const double quad[4][3], size_t i, size_t na, size_t j, size_t nb, double out[3]);

/* The point of a triangle's division into m^2: i steps towards corner 1 and j towards corner 2, i + j <= m.
 */
void triangle_point(const double triangle[3][3], size_t i, size_t j, size_t m, double out[3]);

double point_distance(const double a[3], const double b[3]);

#endif
