/* One polygon to a planar convex quad or to triangles, by cutting ears off its plane projection. */
#include "solver/scene/polygon_split.h"

#include "solver/base/array_grow.h"
#include "solver/scene/plane.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lengths below this share of a polygon's diameter count as 0: about the rounding of single precision. */
static const double straightness = 1e-6;

void polygon_split_scratch_free(polygon_split_scratch *scratch) {
    free(scratch->corners);
    free(scratch->flat);
    free(scratch->quality);
    free(scratch->pieces);
    *scratch = (polygon_split_scratch){0};
}

static lam_status scratch_reserve(polygon_split_scratch *s, size_t n, lam_error *error) {
    if (array_grow(&s->corners, &s->corner_capacity, n, sizeof *s->corners, "face corners", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    if (array_grow(&s->flat, &s->flat_capacity, n, sizeof *s->flat, "face corners", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    if (array_grow(&s->quality, &s->quality_capacity, n, sizeof *s->quality, "face corners", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    if (array_grow(&s->pieces, &s->piece_capacity, n, sizeof *s->pieces, "face corners", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    return LAM_OK;
}

/* Newell's sum: twice the area vector of a polygon, taken about its first corner. */
static void doubled_area(const double (*v)[3], const uint32_t *corners, size_t n, double sum[3]) {
    const double *o = v[corners[0]];
    sum[0] = sum[1] = sum[2] = 0;
    for (size_t i = 1; i + 1 < n; i++) {
        const double *a = v[corners[i]], *b = v[corners[i + 1]];
        const double u[3] = {a[0] - o[0], a[1] - o[1], a[2] - o[2]};
        const double w[3] = {b[0] - o[0], b[1] - o[1], b[2] - o[2]};
        sum[0] += u[1] * w[2] - u[2] * w[1];
        sum[1] += u[2] * w[0] - u[0] * w[2];
        sum[2] += u[0] * w[1] - u[1] * w[0];
    }
}

/* Projects the corners on the plane across the unit normal; returns the largest distance from it. */
static double flatten(const double (*v)[3], const uint32_t *corners, size_t n, const double normal[3],
                      double (*flat)[2]) {
    double u[3], w[3], off = 0, mean = 0;
    plane_axes(normal, u, w);
    const double *o = v[corners[0]];
    for (size_t i = 0; i < n; i++) {
        const double *a = v[corners[i]], d[3] = {a[0] - o[0], a[1] - o[1], a[2] - o[2]};
        flat[i][0] = d[0] * u[0] + d[1] * u[1] + d[2] * u[2];
        flat[i][1] = d[0] * w[0] + d[1] * w[1] + d[2] * w[2];
        mean += (d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]) / (double)n;
    }
    for (size_t i = 0; i < n; i++) {
        const double *a = v[corners[i]], d[3] = {a[0] - o[0], a[1] - o[1], a[2] - o[2]};
        off = fmax(off, fabs(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2] - mean));
    }
    return off;
}

static void remove_corner(polygon_split_scratch *s, size_t *n, size_t i) {
    (*n)--;
    memmove(s->corners + i, s->corners + i + 1, (*n - i) * sizeof *s->corners);
    memmove(s->flat + i, s->flat + i + 1, (*n - i) * sizeof *s->flat);
    memmove(s->quality + i, s->quality + i + 1, (*n - i) * sizeof *s->quality);
}

/* Drops corners that repeat a neighbour, lie straight between both, or are the tip of a spike. */
static void remove_straight(polygon_split_scratch *s, size_t *n, double diameter) {
    for (size_t i = 0, unchanged = 0; *n >= 3 && unchanged < *n;) {
        const size_t before = (i + *n - 1) % *n, after = (i + 1) % *n;
        const double *a = s->flat[before], *b = s->flat[i], *c = s->flat[after];
        const double chord = plane_distance(a, c), tiny = straightness * diameter;
        const bool repeats = plane_distance(a, b) <= tiny;
        if (repeats || chord <= tiny || fabs(plane_turn(a, b, c)) <= tiny * chord) {
            remove_corner(s, n, i);
            unchanged = 0;
            if (i >= *n) i = 0;
            if (*n > 0) i = (i + *n - 1) % *n;
        } else {
            i = after;
            unchanged++;
        }
    }
}

/* The quality of the triangle at corner i: 4 sqrt(3) area / sum of squared edges; -1 where it is not an ear.
 */
static double ear_quality(const polygon_split_scratch *s, size_t n, size_t i) {
    const size_t before = (i + n - 1) % n, after = (i + 1) % n;
    const double *a = s->flat[before], *b = s->flat[i], *c = s->flat[after];
    const double area = plane_turn(a, b, c);
    if (!(area > 0)) return -1;
    for (size_t j = 0; j < n; j++) {
        if (j == before || j == i || j == after) continue;
        const double *p = s->flat[j];
        /* A bridge to a hole visits a corner twice, each time with its own part of the angle. */
        if (memcmp(p, a, sizeof *s->flat) == 0 || memcmp(p, b, sizeof *s->flat) == 0 ||
            memcmp(p, c, sizeof *s->flat) == 0)
            continue;
        if (plane_turn(a, b, p) >= 0 && plane_turn(b, c, p) >= 0 && plane_turn(c, a, p) >= 0) return -1;
    }
    const double ab = plane_distance(a, b), bc = plane_distance(b, c), ca = plane_distance(c, a);
    return 2 * sqrt(3.0) * area / (ab * ab + bc * bc + ca * ca);
}

static void add_piece(polygon_split_scratch *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    const uint32_t piece[4] = {a, b, c, d};
    memcpy(s->pieces[s->n_pieces++], piece, sizeof piece);
}

/* Cuts off the best ear until a triangle is left. Where a polygon that crosses itself has no ear, the corner
 * with the largest area is cut, so that the loop always ends. O(n^2). */
static void clip_ears(polygon_split_scratch *s, size_t n, double least_turn) {
    for (size_t i = 0; i < n; i++) s->quality[i] = ear_quality(s, n, i);
    while (n > 3) {
        size_t best = 0;
        for (size_t i = 1; i < n; i++)
            if (s->quality[i] > s->quality[best]) best = i;
        if (s->quality[best] < 0) {
            double largest = -HUGE_VAL;
            for (size_t i = 0; i < n; i++) {
                const double area = plane_turn(s->flat[(i + n - 1) % n], s->flat[i], s->flat[(i + 1) % n]);
                if (area > largest) best = i, largest = area;
            }
        }
        const size_t before = (best + n - 1) % n, after = (best + 1) % n;
        if (plane_turn(s->flat[before], s->flat[best], s->flat[after]) > least_turn)
            add_piece(s, s->corners[before], s->corners[best], s->corners[after], TABLE_NONE);
        remove_corner(s, &n, best);
        const size_t next = best % n, last = (best + n - 1) % n;
        s->quality[next] = ear_quality(s, n, next);
        s->quality[last] = ear_quality(s, n, last);
    }
    if (plane_turn(s->flat[0], s->flat[1], s->flat[2]) > least_turn)
        add_piece(s, s->corners[0], s->corners[1], s->corners[2], TABLE_NONE);
}

lam_status polygon_split(const double (*vertices)[3], const uint32_t *corners, size_t n, double least_area,
                         bool keep_straight, polygon_split_scratch *s, lam_error *error) {
    lam_status status = LAM_OK;
    double normal[3], diameter = 0;
    s->n_pieces = 0;
    if (n < 3) return LAM_OK;
    TRY(scratch_reserve(s, n, error));
    doubled_area(vertices, corners, n, normal);
    const double twice = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    if (!(twice > 2 * least_area)) return LAM_OK;
    for (int k = 0; k < 3; k++) normal[k] /= twice;
    memcpy(s->corners, corners, n * sizeof *corners);
    const double off = flatten(vertices, corners, n, normal, s->flat);
    for (size_t i = 1; i < n; i++) diameter = fmax(diameter, plane_distance(s->flat[0], s->flat[i]));
    if (n > 3 && !keep_straight) remove_straight(s, &n, diameter);
    if (n < 3) return LAM_OK;
    bool convex = true;
    for (size_t i = 0; i < n; i++)
        convex = convex && plane_turn(s->flat[(i + n - 1) % n], s->flat[i], s->flat[(i + 1) % n]) > 0;
    if (n == 4 && convex && off <= plane_flatness * diameter)
        add_piece(s, s->corners[0], s->corners[1], s->corners[2], s->corners[3]);
    else
        clip_ears(s, n, 2 * least_area);
done:
    return status;
}
