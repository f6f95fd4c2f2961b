/* Where a scene lies on the map of "Aguerre 2016, figure 5.1", and which kind of operator suits it. */
#ifndef LAMBERT_BUILD_CLASSIFY_H
#define LAMBERT_BUILD_CLASSIFY_H

#include "solver/build/build.h"
#include "solver/build/spectrum.h"

/* What a query costs is what it reads, in numbers of a panel: 2 n k of a low-rank operator, n^2 of an exact
 * one, four for every entry of a sparse one, n s of emitters. */
typedef struct scene_class {
    size_t n;
    double density;   /* of F */
    double rank;      /* estimate at epsilon; negative: not looked at */
    double tail;      /* what that leaves out of S, |S - S_k|_F / |S|_F; negative likewise */
    double entries;   /* of a sparse inverse that leaves out as much; negative: not looked at, or too many */
    double threshold; /* of that; or as asked for */
    double exact_cost, low_rank_cost, sparse_cost, emitters_cost; /* infinite: not to be had, or not known */
    const char *method;                                           /* what suits it best */
    char reason[256];
} scene_class;

typedef struct classify_options {
    double epsilon;
    double threshold; /* of a sparse inverse; 0: what leaves out as much as epsilon does */
    size_t memory;    /* bytes an operator may use; 0: no limit */
    uint64_t seed;
    bool thorough; /* looks at the rank also where it decides nothing */
    const progress *progress;
} classify_options;

/* Looks at F and some rows of the inverse: density, number of singular values (spectrum.h), entries of a
 * sparse inverse of the same error, and takes what answers fastest then. What cannot change the choice is
 * skipped unless thorough. Cost: at most 40 products of S with eight vectors, a few dozen with 32, and a
 * hundred rows of sparse inverses.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED. */
lam_status classify_scene(const build_problem *problem, const classify_options *options, scene_class *out,
                          lam_error *error);

/* The rank that a factorization of bound epsilon is going to have. */
double classify_rank(const spectrum *values, double epsilon);

/* Lanczos steps that the spectrum is found with. */
enum { CLASSIFY_STEPS = 40 };

/* Up to so many elements the whole inverse is small, exact, and built in well under a second; beyond so many
 * it takes too long. */
enum { CLASSIFY_SMALL = 1024, CLASSIFY_EXACT_MOST = 12288 };

#endif
