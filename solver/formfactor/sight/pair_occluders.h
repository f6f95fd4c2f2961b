/* The occluders that may stand between two elements, found by planes: those of the occluder, of both
 * elements, and the supporting planes of the pair. Knows no light. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_PAIR_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_SIGHT_PAIR_OCCLUDERS_H

#include "solver/formfactor/clusters/link_occluders.h"
#include "solver/formfactor/exchange/polygon.h"

/* Between two elements, at most; as many as are projected of a pair that no window (windows.h) has cut: the
 * cost of a point grows with them, and the whole of such a pair has more points. */
enum { PAIR_OCCLUDERS_MOST = 16, UNCUT_OCCLUDERS_MOST = 8 };

/* As many as segments are tested against one by one; of more, the whole scene is searched. */
enum { LISTED_OCCLUDERS_MOST = 128 };

/* True where an occluder is one of the faces that rise above an element in its plane, by up to `rise`
 * (visibility_rise), give or take slack: its corners, or those of the element in its plane, are no higher. */
bool occluder_in_contact(const occluder *o, const polygon *element, double rise, double slack);

/* True where an occluder lies in the plane of an element, as far as rounded corners say (plane_slack), and is
 * its neighbour there, or one that was joined from several facets and has three corners of the element in its
 * plane, give or take slack, so that half of the element is a part of it: it hides no more than what leaves
 * the element at angles of that slack over its size, and a segment would have to tell on which side of it the
 * element begins. */
bool occluder_lies_beside(const occluder *o, const polygon *element, double slack);

typedef struct pair_occluders {
    int count;   /* or OCCLUDERS_UNCOUNTED */
    bool hidden; /* one of them covers the pair */
    uint32_t of[LISTED_OCCLUDERS_MOST];
} pair_occluders;

/* Finds the occluders of a link that may block a segment between a and b, which face each other wholly;
 * own_facets: of the two elements, which block no segment of theirs; rise: what of their planes rises above
 * them and blocks none either (visibility_rise). Count 0 proves that none does. */
void pair_occluders_find(const occluders *o, const link_occluders *among, const polygon *a, const polygon *b,
                         const uint32_t own_facets[2], const double rise[2], pair_occluders *out);

/* Bits of those of a pair, among the bits given, that may block a segment between b and a part of a. hidden:
 * one of them covers the part. */
unsigned pair_occluders_of_part(const occluders *o, const pair_occluders *among, unsigned bits,
                                const polygon *part, const polygon *b, bool *hidden);

#endif
