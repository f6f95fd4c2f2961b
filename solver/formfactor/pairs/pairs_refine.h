/* A run of pairs_exchange, and its second pass, in which mixed pairs get as many segments as they need.
 * Private to pairs.c. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIRS_REFINE_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIRS_REFINE_H

#include "solver/formfactor/pairs/element_neighbours.h"
#include "solver/formfactor/pairs/leaf_reaches.h"
#include "solver/formfactor/pairs/pair_demand.h"
#include "solver/formfactor/pairs/pair_ground.h"

typedef struct pairs_run {
    pair_ground on;                          /* all links */
    segment_occluder *listed;                /* for lists of the occluders of pairs; NULL: there are none */
    uint32_t *leaf;                          /* [n], the leaf of a position */
    uint32_t *parent;                        /* of each cluster */
    uint32_t (*neighbours)[NEIGHBOURS_MOST]; /* [n], by element */
    pair_rows rows;
    pair_demand demand; /* all zero before the first pass is over */
} pairs_run;

/* Scales the accuracy of occlusion so that all mixed pairs together take between segments_least, or their
 * share of it, and segments_most segments: the error of N segments is proportional to N^-SEGMENTS_POWER. Sets
 * the demand. Errors: LAM_ERR_MEMORY. */
lam_status pairs_share_segments(pairs_run *run, lam_error *error);

/* Estimates the mixed pairs of one block, and those that the light of one of their elements demands. States
 * stay unchanged, because other blocks read them. known: the exchange areas come from a scratch file and are
 * only counted. to: room for the partners of a leaf. False: out of memory. */
bool pairs_refine_block(pairs_run *run, size_t index, bool known, leaf_reaches *to, pairs_report *sum);

#endif
