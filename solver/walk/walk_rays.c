/* The rays of walks: elements in the form that walks need them in, and origins and directions of many walks
 * at once. */
#include "solver/base/cpu.h"
#include "solver/base/vector3.h"
#include "solver/walk/blend.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>

static float to_unit(uint32_t bits) {
    return (float)(bits >> 8) * 0x1p-24f;
}

#define CPU_KERNELS "solver/walk/walk_kernels.inc"
#include "solver/base/cpu_kernels.inc"

/* An edge from corner a. */
static void set_edge(const double *a, const double *b, float out[3]) {
    for (int d = 0; d < 3; d++) out[d] = (float)(b[d] - a[d]);
}

/* Twice the area of a triangle. */
static double twice_area(const double *a, const double *b, const double *c) {
    double u[3], w[3], normal[3];
    subtract3(b, a, u);
    subtract3(c, a, w);
    cross3(u, w, normal);
    return sqrt(dot3(normal, normal));
}

/* True for a quadrilateral that is not a parallelogram. */
static bool set_shape(const mesh *m, const visibility *v, size_t element, walk_shape *s,
                      walk_halves *halves) {
    const uint32_t *corner = m->elements[element];
    const double *a = m->vertices[corner[0]], *b = m->vertices[corner[1]], *c = m->vertices[corner[2]];
    const double *last = c;
    const float lift = 2 * (float)visibility_rounding(v);
    const size_t n_fronts = m->two_sided ? m->n / 2 : m->n;
    bool uneven = false;
    s->facet = visibility_facets(v)->of_element[element % n_fronts] | WALK_TRIANGLE;
    if (mesh_corners(m, element) == 4) {
        const double *e = m->vertices[corner[3]];
        double off = 0, size = 0;
        for (int d = 0; d < 3; d++) {
            off += fabs(a[d] - b[d] + c[d] - e[d]);
            size += fabs(c[d] - a[d]) + fabs(e[d] - b[d]);
        }
        uneven = off > 1e-9 * size;
        if (!uneven) {
            s->facet &= ~WALK_TRIANGLE;
            last = e;
        } else if (halves != NULL) {
            const double first = twice_area(a, b, c), second = twice_area(a, c, e);
            halves->share = (float)(first / (first + second));
            set_edge(a, e, halves->third);
        }
    }
    visibility_recentre(v, a, s->corner);
    set_edge(a, b, s->edge[0]);
    set_edge(a, last, s->edge[1]);
    for (int d = 0; d < 3; d++) {
        s->normal[d] = m->normal[element][d];
        s->corner[d] += lift * s->normal[d];
    }
    for (size_t k = 0; k < m->n_channels; k++) s->reflectance[k] = m->reflectance[k * m->n + element];
    return uneven;
}

lam_status walk_shapes_create(walk_scene *s, lam_error *error) {
    const size_t n = s->m->n;
    bool uneven = false;
    s->shapes = memory_allocate(n, sizeof *s->shapes, "walks", error);
    if (s->shapes == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) uneven = set_shape(s->m, s->v, i, &s->shapes[i], NULL) || uneven;
    if (!uneven) return LAM_OK;
    s->halves = memory_allocate(n, sizeof *s->halves, "walks", error);
    if (s->halves == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        s->halves[i].share = 1;
        set_shape(s->m, s->v, i, &s->shapes[i], &s->halves[i]);
    }
    return LAM_OK;
}

void walk_place_set(walk_places *p, size_t i, const walk_shape *shape, const uint32_t place[4]) {
    for (int d = 0; d < 3; d++) {
        p->corner[d][i] = shape->corner[d];
        p->edge[0][d][i] = shape->edge[0][d];
        p->edge[1][d][i] = shape->edge[1][d];
        p->normal[d][i] = shape->normal[d];
    }
    p->fold[i] = (shape->facet & WALK_TRIANGLE) != 0 ? .5f : 0;
    p->u[i] = to_unit(place[0]);
    p->w[i] = to_unit(place[1]);
    p->x[i] = to_unit(place[2]);
    p->turn[i] = place[3];
}

/* The coordinate u of lane i chooses the triangle of a quadrilateral and is rescaled to [0, 1). */
static void choose_half(walk_places *p, size_t i, const walk_shape *shape, const walk_halves *h) {
    if (p->u[i] < h->share) {
        p->u[i] /= h->share;
        return;
    }
    p->u[i] = (p->u[i] - h->share) / (1 - h->share);
    for (int d = 0; d < 3; d++) {
        p->edge[0][d][i] = shape->edge[1][d];
        p->edge[1][d][i] = h->third[d];
    }
}

void walk_leave(const walk_places *p, size_t n, ray_packet *rays) {
    typedef void leave(size_t, const walk_places *, ray_packet *);
    static leave *const leaves[] = CPU_TABLE(leave_portable, leave_avx2, leave_avx512);
    leaves[cpu_best()](n, p, rays);
}

void walk_cast(const walk_scene *s, const walker *w, size_t n, ray_packet *rays, hit_packet *hits) {
    const size_t filled = (n + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET * VISIBILITY_PACKET;
    walk_places p[WALK_STREAM / VISIBILITY_PACKET];
    uint32_t self[WALK_STREAM], facet[WALK_STREAM];
    for (size_t j = 0; j < filled; j++) {
        const walker *of = &w[j < n ? j : n - 1];
        const walk_shape *shape = &s->shapes[of->at];
        walk_places *const to = &p[j / VISIBILITY_PACKET];
        const size_t lane = j % VISIBILITY_PACKET;
        walk_place_set(to, lane, shape, of->place);
        if (s->halves != NULL && s->halves[of->at].share < 1)
            choose_half(to, lane, shape, &s->halves[of->at]);
        self[j] = of->at;
        facet[j] = shape->facet & ~WALK_TRIANGLE;
    }
    walk_leave(p, filled / VISIBILITY_PACKET, rays);
    for (size_t j = 0; j < n; j += VISIBILITY_PACKET)
        visibility_cast_lifted(s->v, &rays[j / VISIBILITY_PACKET],
                               n - j < VISIBILITY_PACKET ? n - j : VISIBILITY_PACKET, self + j, facet + j,
                               &hits[j / VISIBILITY_PACKET]);
}
