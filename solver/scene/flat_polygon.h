/* Convex polygons in a plane: their areas, and those of what two of them have in common. */
#ifndef LAMBERT_SCENE_FLAT_POLYGON_H
#define LAMBERT_SCENE_FLAT_POLYGON_H

#include <stddef.h>

/* Corners that two convex quads have in common at most. */
enum { FLAT_CORNERS_MOST = 8 };

/* Counter-clockwise. */
typedef struct flat_polygon {
    size_t n;
    double corner[FLAT_CORNERS_MOST][2];
} flat_polygon;

double flat_polygon_area(const flat_polygon *p);

/* The area that two of at most four corners have in common (Sutherland and Hodgman 1974). */
double flat_polygons_overlap(const flat_polygon *a, const flat_polygon *b);

#endif
