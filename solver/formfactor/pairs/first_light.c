#include "solver/formfactor/pairs/first_light.h"

#include "solver/base/random.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/visibility.h"

#include <math.h>
#include <stdlib.h>

/* EACH_MOST: bright elements that are estimated one by one. STAND_FOR_ALL: above that, 1 over the share of
 * the light from which on an element counts by itself, and the size of each half's sample of the others. */
enum { HALVES = 2, EACH_MOST = 16, STAND_FOR_ALL = 64 };
/* Segments of a packet that belong to a half. */
enum { OF_HALF = VISIBILITY_PACKET / HALVES };
/* A packet of segments for each of this factor, up to PACKETS_MOST. */
static const double packet_factor = 1e-3;
enum { PACKETS_MOST = 32 };
/* Relative tolerance of a pair in the open. */
static const double tolerance = 1e-5;

struct first_light {
    const mesh *m;
    visibility *v;
    polygon *polygons;
    pair_factor_rules rules;
    uint64_t seeds[HALVES];
};

lam_status first_light_create(const mesh *m, uint64_t seed, first_light **out, lam_error *error) {
    lam_status status = LAM_OK;
    first_light *l = memory_allocate(1, sizeof *l, "direct illumination", error);
    if (l == NULL) TRY(LAM_ERR_MEMORY);
    l->m = m;
    l->polygons = memory_allocate(m->n, sizeof *l->polygons, "direct illumination", error);
    if (l->polygons == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) polygon_of_element(m, i, &l->polygons[i]);
    for (uint64_t h = 0; h < HALVES; h++) l->seeds[h] = random_stream(seed, h);
    pair_factor_rules_init(&l->rules);
    TRY(visibility_create(m, &l->v, error));
    *out = l;
    l = NULL;
done:
    first_light_destroy(l);
    return status;
}

void first_light_destroy(first_light *l) {
    if (l == NULL) return;
    visibility_destroy(l->v);
    free(l->polygons);
    free(l);
}

/* Segments of both halves between two elements: all[h] gets sum K, seen[h] of those that are not blocked. */
static void cast_packet(const first_light *l, const pair_sampler *samplers, uint32_t first, uint32_t low,
                        uint32_t high, double *all, double *seen) {
    const polygon *p = &l->polygons[low], *q = &l->polygons[high];
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
    double weight[VISIBILITY_PACKET];
    ray_packet segments;
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        double at[4], points[2][3], r2 = 0, leaving = 0, arriving = 0;
        float origin[3], end[3];
        pair_sampler_place(&samplers[k / OF_HALF], first + (uint32_t)(k % OF_HALF), at);
        const double area =
            polygon_point(p, at[0], at[1], points[0]) * polygon_point(q, at[2], at[3], points[1]);
        visibility_recentre(l->v, points[0], origin);
        visibility_recentre(l->v, points[1], end);
        for (int d = 0; d < 3; d++) {
            const double r = points[1][d] - points[0][d];
            r2 += r * r;
            leaving += r * p->normal[d];
            arriving -= r * q->normal[d];
            segments.origin[d][k] = origin[d];
            segments.direction[d][k] = end[d] - origin[d];
        }
        weight[k] = leaving > 0 && arriving > 0 ? area * leaving * arriving / (r2 * r2) : 0;
        from[k] = low;
        to[k] = high;
    }
    const unsigned blocked = visibility_blocked(l->v, &segments, VISIBILITY_PACKET, from, to);
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        all[k / OF_HALF] += weight[k];
        if ((blocked >> k & 1) == 0) seen[k / OF_HALF] += weight[k];
    }
}

/* out[h] = the visible part of the exchange area of two elements by each half, g sum K V / sum K. Their
 * number of segments depends on the factor alone, not on what they meet, so that nothing favours either
 * outcome. Where no segment of a half counts, the other one speaks for it. */
static void find_seen(const first_light *l, uint32_t e, uint32_t i, double out[HALVES]) {
    const uint32_t low = e < i ? e : i, high = e < i ? i : e;
    double all[HALVES] = {0}, seen[HALVES] = {0};
    pair_sampler samplers[HALVES];
    out[0] = out[1] = 0;
    if (e == i) return;
    const double g = pair_factor_exchange(&l->rules, &l->polygons[e], &l->polygons[i], tolerance);
    if (g <= 0) return;
    const double packets = ceil(fmin(g / fmin(l->m->area[e], l->m->area[i]) / packet_factor, PACKETS_MOST));
    for (int h = 0; h < HALVES; h++) pair_sampler_init(&samplers[h], l->seeds[h], low, high);
    for (uint32_t p = 0; p == 0 || p < (uint32_t)packets; p++)
        cast_packet(l, samplers, p * OF_HALF, low, high, all, seen);
    for (int h = 0; h < HALVES; h++) {
        const int of = all[h] > 0 ? h : 1 - h;
        out[h] = all[of] > 0 ? g * seen[of] / all[of] : g;
    }
}

/* The height of a centre above a plane, or about the mean height of what is in front of it: 0 only where no
 * point within the radius is. */
static double height_in_front(double height, double radius) {
    return height >= radius ? height : fmax(0, .5 * (height + radius));
}

/* About the exchange area, for drawing: cos cos' A A' / (pi r^2) between the centroids, 0 for no pair that
 * sees another. */
static double weight_of(const first_light *l, uint32_t e, uint32_t i) {
    const polygon *p = &l->polygons[e], *q = &l->polygons[i];
    const double size = p->radius + q->radius;
    double r2 = 0, leaving = 0, arriving = 0;
    for (int d = 0; d < 3; d++) {
        const double r = q->centre[d] - p->centre[d];
        r2 += r * r;
        leaving += r * p->normal[d];
        arriving -= r * q->normal[d];
    }
    leaving = height_in_front(leaving, q->radius);
    arriving = height_in_front(arriving, p->radius);
    if (e == i || !(leaving > 0 && arriving > 0)) return 0;
    r2 = fmax(r2, .25 * size * size);
    return l->m->area[e] * l->m->area[i] * leaving * arriving / (M_PI * r2 * r2);
}

/* Bright elements, and room for their weights at one receiver. */
typedef struct bright {
    const first_light *l;
    size_t count;
    const uint32_t *of;
    const float *E;
    double *weight; /* [count] */
} bright;

static double emission_of(const bright *b, size_t k) {
    return (double)b->E[b->of[k]];
}

static void add_each(const bright *b, uint32_t i, double sum[HALVES]) {
    for (size_t k = 0; k < b->count; k++) {
        double seen[HALVES];
        find_seen(b->l, b->of[k], i, seen);
        for (int h = 0; h < HALVES; h++) sum[h] += emission_of(b, k) * seen[h];
    }
}

/* Half h of the light of those of small weights, by systematic sampling in proportion to these: their sum
 * times the mean of E g / weight over the sample. */
static double sample_small(const bright *b, uint32_t i, int h, double large, double rest) {
    const double step = rest / STAND_FOR_ALL;
    double at = step * random_to_double(random_hash(b->l->seeds[h] + i)), passed = 0, ratio = 0, taken = 0;
    for (size_t k = 0; k < b->count; k++) {
        double seen[HALVES];
        if (b->weight[k] > large) continue;
        passed += b->weight[k];
        if (!(at < passed)) continue;
        find_seen(b->l, b->of[k], i, seen);
        for (; at < passed; at += step, taken++) ratio += emission_of(b, k) * seen[h] / b->weight[k];
    }
    return taken > 0 ? rest * ratio / taken : 0;
}

/* sum_e E_e g_ei over many bright elements: those above 1/STAND_FOR_ALL of all weights one by one, of the
 * others a sample for each half. */
static void add_many(const bright *b, uint32_t i, double sum[HALVES]) {
    double all = 0, rest = 0;
    for (size_t k = 0; k < b->count; k++)
        all += b->weight[k] = emission_of(b, k) * weight_of(b->l, b->of[k], i);
    const double large = all / STAND_FOR_ALL;
    for (size_t k = 0; k < b->count; k++) {
        double seen[HALVES];
        if (!(b->weight[k] > large)) {
            rest += b->weight[k];
            continue;
        }
        find_seen(b->l, b->of[k], i, seen);
        for (int h = 0; h < HALVES; h++) sum[h] += emission_of(b, k) * seen[h];
    }
    for (int h = 0; h < HALVES && rest > 0; h++) sum[h] += sample_small(b, i, h, large, rest);
}

lam_status first_light_of(const first_light *l, const float *E, double *H, double *D, bool *known,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = l->m->n;
    size_t count = 0;
    int failed = 0;
    uint32_t *of = NULL;
    for (size_t i = 0; i < n; i++) count += E[i] != 0;
    *known = count <= FIRST_LIGHT_MOST;
    if (!*known) return LAM_OK;
    of = memory_allocate(count, sizeof *of, "direct illumination", error);
    if (of == NULL) TRY(LAM_ERR_MEMORY);
    count = 0;
    for (size_t i = 0; i < n; i++)
        if (E[i] != 0) of[count++] = (uint32_t)i;
#pragma omp parallel
    {
        bright b = {l, count, of, E, malloc((count + 1) * sizeof *b.weight)};
        if (b.weight == NULL) __atomic_store_n(&failed, 1, __ATOMIC_RELAXED);
#pragma omp for schedule(dynamic, 64)
        for (size_t i = 0; i < n; i++) {
            double sum[HALVES] = {0};
            if (b.weight == NULL) continue;
            if (count <= EACH_MOST)
                add_each(&b, (uint32_t)i, sum);
            else
                add_many(&b, (uint32_t)i, sum);
            H[i] = .5 * (sum[0] + sum[1]) / l->m->area[i];
            D[i] = .5 * (sum[0] - sum[1]) / l->m->area[i];
        }
        free(b.weight);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "direct illumination: cannot allocate %zu numbers", count);
done:
    free(of);
    return status;
}

lam_status first_light_for_judge(void *context, const float *E, double *H, double *D, bool *known,
                                 lam_error *error) {
    return first_light_of(context, E, H, D, known, error);
}
