#include "solver/verbs/own_light.h"

#include "solver/light/sunlight.h"
#include "solver/operator/emitters.h"
#include "solver/operator/sky_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void own_light_free(own_light *l) {
    free(l->E);
    free(l->H0);
    free(l->L);
    free(l->L_sent);
    free(l->sent);
    free(l->lamps);
    free(l->sun);
    free(l->work);
    *l = (own_light){.n_tiles = 0};
}

lam_status own_light_make(const lit_store *lit, const error_scene *scene, own_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    const emitters *few = operator_emitters_of(lit->op);
    const emission *light = &lit->light;
    const size_t n = scene->n, C = scene->n_channels;
    const bool by_weights = few != NULL && light->W != NULL && few->a.L != NULL;
    own_light l = {.lit = lit, .scene = scene};
    if (lit->sky != NULL && (light->L != NULL || by_weights)) l.n_tiles = lam_sky_tiles(lit->sky);
    l.E = memory_allocate(C, n * sizeof *l.E, "the light of an answer", error);
    l.H0 = memory_allocate(C, n * sizeof *l.H0, "the light of an answer", error);
    if (l.E == NULL || l.H0 == NULL) TRY(LAM_ERR_MEMORY);
    if (l.n_tiles > 0) {
        l.L = memory_allocate(C, l.n_tiles * sizeof *l.L, "the light of an answer", error);
        if (l.L == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (light->sun != NULL) {
        l.sun = memory_allocate(1, n * sizeof *l.sun, "the light of an answer", error);
        l.work = memory_allocate(1, sunlight_work(light->sun) * sizeof *l.work, "the sun", error);
        l.L_sent = memory_allocate(C, (l.n_tiles + 1) * sizeof *l.L_sent, "the light of an answer", error);
        if (l.sun == NULL || l.work == NULL || l.L_sent == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (light->D != NULL) {
        l.lamps = memory_allocate(C, n * sizeof *l.lamps, "the light of an answer", error);
        if (l.lamps == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (light->sun != NULL || light->D != NULL) {
        l.sent = memory_allocate(C + 2, n * sizeof *l.sent, "the light of an answer", error);
        if (l.sent == NULL) TRY(LAM_ERR_MEMORY);
    }
    *out = l;
    l = (own_light){.n_tiles = 0};
done:
    own_light_free(&l);
    return status;
}

/* The light of the weights of emitters that were given. */
static lam_status add_weights(own_light *l, size_t v, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *light = &l->lit->light;
    const size_t vector = l->scene->n * l->scene->n_channels, all = l->scene->n_channels * l->n_tiles;
    const float *W =
        light->W + (light->steady ? 0 : v * l->scene->n_channels * lam_operator_emitters(l->lit->op));
    float *E = memory_allocate(2, vector * sizeof *E, "the light of an answer", error);
    float *L = memory_allocate(1, (all + 1) * sizeof *L, "the light of an answer", error);
    if (E == NULL || L == NULL) TRY(LAM_ERR_MEMORY);
    TRY(operator_emitters_light(l->lit->op, 1, W, E, E + vector, error));
    for (size_t k = 0; k < vector; k++) l->E[k] += E[k];
    if (l->n_tiles == 0) goto done;
    operator_emitters_radiances(l->lit->op, 1, W, L);
    for (size_t k = 0; k < all; k++) l->L[k] += L[k];
done:
    free(E);
    free(L);
    return status;
}

/* Adds the luminaires of vector v. */
static void add_luminaires(own_light *l, size_t v) {
    const emission *light = &l->lit->light;
    const size_t all = l->scene->n * l->scene->n_channels;
    const size_t row = l->scene->n_channels * lam_luminaires_count(light->luminaires);
    memset(l->lamps, 0, all * sizeof *l->lamps);
    lam_luminaires_irradiance(light->luminaires, 1, light->D + (light->steady ? 0 : v * row), l->lamps);
    for (size_t k = 0; k < all; k++) {
        l->H0[k] += l->lamps[k];
        l->sent[k] += l->lamps[k];
    }
}

/* Adds the sun of vector v. */
static void add_sun(own_light *l, size_t v) {
    const sunlight *sun = l->lit->light.sun;
    const size_t n = l->scene->n, C = l->scene->n_channels, m = l->n_tiles;
    const float *rho = l->scene->reflectance;
    size_t tile;
    double radiance;
    const bool in_tile = sunlight_in_tile(sun, v, &tile, &radiance);
    /* Of a mean the tiles hold many suns: H is then what they lack, and it is not sent on. */
    const bool lost = in_tile || (sun->given != NULL && sun->sky != NULL);
    sunlight_irradiance(sun, 1, &v, l->sun, l->work);
    l->lost2 = 0;
    for (size_t c = 0; c < C; c++) {
        double power = 0, squares = 0;
        for (size_t i = 0; i < n; i++) {
            const double flux = l->scene->area[i] * (double)rho[c * n + i] * (double)l->sun[i];
            power += flux;
            squares += flux * flux;
            l->H0[c * n + i] += l->sun[i];
            l->sent[c * n + i] += lost ? 0 : l->sun[i];
        }
        if (lost) l->lost2 += power * power + squares;
        memset(l->L_sent + c * m, 0, m * sizeof *l->L_sent);
        if (!in_tile || tile >= m) continue;
        l->L_sent[c * m + tile] = fminf(l->L[c * m + tile], (float)radiance);
        l->L[c * m + tile] -= l->L_sent[c * m + tile];
    }
}

lam_status own_light_take(own_light *l, size_t v, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *light = &l->lit->light;
    const size_t vector = l->scene->n * l->scene->n_channels, all = l->scene->n_channels * l->n_tiles;
    l->vector = v;
    memset(l->E, 0, vector * sizeof *l->E);
    memset(l->H0, 0, vector * sizeof *l->H0);
    if (light->E != NULL) memcpy(l->E, light->E + (light->steady ? 0 : v * vector), vector * sizeof *l->E);
    if (light->L != NULL) memcpy(l->L, light->L + v * all, all * sizeof *l->L);
    if (light->L == NULL && l->L != NULL) memset(l->L, 0, all * sizeof *l->L);
    if (light->W != NULL) TRY(add_weights(l, v, error));
    if (l->L != NULL) lam_sky_irradiance(l->lit->sky, l->scene->n_channels, l->L, l->H0);
    if (l->sent != NULL) memset(l->sent, 0, vector * sizeof *l->sent);
    if (light->D != NULL) add_luminaires(l, v);
    if (light->sun != NULL) add_sun(l, v);
done:
    return status;
}

void own_light_put(own_light *l, const error_by_group *by, error_answer *of) {
    const size_t n = l->scene->n, C = l->scene->n_channels, m = l->n_tiles;
    const size_t k = l->lamps != NULL ? lam_luminaires_count(l->lit->light.luminaires) : 0;
    const float *dimmers = k > 0 ? l->lit->light.D + (l->lit->light.steady ? 0 : l->vector * C * k) : NULL;
    of->E = l->E;
    of->H0 = l->L != NULL || l->sent != NULL ? l->H0 : NULL;
    of->L = l->L;
    of->L_sent = l->L != NULL ? l->L_sent : NULL;
    of->lost2 = l->lost2;
    of->luminaires = lit_luminaires_of(l->lit->light.luminaires, dimmers);
    for (size_t c = 0; c < C; c++) {
        error_answer_add_channel(of, l->scene, c, l->E + c * n, l->sent != NULL ? l->sent + c * n : NULL,
                                 l->lamps != NULL ? l->lamps + c * n : NULL, l->sent + C * n);
        if (l->L != NULL) emission_size_add(&of->sky, m, by->figures.sky_power + c * m, l->L + c * m);
        if (of->L_sent != NULL)
            emission_size_add(&of->sky, m, by->figures.sky_power + c * m, l->L_sent + c * m);
    }
}
