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

/* The processor seconds of a sample over those that fixed costs let expect: the pace of this machine in this
 * scene, from 1/8 to 8; 1 where the sample was too short to tell. */
double sample_pace(double seconds, double expected);

typedef struct pairs_cost {
    double seconds;  /* of one thread, by fixed costs of each kind of work: for a choice */
    double measured; /* the same at the pace of the sample on this machine: for a forecast */
    double segments; /* of pairs: of measured, those of segments */
    double entries;  /* of F, or twice the blocks */
    double finer;    /* of blocks: measured, of those that judge them; else 0 */
    double hits;     /* of rays: the share that hits anything; 0: not known */
} pairs_cost;

/* The cost of form factors by RECIPE_PAIRS, RECIPE_NEAR_PAIRS or RECIPE_RAYS, rays included, from
 * pairs_sample. seconds and entries depend on no clock: the same scene has the same figures, however busy the
 * machine is. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status pairs_forecast(const mesh *m, const recipe *r, const progress *p, pairs_cost *out,
                          lam_error *error);

/* pairs_cost.measured of all pairs at another accuracy than that of the forecast, by the law of segments
 * (occlusion.h). */
double pairs_cost_at(const pairs_cost *cost, double accuracy, double other);

#endif
