/* F(x_l, y) of one first hit for all positions of a light: the kernel in vector registers, and visibility by
 * a ray to each position or by maps that were made once. */
#include "solver/walk/reuse_weights.h"

#include "solver/base/cpu.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE_MOST = 1 << 14 };

/* A hit within this part of the distance to y, or as rounding moves it, is y. */
static const float near_part = 1e-4f;

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void point_of(const light_frame *f, const float local[3], float out[3]) {
    for (int d = 0; d < 3; d++) out[d] = dot(f->turn[d], local) + f->move[d];
}

/* Sets f[l] to 0 where a ray from x_l meets something before y. */
static void see(const walk_scene *s, size_t count, const uint32_t *which, const float (*x)[3],
                const first_hit *hit, float *f) {
    const facets *facet = visibility_facets(s->v);
    const uint32_t own = facet->of_element[hit->element % s->m->n];
    const float rounding = (float)visibility_rounding(s->v);
    uint32_t self[VISIBILITY_PACKET];
    for (size_t begin = 0; begin < count; begin += VISIBILITY_PACKET) {
        const size_t n = count - begin < VISIBILITY_PACKET ? count - begin : VISIBILITY_PACKET;
        ray_packet rays;
        hit_packet hits;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            self[i] = VISIBILITY_NOTHING;
            const size_t k = begin + (i < n ? i : 0);
            for (int d = 0; d < 3; d++) {
                rays.origin[d][i] = x[k][d];
                rays.direction[d][i] = hit->y[d] - x[k][d];
            }
        }
        visibility_cast(s->v, &rays, n, self, VISIBILITY_TOGETHER, &hits);
        for (size_t i = 0; i < n; i++) {
            if (hits.element[i] == VISIBILITY_NOTHING) continue;
            const float r[3] = {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
            const float last = 1 - near_part - 4 * rounding / sqrtf(dot(r, r));
            const bool at_y = !hits.back[i] && facet->of_element[hits.element[i]] == own;
            if (!at_y && hits.distance[i] < last) f[which[begin + i]] = 0;
        }
    }
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

static void look(const walk_scene *s, const light_frame *f, light_maps *m, size_t position) {
    const facets *facet = visibility_facets(s->v);
    uint32_t self[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = VISIBILITY_NOTHING;
    for (size_t begin = 0; begin < m->cells; begin += VISIBILITY_PACKET) {
        const size_t n = m->cells - begin < VISIBILITY_PACKET ? m->cells - begin : VISIBILITY_PACKET;
        ray_packet rays;
        hit_packet hits;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            float v[3] = {0, 0, 1};
            (void)direction_of(m, begin + (i < n ? i : 0), v);
            const float over = 1 / sqrtf(dot(v, v));
            for (int d = 0; d < 3; d++) {
                rays.origin[d][i] = f->centre[d];
                rays.direction[d][i] =
                    over * (v[0] * f->tangent[d] + v[1] * f->bitangent[d] + v[2] * f->normal[d]);
            }
        }
        visibility_cast(s->v, &rays, n, self, VISIBILITY_TOGETHER, &hits);
        for (size_t i = 0; i < n; i++) {
            const size_t at = position * m->cells + begin + i;
            const bool met = hits.element[i] != VISIBILITY_NOTHING;
            m->facet[at] = met ? facet->of_element[hits.element[i]] : VISIBILITY_NOTHING;
            if (m->distance != NULL) m->distance[at] = met ? hits.distance[i] : INFINITY;
        }
    }
}

void light_maps_free(light_maps *m) {
    free(m->facet);
    free(m->distance);
    *m = (light_maps){.side = 0};
}

lam_status light_maps_create(const walk_scene *s, size_t n, const light_frame *frames, reuse_way way,
                             size_t resolution, light_maps *out, lam_error *error) {
    light_maps m = {.way = way, .side = resolution + resolution % 2};
    m.cells = way == REUSE_MAPS ? m.side * m.side : 3 * m.side * m.side;
    if (resolution > SIDE_MOST || m.cells > INT32_MAX / n)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "visibility maps of %zu cells a side for %zu positions: more than 2^31 cells",
                           resolution, n);
    m.facet = memory_allocate(n, m.cells * sizeof *m.facet, "visibility maps", error);
    if (m.facet != NULL && way == REUSE_MAPS)
        m.distance = memory_allocate(n, m.cells * sizeof *m.distance, "visibility maps", error);
    if (m.facet == NULL || (way == REUSE_MAPS && m.distance == NULL)) {
        light_maps_free(&m);
        return LAM_ERR_MEMORY;
    }
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t l = 0; l < n; l++) look(s, &frames[l], &m, l);
    *out = m;
    return LAM_OK;
}

void light_table_free(light_table *t) {
    free(t->turn[0]);
    *t = (light_table){.n = 0};
}

lam_status light_table_create(size_t n, const light_frame *frames, light_table *out, lam_error *error) {
    enum { NUMBERS = sizeof(light_frame) / sizeof(float) };
    float *all = memory_allocate(n, NUMBERS * sizeof *all, "positions", error);
    light_table t = {.n = n};
    float **const groups[] = {t.turn, t.move, t.tangent, t.bitangent, t.normal, t.centre};
    static const size_t sizes[] = {9, 3, 3, 3, 3, 3};
    size_t at = 0;
    if (all == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < sizeof sizes / sizeof *sizes; g++)
        for (size_t k = 0; k < sizes[g]; k++) groups[g][k] = all + n * at++;
    for (size_t l = 0; l < n; l++) {
        const light_frame *f = &frames[l];
        for (int d = 0; d < 3; d++) {
            for (int k = 0; k < 3; k++) t.turn[3 * d + k][l] = f->turn[d][k];
            t.move[d][l] = f->move[d];
            t.tangent[d][l] = f->tangent[d];
            t.bitangent[d][l] = f->bitangent[d];
            t.normal[d][l] = f->normal[d];
            t.centre[d][l] = f->centre[d];
        }
    }
    *out = t;
    return LAM_OK;
}

#define CPU_KERNELS "solver/walk/reuse_kernels.inc"
#include "solver/base/cpu_kernels.inc"

/* Sets f to 0 where rays find something before y, but for the path's own position. */
static void see_all(const walk_scene *s, size_t n, const light_frame *frames, const first_hit *hit,
                    float *f) {
    enum { AT_ONCE = 64 };
    uint32_t which[AT_ONCE];
    float x[AT_ONCE][3];
    size_t count = 0;
    for (size_t l = 0; l < n; l++) {
        if (l == hit->position || !(f[l] > 0)) continue;
        point_of(&frames[l], hit->local, x[count]);
        which[count++] = (uint32_t)l;
        if (count < AT_ONCE) continue;
        see(s, count, which, (const float(*)[3])x, hit, f);
        count = 0;
    }
    if (count > 0) see(s, count, which, (const float(*)[3])x, hit, f);
}

void reuse_kernels(const walk_scene *s, const light_table *table, const light_frame *frames,
                   const light_maps *maps, const first_hit *hit, float *f) {
    typedef void exchange(const light_table *, const first_hit *, const float *, bool, float *);
    typedef void show(const light_table *, const light_maps *, const first_hit *, uint32_t, float *);
    static exchange *const exchanges[] = CPU_TABLE(exchange_portable, exchange_avx2, exchange_avx512);
    static show *const shows[] = CPU_TABLE(show_portable, show_avx2, show_avx512);
    const cpu_level level = cpu_best();
    exchanges[level](table, hit, s->m->normal[hit->element], maps != NULL && maps->way == REUSE_CUBES, f);
    const float own = f[hit->position];
    if (maps == NULL) {
        see_all(s, table->n, frames, hit, f);
        return;
    }
    shows[level](table, maps, hit, visibility_facets(s->v)->of_element[hit->element], f);
    f[hit->position] = own;
}
