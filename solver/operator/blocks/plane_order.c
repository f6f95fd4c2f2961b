#include "solver/operator/blocks/plane_order.h"

#include <math.h>
#include <stdlib.h>

/* A difference of normals of 1 counts as this share of the extent of the planes that are split. */
static const double facing_weight = .35;

static int by_value(const void *left, const void *right) {
    const plane_place *a = left, *b = right;
    if (a->value != b->value) return a->value < b->value ? -1 : 1;
    return a->begin < b->begin ? -1 : a->begin > b->begin;
}

/* Sorts planes of one part. */
static void order_part(plane_place *planes, size_t count) {
    double low[6], high[6], size = 0;
    int longest = 0;
    if (count < 2) return;
    for (int d = 0; d < 6; d++) low[d] = INFINITY, high[d] = -INFINITY;
    for (size_t g = 0; g < count; g++)
        for (int d = 0; d < 6; d++) {
            low[d] = fmin(low[d], planes[g].at[d]);
            high[d] = fmax(high[d], planes[g].at[d]);
        }
    for (int d = 0; d < 3; d++) size = fmax(size, high[d] - low[d]);
    for (int d = 0; d < 6; d++) {
        const double here = (high[d] - low[d]) * (d < 3 ? 1 : facing_weight * size);
        const double best = (high[longest] - low[longest]) * (longest < 3 ? 1 : facing_weight * size);
        if (here > best) longest = d;
    }
    for (size_t g = 0; g < count; g++) planes[g].value = planes[g].at[longest];
    qsort(planes, count, sizeof *planes, by_value);
    order_part(planes, count / 2);
    order_part(planes + count / 2, count - count / 2);
}

void plane_order(plane_place *planes, size_t count) {
    for (size_t g = 0; g < count; g++) planes[g].value = (double)planes[g].part;
    qsort(planes, count, sizeof *planes, by_value);
    for (size_t first = 0, last; first < count; first = last) {
        for (last = first + 1; last < count && planes[last].part == planes[first].part;) last++;
        order_part(planes + first, last - first);
    }
}
