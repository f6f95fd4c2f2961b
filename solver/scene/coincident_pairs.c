#include "solver/scene/coincident_pairs.h"

#include "solver/base/array_grow.h"
#include "solver/scene/box_pairs.h"
#include "solver/scene/element_face.h"
#include "solver/scene/flat_polygon.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Faces that share less of the smaller one count as neighbours. */
static const double shared_least = 1e-3;

/* Cosine of the angle between normals above which faces may lie in one plane. The corners decide: the normal
 * of a face as small as the rounding of its corners says little. */
static const double alike = .9;

typedef struct search {
    const mesh *m;
    bool both_sides;
    double distance;
    coincident_pairs *out;
} search;

double coincident_distance(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return plane_same_place * radius;
}

/* The corners of a face in a plane through a point, counter-clockwise as seen from where its normal points;
 * false where one of them is off the plane. */
static bool flatten(const mesh *m, size_t face, const double at[3], const double normal[3], double distance,
                    bool turned, flat_polygon *out) {
    double u[3], w[3];
    plane_axes(normal, u, w);
    out->n = mesh_corners(m, face);
    for (size_t c = 0; c < out->n; c++) {
        const double *v = m->vertices[m->elements[face][turned ? out->n - 1 - c : c]];
        double off = 0, x = 0, y = 0;
        for (int d = 0; d < 3; d++) {
            off += (v[d] - at[d]) * normal[d];
            x += (v[d] - at[d]) * u[d];
            y += (v[d] - at[d]) * w[d];
        }
        if (!(fabs(off) <= distance)) return false;
        out->corner[c][0] = x;
        out->corner[c][1] = y;
    }
    return true;
}

/* True if the second polygon has the corners of the first, from any of them on. */
static bool same_corners(const flat_polygon *a, const flat_polygon *b, double distance) {
    if (a->n != b->n) return false;
    for (size_t shift = 0; shift < a->n; shift++) {
        size_t k = 0;
        while (k < a->n && plane_distance(a->corner[k], b->corner[(k + shift) % b->n]) <= distance) k++;
        if (k == a->n) return true;
    }
    return false;
}

static double perimeter(const flat_polygon *p) {
    double sum = 0;
    for (size_t k = 0; k < p->n; k++) sum += plane_distance(p->corner[k], p->corner[(k + 1) % p->n]);
    return sum;
}

/* Notes two faces where they overlap. */
static lam_status look(void *context, uint32_t i, uint32_t j, lam_error *error) {
    const search *s = context;
    const mesh *m = s->m;
    const float *p = m->normal[i], *q = m->normal[j];
    const double cosine =
        (double)p[0] * (double)q[0] + (double)p[1] * (double)q[1] + (double)p[2] * (double)q[2];
    element_face plane;
    flat_polygon large, small;
    if (cosine < alike && !(s->both_sides && cosine < -alike)) return LAM_OK;
    const bool swapped = m->area[j] > m->area[i];
    const uint32_t a = swapped ? j : i, b = swapped ? i : j;
    if (!element_face_set(m, m->elements[a], &plane)) return LAM_OK;
    /* The larger face gives the plane. A quad may deviate from its own by a hundred-thousandth. */
    if (!flatten(m, b, plane.centre, plane.normal, s->distance, cosine < 0, &small)) return LAM_OK;
    (void)flatten(m, a, plane.centre, plane.normal, HUGE_VAL, false, &large);
    /* Rounding moves the edge that neighbours share by `distance`, and makes them share a strip beside it. */
    const double least = shared_least * m->area[b] + s->distance * perimeter(&small);
    const double area = fmin(flat_polygons_overlap(&small, &large), m->area[b]);
    if (!(area > least)) return LAM_OK;
    coincident_pairs *out = s->out;
    const double near = fmin(s->distance, 1e-2 * sqrt(m->area[b]));
    if (array_grow(&out->pairs, &out->capacity, out->n + 1, sizeof *out->pairs, "overlapping faces", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    out->pairs[out->n++] =
        (coincident_pair){i < j ? i : j, i < j ? j : i, same_corners(&large, &small, near), area};
    return LAM_OK;
}

lam_status coincident_pairs_find(const mesh *m, bool both_sides, coincident_pairs *out, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_pairs found = {.n = 0};
    search s = {.m = m, .both_sides = both_sides, .distance = coincident_distance(m), .out = &found};
    /* A part of a plane that is in both is long along two axes. Faces that share an edge along an axis are
     * no further apart, but their boxes have only that axis in common. */
    const box_pairs how = {.distance = s.distance, .long_axes = 2, .visit = look, .context = &s};
    TRY(box_pairs_visit(m, &how, &found.cut, error));
    *out = found;
    found = (coincident_pairs){.n = 0};
done:
    free(found.pairs);
    return status;
}
