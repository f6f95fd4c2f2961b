/* Curved surfaces of triangles seen from inside, no two of which lie in one plane but for the halves of a
 * trapezoid. */
#ifndef LAMBERT_TESTS_BOWL_H
#define LAMBERT_TESTS_BOWL_H

#include "solver/scene/mesh.h"
#include "support/suite.h"

/* The lower half of the ellipsoid x^2 + y^2 + (z/depth)^2 = 1 in rings of latitude, each of so many sectors
 * of two triangles (the lowest of one), facing its centre. With depth 1 it is half a sphere, where the kernel
 * cos cos' / (pi r^2) is 1/(4 pi) everywhere. A lid of one triangle for each sector closes it. */
mesh bowl(size_t rings, size_t sectors, double depth, bool lid);

#endif
