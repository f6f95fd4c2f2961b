/* The rays of walks: elements in the form that walks need them in, and origins and directions of many walks
 * at once. */
#include "solver/base/cpu.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/walk/blend.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A vector of the rays of a packet. */
typedef float lanes __attribute__((vector_size(4 * VISIBILITY_PACKET), aligned(4), may_alias));

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

static void set_shape(const mesh *m, const visibility *v, size_t element, walk_shape *s, float *share) {
    const uint32_t *corner = m->elements[element];
    const double *a = m->vertices[corner[0]], *b = m->vertices[corner[1]], *c = m->vertices[corner[2]];
    const double *last = c;
    const float lift = 2 * (float)visibility_rounding(v) + (float)visibility_rise(v, element);
    const size_t n_fronts = m->two_sided ? m->n / 2 : m->n;
    s->facet = visibility_facets(v)->of_element[element % n_fronts] | WALK_TRIANGLE;
    *share = 1;
    if (mesh_corners(m, element) == 4) {
        const double *e = m->vertices[corner[3]];
        double off = 0, size = 0;
        for (int d = 0; d < 3; d++) {
            off += fabs(a[d] - b[d] + c[d] - e[d]);
            size += fabs(c[d] - a[d]) + fabs(e[d] - b[d]);
        }
        if (off > 1e-9 * size) {
            const double first = twice_area(a, b, c), second = twice_area(a, c, e);
            *share = (float)(first / (first + second));
            set_edge(a, e, s->third);
        } else {
            s->facet &= ~WALK_TRIANGLE;
            last = e;
        }
    }
    visibility_recentre(v, a, s->corner);
    set_edge(a, b, s->edge[0]);
    set_edge(a, last, s->edge[1]);
    for (int d = 0; d < 3; d++) {
        s->normal[d] = m->normal[element][d];
        s->corner[d] += lift * s->normal[d];
    }
}

lam_status walk_shapes_create(walk_scene *s, lam_error *error) {
    const size_t n = s->m->n;
    s->shapes = memory_allocate(n, sizeof *s->shapes, "walks", error);
    s->reflectance = memory_allocate(n, sizeof *s->reflectance, "walks", error);
    s->share = memory_allocate(n, sizeof *s->share, "walks", error);
    if (s->shapes == NULL || s->reflectance == NULL || s->share == NULL) return LAM_ERR_MEMORY;
    for (size_t c = 0; c < s->m->n_channels; c++)
        for (size_t i = 0; i < n; i++) s->reflectance[i].of[c] = s->m->reflectance[c * n + i];
    for (size_t i = 0; i < n; i++) set_shape(s->m, s->v, i, &s->shapes[i], &s->share[i]);
    return LAM_OK;
}

void walk_leave(size_t n, const walk_shape *const *shape, const float *share,
                const uint32_t (*place)[WALK_STREAM], ray_packet *rays, uint32_t *facet) {
    typedef void leave(size_t, const walk_shape *const *, const float *, const uint32_t(*)[WALK_STREAM],
                       ray_packet *, uint32_t *);
    static leave *const leaves[] = CPU_TABLE(leave_portable, leave_avx2, leave_avx512);
    leaves[cpu_best()](n, shape, share, place, rays, facet);
}

/* Of the light that meets a pane T goes on behind it, and all of it comes to the pane, where a part may be
 * reflected. A walk goes one of the ways with 1 + T times its weight, on with the probability T / (1 + T),
 * which leaves the expectation as it is; no other probabilities leave a smaller largest weight. */
static void cross_panes(const walk_scene *s, walk_stream *w, size_t n, ray_packet *rays, hit_packet *hits) {
    for (size_t first = 0; first < n; first += VISIBILITY_PACKET, rays++, hits++) {
        const size_t count = n - first < VISIBILITY_PACKET ? n - first : VISIBILITY_PACKET;
        bool ahead[VISIBILITY_PACKET], there[VISIBILITY_PACKET] = {false}, any = true;
        for (int crossed = 0; any && crossed < PANES_MOST; crossed++) {
            any = false;
            for (size_t i = 0; i < count; i++) {
                const uint32_t pane = hits->element[i];
                ahead[i] = false;
                if (there[i] || pane == VISIBILITY_NOTHING || !mesh_is_pane(s->m, pane)) continue;
                const double T = pane_path_passes(s->m, pane, rays, i);
                ahead[i] = random_unit(&w->random[first + i]) * (1 + T) < T;
                there[i] = !ahead[i];
                for (size_t c = 0; c < WALK_CHANNELS; c++) w->weight[c][first + i] *= 1 + T;
                any = any || ahead[i];
            }
            pane_path_step(s->v, s->m, rays, count, ahead, 0, hits);
        }
    }
}

void walk_cast(const walk_scene *s, walk_stream *w, size_t n, ray_packet *rays, hit_packet *hits) {
    const size_t filled = (n + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET * VISIBILITY_PACKET;
    const walk_shape *shape[WALK_STREAM];
    float share[WALK_STREAM];
    uint32_t self[WALK_STREAM], facet[WALK_STREAM];
    const uint32_t n_elements = (uint32_t)s->m->n;
    for (size_t j = n; j < filled; j++) {
        w->at[j] = w->at[n - 1];
        for (int d = 0; d < 4; d++) w->place[d][j] = w->place[d][n - 1];
    }
    for (size_t j = 0; j < filled; j++) {
        const uint32_t at = w->at[j];
        shape[j] = &s->shapes[at];
        share[j] = s->share[at];
        /* VISIBILITY_NOTHING from n_elements on: a branch would be mispredicted half of the time. */
        self[j] = at | (uint32_t)-(int)((n_elements - 1 - at) >> 31);
    }
    walk_leave(filled, shape, share, w->place, rays, facet);
    visibility_cast_lifted(s->v, rays, n, self, facet, hits);
    if (s->m->glass != NULL) cross_panes(s, w, n, rays, hits);
    for (size_t j = n; j < filled; j++) {
        hits[j / VISIBILITY_PACKET].element[j % VISIBILITY_PACKET] = VISIBILITY_NOTHING;
        hits[j / VISIBILITY_PACKET].back[j % VISIBILITY_PACKET] = false;
    }
}

void walk_stream_meet(const walk_scene *s, const walk_stream *w, size_t n, const hit_packet *hits,
                      uint32_t *met, uint32_t *again) {
    typedef void meet(const walk_scene *, uint32_t, const walk_stream *, size_t, const hit_packet *,
                      uint32_t *, uint32_t *);
    static meet *const meets[] = CPU_TABLE(meet_portable, meet_avx2, meet_avx512);
    meets[cpu_best()](s, (uint32_t)s->m->n, w, n, hits, met, again);
}

void walk_stream_survive(walk_stream *s, size_t n, const uint32_t *met, const uint32_t *again,
                         const float (*reflectance)[WALK_STREAM], uint32_t *alive) {
    typedef void survive(walk_stream *, size_t, const uint32_t *, const uint32_t *,
                         const float(*)[WALK_STREAM], uint32_t *);
    static survive *const survives[] = CPU_TABLE(survive_portable, survive_avx2, survive_avx512);
    survives[cpu_best()](s, n, met, again, reflectance, alive);
}
