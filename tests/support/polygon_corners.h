/* Polygons that tests write down by their corners. */
#ifndef LAMBERT_TESTS_POLYGON_CORNERS_H
#define LAMBERT_TESTS_POLYGON_CORNERS_H

#include "solver/formfactor/exchange/polygon.h"

/* The polygon of n corners, counter-clockwise seen from its front. */
polygon polygon_of_corners(int n, const double corners[][3]);

#endif
