#include "solver/method/two_mesh/proximity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* cos 60 degrees */
static const double facing = .5;

typedef struct site {
    double centre[3]; /* centroid by area */
    double normal[3]; /* mean by area, of length 1 or 0 */
} site;

static double square_distance(const double a[3], const double b[3]) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

static site site_of(const build_problem *problem, const uint32_t *elements, size_t count) {
    site s = {{0}, {0}};
    double area = 0, length = 0;
    for (size_t i = 0; i < count; i++) {
        const uint32_t e = elements[i];
        for (int d = 0; d < 3; d++) {
            s.centre[d] += problem->area[e] * problem->centre[e][d];
            s.normal[d] += problem->area[e] * (double)problem->normal[e][d];
        }
        area += problem->area[e];
    }
    for (int d = 0; d < 3; d++) {
        s.centre[d] /= area;
        s.normal[d] /= area;
        length += s.normal[d] * s.normal[d];
    }
    /* Where a patch faces all ways, none is its own. */
    for (int d = 0; d < 3; d++) s.normal[d] = length > 1e-12 ? s.normal[d] / sqrt(length) : 0;
    return s;
}

static uint32_t nearest_site(const build_problem *problem, size_t k, const site *sites, size_t e,
                             uint32_t own) {
    const float *normal = problem->normal[e];
    uint32_t best = own;
    double best_distance = INFINITY;
    for (size_t p = 0; p < k; p++) {
        const double *m = sites[p].normal;
        if ((double)normal[0] * m[0] + (double)normal[1] * m[1] + (double)normal[2] * m[2] < facing) continue;
        const double distance = square_distance(problem->centre[e], sites[p].centre);
        if (distance < best_distance) {
            best_distance = distance;
            best = (uint32_t)p;
        }
    }
    return best;
}

lam_status assign_by_proximity(const build_problem *problem, size_t k, uint32_t *element, uint64_t *begin,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    site *sites = memory_allocate(k, sizeof *sites, "patches", error);
    uint32_t *patch = memory_allocate(n, sizeof *patch, "patches", error), *stays = NULL;
    stays = memory_allocate(k, sizeof *stays, "patches", error);
    if (sites == NULL || patch == NULL || stays == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < k; p++) {
        double nearest = INFINITY;
        sites[p] = site_of(problem, element + begin[p], begin[p + 1] - begin[p]);
        for (uint64_t i = begin[p]; i < begin[p + 1]; i++) {
            const double distance = square_distance(problem->centre[element[i]], sites[p].centre);
            patch[element[i]] = (uint32_t)p;
            if (distance < nearest) {
                nearest = distance;
                stays[p] = element[i];
            }
        }
    }
#pragma omp parallel for schedule(static, 64)
    for (size_t e = 0; e < n; e++)
        if (stays[patch[e]] != e) patch[e] = nearest_site(problem, k, sites, e, patch[e]);

    memset(begin, 0, (k + 1) * sizeof *begin);
    for (size_t e = 0; e < n; e++) begin[patch[e] + 1]++;
    for (size_t p = 0; p < k; p++) begin[p + 1] += begin[p];
    for (size_t e = n; e-- > 0;) /* from behind, so that begin ends as it is now: where patches begin */
        element[--begin[patch[e] + 1]] = (uint32_t)e;
    memmove(begin, begin + 1, k * sizeof *begin);
    begin[k] = n;
done:
    free(sites);
    free(patch);
    free(stays);
    return status;
}
