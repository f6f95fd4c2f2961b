/* Form factors that are known exactly, and the geometry of each. Constants only. */
#ifndef LAMBERT_BENCH_FORMFACTORS_TRUTHS_H
#define LAMBERT_BENCH_FORMFACTORS_TRUTHS_H

#include "tests/bench/suites/scenes.h"

/* F from one piece of a scene to another. */
typedef struct formfactors_truth {
    const char *name, *source;
    double F;
    const scene_piece *pieces;
    size_t n, from, to;
    bool occluded; /* wholly or partly */
} formfactors_truth;

extern const formfactors_truth formfactors_truths[]; /* the last has no name */

/* F between all surfaces of an enclosure, each of several pieces. */
typedef struct formfactors_enclosure {
    const char *name, *source;
    const scene_piece *pieces;
    size_t n, n_surfaces;
    const int *surface; /* [n] */
    /* Long strips stand for endless ones: a surface emits from its first piece, in the middle of its length,
     * and receives on all. */
    bool strips;
    const double *F;     /* [n_surfaces][n_surfaces] */
    double F_within;     /* error bound of F as published */
    const double *E, *B; /* [n_surfaces], W/m^2, at a reflectance of .1; or NULL */
    double B_within;     /* W/m^2 */
} formfactors_enclosure;

extern const formfactors_enclosure formfactors_enclosures[]; /* the last has no name */

#endif
