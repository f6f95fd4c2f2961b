/* Eight segments at once against a short list of occluders, in single precision: where few of them may stand
 * between a pair, this takes a fraction of a search through the whole scene. Knows no elements. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_SEGMENT_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_SIGHT_SEGMENT_OCCLUDERS_H

#include "solver/formfactor/visibility/occluders.h"
#include "solver/formfactor/visibility/visibility.h"

/* An occluder in recentred coordinates: a point x of its plane is inside where edge[e] . (x, 1) > 0 for all.
 * Occluders are larger than they are by slack, so that no segment passes where two of them meet. */
typedef struct segment_occluder {
    float normal[3], level, edge[OCCLUDER_CORNERS][4];
    int n;
    uint32_t pane; /* as of occluder */
} segment_occluder;

/* Segments of a pair for which a list is made, at least: making it takes the time of some packets. */
enum { SEGMENTS_LISTED = 8 * VISIBILITY_PACKET };

/* The occluders that may block the segments of a pair. Where all segments are blocked those that do it are
 * moved to the front, because the next ones are mostly blocked by the same: results do not depend on the
 * order. */
typedef struct segment_list {
    int count;
    uint32_t *of;
} segment_list;

/* Moves entry c half of the way to the front. */
static inline void segment_list_forward(segment_list *list, int c) {
    const uint32_t moved = list->of[c];
    list->of[c] = list->of[c / 2];
    list->of[c / 2] = moved;
}

/* Packets that are tested together. */
enum { SEGMENT_PACKETS = 2 };

/* centre: that of the recentred coordinates. *out is freed by free. Errors: LAM_ERR_MEMORY. */
lam_status segment_occluders_make(const occluders *o, const double centre[3], segment_occluder **out,
                                  lam_error *error);

/* Sets bit k of bits[p] where one of the list blocks segment k of s[p], from its origin to origin +
 * direction, for up to SEGMENT_PACKETS packets. Those set before need no test. */
void segment_occluders_block(const segment_occluder *of, segment_list *list, const ray_packet *s, int packets,
                             unsigned *bits);

#endif
