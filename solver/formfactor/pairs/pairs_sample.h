/* A forecast of the work that pairs_exchange is going to do, counted on a sample of its pairs. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIRS_SAMPLE_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIRS_SAMPLE_H

#include "solver/formfactor/factor_cost.h"
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
    double saved;                                 /* segments that projected pairs would ask for */
    double segments;                              /* that mixed pairs ask for */
    double lists;                                 /* mixed pairs whose occluders are listed */
    double proven;                                /* segments that an empty list saves */
    double listed;                                /* segments that are tested against lists */
    double list_tests;                            /* of these, times the lengths of the lists */
} pairs_work;

/* The rows of pairs that were counted: the work that this did, and the processor seconds that it took; and
 * those that all links take, by the part of them that was found. */
typedef struct pairs_trial {
    pairs_work work;
    double seconds, link_seconds;
} pairs_trial;

/* Counts are the same for any number of threads. trial may be NULL. Cost: a sixty-fourth
 * of finding links, or all of it for few elements, and some 40,000 pairs of elements. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED. */
lam_status pairs_sample(const mesh *m, const visibility *v, const pairs_options *options, pairs_work *out,
                        pairs_trial *trial, lam_error *error);

/* The cost of all pairs, or with a threshold above 0 of near pairs and rays, from pairs_sample; of few rays
 * by their number. seconds and entries depend on no clock: the same scene has the same figures, however busy
 * the machine is. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status pairs_cost(const mesh *m, const recipe *r, double threshold, const progress *p, factor_cost *out,
                      lam_error *error);

/* factor_cost.measured of all pairs at another accuracy than that of the forecast, by the law of segments
 * (occlusion.h). */
double pairs_cost_at(const factor_cost *cost, double accuracy, double other);

#endif
