#include "solver/scene/coincident_pairs.h"

#include "solver/base/array_grow.h"
#include "solver/scene/box_pairs.h"
#include "solver/scene/coincident.h"
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

/* Decimals that are looked for: single precision has fewer, and more are no rounding that matters. */
enum { DECIMALS_MOST = 8 };

/* The step of the decimals of all coordinates, in units of the file, where each is off by no more than a
 * share of itself; 0: they have more decimals. */
static double step_of_decimals(const mesh *m, double share) {
    static const double near = 1e-9;
    double steps = 1; /* in a unit */
    int decimals = 0;
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int d = 0; d < 3; d++) {
            const double x = m->vertices[v][d] / m->unit;
            while (!(fabs(x * steps - round(x * steps)) <= near + fabs(x) * steps * share)) {
                if (decimals++ == DECIMALS_MOST) return 0;
                steps *= 10;
            }
        }
    return 1 / steps;
}

void coincident_find_rounding(mesh *m) {
    double step = step_of_decimals(m, 0x1p-50);
    if (!(step > 0)) step = step_of_decimals(m, 0x1p-24); /* a file that was read in single precision */
    m->rounding = m->unit * step;
}

coincident_planes coincident_planes_of(const mesh *m) {
    double centre[3], radius, largest = 0;
    mesh_bounds(m, centre, &radius);
    for (size_t i = 0; i < m->n; i++) largest = fmax(largest, 2 * sqrt(m->area[i]));
    const double distance = plane_same_place * radius;
    const double rounded = fmin(2 * m->rounding, plane_gap(largest, largest));
    return (coincident_planes){.m = m, .distance = distance, .reach = fmax(distance, rounded)};
}

static double cosine_between(const mesh *m, uint32_t i, uint32_t j) {
    const float *p = m->normal[i], *q = m->normal[j];
    return (double)p[0] * (double)q[0] + (double)p[1] * (double)q[1] + (double)p[2] * (double)q[2];
}

/* Few decimals may be all that there are: edges are one only where plane_slack lets them. */
double coincident_width(const coincident_planes *p, uint32_t i, uint32_t j) {
    const double slack = plane_slack(2 * sqrt(p->m->area[i]), 2 * sqrt(p->m->area[j]));
    return fmax(p->distance, fmin(2 * p->m->rounding, slack));
}

/* Half a step along each axis moves a corner by (|n_x| + |n_y| + |n_z|) / 2 steps along a normal n, and the
 * plane as much. Along an axis that is one step: a rug that lies so far above a floor is meant to. */
static bool in_plane(const coincident_planes *p, const element_face *plane, uint32_t large, uint32_t small) {
    static const double below = .99;
    const mesh *m = p->m;
    const double sum = fabs(plane->normal[0]) + fabs(plane->normal[1]) + fabs(plane->normal[2]);
    const double gap = plane_gap(2 * sqrt(m->area[large]), 2 * sqrt(m->area[small]));
    const double most = fmax(p->distance, fmin(below * sum * m->rounding, gap));
    for (size_t c = 0; c < mesh_corners(m, small); c++) {
        const double *v = m->vertices[m->elements[small][c]];
        double height = 0;
        for (int d = 0; d < 3; d++) height += (v[d] - plane->centre[d]) * plane->normal[d];
        if (!(fabs(height) <= most)) return false;
    }
    return true;
}

bool coincident_share_plane(const coincident_planes *p, uint32_t i, uint32_t j) {
    const bool swapped = p->m->area[j] > p->m->area[i];
    const uint32_t large = swapped ? j : i, small = swapped ? i : j;
    element_face plane;
    return fabs(cosine_between(p->m, i, j)) >= alike &&
           element_face_set(p->m, p->m->elements[large], &plane) && in_plane(p, &plane, large, small);
}

/* The corners of a face in a plane, counter-clockwise as seen from where its normal points. */
static void flatten(const mesh *m, uint32_t face, const element_face *plane, bool turned, flat_polygon *out) {
    double u[3], w[3];
    plane_axes(plane->normal, u, w);
    out->n = mesh_corners(m, face);
    for (size_t c = 0; c < out->n; c++) {
        const double *v = m->vertices[m->elements[face][turned ? out->n - 1 - c : c]];
        double x = 0, y = 0;
        for (int d = 0; d < 3; d++) {
            x += (v[d] - plane->centre[d]) * u[d];
            y += (v[d] - plane->centre[d]) * w[d];
        }
        out->corner[c][0] = x;
        out->corner[c][1] = y;
    }
}

typedef struct search {
    coincident_planes planes;
    coincident_sort sort;
    coincident_pairs *out;
} search;

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

/* Faces of opposite sides cover a place twice where both have a back. */
static bool looks_matter(const search *s, uint32_t i, uint32_t j, double cosine) {
    const bool *has_back = s->planes.m->has_back;
    if (cosine >= alike) return s->sort != COINCIDENT_SHEETS;
    if (cosine > -alike) return false;
    return s->sort != COINCIDENT_ONE_SIDE || (has_back != NULL && has_back[i] && has_back[j]);
}

/* Notes two faces where they overlap. */
static lam_status look(void *context, uint32_t i, uint32_t j, lam_error *error) {
    const search *s = context;
    const mesh *m = s->planes.m;
    const double cosine = cosine_between(m, i, j);
    element_face plane;
    flat_polygon large, small;
    if (!looks_matter(s, i, j, cosine)) return LAM_OK;
    const bool swapped = m->area[j] > m->area[i];
    const uint32_t a = swapped ? j : i, b = swapped ? i : j;
    if (!element_face_set(m, m->elements[a], &plane) || !in_plane(&s->planes, &plane, a, b)) return LAM_OK;
    flatten(m, b, &plane, cosine < 0, &small);
    flatten(m, a, &plane, false, &large);
    /* Rounding moves the edge that neighbours share, and makes them share a strip beside it. Many parts cover
     * an element together. */
    const double width = coincident_width(&s->planes, i, j);
    const double strip = s->sort == COINCIDENT_SHEETS ? 0 : width * perimeter(&small);
    const double least = shared_least * m->area[b] + strip;
    const double area = fmin(flat_polygons_overlap(&small, &large), m->area[b]);
    if (!(area > least)) return LAM_OK;
    coincident_pairs *out = s->out;
    const double near = fmin(width, 1e-2 * sqrt(m->area[b]));
    if (array_grow(&out->pairs, &out->capacity, out->n + 1, sizeof *out->pairs, "overlapping faces", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    out->pairs[out->n++] =
        (coincident_pair){i < j ? i : j, i < j ? j : i, same_corners(&large, &small, near), cosine < 0, area};
    return LAM_OK;
}

lam_status coincident_pairs_find(const mesh *m, coincident_sort sort, coincident_pairs *out,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    coincident_pairs found = {.n = 0};
    search s = {.planes = coincident_planes_of(m), .sort = sort, .out = &found};
    /* A part of a plane that is in both is long along two axes. Faces that share an edge along an axis are
     * no further apart, but their boxes have only that axis in common. */
    const box_pairs how = {
        .distance = s.planes.reach, .least = s.planes.distance, .long_axes = 2, .visit = look, .context = &s};
    TRY(box_pairs_visit(m, &how, &found.cut, error));
    *out = found;
    found = (coincident_pairs){.n = 0};
done:
    free(found.pairs);
    return status;
}
