/* A forecast of the work that pairs_exchange is going to do, counted on a sample of its pairs. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIRS_SAMPLE_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIRS_SAMPLE_H

#include "solver/formfactor/pairs/pairs.h"

/* About how often each kind of work occurs in all pairs. */
typedef struct pairs_work {
    double shafts, candidates, occlusion, hidden; /* of links: cluster_links.h */
    double tried;                                 /* pairs of elements in links */
    double close;                                 /* of those tried, too close for a product rule */
    double facing;                                /* of those tried, not 0 and above the threshold */
    double seen;                                  /* of those facing, not plainly hidden */
    double tests;                                 /* occlusion tests */
    double sifted;                                /* pairs given to projection, decided or not */
    double projection;                            /* points times 1 + occluders there */
    double segments;                              /* that mixed pairs ask for */
    double saved;                                 /* that projected pairs would ask for */
} pairs_work;

/* Counts are the same for any number of threads. Cost: a sixty-fourth of finding links, or all of it for few
 * elements, and some 40,000 pairs of elements. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status pairs_sample(const mesh *m, const visibility *v, const pairs_options *options, pairs_work *out,
                        lam_error *error);

typedef struct pairs_cost {
    double seconds; /* of one thread */
    double entries; /* of F */
} pairs_cost;

/* The cost of form factors by RECIPE_PAIRS, RECIPE_NEAR_PAIRS or RECIPE_RAYS, rays included, from
 * pairs_sample and fixed costs of each kind of work. No clock is read: the same scene has the same figures,
 * however busy the machine is. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status pairs_forecast(const mesh *m, const recipe *r, const progress *p, pairs_cost *out,
                          lam_error *error);

#endif
