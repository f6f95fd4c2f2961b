/* Building 2MSC operators of rooms. */
#ifndef LAMBERT_TESTS_TWO_MESH_H
#define LAMBERT_TESTS_TWO_MESH_H

#include "solver/method/two_mesh/method_two_mesh.h"
#include "support/building.h"
#include "support/room.h"
#include "support/transport.h"

static const double hall[3] = {10, 6, 3}, cube[3] = {1, 1, 1};

lam_operator *build_as(const build_problem *problem, const build_options *options, build_report *report);

lam_operator *build_rank(room *r, size_t rank, const char *by, build_report *report);

/* Everything is positive, so errors are relative. U, the weights and the core are rounded once, and what is
 * off by u in U is off by u / (1 - rho) in the core; sums over k columns (twice: the fold, or the core, and
 * the product), of which 16 lanes at most 128 terms are added in single precision; rho, B. */
double tolerance(size_t k, double rho);

#endif
