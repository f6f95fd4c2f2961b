/* F(x_l, y) of one first hit for all positions of a light: the kernel in vector registers, and visibility by
 * a ray to each position or by maps that were made once. */
#include "solver/walk/reuse_weights.h"

#include "solver/base/cpu.h"
#include "solver/base/vector3.h"
#include "solver/walk/blend.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* These bound maps; PART_LEAST: cells along the side of the map of a part, below which fewer parts are
 * better. */
enum { SIDE_MOST = 1 << 14, SPLIT_MOST = 4, PART_LEAST = 32 };

/* The largest diagonal of a part of a light, times the radius of the scene. */
static const double part_most = .1;

/* Far below the fourth power of any distance, added to it so that nothing is divided by 0. */
static const float tiny = 1e-30f;

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The direction through the middle of a cell, in the frame; false for a cell beyond the disc. */
static bool direction_of(const light_maps *m, size_t cell, float out[3]) {
    const size_t side = m->side;
    const float per = 2 / (float)side;
    const size_t row = cell / side;
    const float u = ((float)(cell % side) + .5f) * per - 1;
    if (row < side) {
        const float w = ((float)row + .5f) * per - 1;
        out[0] = u;
        out[1] = w;
        out[2] = 1;
        if (m->way != REUSE_MAPS) return true;
        const float size = u * u + w * w, inside = size < 1 ? 1 : .999f / sqrtf(size);
        out[0] *= inside; /* cells at the rim have their nearest direction inside */
        out[1] *= inside;
        out[2] = sqrtf(1 - fminf(size * inside * inside, 1));
        return size < 2;
    }
    const size_t face = (row - side) / (side / 2);
    const float w = ((float)((row - side) % (side / 2)) + .5f) * per, one = face % 2 == 0 ? 1 : -1;
    out[0] = face < 2 ? one : u;
    out[1] = face < 2 ? u : one;
    out[2] = w;
    return true;
}

size_t light_maps_split(const walk_scene *s, const moving_light *l, const light_pieces *p) {
    double centre[3], radius, across = 0;
    if (!p->parallelogram) return 1;
    mesh_bounds(s->m, centre, &radius);
    for (int k = 0; k < 2; k++) {
        double diagonal[3];
        subtract3(l->corner[k + 2], l->corner[k], diagonal);
        across = fmax(across, sqrt(dot3(diagonal, diagonal)));
    }
    const double split = ceil(across / (part_most * radius));
    return split > SPLIT_MOST ? SPLIT_MOST : split > 1 ? (size_t)split : 1;
}

/* The map of a part of the light at a position, from its middle. */
static void look(const walk_scene *s, const light_frame *f, const float middle[3], light_maps *m,
                 size_t first) {
    const facets *facet = visibility_facets(s->v);
    float centre[3];
    for (int d = 0; d < 3; d++) centre[d] = dot(f->turn[d], middle) + f->move[d];
    uint32_t self[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = VISIBILITY_NOTHING;
    for (size_t begin = 0; begin < m->one; begin += VISIBILITY_PACKET) {
        const size_t n = m->one - begin < VISIBILITY_PACKET ? m->one - begin : VISIBILITY_PACKET;
        ray_packet rays;
        hit_packet hits;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            float v[3] = {0, 0, 1};
            (void)direction_of(m, begin + (i < n ? i : 0), v);
            const float over = 1 / sqrtf(dot(v, v));
            for (int d = 0; d < 3; d++) {
                rays.origin[d][i] = centre[d];
                rays.direction[d][i] =
                    over * (v[0] * f->tangent[d] + v[1] * f->bitangent[d] + v[2] * f->normal[d]);
            }
        }
        visibility_cast(s->v, &rays, n, self, VISIBILITY_TOGETHER, &hits);
        for (size_t i = 0; i < n; i++) {
            const size_t at = first + begin + i;
            const bool met = hits.element[i] != VISIBILITY_NOTHING;
            const uint32_t seen = met ? facet->of_element[hits.element[i] % s->m->n] : VISIBILITY_NOTHING;
            if (m->cell != NULL)
                m->cell[at] = (map_cell){.facet = seen, .distance = met ? hits.distance[i] : INFINITY};
            else
                m->facet[at] = seen;
        }
    }
}

void light_maps_free(light_maps *m) {
    free(m->facet);
    free(m->cell);
    *m = (light_maps){.side = 0};
}

lam_status light_maps_create(const walk_scene *s, size_t n, const light_frame *frames,
                             const light_pieces *pieces, reuse_way way, size_t resolution, size_t split,
                             light_maps *out, lam_error *error) {
    while (split > 1 && resolution / split < PART_LEAST) split--;
    const size_t each = resolution / split, parts = split * split;
    light_maps m = {.way = way, .split = split, .side = each + each % 2};
    m.one = way == REUSE_MAPS ? m.side * m.side : 3 * m.side * m.side;
    m.cells = parts * m.one;
    if (resolution > SIDE_MOST || m.cells > INT32_MAX / n)
        return status_fail(
            error, LAM_ERR_ARGUMENT,
            "visibility maps of %zu cells a side for %zu positions of %zu parts: more than 2^31 "
            "cells",
            resolution, n, parts);
    if (way == REUSE_MAPS)
        m.cell = memory_allocate(n, m.cells * sizeof *m.cell, "visibility maps", error);
    else
        m.facet = memory_allocate(n, m.cells * sizeof *m.facet, "visibility maps", error);
    if (m.facet == NULL && m.cell == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < n * parts; k++) {
        float middle[3];
        light_pieces_middle(pieces, split, k % parts, middle);
        look(s, &frames[k / parts], middle, &m, k * m.one);
    }
    *out = m;
    return LAM_OK;
}

#define CPU_KERNELS "solver/walk/reuse_kernels.inc"
#include "solver/base/cpu_kernels.inc"

/* Sets f[l * HITS_BLOCK] to 0 for the positions l between which and hit k something stands, but for the
 * path's own. Segments begin above the face that was hit by more than rounding, and all in one point. */
static void see_all(const walk_scene *s, size_t n, const light_frame *frames, const first_hits *h, size_t k,
                    float *f) {
    uint32_t which[VISIBILITY_PACKET];
    const float lift = 4 * (float)visibility_rounding(s->v) + (float)visibility_rise(s->v, h->element[k]);
    const float local[3] = {h->local[0][k], h->local[1][k], h->local[2][k]};
    float y[3];
    ray_packet segments;
    size_t count = 0;
    for (int d = 0; d < 3; d++) {
        y[d] = h->y[d][k] + lift * h->normal[d][k];
        for (int i = 0; i < VISIBILITY_PACKET; i++) {
            segments.origin[d][i] = y[d];
            segments.direction[d][i] = 0;
        }
    }
    for (size_t l = 0; l <= n; l++) {
        if (l < n && l != h->position[k] && f[l * HITS_BLOCK] > 0) {
            for (int d = 0; d < 3; d++)
                segments.direction[d][count] = dot(frames[l].turn[d], local) + frames[l].move[d] - y[d];
            which[count++] = (uint32_t)l;
        }
        if (count == 0 || (l < n && count < VISIBILITY_PACKET)) continue;
        const unsigned blocked = visibility_between(s->v, &segments, count);
        for (size_t i = 0; i < count; i++)
            if ((blocked >> i & 1) != 0) f[which[i] * HITS_BLOCK] = 0;
        count = 0;
    }
}

/* f[l * HITS_BLOCK + k] = F(x_l, y_k) times pi for n hits from begin on, a multiple of HITS_LANES. */
static void kernels_of(const walk_scene *s, size_t n_positions, const light_frame *frames,
                       const light_maps *maps, const first_hits *h, size_t begin, size_t n, float *f) {
    typedef void exchange(size_t, const light_frame *, const first_hits *, size_t, float *);
    typedef void look_up(size_t, const light_frame *, uint32_t, size_t, const map_cell *, const first_hits *,
                         size_t, float *);
    typedef void project(size_t, const light_frame *, uint32_t, size_t, const uint32_t *, const first_hits *,
                         size_t, float *);
    static exchange *const exchanges[] = CPU_TABLE(exchange_portable, exchange_avx2, exchange_avx512);
    static look_up *const look_ups[] = CPU_TABLE(maps_portable, maps_avx2, maps_avx512);
    static project *const projects[] = CPU_TABLE(cubes_portable, cubes_avx2, cubes_avx512);
    const cpu_level level = cpu_best();
    for (size_t l = 0; l < n_positions; l++) {
        float *const row = f + l * HITS_BLOCK;
        if (maps != NULL && maps->way == REUSE_CUBES) {
            projects[level](n, &frames[l], (uint32_t)l, maps->side, maps->facet + l * maps->cells, h, begin,
                            row);
            continue;
        }
        exchanges[level](n, &frames[l], h, begin, row);
        if (maps != NULL)
            look_ups[level](n, &frames[l], (uint32_t)l, maps->side, maps->cell + l * maps->cells, h, begin,
                            row);
    }
    for (size_t k = 0; k < n && maps == NULL && begin + k < h->count; k++)
        see_all(s, n_positions, frames, h, begin + k, f + k);
}

void reuse_weights(const walk_scene *s, size_t n, const light_frame *frames, const light_maps *maps,
                   const first_hits *hits, float *work, float *weight) {
    typedef void gain(size_t, float, const float *, float *);
    static gain *const gains[] = CPU_TABLE(gain_portable, gain_avx2, gain_avx512);
    const cpu_level level = cpu_best();
    float *const sum = work + HITS_BLOCK * n;
    for (size_t begin = 0; begin < hits->count; begin += HITS_BLOCK) {
        const size_t left = hits->count - begin, count = left < HITS_BLOCK ? left : HITS_BLOCK;
        const size_t filled = (count + HITS_LANES - 1) / HITS_LANES * HITS_LANES;
        kernels_of(s, n, frames, maps, hits, begin, filled, work);
        memset(sum, 0, filled * sizeof *sum);
        for (size_t l = 0; l < n; l++) gains[level](filled, frames[l].paths, work + l * HITS_BLOCK, sum);
        for (size_t k = 0; k < count; k++) {
            const float scale = sum[k] > 0 ? 1 / sum[k] : 0;
            float *const out = weight + (begin + k) * n;
            for (size_t l = 0; l < n; l++) out[l] = work[l * HITS_BLOCK + k] * scale;
        }
    }
}
