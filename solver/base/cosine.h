/* Directions about a normal. */
#ifndef LAMBERT_BASE_COSINE_H
#define LAMBERT_BASE_COSINE_H

#include <math.h>

/* The cosine-weighted direction at (x, y) of the unit square, in a frame of unit vectors: the point of the
 * disc at radius sqrt(x), angle 2 pi y, raised to the sphere, a little above its rim. */
static inline void cosine_direction(const float tangent[3], const float bitangent[3], const float normal[3],
                                    double x, double y, float direction[3]) {
    const double radius = sqrt(x), angle = 2 * M_PI * y;
    const float along = (float)(radius * cos(angle)), across = (float)(radius * sin(angle)),
                up = (float)sqrt(fmax(1 - x, 1e-12));
    for (int d = 0; d < 3; d++) direction[d] = along * tangent[d] + across * bitangent[d] + up * normal[d];
}

#endif
