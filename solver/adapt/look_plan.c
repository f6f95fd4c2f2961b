#include "solver/adapt/look_plan.h"

#include <math.h>
#include <stdlib.h>

void look_plan_free(look_plan *l) {
    free(l->start);
    free(l->members);
    free(l->weight);
    free(l->first);
    free(l->chosen);
    free(l->area);
    free(l->light2);
    free(l->group_area);
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
lam_status look_plan_make(const mesh *m, size_t n_lights, const float *E, const float *B, size_t fewer,
                          look_plan *l, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t G = m->n_groups;
    size_t scene = m->n < LOOKS_MOST ? m->n : LOOKS_MOST, least;
    double area = 0;
    if (G == 0) FAIL(error, LAM_ERR_INTERNAL, "the mesh has no groups");
    if (scene < LOOKS_LEAST) scene = LOOKS_LEAST;
    least = LOOKS_OF_GROUPS / G;
    if (least > LOOKS_OF_GROUP) least = LOOKS_OF_GROUP;
    if (fewer > 0) {
        scene /= fewer;
        least /= fewer;
    }
    l->start = memory_allocate(G + 2, sizeof *l->start, "error of the mesh", error);
    l->members = memory_allocate(m->n, sizeof *l->members, "error of the mesh", error);
    l->weight = memory_allocate(m->n, sizeof *l->weight, "error of the mesh", error);
    l->first = memory_allocate(G + 1, sizeof *l->first, "error of the mesh", error);
    l->light2 = memory_allocate(n_lights + 1, G * sizeof *l->light2, "error of the mesh", error);
    l->group_area = memory_allocate(G, sizeof *l->group_area, "error of the mesh", error);
    if (l->start == NULL || l->members == NULL || l->weight == NULL || l->first == NULL ||
        l->light2 == NULL || l->group_area == NULL)
        TRY(LAM_ERR_MEMORY);
    sort_elements(m, n_lights, E, B, l);
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (size_t g = 0; g < G; g++) {
        double own = 0;
        for (size_t at = l->start[g]; at < l->start[g + 1]; at++) own += m->area[l->members[at]];
        l->group_area[g] = own;
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

look_sum look_plan_sum(const look_plan *l, size_t n_values, const double *seen, size_t value, size_t group) {
    const size_t first = l->first[group], last = l->first[group + 1], n = last - first;
    look_sum v = {0, 0};
    double squares = 0;
    for (size_t k = first; k < last; k++) {
        const double x = l->area[k] * seen[k * n_values + value];
        v.sum += x;
        squares += x * x;
    }
    if (n > 1) v.noise = sqrt(fmax(squares - v.sum * v.sum / (double)n, 0) * (double)n / (double)(n - 1));
    return v;
}
