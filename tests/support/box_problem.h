/* Everything a builder needs, of one box with exact form factors. */
#ifndef LAMBERT_TESTS_BOX_PROBLEM_H
#define LAMBERT_TESTS_BOX_PROBLEM_H

#include "solver/method/method.h"
#include "support/box.h"
#include "support/suite.h"

static const double unit_cube[3] = {1, 1, 1};
static const double room[3] = {10, 6, 3};

typedef struct fixture {
    mesh m;
    csr F;
    uint32_t *order;
    build_problem problem;
} fixture;

fixture fixture_box(const double size[3], unsigned divisions, float reflectance);

const build_problem *problem_of(fixture *f);

void fixture_free(fixture *f);

#endif
