#include "solver/scene/facet/plane_outside.h"

#include "solver/base/array_grow.h"
#include "solver/scene/plane.h"

#include <stdlib.h>
#include <string.h>

typedef struct placed {
    double at[2];
    uint32_t position; /* in the ring */
} placed;

static int by_place(const void *a, const void *b) {
    const placed *p = a, *q = b;
    for (int k = 0; k < 2; k++)
        if (p->at[k] != q->at[k]) return p->at[k] < q->at[k] ? -1 : 1;
    return (p->position > q->position) - (p->position < q->position);
}

/* Marks the corners of the hull (Andrew 1979): the lower chain, then the upper one. */
static void mark_hull(const placed *sorted, size_t n, placed *hull, bool *is_corner) {
    for (int way = 0; way < 2; way++) {
        size_t h = 0;
        for (size_t k = 0; k < n; k++) {
            const placed *p = &sorted[way == 0 ? k : n - 1 - k];
            while (h >= 2 && plane_turn(hull[h - 2].at, hull[h - 1].at, p->at) <= 0) h--;
            hull[h++] = *p;
        }
        for (size_t k = 0; k < h; k++) is_corner[hull[k].position] = true;
    }
}

/* Marks the points of the ring that lie on the edge of the hull from position first to position last. */
static void mark_edge(const double (*points)[2], size_t count, const uint32_t *ring, size_t first,
                      size_t last, double slack, bool *is_corner) {
    const double *a = points[ring[first % count]], *b = points[ring[last % count]];
    const double length = plane_distance(a, b);
    for (size_t k = first + 1; k < last; k++)
        if (plane_turn(a, b, points[ring[k % count]]) >= -slack * length &&
            plane_turn(a, b, points[ring[k % count]]) <= slack * length)
            is_corner[k % count] = true;
}

static double doubled_area(const double (*points)[2], const uint32_t *ring, size_t n) {
    double sum = 0;
    for (size_t k = 1; k + 1 < n; k++)
        sum += plane_turn(points[ring[0]], points[ring[k]], points[ring[k + 1]]);
    return sum;
}

lam_status plane_outside_find(const double (*points)[2], size_t count, const uint32_t *ring, double slack,
                              plane_outside *out, lam_error *error) {
    lam_status status = LAM_OK;
    out->n = 0;
    TRY(array_grow(&out->sorted, &out->sorted_capacity, count + 1, sizeof *out->sorted, "outlines", error));
    TRY(array_grow(&out->hull, &out->hull_capacity, count + 1, sizeof *out->hull, "outlines", error));
    TRY(array_grow(&out->is_corner, &out->is_capacity, count + 1, sizeof *out->is_corner, "outlines", error));
    TRY(array_grow(&out->first, &out->first_capacity, count + 2, sizeof *out->first, "outlines", error));
    TRY(array_grow(&out->points, &out->point_capacity, 2 * count + 2, sizeof *out->points, "outlines",
                   error));
    for (size_t k = 0; k < count; k++) {
        memcpy(out->sorted[k].at, points[ring[k]], sizeof out->sorted[k].at);
        out->sorted[k].position = (uint32_t)k;
        out->is_corner[k] = false;
    }
    qsort(out->sorted, count, sizeof *out->sorted, by_place);
    mark_hull(out->sorted, count, out->hull, out->is_corner);
    size_t start = 0;
    while (start < count && !out->is_corner[start]) start++;
    for (size_t k = start, next; k < start + count && start < count; k = next) {
        for (next = k + 1; !out->is_corner[next % count];) next++;
        mark_edge(points, count, ring, k, next, slack, out->is_corner);
    }
    out->first[0] = 0;
    for (size_t k = 0, last = 0; k < count && start < count; k = last) {
        size_t n = out->first[out->n];
        const size_t first = n;
        last = k;
        do {
            out->points[n++] = ring[(start + last) % count];
            last++;
        } while (!out->is_corner[(start + last) % count]);
        out->points[n++] = ring[(start + last) % count];
        if (n - first < 3 || !(doubled_area(points, out->points + first, n - first) > 0)) continue;
        out->first[++out->n] = n;
    }
done:
    return status;
}

void plane_outside_free(plane_outside *o) {
    free(o->first);
    free(o->points);
    free(o->sorted);
    free(o->hull);
    free(o->is_corner);
    *o = (plane_outside){.n = 0};
}
