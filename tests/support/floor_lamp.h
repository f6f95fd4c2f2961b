/* A floor below a lamp, whose light has a closed form at every point. */
#ifndef LAMBERT_TESTS_FLOOR_LAMP_H
#define LAMBERT_TESTS_FLOOR_LAMP_H

#include "solver/scene/mesh.h"

static const float floor_lamp_rho = .5f;

/* A floor of 3 x 3 m, cells x cells elements, 1 m below a lamp of 1 x 1 m that emits 1. The lamp is the last
 * element and reflects nothing, so that B = rho F on the floor. */
mesh floor_lamp_mesh(size_t cells);

/* F from the point (x, y) of the floor to the lamp; its mean and variance over an element of the floor. */
double floor_lamp_truth(double x, double y);
void floor_lamp_over(const mesh *m, size_t i, double *mean, double *variance);

/* The true error of constants, and B [n] with them, or NULL; the elements that are not the lamp lie in the
 * floor. */
double floor_lamp_error(const mesh *m, float *B);

#endif
