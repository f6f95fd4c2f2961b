#include "solver/operator/stated/mesh_law.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>

void mesh_shares_free(mesh_shares *m) {
    for (int k = 0; k < MESH_FIGURES; k++) free(m->of[k]);
    free(m->lamps);
    *m = (mesh_shares){.n_groups = 0};
}

lam_status mesh_shares_make(const mesh_figures *from, size_t n_groups, mesh_shares *out, lam_error *error) {
    lam_status status = LAM_OK;
    const struct {
        bool has;
        double whole;
    } all[MESH_FIGURES] = {[MESH_OF_LAMPS] = {from->has_lights, from->lights},
                           [MESH_OF_EVEN] = {from->has_even, from->even},
                           [MESH_OF_SKY_EVEN] = {from->has_skies, from->sky_even},
                           [MESH_OF_SKY_CLOUDY] = {from->has_skies, from->sky_cloudy},
                           [MESH_OF_SINGLE] = {from->has_single, from->single},
                           [MESH_OF_GROUPS] = {from->has_groups, from->groups}};
    mesh_shares m = {n_groups, .even_emitters = from->even_emitters,
                     .groups_emitters = from->groups_emitters};
    *out = (mesh_shares){.n_groups = 0};
    for (int k = 0; k < MESH_FIGURES; k++) {
        const double *variation = from->variation[k], *reflected = from->reflected[k];
        if (!all[k].has) continue;
        m.of[k] = memory_allocate(n_groups + 1, sizeof *m.of[k], "errors of the mesh", error);
        if (m.of[k] == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t g = 0; g < n_groups; g++) {
            const bool known = variation != NULL && reflected != NULL && reflected[g] > 0;
            const double share = known ? variation[g] / reflected[g] : all[k].whole;
            m.of[k][g] = share * share;
        }
        m.of[k][n_groups] = all[k].whole * all[k].whole;
    }
    if (from->lights_power != NULL) {
        m.lamps = memory_allocate(n_groups, sizeof *m.lamps, "errors of the mesh", error);
        if (m.lamps == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t g = 0; g < n_groups; g++) m.lamps[g] = from->lights_power[g] > 0;
    }
    *out = m;
    m = (mesh_shares){.n_groups = 0};
done:
    mesh_shares_free(&m);
    return status;
}

bool mesh_shares_known(const mesh_shares *m) {
    for (int k = 0; k < MESH_FIGURES; k++)
        if (m->of[k] != NULL) return true;
    return false;
}

/* A share between two lights of n and N > n emitters: the part of the way from n to N by their logarithms. */
static double way(double emitters, double n, double N) {
    return fmin(fmax(log(fmax(emitters, 1) / n) / log(N / n), 0), 1);
}

/* An emission of so many emitters: a power of N from single elements to groups, as single elements add up;
 * beyond, squares follow log N, as an even light may have no error at all. */
static double by_emitters(const mesh_shares *m, double emitters, size_t group) {
    const double *single = m->of[MESH_OF_SINGLE], *groups = m->of[MESH_OF_GROUPS],
                 *even = m->of[MESH_OF_EVEN];
    const double N = m->groups_emitters, all = m->even_emitters;
    double found = even != NULL ? even[group] : 0;
    if (groups == NULL || !(N > 0)) return found;
    if (even == NULL || !(all > N)) found = groups[group];
    if (even != NULL && all > N) {
        const double t = way(emitters, N, all);
        found = (1 - t) * groups[group] + t * even[group];
    }
    if (single == NULL || !(N > 1) || !(emitters < N) || !(groups[group] > 0) || !(single[group] > 0))
        return found;
    return single[group] * pow(groups[group] / single[group], way(emitters, 1, N));
}

static double of_emission(const mesh_shares *m, const mesh_light *light, size_t group) {
    const double *lamps = m->of[MESH_OF_LAMPS];
    /* Older stores have no more than two figures. */
    if (m->lamps == NULL)
        return lamps != NULL ? lamps[group] : m->of[MESH_OF_EVEN] != NULL ? m->of[MESH_OF_EVEN][group] : 0;
    const double other = by_emitters(m, light->emitters, group);
    if (lamps == NULL || !(light->power > 0)) return other;
    const double part = fmin(light->of_lamps / light->power, 1);
    return part * lamps[group] + (1 - part) * other;
}

static double of_sky(const mesh_shares *m, const mesh_light *light, size_t group) {
    const double *even = m->of[MESH_OF_SKY_EVEN], *cloudy = m->of[MESH_OF_SKY_CLOUDY];
    if (light->bounced && m->of[MESH_OF_EVEN] != NULL) return m->of[MESH_OF_EVEN][group];
    return even != NULL && cloudy != NULL ? fmax(even[group], cloudy[group]) : of_emission(m, light, group);
}

static double share2(const mesh_shares *m, const mesh_light *light, size_t group) {
    const double all = light->power + light->sky_power;
    double sum = 0;
    if (!(all > 0)) return 0;
    if (light->power > 0) sum += light->power / all * of_emission(m, light, group);
    if (light->sky_power > 0) sum += light->sky_power / all * of_sky(m, light, group);
    return sum;
}

mesh_lack mesh_lack_of(const mesh_shares *m, const mesh_light *light, size_t group) {
    const double own2 = share2(m, light, group), mean = (own2 + share2(m, light, m->n_groups)) / 2;
    return (mesh_lack){own2 + mean * mean, mean * mean};
}
