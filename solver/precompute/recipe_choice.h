/* The choice of a recipe of form factors by the options of a precomputation. */
#ifndef LAMBERT_PRECOMPUTE_RECIPE_CHOICE_H
#define LAMBERT_PRECOMPUTE_RECIPE_CHOICE_H

#include "solver/base/options.h"
#include "solver/formfactor/formfactor.h"

#define CHOICE_AUTO OPTION_AUTO

/* The options that decide. */
typedef struct choice_request {
    const char *quality; /* "draft", "normal", "high" */
    double epsilon;
    uint64_t rays;     /* CHOICE_AUTO */
    size_t resolution; /* of hemicubes in place of rays; 0: none */
    uint64_t seed;
    bool sky;      /* light that leaves the scene matters too */
    bool filtered; /* the method takes out most of the noise of rays: few are enough */
} choice_request;

/* More elements than these have more pairs than anybody waits for. */
enum { CHOICE_PAIRS_MOST = 32768 };

/* The recipe: hemicubes where they are asked for, plain rays where their number is given or at draft, else
 * pairs, all where that is affordable and else the near ones. */
recipe choice_recipe(const choice_request *asked, bool all_pairs);

/* Rays that keep the noise of the samples the quality's part below epsilon, or the number given. */
size_t choice_rays(const choice_request *asked);

#endif
