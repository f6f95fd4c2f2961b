/* Generated scenes of about 500 elements with form factors by rays: coloured, open, two-sided, partly black.
 */
#ifndef LAMBERT_TESTS_VIEW_H
#define LAMBERT_TESTS_VIEW_H

#include "solver/formfactor/formfactor.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"

typedef struct view {
    const char *name;
    mesh m;
    form_factors f;
    uint32_t *order;
} view;

enum { CORNELL, CITY, TWO_SIDED, BLACK_FLOOR, SCENES };

view make_view(int which);

void view_free(view *v);

#endif
