#include "solver/adapt/mesh_error.h"

#include "solver/base/random.h"

#include <math.h>
#include <stdlib.h>

enum { QUARTERS = 4 };

/* The mean square of n points in strata, about their own mean, lacks the variance of that mean, which for a
 * function that is linear over a square is a 16th of the whole. */
static const double lacking = 16. / 15;

/* out [n_lights] = the variance of rho H over element i, summed over channels: from one point in each quarter
 * q and two independent halves 0 and 1 of each estimate,
 *     var(rho H) = 16/15 rho^2 (1/4) sum_q (H_q0 - mean of H_0) (H_q1 - mean of H_1). */
static void look(const gather *g, const mesh *m, uint32_t i, uint64_t key, double *out) {
    const size_t values = gather_values(g);
    float uw[QUARTERS][2];
    double points[QUARTERS][3], H[QUARTERS * GATHER_HALVES * GATHER_VALUES_MOST];
    uint64_t random = key;
    for (size_t k = 0; k < QUARTERS; k++) {
        uw[k][0] = (float)((double)(k % 2) + random_unit(&random)) / 2;
        uw[k][1] = (float)((double)(k / 2) + random_unit(&random)) / 2;
        for (int d = 0; d < 2; d++) uw[k][d] = fminf(uw[k][d], 1 - 0x1p-24f);
    }
    gather_place(g, i, QUARTERS, (const float(*)[2])uw, points);
    gather_at(g, i, key, QUARTERS, (const double(*)[3])points, H);
    for (size_t v = 0; v < values; v++) {
        const double rho = (double)m->reflectance[v % m->n_channels * m->n + i];
        double mean[GATHER_HALVES] = {0}, sum = 0;
        for (size_t k = 0; k < QUARTERS; k++)
            for (size_t h = 0; h < GATHER_HALVES; h++)
                mean[h] += H[(k * GATHER_HALVES + h) * values + v] / QUARTERS;
        for (size_t k = 0; k < QUARTERS; k++)
            sum += (H[k * GATHER_HALVES * values + v] - mean[0]) *
                   (H[(k * GATHER_HALVES + 1) * values + v] - mean[1]);
        if (v % m->n_channels == 0) out[v / m->n_channels] = 0;
        out[v / m->n_channels] += lacking * rho * rho * sum / QUARTERS;
    }
}

/* The elements of each group, and the looks at them. */
typedef struct look_plan {
    uint32_t *start, *members; /* [n_groups + 1], [n] */
    double *weight;            /* [n], of members[k]: it is looked at as often as this says */
    size_t *first;             /* [n_groups + 1]: the looks of group g are first[g] ... first[g + 1] - 1 */
    uint32_t *chosen;          /* of each look */
    double *area;              /* of each look: the area that it stands for */
    double *light2;            /* [n_lights][n_groups], sum A (B - E)^2 */
} look_plan;

static void look_plan_free(look_plan *l) {
    free(l->start);
    free(l->members);
    free(l->weight);
    free(l->first);
    free(l->chosen);
    free(l->area);
    free(l->light2);
}

/* The square of B - E of an element, summed over channels. */
static double light2_at(const mesh *m, const float *E, const float *B, size_t light, size_t i) {
    double sum = 0;
    for (size_t c = 0; c < m->n_channels; c++) {
        const size_t k = (light * m->n_channels + c) * m->n + i;
        const double x = (double)B[k] - (double)E[k];
        sum += x * x;
    }
    return sum;
}

/* Sorts elements by group, and finds the sums of their light. */
static void sort_elements(const mesh *m, size_t n_lights, const float *E, const float *B, look_plan *l) {
    const size_t G = m->n_groups;
    for (size_t i = 0; i < m->n; i++) l->start[m->group[i] + 1]++;
    for (size_t g = 0; g < G; g++) l->start[g + 1] += l->start[g];
    for (size_t i = m->n; i-- > 0;) l->members[--l->start[m->group[i] + 1]] = (uint32_t)i;
    /* Every start has moved to that of its group, one place late. */
    for (size_t g = 0; g < G; g++) l->start[g] = l->start[g + 1];
    l->start[G] = (uint32_t)m->n;
    for (size_t k = 0; k < n_lights; k++)
        for (size_t i = 0; i < m->n; i++)
            l->light2[k * G + m->group[i]] += m->area[i] * light2_at(m, E, B, k, i);
}

/* Chooses the elements of one group at equal steps of their weights
 *     w_i = A_i / sum A + the mean over lights of A_i (B_i - E_i)^2 / sum A (B - E)^2,
 * so that neither large elements nor bright ones are left out. A look at i then stands for A_i sum w / w_i
 * over the number of looks. */
static void choose(const mesh *m, size_t n_lights, const float *E, const float *B, size_t group,
                   look_plan *l) {
    const size_t first = l->start[group], last = l->start[group + 1],
                 n = l->first[group + 1] - l->first[group];
    double area = 0, all = 0, before = 0;
    size_t k = 0;
    for (size_t at = first; at < last; at++) area += m->area[l->members[at]];
    for (size_t at = first; at < last; at++) {
        const size_t i = l->members[at];
        double w = m->area[i] / area;
        for (size_t light = 0; light < n_lights; light++) {
            const double sum = l->light2[light * m->n_groups + group];
            if (sum > 0) w += m->area[i] * light2_at(m, E, B, light, i) / sum / (double)n_lights;
        }
        l->weight[at] = w;
        all += w;
    }
    for (size_t at = first; at < last; at++) {
        before += l->weight[at];
        for (; k < n && (((double)k + .5) / (double)n * all < before || at + 1 == last); k++) {
            l->chosen[l->first[group] + k] = l->members[at];
            l->area[l->first[group] + k] = m->area[l->members[at]] * all / l->weight[at] / (double)n;
        }
    }
}

/* The looks of each group: those of the scene by area, and some at least. */
static lam_status plan_looks(const mesh *m, size_t n_lights, const float *E, const float *B, size_t fewer,
                             look_plan *l, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t G = m->n_groups;
    size_t scene = m->n < MESH_ERROR_LOOKS_MOST ? m->n : MESH_ERROR_LOOKS_MOST, least;
    double area = 0;
    if (G == 0) FAIL(error, LAM_ERR_INTERNAL, "the mesh has no groups");
    if (scene < MESH_ERROR_LOOKS_LEAST) scene = MESH_ERROR_LOOKS_LEAST;
    least = MESH_ERROR_LOOKS_OF_GROUPS / G;
    if (least > MESH_ERROR_LOOKS_OF_GROUP) least = MESH_ERROR_LOOKS_OF_GROUP;
    if (fewer > 0) {
        scene /= fewer;
        least /= fewer;
    }
    l->start = memory_allocate(G + 2, sizeof *l->start, "error of the mesh", error);
    l->members = memory_allocate(m->n, sizeof *l->members, "error of the mesh", error);
    l->weight = memory_allocate(m->n, sizeof *l->weight, "error of the mesh", error);
    l->first = memory_allocate(G + 1, sizeof *l->first, "error of the mesh", error);
    l->light2 = memory_allocate(n_lights, G * sizeof *l->light2, "error of the mesh", error);
    if (l->start == NULL || l->members == NULL || l->weight == NULL || l->first == NULL || l->light2 == NULL)
        TRY(LAM_ERR_MEMORY);
    sort_elements(m, n_lights, E, B, l);
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (size_t g = 0; g < G; g++) {
        double own = 0;
        for (size_t at = l->start[g]; at < l->start[g + 1]; at++) own += m->area[l->members[at]];
        const size_t share = (size_t)llround((double)scene * own / area);
        l->first[g + 1] = l->first[g] + (own > 0 ? share > least ? share : least : 0);
    }
    l->chosen = memory_allocate(l->first[G], sizeof *l->chosen, "error of the mesh", error);
    l->area = memory_allocate(l->first[G], sizeof *l->area, "error of the mesh", error);
    if (l->chosen == NULL || l->area == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < G; g++) choose(m, n_lights, E, B, g, l);
done:
    return status;
}

/* Sum A var over a group by its looks x_k = a_k var_k, and its standard error. */
typedef struct group_variance {
    double sum, noise;
} group_variance;
static group_variance variance_of_group(const look_plan *l, size_t n_lights, const double *seen, size_t light,
                                        size_t group) {
    const size_t first = l->first[group], last = l->first[group + 1], n = last - first;
    group_variance v = {0, 0};
    double squares = 0;
    for (size_t k = first; k < last; k++) {
        const double x = l->area[k] * seen[k * n_lights + light];
        v.sum += x;
        squares += x * x;
    }
    if (n > 1) v.noise = sqrt(fmax(squares - v.sum * v.sum / (double)n, 0) * (double)n / (double)(n - 1));
    return v;
}

/* The error e of each light, by the groups that were looked at,
 *     e^2 = sum_g sum A var(rho H) / sum_g sum A (B - E)^2,
 * where variances and squares are summed over channels. */
static void sum_groups(const mesh *m, size_t n_lights, const look_plan *l, const double *seen,
                       double *error_of_light, const mesh_error_groups *groups) {
    const size_t G = m->n_groups;
    for (size_t light = 0; light < n_lights; light++) {
        double off = 0, all = 0;
        for (size_t g = 0; g < G; g++) {
            const group_variance v = variance_of_group(l, n_lights, seen, light, g);
            const double light2 = l->light2[light * G + g];
            double area = 0;
            if (l->first[g + 1] == l->first[g]) continue;
            off += v.sum;
            all += light2;
            for (size_t at = l->start[g]; at < l->start[g + 1]; at++) area += m->area[l->members[at]];
            if (groups == NULL) continue;
            groups->variance[light * G + g] = v.sum / area;
            groups->noise[light * G + g] = v.noise / area;
            groups->light2[light * G + g] = light2 / area;
        }
        error_of_light[light] = all > 0 ? sqrt(fmax(off, 0) / all) : 0;
    }
}

lam_status mesh_error(const mesh *m, size_t n_lights, const float *E, const float *B, bool lamps,
                      const gather_sky *sky, uint64_t seed, const progress *p, double *error_of_light,
                      const mesh_error_groups *groups, lam_error *error) {
    lam_status status = LAM_OK;
    gather *g = NULL;
    look_plan l = {.start = NULL};
    double *seen = NULL;
    TRY(plan_looks(m, n_lights, E, B, groups != NULL ? groups->fewer : 0, &l, error));
    const size_t looks = l.first[m->n_groups];
    seen = memory_allocate(looks, n_lights * sizeof *seen, "error of the mesh", error);
    if (seen == NULL) TRY(LAM_ERR_MEMORY);
    TRY(gather_create(m, n_lights, B, lamps ? E : NULL, sky, &g, error));
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < looks; k++)
        if (!progress_cancelled(p))
            look(g, m, l.chosen[k], random_hash(random_hash(seed) ^ random_hash(k + 1)), seen + k * n_lights);
    if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    sum_groups(m, n_lights, &l, seen, error_of_light, groups);
done:
    gather_free(g);
    look_plan_free(&l);
    free(seen);
    return status;
}
