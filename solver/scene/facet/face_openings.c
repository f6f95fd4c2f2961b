#include "solver/scene/facet/face_openings.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/base/vector3.h"
#include "solver/scene/facet/plane_regions.h"
#include "solver/scene/facet/polygon_slabs.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The part of a rectangle from which on an opening in it is taken for all of it, pieces of another opening at
 * most, and comparisons of openings with what planes cover at most. */
static const double rectangle_share = .7;
enum { PIECES_MOST = 64, COMPARED_MOST = 1 << 27 };

/* Planes by faces of other sizes agree to some roundings of corners. */
static const double plane_roundings = 4;

typedef struct finder {
    const mesh *m;
    const face_edges *e;
    const plane_regions *r;
    double slack, narrow;
    size_t compared;
    slab_edge *ring;
    uint32_t (*ends)[2]; /* of the ring of the opening itself, by places */
    double (*points)[3];
    size_t n_ring, ring_capacity, end_capacity, point_capacity;
    face_openings *out;
    size_t patch_capacity;
} finder;

static double squared_length(const finder *f, const uint32_t ends[2]) {
    double sum = 0;
    for (int d = 0; d < 3; d++) {
        const double along = f->m->vertices[ends[1]][d] - f->m->vertices[ends[0]][d];
        sum += along * along;
    }
    return sum;
}

/* The place of a corner in the axes of an opening. */
static void flatten(const finder *f, uint32_t place, const double u[3], const double w[3], double at[2]) {
    at[0] = dot3(f->m->vertices[place], u);
    at[1] = dot3(f->m->vertices[place], w);
}

static lam_status add_ring(finder *f, const plane_region *r, const double u[3], const double w[3],
                           lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *corners = f->r->corners + r->first;
    TRY(array_grow(&f->ring, &f->ring_capacity, f->n_ring + r->count, sizeof *f->ring, "openings", error));
    for (size_t k = 0; k < r->count; k++) {
        flatten(f, corners[k], u, w, f->ring[f->n_ring].from);
        flatten(f, corners[(k + 1) % r->count], u, w, f->ring[f->n_ring++].to);
    }
done:
    return status;
}

/* True where a point is inside an odd number of the rings. */
static bool surrounds(const finder *f, const double at[2]) {
    bool inside = false;
    for (size_t k = 0; k < f->n_ring; k++) {
        const double *p = f->ring[k].from, *q = f->ring[k].to;
        if ((p[1] < at[1]) != (q[1] < at[1]) && at[0] < p[0] + (at[1] - p[1]) / (q[1] - p[1]) * (q[0] - p[0]))
            inside = !inside;
    }
    return inside;
}

/* Adds the rings of islands: what faces of the plane cover inside. */
static lam_status add_islands(finder *f, const plane_region *r, const double u[3], const double w[3],
                              double *area, lam_error *error) {
    static const double least_share = .05;
    lam_status status = LAM_OK;
    for (size_t k = 0; k < f->r->n_covered && f->r->covered[k].area >= least_share * r->area; k++) {
        const plane_region *island = &f->r->covered[k];
        if (f->compared++ >= COMPARED_MOST) return LAM_OK;
        const uint32_t corner = f->r->corners[island->first];
        double at[2];
        if (island->plane == r->plane || island->area >= r->area ||
            fabs(dot3(f->m->vertices[corner], r->normal) - r->level) > f->slack ||
            !(fabs(dot3(island->normal, r->normal)) > .999))
            continue;
        flatten(f, corner, u, w, at);
        if (!surrounds(f, at)) continue;
        TRY(add_ring(f, island, u, w, error));
        *area -= island->area;
    }
done:
    return status;
}

static lam_status add_patch(face_openings *o, size_t *capacity, const plane_patch *patch, lam_error *error) {
    if (array_grow(&o->patches, capacity, o->n_patches + 1, sizeof *o->patches, "openings", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    o->patches[o->n_patches++] = *patch;
    return LAM_OK;
}

static plane_patch patch_of(const plane_rectangle *r, size_t opening) {
    plane_patch p = {.opening = (uint32_t)opening};
    memcpy(p.corner, r->corner, sizeof p.corner);
    memcpy(p.edge, r->edge, sizeof p.edge);
    return p;
}

static int by_places(const void *a, const void *b) {
    const uint32_t *p = a, *q = b;
    for (int k = 0; k < 2; k++)
        if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
    return 0;
}

/* The rectangle around an opening. Its edges are sorted by their places, so that it does not depend on where
 * the walk around it began. */
static lam_status rectangle_of(finder *f, const plane_region *r, bool *is, plane_rectangle *out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *corners = f->r->corners + r->first;
    TRY(array_grow(&f->ends, &f->end_capacity, r->count, sizeof *f->ends, "openings", error));
    TRY(array_grow(&f->points, &f->point_capacity, 2 * r->count, sizeof *f->points, "openings", error));
    for (size_t k = 0; k < r->count; k++) {
        const uint32_t a = corners[k], b = corners[(k + 1) % r->count];
        f->ends[k][0] = a < b ? a : b;
        f->ends[k][1] = a < b ? b : a;
    }
    qsort(f->ends, r->count, sizeof *f->ends, by_places);
    for (size_t k = 0; k < r->count; k++)
        for (int end = 0; end < 2; end++) {
            memcpy(f->points[2 * k + (size_t)end], f->m->vertices[f->ends[k][end]], sizeof *f->points);
            f->ends[k][end] = (uint32_t)(2 * k) + (uint32_t)end;
        }
    *is = plane_rectangle_around((const double(*)[3])f->points, 2 * r->count, (const uint32_t(*)[2])f->ends,
                                 r->count, f->narrow, out);
done:
    return status;
}

static lam_status add_opening(finder *f, const plane_region *r, lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *corners = f->r->corners + r->first;
    double u[3] = {0}, w[3], longest = 0, area = r->area;
    slab_piece *pieces = NULL;
    size_t n_pieces = 0;
    plane_rectangle around;
    bool is;
    TRY(rectangle_of(f, r, &is, &around, error));
    if (!is) return LAM_OK;
    for (size_t k = 0; k < r->count; k++) { /* slabs run along the longest edge */
        const uint32_t ends[2] = {corners[k], corners[(k + 1) % r->count]};
        const double length = squared_length(f, ends);
        if (!(length > longest)) continue;
        longest = length;
        for (int d = 0; d < 3; d++) u[d] = f->m->vertices[ends[1]][d] - f->m->vertices[ends[0]][d];
    }
    const double lean = dot3(u, r->normal);
    for (int d = 0; d < 3; d++) u[d] -= lean * r->normal[d];
    const double length = sqrt(dot3(u, u));
    for (int d = 0; d < 3; d++) u[d] /= length;
    cross3(r->normal, u, w);
    f->n_ring = 0;
    TRY(add_ring(f, r, u, w, error));
    TRY(add_islands(f, r, u, w, &area, error));
    const plane_patch whole = patch_of(&around, f->out->n);
    bool simple = area >= rectangle_share * plane_rectangle_area(&around);
    if (!simple) {
        TRY(polygon_slabs(f->n_ring, f->ring, f->slack, &pieces, &n_pieces, error));
        simple = n_pieces == 0 || n_pieces > PIECES_MOST;
    }
    if (simple) TRY(add_patch(f->out, &f->patch_capacity, &whole, error));
    for (size_t k = 0; k < n_pieces && !simple; k++) {
        const slab_piece *p = &pieces[k];
        plane_patch patch = {.triangle = p->triangle, .opening = (uint32_t)f->out->n};
        for (int d = 0; d < 3; d++) {
            patch.corner[d] = p->corner[0] * u[d] + p->corner[1] * w[d] + r->level * r->normal[d];
            for (int e = 0; e < 2; e++) patch.edge[e][d] = p->edge[e][0] * u[d] + p->edge[e][1] * w[d];
        }
        TRY(add_patch(f->out, &f->patch_capacity, &patch, error));
    }
    f->out->n++;
done:
    free(pieces);
    return status;
}

static int larger_first(const void *a, const void *b) {
    const plane_region *p = a, *q = b;
    if (p->area != q->area) return p->area > q->area ? -1 : 1;
    return (p->first > q->first) - (p->first < q->first);
}

lam_status face_openings_find(const mesh *m, double narrow, face_openings *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_faces = m->n - m->n_backs;
    double centre[3], radius;
    face_edges e = {.n = 0};
    plane_regions r = {.n_open = 0};
    face_openings made = {.n = 0};
    mesh_bounds(m, centre, &radius);
    const double slack = 2 * plane_flatness * radius;
    finder f = {.m = m,
                .e = &e,
                .r = &r,
                .slack = plane_roundings * slack,
                .narrow = fmax(narrow, slack),
                .out = &made};
    TRY(face_edges_find(m, n_faces, slack, &e, error));
    TRY(plane_regions_find(m, n_faces, &e, plane_roundings * slack, narrow, &r, error));
    array_sort(r.open, r.n_open, sizeof *r.open, larger_first);
    array_sort(r.covered, r.n_covered, sizeof *r.covered, larger_first);
    if (r.n_open > FACE_OPENINGS_MOST) made.n_left = r.n_open - FACE_OPENINGS_MOST;
    for (size_t k = 0; k + made.n_left < r.n_open; k++) TRY(add_opening(&f, &r.open[k], error));
    *out = made;
    made = (face_openings){.n = 0};
done:
    free(f.ring);
    free(f.ends);
    free(f.points);
    face_edges_free(&e);
    plane_regions_free(&r);
    face_openings_free(&made);
    return status;
}

lam_status face_openings_give(face_openings *o, const plane_rectangle *r, lam_error *error) {
    size_t capacity = o->n_patches; /* of which openings that are given have one each */
    const plane_patch patch = patch_of(r, o->n);
    const lam_status status = add_patch(o, &capacity, &patch, error);
    if (status != LAM_OK) return status;
    o->given = true;
    o->n++;
    return LAM_OK;
}

void face_openings_free(face_openings *o) {
    free(o->patches);
    *o = (face_openings){.n = 0};
}
