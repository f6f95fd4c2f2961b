/* The occluders that may stand between two flat clusters, the proof that one of them hides the clusters from
 * each other, and segments against a few of them. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_CANDIDATES_H
#define LAMBERT_FORMFACTOR_BLOCKS_CANDIDATES_H

#include "solver/formfactor/blocks/flat_clusters.h"
#include "solver/formfactor/visibility/occluders.h"

/* Candidates at most; more of them are as good as unknown. */
enum { CANDIDATES_MOST = 128 };

/* The occluders that may stand between two nodes: count of them, or any (count is CANDIDATES_UNKNOWN). */
typedef struct candidates {
    int count;
    int examined; /* pieces that were compared with the two */
    bool hidden;  /* one of them blocks every segment between the two */
    bool amid[2]; /* one of them stands before some elements of the first, of the second, not before others */
    uint32_t of[CANDIDATES_MOST];
} candidates;

enum { CANDIDATES_UNKNOWN = -1 };

/* Keeps those of `among` (NULL or unknown: all of the scene) that may block a segment between the rectangles
 * of a and b, with corners `at`. Left out are pieces that a plane through one of their edges, or their own
 * plane, holds apart from both rectangles, and those behind the plane of either; up to slack. Where one of
 * them blocks every segment, out->hidden is set and the others are left out; that is never so of panes, and
 * of clusters whose elements differ in height. */
void candidates_between(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                        const flat_pair *at, const candidates *among, candidates *out);

/* True where no candidate is of the plane of either node. */
bool candidates_are_others(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                           const candidates *among);

/* The share of the way from a to b at which the first candidate stands, between .05 and .95. */
double candidates_place(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                        const candidates *among);

/* Segments side by side; coordinates are relative to some point near them. */
enum { SEGMENT_LANES = 16 };
typedef struct segment_lanes {
    float from[3][SEGMENT_LANES], to[3][SEGMENT_LANES];
} segment_lanes;

/* blocked [SEGMENT_LANES]: 1 where a candidate blocks the segment, else 0. origin: that of the coordinates.
 */
void candidates_block(const occluders *o, const candidates *among, const double origin[3],
                      const segment_lanes *s, float blocked[SEGMENT_LANES]);

#endif
