#include "server/scene/luminaire_sums.h"

#include "server/scene/scene.h"
#include "solver/operator/luminaire_light.h"

#include <math.h>
#include <stdlib.h>

/* Limits of sums over all pairs: products (some tenths of a second) and numbers kept. */
#define MOST_WORK ((double)(1u << 28))
#define MOST_NUMBERS ((double)(1u << 22))

void luminaire_sums_free(luminaire_sums *sums) {
    if (sums == NULL) return;
    free(sums->power);
    free(sums->squares);
    free(sums->first);
    free(sums);
}

static bool pairs_worth(const scene *s, size_t k) {
    const double pairs = (double)s->n_channels * (double)k * (double)k;
    return pairs / 2 * (double)s->n <= MOST_WORK && pairs <= MOST_NUMBERS;
}

/* Means of each luminaire over each group. */
static void find_first(const scene *s, const float *h, luminaire_sums *to) {
    const group_index *groups = &s->groups;
    for (size_t g = 0; g < groups->n_groups; g++) {
        double area = 0;
        for (uint32_t e = groups->start[g]; e < groups->start[g + 1]; e++)
            area += s->area[groups->elements[e]];
        for (size_t j = 0; area > 0 && j < to->k; j++) {
            double sum = 0;
            for (uint32_t e = groups->start[g]; e < groups->start[g + 1]; e++) {
                const size_t i = groups->elements[e];
                sum += s->area[i] * (double)h[j * s->n + i];
            }
            to->first[g * to->k + j] = sum / area;
        }
    }
}

/* weight [n], A rho of channel c. */
static void find_channel(const scene *s, size_t c, const float *h, const double *weight, luminaire_sums *to) {
    const size_t n = s->n, k = to->k;
    const double *f = luminaires_factors(s->luminaires) + c * k;
    for (size_t j = 0; j < k; j++) {
        const float *h_j = h + j * n;
        double power = 0;
        for (size_t i = 0; i < n; i++) power += weight[i] * (double)h_j[i];
        to->power[c * k + j] = power * f[j];
        for (size_t l = to->whole ? 0 : j; l <= j; l++) {
            const float *h_l = h + l * n;
            double sum = 0;
            for (size_t i = 0; i < n; i++) sum += weight[i] * weight[i] * (double)h_j[i] * (double)h_l[i];
            sum *= f[j] * f[l];
            if (to->whole)
                to->squares[(c * k + j) * k + l] = to->squares[(c * k + l) * k + j] = sum;
            else
                to->squares[c * k + j] = sum;
        }
    }
}

static luminaire_sums *sums_make(const scene *s, bool whole) {
    const size_t C = s->n_channels, n = s->n, k = lam_luminaires_count(s->luminaires);
    const float *h = luminaires_irradiance(s->luminaires);
    luminaire_sums *made = memory_allocate(1, sizeof *made, "luminaires", NULL);
    double *weight = memory_allocate(n, sizeof *weight, "luminaires", NULL);
    bool good = made != NULL && weight != NULL;
    if (good) {
        *made = (luminaire_sums){.k = k, .whole = whole};
        made->power = memory_allocate(C, k * sizeof *made->power, "luminaires", NULL);
        made->squares = memory_allocate(C * k, (whole ? k : 1) * sizeof *made->squares, "luminaires", NULL);
        made->first = memory_allocate(s->groups.n_groups, k * sizeof *made->first, "luminaires", NULL);
        good = made->power != NULL && made->squares != NULL && made->first != NULL;
    }
    if (good) find_first(s, h, made);
    for (size_t c = 0; good && c < C; c++) {
        for (size_t i = 0; i < n; i++) weight[i] = s->area[i] * (double)s->reflectance[c * n + i];
        find_channel(s, c, h, weight, made);
    }
    free(weight);
    if (good) return made;
    luminaire_sums_free(made);
    return NULL;
}

bool scene_has_luminaire_sums(const scene *s) {
    return row_cache_luminaires(s->rows) != NULL;
}

bool scene_luminaire_sums(const scene *s, const luminaire_sums **sums) {
    *sums = row_cache_luminaires(s->rows);
    if (*sums != NULL) return true;
    const size_t C = s->n_channels, k = lam_luminaires_count(s->luminaires);
    const bool whole = pairs_worth(s, k);
    const size_t bytes =
        sizeof(luminaire_sums) + k * (C * (whole ? k + 1 : 2) + s->groups.n_groups) * sizeof(double);
    if (!memory_ledger_take(s->ledger, bytes)) return true;
    luminaire_sums *made = sums_make(s, whole);
    if (made == NULL) {
        memory_ledger_give_back(s->ledger, bytes);
        return false;
    }
    made->bytes = bytes;
    *sums = row_cache_set_luminaires(s->rows, made);
    return true;
}

void luminaire_sums_size(const luminaire_sums *sums, size_t c, const float *D, double *power,
                         double *squares) {
    const size_t k = sums->k;
    double root = 0;
    for (size_t j = 0; j < k; j++) {
        if (D[j] == 0) continue;
        *power += (double)D[j] * sums->power[c * k + j];
        if (!sums->whole) root += (double)D[j] * sqrt(sums->squares[c * k + j]);
        for (size_t l = 0; sums->whole && l < k; l++)
            *squares += (double)D[j] * (double)D[l] * sums->squares[(c * k + j) * k + l];
    }
    *squares += root * root;
}
