/* The faces of the scene file that elements of joined faces are parts of: faces_part of face_join.h. The
 * faces and the elements of one joined face are laid into its plane, with axes u and w. The faces are sorted
 * along u, so that an element meets few of them, and what it has in common with each is found by clipping. */
#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/base/vector3.h"
#include "solver/scene/element_face.h"
#include "solver/scene/facet/face_join.h"
#include "solver/scene/flat_polygon.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The share of the smaller of an element and a face that is no common area, but the rounding of corners. */
static const double least_share = 1e-6;

/* A polygon in the plane of a joined face, with the box around it. */
typedef struct placed_polygon {
    flat_polygon flat;
    double low[2], high[2], area;
    uint32_t face; /* of the scene file */
} placed_polygon;

typedef struct plane_axes_at {
    double origin[3], u[3], w[3];
} plane_axes_at;

typedef struct parting {
    mesh *m;
    const faces_before *before;
    uint32_t *start, *elements; /* [n_joined + 1], into [m->n]: elements by joined face */
    placed_polygon *placed;     /* the faces of one, by their low[0] */
    size_t n_placed, placed_room;
    double widest;           /* of these, along u */
    scene_face_part *common; /* of one element */
    size_t n_common, common_room;
    scene_face_part *parts;
    size_t n_parts, part_room;
} parting;

static placed_polygon place(const plane_axes_at *at, const double (*vertices)[3], const uint32_t corners[4]) {
    placed_polygon p = {
        .flat = {.n = corner_count(corners)}, .low = {HUGE_VAL, HUGE_VAL}, .high = {-HUGE_VAL, -HUGE_VAL}};
    for (size_t k = 0; k < p.flat.n; k++) {
        double to[3];
        subtract3(vertices[corners[k]], at->origin, to);
        p.flat.corner[k][0] = dot3(to, at->u);
        p.flat.corner[k][1] = dot3(to, at->w);
        for (int d = 0; d < 2; d++) {
            p.low[d] = fmin(p.low[d], p.flat.corner[k][d]);
            p.high[d] = fmax(p.high[d], p.flat.corner[k][d]);
        }
    }
    p.area = flat_polygon_area(&p.flat);
    return p;
}

static int by_low(const void *a, const void *b) {
    const placed_polygon *p = a, *q = b;
    if (p->low[0] != q->low[0]) return p->low[0] < q->low[0] ? -1 : 1;
    return (p->face > q->face) - (p->face < q->face);
}

static int by_face(const void *a, const void *b) {
    const scene_face_part *p = a, *q = b;
    return (p->face > q->face) - (p->face < q->face);
}

/* The axes of a joined face: in the plane of the largest face that became a part of it. False where that
 * spans no area. */
static bool set_axes(const faces_before *before, size_t joined, plane_axes_at *out) {
    const mesh view = {.vertices = before->vertices};
    element_face largest = {.radius = -1};
    for (uint32_t k = before->start[joined]; k < before->start[joined + 1]; k++) {
        element_face one;
        if (element_face_set(&view, before->elements[before->order[k]], &one) && one.radius > largest.radius)
            largest = one;
    }
    if (largest.radius < 0) return false;
    memcpy(out->origin, largest.centre, sizeof out->origin);
    plane_axes(largest.normal, out->u, out->w);
    return true;
}

static lam_status place_faces(parting *p, size_t joined, const plane_axes_at *at, lam_error *error) {
    lam_status status = LAM_OK;
    const faces_before *b = p->before;
    const size_t count = b->start[joined + 1] - b->start[joined];
    TRY(array_grow(&p->placed, &p->placed_room, count, sizeof *p->placed, "parts of faces", error));
    p->n_placed = count;
    p->widest = 0;
    for (size_t k = 0; k < count; k++) {
        const uint32_t i = b->order[b->start[joined] + k];
        p->placed[k] = place(at, (const double(*)[3])b->vertices, b->elements[i]);
        p->placed[k].face = b->face[i];
        p->widest = fmax(p->widest, p->placed[k].high[0] - p->placed[k].low[0]);
    }
    array_sort(p->placed, count, sizeof *p->placed, by_low);
done:
    return status;
}

/* The first face that may reach as far as x along u. */
static size_t first_from(const parting *p, double x) {
    size_t low = 0, high = p->n_placed;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (p->placed[middle].low[0] < x - p->widest)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Gathers in common what an element has in common with faces, each face once. */
static lam_status overlap(parting *p, uint32_t element, const placed_polygon *own, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    p->n_common = 0;
    for (size_t k = first_from(p, own->low[0]); k < p->n_placed && p->placed[k].low[0] <= own->high[0]; k++) {
        const placed_polygon *of = &p->placed[k];
        if (of->high[0] < own->low[0] || of->high[1] < own->low[1] || of->low[1] > own->high[1]) continue;
        const double area = flat_polygons_overlap(&own->flat, &of->flat);
        if (!(area > least_share * fmin(own->area, of->area))) continue;
        TRY(array_grow(&p->common, &p->common_room, p->n_common + 1, sizeof *p->common, "parts of faces",
                       error));
        p->common[p->n_common++] = (scene_face_part){element, of->face, area};
    }
    if (p->n_common == 0) goto done;
    qsort(p->common, p->n_common, sizeof *p->common, by_face);
    for (size_t k = 1; k < p->n_common; k++)
        if (p->common[k].face == p->common[n].face)
            p->common[n].area += p->common[k].area;
        else
            p->common[++n] = p->common[k];
    p->n_common = n + 1;
done:
    return status;
}

/* Gives an element its face, or its parts. */
static lam_status take_common(parting *p, uint32_t element, double area, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *const face = &p->m->faces.of[element];
    *face = SCENE_FACE_NONE;
    for (size_t k = 0; k < p->n_common; k++)
        if (p->common[k].area >= (1 - least_share) * area) *face = p->common[k].face;
    if (*face != SCENE_FACE_NONE || p->n_common == 0) goto done;
    TRY(array_grow(&p->parts, &p->part_room, p->n_parts + p->n_common, sizeof *p->parts, "parts of faces",
                   error));
    memcpy(p->parts + p->n_parts, p->common, p->n_common * sizeof *p->common);
    p->n_parts += p->n_common;
done:
    return status;
}

/* The elements of one joined face. */
static lam_status part_one(parting *p, size_t joined, lam_error *error) {
    lam_status status = LAM_OK;
    const faces_before *b = p->before;
    const mesh *m = p->m;
    const uint32_t first = p->start[joined], end = p->start[joined + 1], *whole = b->order + b->start[joined];
    plane_axes_at at;
    const bool apart = b->start[joined + 1] - b->start[joined] > 1 && set_axes(b, joined, &at);
    for (uint32_t k = first; k < end && !apart; k++) m->faces.of[p->elements[k]] = b->face[*whole];
    if (!apart) goto done;
    TRY(place_faces(p, joined, &at, error));
    for (uint32_t k = first; k < end; k++) {
        const uint32_t i = p->elements[k];
        const placed_polygon own = place(&at, (const double(*)[3])m->vertices, m->elements[i]);
        TRY(overlap(p, i, &own, error));
        TRY(take_common(p, i, own.area, error));
    }
done:
    return status;
}

static int by_element(const void *a, const void *b) {
    const scene_face_part *p = a, *q = b;
    if (p->element != q->element) return p->element < q->element ? -1 : 1;
    return by_face(a, b);
}

lam_status faces_part(mesh *m, const faces_before *before, lam_error *error) {
    lam_status status = LAM_OK;
    parting p = {.m = m, .before = before};
    if (before->n == 0) return LAM_OK;
    p.start = memory_allocate(before->n_joined + 1, sizeof *p.start, "parts of faces", error);
    p.elements = memory_allocate(m->n, sizeof *p.elements, "parts of faces", error);
    if (p.start == NULL || p.elements == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) p.start[m->faces.of[i]]++;
    for (size_t j = 0; j < before->n_joined; j++) p.start[j + 1] += p.start[j];
    for (size_t i = m->n; i-- > 0;) p.elements[--p.start[m->faces.of[i]]] = (uint32_t)i;
    for (size_t j = 0; j < before->n_joined; j++) TRY(part_one(&p, j, error));
    array_sort(p.parts, p.n_parts, sizeof *p.parts, by_element);
    m->faces.parts = p.parts;
    m->faces.n_parts = p.n_parts;
    p.parts = NULL;
done:
    free(p.start);
    free(p.elements);
    free(p.placed);
    free(p.common);
    free(p.parts);
    return status;
}
