/* A closed room with exact form factors, and all that a method wants to know of it. */
#ifndef LAMBERT_TESTS_ROOM_H
#define LAMBERT_TESTS_ROOM_H

#include "solver/method/method.h"
#include "solver/scene/surfaces.h"
#include "support/box.h"

typedef struct room {
    mesh m;
    csr F;
    uint32_t *order;
    double (*centre)[3];
    uint32_t *surface;
    build_problem problem;
} room;

/* Reflectance of each channel: rho, less by a tenth for the next one. */
room room_create(const double size[3], unsigned divisions, float rho, size_t n_channels);

/* F lies in the room, which is moved when it is returned. */
const build_problem *room_problem(room *r);

void room_free(room *r);

/* F as a dense matrix in double; the caller frees. */
double *room_dense(const csr *F);

#endif
