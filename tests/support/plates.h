/* Two facing unit squares with something between them, at several scales and places. */
#ifndef LAMBERT_TESTS_PLATES_H
#define LAMBERT_TESTS_PLATES_H

#include "support/box.h"

/* Unit squares at z = 0 (up) and z = 1 (down), with an occluder between that has both its faces. */
mesh plates(const double *occluder);

void plates_move(mesh *m, double scale, double offset);

/* F from one to the other (the first without an occluder), and what hides one from the other entirely. */
static const struct {
    double occluder[4]; /* x from, to, y from, to */
    double F;
} plates_cases[] = {{{0}, .199824895698},
                    {{0, .5, 0, .5}, .149868671774},
                    {{0, .5, 0, 1}, .099912447849},
                    {{.25, .75, .25, .75}, .099506294599}};
static const double plates_hidden[4] = {0, 1, 0, 1};

static const double plates_places[][2] = {{1, 0}, {1, 1e6}, {1e-3, 0}, {1e3, 0}};

#endif
