/* Where a scene lies on the map of "Aguerre 2016, figure 5.1", and which kind of operator suits it. */
#ifndef LAMBERT_METHOD_CLASSIFY_H
#define LAMBERT_METHOD_CLASSIFY_H

#include "solver/method/method.h"
#include "solver/method/spectrum.h"

/* What a query costs is what it reads, in numbers of a panel: 2 n k of a low-rank operator, n^2 of an exact
 * one, four for every entry of a sparse one, n s of emitters; of a hierarchical one four for every entry of
 * its core and forty an element for the transforms. Per channel. */
typedef struct scene_class {
    size_t n;
    double density;   /* of F */
    double rank;      /* estimate at epsilon; negative: not looked at */
    double tail;      /* what that leaves out of S, |S - S_k|_F / |S|_F; negative likewise */
    double entries;   /* of a sparse inverse that leaves out as much; negative: not looked at, or too many */
    double threshold; /* of that; or as asked for */
    double numbers;   /* an element of a hierarchical operator's core; negative: none was built */
    /* infinite: not to be had, or not known */
    double exact_cost, low_rank_cost, sparse_cost, emitters_cost, hierarchical_cost;
    const char *method; /* what suits it best */
    char reason[256];
} scene_class;

typedef struct classify_options {
    double epsilon;
    double threshold; /* of a sparse inverse; 0: what leaves out as much as epsilon does */
    size_t memory;    /* bytes an operator may use; 0: no limit */
    uint64_t seed;
    bool thorough; /* looks also at what decides nothing */
    /* The hierarchical operator, where one was built to see what it costs, and its report; closed by the
     * caller. NULL: it is not wanted. */
    lam_operator **hierarchical;
    build_report *hierarchical_report;
    const progress *progress;
} classify_options;

/* Builds the hierarchical operator, which is as exact as epsilon says, and looks whether one of another kind
 * that is so too answers faster: the whole inverse, or, where F is sparse and its samples are not so few that
 * only the hierarchical one tells light from their noise, a sparse inverse, of which some rows are found.
 * Where there is no geometry to build it by: the number of singular values (spectrum.h), and a sparse inverse
 * that leaves out as much. What cannot change the choice is skipped unless thorough. Cost: that of the
 * hierarchical operator, a hundred rows of sparse inverses, else at most 40 products of S with eight vectors
 * and a few dozen with 32.
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
