/* Convex pieces of facets as occluders between two flat clusters: those that may stand between them, the
 * proof that one of them hides the clusters from each other, and segments against a few of them. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_BLOCKS_OCCLUDERS_H

#include "solver/formfactor/blocks/flat_clusters.h"
#include "solver/scene/facet/facets.h"

/* A triangle or a convex quadrilateral in its plane: a point x of the plane is inside where edge[e] . (x, 1)
 * >= 0 for all. */
typedef struct occluder {
    double low[3], high[3], normal[3], level;
    double corner[4][3];
    double edge[4][4]; /* of a triangle the last one stands twice */
    uint32_t n_corners;
} occluder;

typedef struct occluder_box {
    double low[3], high[3];
    uint32_t first, count; /* of the list; count 0: the boxes `first` and `first` + 1 */
} occluder_box;

typedef struct occluders {
    size_t n;
    occluder *of;
    uint32_t *list; /* [n], in the order of the boxes */
    occluder_box *boxes;
    size_t n_boxes;
} occluders;

/* The pieces of facets, joined. slack as in flat_clusters. Errors: LAM_ERR_MEMORY. */
lam_status occluders_make(const mesh *m, const facets *f, double slack, occluders *out, lam_error *error);
void occluders_free(occluders *o);

/* Candidates at most; more of them are as good as unknown. */
enum { OCCLUDERS_MOST = 128 };

/* The occluders that may stand between two nodes: count of them, or any (count is OCCLUDERS_UNKNOWN). */
typedef struct candidates {
    int count;
    int examined; /* pieces that were compared with the two */
    bool hidden;  /* one of them blocks every segment between the two */
    bool amid[2]; /* one of them stands before some elements of the first, of the second, not before others */
    uint32_t of[OCCLUDERS_MOST];
} candidates;

enum { OCCLUDERS_UNKNOWN = -1 };

/* Keeps those of `among` (NULL or unknown: all of the scene) that may block a segment between the rectangles
 * of a and b, with corners `at`. Left out are pieces that a plane through one of their edges, or their own
 * plane, holds apart from both rectangles, and those behind the plane of either; up to slack. Where one of
 * them blocks every segment, out->hidden is set and the others are left out; that is never so of clusters
 * whose elements differ in height. */
void occluders_between(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                       const flat_pair *at, const candidates *among, candidates *out);

/* The share of the way from a to b at which the first candidate stands, between .05 and .95. */
double occluders_place(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                       const candidates *among);

/* Segments side by side; coordinates are relative to some point near them. */
enum { SEGMENT_LANES = 16 };
typedef struct segment_lanes {
    float from[3][SEGMENT_LANES], to[3][SEGMENT_LANES];
} segment_lanes;

/* blocked [SEGMENT_LANES]: 1 where a candidate blocks the segment, else 0. origin: that of the coordinates.
 */
void occluders_block(const occluders *o, const candidates *among, const double origin[3],
                     const segment_lanes *s, float blocked[SEGMENT_LANES]);

#endif
