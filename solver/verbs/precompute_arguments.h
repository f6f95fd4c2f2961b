/* The options of lambert precompute, one row for each. */
#ifndef LAMBERT_VERBS_PRECOMPUTE_ARGUMENTS_H
#define LAMBERT_VERBS_PRECOMPUTE_ARGUMENTS_H

#include "solver/base/options.h"

/* The values of the options; texts point into argv. */
typedef struct precompute_arguments {
    const char *output;
    uint64_t subdivide, elements;
    double max_edge, unit, reflectance;
    const char *up;
    bool two_sided;
    const char *form_factors;
    uint64_t rays, resolution;
    const char *quality, *sky, *keep_form_factors;
    double ground_albedo;
    const char *method, *factorizer;
    double epsilon, alpha;
    const char *budget;
    uint64_t levels, rank;
    double coherence, min_area, threshold;
    const char *assign, *correction, *emitters, *precision;
    const char *scratch;
    uint64_t threads, memory, seed, probes;
    bool keep_factors, quiet, progress;
} precompute_arguments;

enum { PRECOMPUTE_TABLES = 6 };

/* The tables of options, the last of which has no rows, that fill f. */
void precompute_tables(precompute_arguments *f, option_table tables[PRECOMPUTE_TABLES]);

extern const option_command precompute_command;

#endif
