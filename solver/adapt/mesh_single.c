#include "solver/adapt/mesh_single.h"

#include "solver/base/random.h"
#include "solver/formfactor/visibility/visibility.h"

#include <stdlib.h>

enum { QUARTERS = GATHER_QUARTERS, HITS = GATHER_QUARTERS * GATHER_HALVES * GATHER_RAYS };

/* A ray that met an element: from which point, and in which half. */
typedef struct hit {
    uint32_t element;
    uint8_t quarter, half;
} hit;

static int by_element(const void *a, const void *b) {
    const uint32_t x = ((const hit *)a)->element, y = ((const hit *)b)->element;
    return (x > y) - (x < y);
}

/* The values of a look. */
enum { VARIANCE, SQUARE, VALUES };

/* Adds an element by its hits from the points, which are GATHER_RAYS F on average. */
static void add_element(double area, double hits[QUARTERS][GATHER_HALVES], double out[VALUES]) {
    const double scale = 1. / (GATHER_RAYS * GATHER_RAYS) / QUARTERS / area;
    double mean[GATHER_HALVES] = {0}, variance = 0, square = 0;
    for (size_t q = 0; q < QUARTERS; q++)
        for (size_t h = 0; h < GATHER_HALVES; h++) mean[h] += hits[q][h] / QUARTERS;
    for (size_t q = 0; q < QUARTERS; q++) {
        variance += (hits[q][0] - mean[0]) * (hits[q][1] - mean[1]);
        square += hits[q][0] * hits[q][1];
    }
    out[VARIANCE] += GATHER_QUARTERS_LACK * scale * variance;
    out[SQUARE] += scale * square;
}

static void look(const gather *g, const mesh *m, uint32_t i, uint64_t key, double out[VALUES]) {
    double points[QUARTERS][3], rho2 = 0;
    uint32_t met[HITS];
    hit hits[HITS];
    size_t n = 0;
    gather_quarters(g, i, key, points);
    gather_hits(g, i, key, QUARTERS, (const double(*)[3])points, met);
    for (size_t k = 0; k < HITS; k++)
        if (met[k] != VISIBILITY_NOTHING)
            hits[n++] = (hit){met[k], (uint8_t)(k / (GATHER_HALVES * GATHER_RAYS)),
                              (uint8_t)(k / GATHER_RAYS % GATHER_HALVES)};
    qsort(hits, n, sizeof *hits, by_element);
    for (size_t v = 0; v < VALUES; v++) out[v] = 0;
    for (size_t first = 0, last; first < n; first = last) {
        double of[QUARTERS][GATHER_HALVES] = {{0}};
        for (last = first; last < n && hits[last].element == hits[first].element; last++)
            of[hits[last].quarter][hits[last].half]++;
        add_element(m->area[hits[first].element], of, out);
    }
    for (size_t c = 0; c < m->n_channels; c++)
        rho2 += (double)m->reflectance[c * m->n + i] * (double)m->reflectance[c * m->n + i];
    for (size_t v = 0; v < VALUES; v++) out[v] *= rho2;
}

lam_status mesh_single(const mesh *m, uint64_t seed, const progress *p, const mesh_error_groups *groups,
                       lam_error *error) {
    lam_status status = LAM_OK;
    gather *g = NULL;
    look_plan l = {.start = NULL};
    double *seen = NULL;
    TRY(look_plan_make(m, 0, NULL, NULL, groups->fewer, &l, error));
    const size_t looks = l.first[m->n_groups];
    seen = memory_allocate(looks, VALUES * sizeof *seen, "error of the mesh", error);
    if (seen == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gather_create(m, 0, NULL, NULL, NULL, NULL, &g, error));
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < looks; k++)
        if (!progress_cancelled(p))
            look(g, m, l.chosen[k], random_hash(random_hash(seed) ^ random_hash(k + 1)), seen + k * VALUES);
    if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    for (size_t k = 0; k < m->n_groups; k++) {
        const look_sum variance = look_plan_sum(&l, VALUES, seen, VARIANCE, k),
                       square = look_plan_sum(&l, VALUES, seen, SQUARE, k);
        if (l.first[k + 1] == l.first[k]) continue;
        groups->variance[k] = variance.sum / l.group_area[k];
        groups->noise[k] = variance.noise / l.group_area[k];
        groups->light2[k] = square.sum > 0 ? square.sum / l.group_area[k] : 0;
    }
done:
    gather_free(g);
    look_plan_free(&l);
    free(seen);
    return status;
}
