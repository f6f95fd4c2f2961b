#include "solver/formfactor/rays/ray_crossings.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>

/* Bounding boxes of all elements, one array for each side, from a corner of the scene. */
typedef struct boxes {
    double corner[3], slack; /* slack: a hundred thousandth of the size of the scene, far above rounding */
    float *low[3], *high[3]; /* [n] */
} boxes;

typedef struct ray {
    double origin[3], direction[3], inverse[3];
} ray;

static void boxes_free(boxes *b) {
    free(b->low[0]);
}

static lam_status boxes_make(const mesh *m, boxes *out, lam_error *error) {
    float *at = memory_allocate(6 * m->n, sizeof *at, "rays", error);
    if (at == NULL) return LAM_ERR_MEMORY;
    *out = (boxes){.slack = 0};
    for (int k = 0; k < 3; k++) {
        double least = INFINITY, most = -INFINITY;
        out->low[k] = at + 2 * (size_t)k * m->n;
        out->high[k] = out->low[k] + m->n;
        for (size_t v = 0; v < m->n_vertices; v++) {
            least = fmin(least, m->vertices[v][k]);
            most = fmax(most, m->vertices[v][k]);
        }
        out->corner[k] = least;
        out->slack = fmax(out->slack, 1e-5 * (most - least));
        for (size_t i = 0; i < m->n; i++) {
            double low = INFINITY, high = -INFINITY;
            for (size_t v = 0; v < corner_count(m->elements[i]); v++) {
                low = fmin(low, m->vertices[m->elements[i][v]][k]);
                high = fmax(high, m->vertices[m->elements[i][v]][k]);
            }
            out->low[k][i] = (float)(low - least);
            out->high[k][i] = (float)(high - least);
        }
    }
    return LAM_OK;
}

/* A cosine distribution: the normal and a random unit vector (Marsaglia 1972) add up to its directions. */
static ray ray_of(const mesh *m, size_t i, uint64_t *seed) {
    const uint32_t *corner = m->elements[i];
    double u = random_unit(seed), v = random_unit(seed), x, y, s;
    ray r;
    if (u + v > 1) u = 1 - u, v = 1 - v;
    do {
        x = 2 * random_unit(seed) - 1;
        y = 2 * random_unit(seed) - 1;
        s = x * x + y * y;
    } while (s >= 1);
    const double unit[3] = {2 * x * sqrt(1 - s), 2 * y * sqrt(1 - s), 1 - 2 * s};
    for (int k = 0; k < 3; k++) {
        const double *a = m->vertices[corner[0]], *b = m->vertices[corner[1]], *c = m->vertices[corner[2]];
        r.origin[k] = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
        r.direction[k] = (double)m->normal[i][k] + unit[k];
        r.inverse[k] = 1 / (r.direction[k] != 0 ? r.direction[k] : 1e-30);
    }
    return r;
}

#define LESS(a, b) ((a) < (b) ? (a) : (b))
#define MORE(a, b) ((a) > (b) ? (a) : (b))

/* entry[i]: the distance at which a ray enters box i; infinite where it misses it. The two
 * sides of a flat box are equal in its direction, whatever rounding does. */
static void find_entries(const ray *r, const boxes *b, size_t n, float *restrict entry) {
    float from[3], times[3];
    for (int k = 0; k < 3; k++) {
        from[k] = (float)(r->origin[k] - b->corner[k]);
        times[k] = (float)r->inverse[k];
    }
#pragma omp simd
    for (size_t i = 0; i < n; i++) {
        float first = 0, last = INFINITY;
        for (int k = 0; k < 3; k++) {
            const float one = (b->low[k][i] - from[k]) * times[k],
                        other = (b->high[k][i] - from[k]) * times[k];
            const float near = LESS(one, other), far = MORE(one, other);
            first = MORE(first, near);
            last = LESS(last, far);
        }
        entry[i] = first <= last ? first : INFINITY;
    }
}

/* The distance of the plane of an element, from either side, where the ray meets it inside; else infinite. */
static double meets(const ray *r, const mesh *m, size_t i) {
    const size_t count = corner_count(m->elements[i]);
    const double normal[3] = {m->normal[i][0], m->normal[i][1], m->normal[i][2]};
    const double *a = m->vertices[m->elements[i][0]];
    const double towards = dot3(normal, r->direction);
    const double to[3] = {a[0] - r->origin[0], a[1] - r->origin[1], a[2] - r->origin[2]};
    const double t = dot3(normal, to) / towards;
    if (!(t > 0) || !isfinite(t)) return INFINITY;
    for (size_t v = 0; v < count; v++) {
        const double *p = m->vertices[m->elements[i][v]], *q = m->vertices[m->elements[i][(v + 1) % count]];
        double edge[3], from[3];
        for (int k = 0; k < 3; k++) {
            edge[k] = q[k] - p[k];
            from[k] = r->origin[k] + t * r->direction[k] - p[k];
        }
        const double across[3] = {normal[1] * edge[2] - normal[2] * edge[1],
                                  normal[2] * edge[0] - normal[0] * edge[2],
                                  normal[0] * edge[1] - normal[1] * edge[0]};
        if (dot3(across, from) < 0) return INFINITY;
    }
    return t;
}

lam_status ray_crossings_sample(const mesh *m, uint64_t seed, ray_crossings *out, lam_error *error) {
    enum { RAYS = 256, RAYS_LEAST = 32, COMPARED = 1 << 24 };
    lam_status status = LAM_OK;
    const size_t some = COMPARED / m->n, rays = some > RAYS ? RAYS : some < RAYS_LEAST ? RAYS_LEAST : some;
    double crossed = 0, hits = 0;
    boxes all = {.low = {NULL}};
    float *entry = memory_allocate(m->n, sizeof *entry, "rays", error);
    if (entry == NULL) TRY(LAM_ERR_MEMORY);
    TRY(boxes_make(m, &all, error));
    for (size_t k = 0; k < rays; k++) {
        const size_t self = (size_t)(random_unit(&seed) * (double)m->n);
        const ray r = ray_of(m, self, &seed);
        double hit = INFINITY;
        find_entries(&r, &all, m->n, entry);
        for (size_t i = 0; i < m->n; i++)
            if (entry[i] < INFINITY && i != self) hit = fmin(hit, meets(&r, m, i));
        /* Rounding must not decide whether the flat box of the element that is hit counts. */
        const double reached = hit < INFINITY ? hit + all.slack : 0x1p100;
        for (size_t i = 0; i < m->n; i++)
            if ((double)entry[i] <= reached) crossed += (double)corner_count(m->elements[i]) - 2;
        hits += hit < INFINITY;
    }
    *out = (ray_crossings){.boxes = crossed / (double)rays, .hits = hits / (double)rays};
done:
    boxes_free(&all);
    free(entry);
    return status;
}
