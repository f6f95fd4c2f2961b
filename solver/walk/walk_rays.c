/* The rays of walks: elements in the form that walks need them in, and origins and directions of many walks
 * at once. */
#include "solver/base/cpu.h"
#include "solver/scene/plane.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What leave() reads of up to WALK_STREAM walks. */
typedef struct walk_places {
    float corner[3][WALK_STREAM], edge[2][3][WALK_STREAM], normal[3][WALK_STREAM], per_edge[WALK_STREAM];
    float u[WALK_STREAM], w[WALK_STREAM], x[WALK_STREAM]; /* in [0, 1) */
    uint32_t turn[WALK_STREAM];                           /* in 2^-32 of a turn */
} walk_places;

static float to_unit(uint32_t bits) {
    return (float)(bits >> 8) * 0x1p-24f;
}

static inline float blend(int mask, float a, float b) {
    int x, y;
    memcpy(&x, &a, sizeof x);
    memcpy(&y, &b, sizeof y);
    const int both = (x & mask) | (y & ~mask);
    float value;
    memcpy(&value, &both, sizeof value);
    return value;
}

#define CPU_KERNELS "solver/walk/walk_kernels.inc"
#include "solver/base/cpu_kernels.inc"

/* An edge from corner a. */
static void set_edge(const double *a, const double *b, float out[3]) {
    for (int d = 0; d < 3; d++) out[d] = (float)(b[d] - a[d]);
}

/* True for a quadrilateral that is not a parallelogram. */
static bool set_shape(const mesh *m, const visibility *v, size_t element, walk_shape *s,
                      walk_halves *halves) {
    const uint32_t *corner = m->elements[element];
    const double *a = m->vertices[corner[0]], *b = m->vertices[corner[1]], *c = m->vertices[corner[2]];
    const double *last = c;
    double length = 0;
    bool uneven = false;
    for (int d = 0; d < 3; d++) length += (b[d] - a[d]) * (b[d] - a[d]);
    s->per_edge = (float)(-1 / sqrt(length));
    if (mesh_corners(m, element) == 4) {
        const double *e = m->vertices[corner[3]];
        double off = 0, size = 0;
        for (int d = 0; d < 3; d++) {
            off += fabs(a[d] - b[d] + c[d] - e[d]);
            size += fabs(c[d] - a[d]) + fabs(e[d] - b[d]);
        }
        uneven = off > 1e-9 * size;
        if (!uneven) {
            s->per_edge = -s->per_edge;
            last = e;
        } else if (halves != NULL) {
            const double first = triangle_area(a, b, c), second = triangle_area(a, c, e);
            halves->share = (float)(first / (first + second));
            set_edge(a, e, halves->third);
        }
    }
    visibility_recentre(v, a, s->corner);
    set_edge(a, b, s->edge[0]);
    set_edge(a, last, s->edge[1]);
    for (int d = 0; d < 3; d++) s->normal[d] = m->normal[element][d];
    for (size_t c3 = 0; c3 < m->n_channels; c3++) s->reflectance[c3] = m->reflectance[c3 * m->n + element];
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

static void set_place(const walk_scene *s, const walker *w, size_t j, walk_places *p) {
    const walk_shape *shape = &s->shapes[w->at];
    const float *first = shape->edge[0], *second = shape->edge[1];
    float u = to_unit(w->place[0]), per_edge = shape->per_edge;
    if (s->halves != NULL && s->halves[w->at].share < 1) {
        /* u chooses the triangle and is rescaled to [0, 1). */
        const walk_halves *h = &s->halves[w->at];
        if (u < h->share) {
            u /= h->share;
        } else {
            u = (u - h->share) / (1 - h->share);
            first = shape->edge[1];
            second = h->third;
            per_edge = -1 / sqrtf(first[0] * first[0] + first[1] * first[1] + first[2] * first[2]);
        }
    }
    for (int d = 0; d < 3; d++) {
        p->corner[d][j] = shape->corner[d];
        p->edge[0][d][j] = first[d];
        p->edge[1][d][j] = second[d];
        p->normal[d][j] = shape->normal[d];
    }
    p->per_edge[j] = per_edge;
    p->u[j] = u;
    p->w[j] = to_unit(w->place[1]);
    p->x[j] = to_unit(w->place[2]);
    p->turn[j] = w->place[3];
}

void walk_cast(const walk_scene *s, const walker *w, size_t n, ray_packet *rays, hit_packet *hits) {
    typedef void leave(size_t, const walk_places *, float, ray_packet *);
    static leave *const leaves[] = CPU_TABLE(leave_portable, leave_avx2, leave_avx512);
    const size_t packets = (n + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET;
    walk_places p;
    uint32_t self[WALK_STREAM];
    for (size_t j = 0; j < packets * VISIBILITY_PACKET; j++) {
        const walker *of = &w[j < n ? j : n - 1]; /* the last packet is filled up */
        set_place(s, of, j, &p);
        self[j] = of->at;
    }
    leaves[cpu_best()](packets, &p, 0, rays);
    for (size_t k = 0; k < packets; k++) {
        const size_t left = n - k * VISIBILITY_PACKET;
        visibility_cast(s->v, &rays[k], left < VISIBILITY_PACKET ? left : VISIBILITY_PACKET,
                        self + k * VISIBILITY_PACKET, 0, &hits[k]);
    }
}
