/* Boxes with exact form factors and the places of their elements, for methods that need these, and the error
 * of their hierarchical operators. */
#ifndef LAMBERT_TESTS_CLOSED_BOX_H
#define LAMBERT_TESTS_CLOSED_BOX_H

#include "support/box_problem.h"

typedef struct closed_box {
    fixture f;
    build_problem problem;
    double (*centre)[3];
} closed_box;

closed_box closed_box_make(const double size[3], unsigned divisions, float reflectance);
void closed_box_free(closed_box *s);

/* The problem as it lies now. */
const build_problem *closed_box_problem(closed_box *s);

/* The hierarchical operator, which the caller closes; report may be NULL. */
lam_operator *hierarchical_good(const build_problem *problem, double epsilon, build_report *report);

/* |B~ - B| / |B - E| by areas times w [n] (NULL: 1), against a dense LU. */
double indirect_error(const build_problem *problem, const lam_operator *op, const float *w, const float *E);

#endif
