/* The two plates as a pair, with the occluders between them. */
#ifndef LAMBERT_TESTS_PLATES_PAIR_H
#define LAMBERT_TESTS_PLATES_PAIR_H

#include "solver/formfactor/sight/projection.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/plates.h"

typedef struct plates_pair {
    mesh m;
    visibility *v;
    polygon a, b;
    occluders occluders;
    pair_occluders among; /* UNCUT_OCCLUDERS_MOST at most, without the plates, which block nothing */
} plates_pair;

/* Takes over plates() to which occluders were added, which are measured here. */
void plates_pair_open(plates_pair *p, mesh m);
void plates_pair_close(plates_pair *p);

#endif
