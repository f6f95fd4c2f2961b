/* Edges along which walls stand on a face, in its interior: an element on both sides of one would take light
 * on one side of the wall and give it on the other. Knows no light. */
#ifndef LAMBERT_SCENE_FACET_STANDING_EDGES_H
#define LAMBERT_SCENE_FACET_STANDING_EDGES_H

#include "solver/scene/face_frame.h"

/* The largest distance between corners. Area over diameter is seven to ten tenths of the shorter side of a
 * rectangle. */
double face_diameter(const mesh *m, size_t face);

/* The part of a segment within a convex polygon, whose corners run counter-clockwise. False where there is
 * none; from and to are unchanged then. */
bool segment_clip(size_t n, const double (*corner)[2], double from[2], double to[2]);

/* A segment of a face where another face leaves its front, or either side where it is to have a back: an edge
 * of that in the plane, or where it passes through the plane. */
typedef struct standing_edge {
    uint32_t face;
    double whole[2][2];    /* m, its ends in the frame of the face */
    double from[2], to[2]; /* the part that lies on the face */
    flat_line line;
    double tolerance;     /* m: nothing closer to the line is on a side of it */
    double extent, reach; /* m, of all such edges of the face that are connected with it, as far as they lie
                             on the face, and as a whole */
} standing_edge;

typedef struct standing_edges {
    standing_edge *edges; /* by face, ascending */
    size_t n, capacity;
    bool cut; /* the search was ended: there may be more */
} standing_edges;

/* Finds them on elements that are fronts. Their sequence depends on the mesh alone. Freed by
 * free(out->edges). Cost: O(n log n + edges log edges). Errors: LAM_ERR_MEMORY. */
lam_status standing_edges_find(const mesh *m, standing_edges *out, lam_error *error);

#endif
