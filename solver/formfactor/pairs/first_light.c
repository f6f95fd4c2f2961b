#include "solver/formfactor/pairs/first_light.h"

#include "solver/base/random.h"
#include "solver/formfactor/pairs/occlusion.h"

#include <math.h>
#include <stdlib.h>

/* CLOSELY_MOST: bright elements that are estimated one by one. STAND_FOR_ALL: above that, 1 over the share of
 * the light from which on an element counts by itself, and the size of the sample of the others. */
enum { CLOSELY_MOST = 16, STAND_FOR_ALL = 96 };

struct first_light {
    const mesh *m;
    visibility *v;
    polygon *polygons;
    pair_factor_rules rules;
    occlusion occlusion;
};

lam_status first_light_create(const mesh *m, uint64_t seed, first_light **out, lam_error *error) {
    lam_status status = LAM_OK;
    first_light *l = memory_allocate(1, sizeof *l, "direct illumination", error);
    if (l == NULL) TRY(LAM_ERR_MEMORY);
    l->m = m;
    l->polygons = memory_allocate(m->n, sizeof *l->polygons, "direct illumination", error);
    if (l->polygons == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) polygon_of_element(m, i, &l->polygons[i]);
    pair_factor_rules_init(&l->rules);
    TRY(visibility_create(m, &l->v, error));
    l->occlusion = (occlusion){.v = l->v,
                               .area = m->area,
                               .polygons = l->polygons,
                               .rules = &l->rules,
                               .tolerance = 1e-5,
                               .accuracy = 3e-5,
                               .segments = 64,
                               .seed = seed};
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

/* The visible part of the exchange area of two elements; closely: by occlusion_estimate where the test is
 * mixed. */
static double seen(const first_light *l, uint32_t e, uint32_t i, bool closely) {
    double part;
    if (e == i) return 0;
    const uint32_t low = e < i ? e : i, high = e < i ? i : e;
    const double g =
        pair_factor_exchange(&l->rules, &l->polygons[e], &l->polygons[i], l->occlusion.tolerance);
    if (g <= 0) return 0;
    const bool mixed = occlusion_test(&l->occlusion, low, high, g, &part) == OCCLUSION_PARTIAL;
    return mixed && closely ? occlusion_estimate(&l->occlusion, low, high, g) : part;
}

/* cos cos' A A' / (pi r^2) between the centroids. */
static double kernel(const first_light *l, uint32_t e, uint32_t i) {
    const polygon *p = &l->polygons[e], *q = &l->polygons[i];
    double r2 = 0, leaving = 0, arriving = 0;
    for (int d = 0; d < 3; d++) {
        const double r = q->centre[d] - p->centre[d];
        r2 += r * r;
        leaving += r * p->normal[d];
        arriving -= r * q->normal[d];
    }
    if (!(leaving > 0 && arriving > 0)) return 0;
    return l->m->area[e] * l->m->area[i] * leaving * arriving / (M_PI * r2 * r2);
}

/* sum_e E_e g_ei over many bright elements. Those above 1/STAND_FOR_ALL of all sum_e E_e K_ei one by one; the
 * others by systematic sampling in proportion to E_e K_ei: rest times the mean of g / K over the sample. */
static double of_many(const first_light *l, size_t count, const uint32_t *of, const float *E, uint32_t i,
                      double *g) {
    double all = 0, rest = 0, sum = 0, taken = 0, ratio = 0, passed = 0;
    for (size_t k = 0; k < count; k++) all += g[k] = (double)E[of[k]] * kernel(l, of[k], i);
    const double large = all / STAND_FOR_ALL;
    for (size_t k = 0; k < count; k++) {
        if (g[k] > large)
            sum += (double)E[of[k]] * seen(l, of[k], i, false);
        else
            rest += g[k];
    }
    const double step = rest / STAND_FOR_ALL;
    double at = step * random_to_double(random_scatter(((uint64_t)i + 1) * RANDOM_STEP));
    for (size_t k = 0; k < count && rest > 0; k++) {
        if (g[k] > large) continue;
        passed += g[k];
        if (!(at < passed)) continue;
        const double one = (double)E[of[k]] * seen(l, of[k], i, false) / g[k];
        for (; at < passed; at += step, taken++) ratio += one;
    }
    return taken > 0 ? sum + rest * ratio / taken : sum;
}

lam_status first_light_of(const first_light *l, const float *E, double *H, bool *known, lam_error *error) {
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
        double *g = malloc((count + 1) * sizeof *g);
        if (g == NULL) __atomic_store_n(&failed, 1, __ATOMIC_RELAXED);
#pragma omp for schedule(dynamic, 64)
        for (size_t i = 0; i < n; i++) {
            double sum = 0;
            if (g == NULL) continue;
            if (count <= CLOSELY_MOST)
                for (size_t k = 0; k < count; k++)
                    sum += (double)E[of[k]] * seen(l, of[k], (uint32_t)i, true);
            else
                sum = of_many(l, count, of, E, (uint32_t)i, g);
            H[i] = sum / l->m->area[i];
        }
        free(g);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "direct illumination: cannot allocate %zu numbers", count);
done:
    free(of);
    return status;
}

lam_status first_light_for_judge(void *context, const float *E, double *H, bool *known, lam_error *error) {
    return first_light_of(context, E, H, known, error);
}
