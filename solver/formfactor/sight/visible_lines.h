/* The visible share of two elements by lines: from a point P of the one to a line X + t D, 0 <= t <= 1,
 * across the other. The t that a convex occluder hides are an interval, found exactly, and the kernel has a
 * closed integral over the rest. Three dimensions are left to be sampled in place of the four of segments, in
 * which the visible part of a line has no step unless a shadow runs along the lines: 16 lines err as 40 to
 * 250 segments do (tests/bench/bench_segments.c). For shadows of lights: Billen and Dutre 2016. Knows no
 * scene. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_VISIBLE_LINES_H
#define LAMBERT_FORMFACTOR_SIGHT_VISIBLE_LINES_H

#include "solver/formfactor/exchange/affine_segments.h"
#include "solver/formfactor/sight/segment_occluders.h"

/* Lines side by side, and occluders of a list at most. */
enum { VISIBLE_LINES = AFFINE_SEGMENTS, LINE_OCCLUDERS_MOST = 64 };

/* Points of maps.from, and lines across maps.to along its side `along`. */
typedef struct line_pair {
    affine_pair maps;
    int along;
} line_pair;

/* sum of the integrals of K = cos cos' / r^2 over lines, times the Jacobian of their points: over what is
 * seen, and over all that is in front. */
typedef struct line_sums {
    double seen, all;
} line_sums;

/* Chooses the lines across either map, along either side, that shadows of the listed occluders run along
 * least: a segment from a to b passes an edge where a form S, linear in each of the four coordinates, is 0,
 * and the visible parts of lines along the coordinate that S depends on most differ least. Edges count by
 * how near to the middle of all segments they are. False where neither map is a triangle or parallelogram,
 * and for more than LINE_OCCLUDERS_MOST occluders. */
bool line_pair_choose(const segment_occluder *of, const segment_list *list, const affine_map *a,
                      const affine_map *b, const double centre[3], line_pair *out);

/* Adds VISIBLE_LINES lines: the points at (x[0], x[1]) of the unit square, the lines at x[2] of the unit
 * interval, uniform by area. No occluder of the list may lie in the plane of either map; centre is that of
 * the recentred coordinates. Where an occluder hides all of the lines it moves towards the front of the
 * list. */
void visible_lines_add(const segment_occluder *of, segment_list *list, const line_pair *p,
                       const double centre[3], const double x[3][VISIBLE_LINES], line_sums *sums);

#endif
