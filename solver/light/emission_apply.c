#include "solver/light/emission_apply.h"

#include "solver/light/sunlight.h"
#include "solver/operator/emitters.h"
#include "solver/operator/limiter.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/sensor_light.h"
#include "solver/operator/sky_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AT_ONCE = EMISSION_PASS_MOST }; /* vectors in one go of a whole answer */

void emission_pass_free(emission_pass *p) {
    free(p->work);
    free(p->limiter_work);
    free(p->E);
    free(p->L);
    free(p->H0);
    free(p->W);
    free(p->D);
    free(p->B);
    free(p->seen);
    free(p->sun);
    free(p->sun_work);
    free(p->sun_at);
    *p = (emission_pass){0};
}

static lam_status reserve(size_t rows, size_t width, const char *what, float **out, lam_error *error) {
    *out = memory_allocate(rows, width * sizeof **out, what, error);
    return *out == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

size_t emission_width(const emission *light, const lam_operator *op) {
    return light->sensors != NULL ? lam_sensors_count(light->sensors) : lam_operator_elements(op);
}

static lam_status check_sensors(const emission *light, const lam_operator *op, lam_error *error) {
    const char *why = operator_points_why_not(op);
    if (light->sensors == NULL || why == NULL) return LAM_OK;
    return status_fail(error, LAM_ERR_UNSUPPORTED, "sensors have no values: %s", why);
}

/* True where nothing but the sun at sensors gives light: elements have none. */
static bool sun_is_all(const emission *light, const lam_operator *op) {
    const size_t count = lam_operator_channels(op) * lam_operator_elements(op);
    if (light->sun == NULL || !light->sun->sensors_alone || !light->steady) return false;
    for (size_t i = 0; light->E != NULL && i < count; i++)
        if (light->E[i] != 0) return false;
    return light->L == NULL && light->D == NULL && light->W == NULL;
}

/* Room for the dimmers of one go, where they stay if they are steady. */
static lam_status take_dimmers(const emission *light, size_t most, size_t C, float **D, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t row = C * lam_luminaires_count(light->luminaires);
    TRY(reserve(most, row, "dimmers of luminaires", D, error));
    for (size_t k = 0; light->steady && k < most; k++) memcpy(*D + k * row, light->D, row * sizeof **D);
done:
    return status;
}

/* Room for the weights of few emitters of one go, and for what sensors see of their sky. */
static lam_status take_weights(const emission *light, const lam_operator *op, size_t most, emission_pass *p,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const emitter_arrays *a = &operator_emitters_of(op)->a;
    const size_t rows = most * lam_operator_channels(op);
    TRY(reserve(rows, a->s, "weights of emitters", &p->W, error));
    if (light->sensors != NULL && a->L != NULL) TRY(reserve(rows, a->n_tiles, "skies", &p->seen, error));
done:
    return status;
}

lam_status emission_pass_create(const emission *light, const lam_operator *op, const lam_sky *sky,
                                lam_quantity quantity, size_t n_selected, const uint32_t *selected,
                                size_t most, emission_pass *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(op), C = lam_operator_channels(op), s = lam_operator_emitters(op);
    const bool on_elements = light->sun != NULL && !light->sun->sensors_alone;
    emission_pass p = {.light = light,
                       .op = op,
                       .sky = sky,
                       .quantity = quantity,
                       .n_selected = n_selected,
                       .selected = selected,
                       .most = most,
                       .work_bytes = lam_operator_work_bytes(op, most)};
    TRY(check_sensors(light, op, error));
    if (light->sensors != NULL) {
        p.quantity = LAM_RADIOSITY;
        p.sun_is_all = sun_is_all(light, op);
        TRY(reserve(most * C, n, "radiosity", &p.B, error));
        if (light->sun != NULL)
            TRY(reserve(most, lam_sensors_count(light->sensors), "the sun", &p.sun_at, error));
    }
    p.work = memory_allocate(p.work_bytes, 1, "the work area of a solve", error);
    if (p.work == NULL) TRY(LAM_ERR_MEMORY);
    if (light->limiter != NULL) {
        p.limiter_work = memory_allocate(lam_limiter_work_bytes(light->limiter), 1, "the limiter", error);
        if (p.limiter_work == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (light->E != NULL) TRY(reserve(most * C, n, "emissions", &p.E, error));
    for (size_t k = 0; light->steady && p.E != NULL && k < most; k++)
        memcpy(p.E + k * C * n, light->E, C * n * sizeof *p.E);
    if (light->L != NULL) TRY(reserve(most * C, lam_sky_tiles(sky), "skies", &p.L, error));
    if (light->D != NULL) TRY(take_dimmers(light, most, C, &p.D, error));
    if (s > 0)
        TRY(take_weights(light, op, most, &p, error));
    else if (light->L != NULL || light->D != NULL || on_elements)
        TRY(reserve(most * C, n, "direct light", &p.H0, error));
    if (on_elements) {
        TRY(reserve(most, n, "the sun", &p.sun, error));
        TRY(reserve(1, sunlight_work(light->sun), "the sun", &p.sun_work, error));
    }
    *out = p;
    p = (emission_pass){0};
done:
    emission_pass_free(&p);
    return status;
}

/* Rows of a batch side by side. */
static void gather(size_t n, const size_t *vectors, size_t width, const float *from, float *to) {
    for (size_t k = 0; k < n; k++) memcpy(to + k * width, from + vectors[k] * width, width * sizeof *to);
}

/* The weights of the emitters: those given, those found from E and L, and the dimmers of luminaires. */
static lam_status find_weights(emission_pass *p, size_t n, const size_t *vectors, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *e = p->light;
    const size_t row = lam_operator_channels(p->op) * lam_operator_emitters(p->op);
    TRY(lam_operator_weights(p->op, n, p->E, p->sky != NULL ? lam_sky_tiles(p->sky) : 0, p->L, p->W, error));
    for (size_t k = 0; e->W != NULL && k < n * row; k++)
        p->W[k] += e->W[(e->steady ? 0 : vectors[k / row] * row) + k % row];
    if (p->D != NULL) operator_emitters_dim(p->op, n, p->D, p->W);
done:
    return status;
}

/* H0 [n][C][elements] under the skies, luminaires and the sun. Rounding must not make a value negative. */
static void light_directly(emission_pass *p, size_t n, const size_t *vectors) {
    const size_t C = lam_operator_channels(p->op), n_elements = lam_operator_elements(p->op);
    if (p->L != NULL)
        lam_sky_irradiance(p->sky, n * C, p->L, p->H0);
    else
        memset(p->H0, 0, n * C * n_elements * sizeof *p->H0);
    if (p->D != NULL) lam_luminaires_irradiance(p->light->luminaires, n, p->D, p->H0);
    if (p->sun == NULL) return;
    sunlight_irradiance(p->light->sun, n, vectors, p->sun, p->sun_work);
    for (size_t row = 0; row < n * C; row++)
        for (size_t i = 0; i < n_elements; i++)
            p->H0[row * n_elements + i] =
                fmaxf(p->H0[row * n_elements + i] + p->sun[row / C * n_elements + i], 0);
}

/* Limits the answers of n vectors where the emission asks for it. */
static void limit(emission_pass *p, size_t n, float *out) {
    const limiter_light light = {.E = p->W == NULL ? p->E : NULL, .H0 = p->H0, .W = p->W};
    memset(p->limited, 0, sizeof p->limited);
    if (p->light->limiter != NULL)
        limiter_limit(p->light->limiter, p->op, n, p->quantity, &light, p->n_selected, p->selected, out,
                      p->limited, p->limiter_work);
}

/* Adds the sun to the answers of an operator of few emitters. Their direct light becomes exact; the bounced
 * light stays that of the tile. Rounding must not make a value negative. */
static void light_answers(emission_pass *p, size_t n, const size_t *vectors, float *out) {
    const size_t C = lam_operator_channels(p->op), n_elements = lam_operator_elements(p->op);
    const size_t width = p->selected != NULL ? p->n_selected : n_elements;
    if (p->sun == NULL || p->quantity == LAM_INDIRECT) return;
    sunlight_irradiance(p->light->sun, n, vectors, p->sun, p->sun_work);
    for (size_t row = 0; row < n * C; row++)
        for (size_t r = 0; r < width; r++) {
            const size_t i = p->selected != NULL ? p->selected[r] : r;
            const float *rho = p->op->reflectance + row % C * n_elements;
            const float share = p->quantity == LAM_RADIOSITY ? rho[i] : 1;
            float *x = out + row * width + r;
            *x = fmaxf(*x + share * p->sun[row / C * n_elements + i], 0);
        }
}

/* The light of n vectors side by side. */
static void take_light(emission_pass *p, size_t n, const size_t *vectors) {
    const emission *e = p->light;
    const size_t C = lam_operator_channels(p->op), n_elements = lam_operator_elements(p->op);
    if (!e->steady && p->E != NULL) gather(n, vectors, C * n_elements, e->E, p->E);
    if (e->L != NULL) gather(n, vectors, C * lam_sky_tiles(p->sky), e->L, p->L);
    if (!e->steady && e->D != NULL) gather(n, vectors, C * lam_luminaires_count(e->luminaires), e->D, p->D);
}

/* Raises values of sensors to zero, but coefficients of probes of either sign. */
static void limit_sensors(emission_pass *p, size_t n, float *out) {
    const size_t count = lam_sensors_count(p->light->sensors), row = lam_operator_channels(p->op) * count;
    memset(p->limited, 0, sizeof p->limited);
    for (size_t k = 0; p->light->limiter != NULL && k < n * row; k++)
        if (out[k] < 0 && !sensors_is_signed(p->light->sensors, k % count)) {
            out[k] = 0;
            p->limited[k / row]++;
        }
}

void emission_pass_limit(emission_pass *p, size_t n, const size_t *vectors, float *out) {
    if (p->light->sensors != NULL) {
        limit_sensors(p, n, out);
        return;
    }
    take_light(p, n, vectors);
    if (p->H0 != NULL) light_directly(p, n, vectors);
    limit(p, n, out);
}

/* The answers of n vectors on elements, those selected or all; H0 is there. */
static lam_status answer_elements(emission_pass *p, size_t n, const size_t *vectors, float *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    if (p->W != NULL) {
        TRY(find_weights(p, n, vectors, error));
        TRY(lam_operator_apply_emitters(p->op, n, p->quantity, p->W, p->n_selected, p->selected, out, p->work,
                                        p->work_bytes, error));
    } else if (p->selected != NULL) {
        TRY(lam_operator_apply_selected(p->op, n, p->quantity, p->E, p->H0, p->n_selected, p->selected, out,
                                        p->work, p->work_bytes, error));
    } else {
        TRY(lam_operator_apply_lit(p->op, n, p->quantity, p->E, p->H0, out, p->work, p->work_bytes, error));
    }
    limit(p, n, out);
    if (p->W != NULL) light_answers(p, n, vectors, out);
done:
    return status;
}

/* The answers of n vectors at sensors. */
static lam_status answer_at_sensors(emission_pass *p, size_t n, const size_t *vectors, float *out,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    const emission *e = p->light;
    const size_t C = lam_operator_channels(p->op), count = lam_sensors_count(e->sensors);
    if (p->sun_is_all) {
        memset(out, 0, n * C * count * sizeof *out);
    } else {
        TRY(answer_elements(p, n, vectors, p->B, error));
        if (p->seen != NULL) operator_emitters_radiances(p->op, n, p->W, p->seen);
        lam_sensors_gather(e->sensors, n, p->B, p->W != NULL ? p->seen : p->L, p->D, out);
    }
    if (e->sun == NULL) goto done;
    sunlight_sensors(e->sun, n, vectors, p->sun_at);
    for (size_t row = 0; row < n * C; row++)
        for (size_t i = 0; i < count; i++) out[row * count + i] += p->sun_at[row / C * count + i];
    /* Where the sun takes the place of its tile, rounding must not make a value negative. */
    for (size_t k = 0; e->limiter != NULL && p->L != NULL && k < n * C * count; k++)
        out[k] = fmaxf(out[k], 0);
done:
    return status;
}

lam_status emission_pass_solve(emission_pass *p, size_t n, const size_t *vectors, float *out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    take_light(p, n, vectors);
    if (p->H0 != NULL) light_directly(p, n, vectors);
    TRY(p->B != NULL ? answer_at_sensors(p, n, vectors, out, error)
                     : answer_elements(p, n, vectors, out, error));
done:
    return status;
}

lam_status emission_pass_light(emission_pass *p, size_t n, const size_t *vectors, double *E, double *H0,
                               bool *H0_there, float *start, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *e = p->light;
    const size_t C = lam_operator_channels(p->op), n_elements = lam_operator_elements(p->op);
    double *L = NULL, *D = NULL;
    take_light(p, n, vectors);
    *H0_there = p->W != NULL || p->H0 != NULL;
    if (p->W != NULL) {
        if (p->sun != NULL)
            FAIL(error, LAM_ERR_UNSUPPORTED,
                 "--tolerance beside --sun exact of a store of few emitters is not supported; use --sun "
                 "tiles, or a store of another method");
        TRY(find_weights(p, n, vectors, error));
        TRY(operator_emitters_light_double(p->op, n, p->W, E, H0, error));
        TRY(lam_operator_apply_emitters(p->op, n, LAM_INDIRECT, p->W, n_elements, NULL, start, p->work,
                                        p->work_bytes, error));
        goto done;
    }
    for (size_t k = 0; k < n * C * n_elements; k++) E[k] = p->E != NULL ? (double)p->E[k] : 0;
    if (!*H0_there) goto done;
    memset(H0, 0, n * C * n_elements * sizeof *H0);
    if (p->L != NULL) {
        const size_t count = n * C * lam_sky_tiles(p->sky);
        L = memory_allocate(count, sizeof *L, "skies", error);
        if (L == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t k = 0; k < count; k++) L[k] = (double)p->L[k];
        sky_irradiance_double(p->sky, n * C, L, H0);
    }
    if (p->D != NULL) {
        const size_t count = n * C * lam_luminaires_count(e->luminaires);
        D = memory_allocate(count, sizeof *D, "dimmers of luminaires", error);
        if (D == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t k = 0; k < count; k++) D[k] = (double)p->D[k];
        luminaires_irradiance_double(e->luminaires, n, D, H0);
    }
    if (p->sun == NULL) goto done;
    sunlight_irradiance(e->sun, n, vectors, p->sun, p->sun_work);
    for (size_t row = 0; row < n * C; row++)
        for (size_t i = 0; i < n_elements; i++)
            H0[row * n_elements + i] =
                fmax(H0[row * n_elements + i] + (double)p->sun[row / C * n_elements + i], 0);
done:
    free(L);
    free(D);
    return status;
}

void emission_scatter(size_t n_rows, size_t n, size_t n_selected, const uint32_t *selected, const float *from,
                      float *to) {
    for (size_t row = 0; row < n_rows; row++)
        for (size_t r = 0; r < n_selected; r++) to[row * n + selected[r]] = from[row * n_selected + r];
}

lam_status emission_apply(const emission *e, const lam_operator *op, const lam_sky *sky,
                          lam_quantity quantity, size_t n_selected, const uint32_t *selected,
                          lam_status (*stop)(lam_error *error), float **values, size_t *limited,
                          lam_error *error) {
    lam_status status = LAM_OK;
    emission_pass p = {0};
    const size_t C = lam_operator_channels(op), n = emission_width(e, op);
    const size_t most = e->n_vectors < AT_ONCE ? e->n_vectors : AT_ONCE;
    float *made = NULL, *some = NULL;
    size_t count, vectors[AT_ONCE];
    if (!size_multiply(n * C, e->n_vectors, &count))
        FAIL(error, LAM_ERR_MEMORY, "%zu emissions are too many for memory", e->n_vectors);
    made = memory_allocate(count, sizeof *made, "the solution", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    TRY(emission_pass_create(e, op, sky, quantity, n_selected, selected, most, &p, error));
    if (selected != NULL) TRY(reserve(most * C, n_selected, "the solution", &some, error));
    for (size_t first = 0; first < e->n_vectors; first += most) {
        const size_t left = e->n_vectors - first, now = left < most ? left : most;
        float *to = made + first * C * n;
        for (size_t k = 0; k < now; k++) vectors[k] = first + k;
        TRY(emission_pass_solve(&p, now, vectors, selected != NULL ? some : to, error));
        if (selected != NULL) emission_scatter(now * C, n, n_selected, selected, some, to);
        if (limited != NULL) memcpy(limited + first, p.limited, now * sizeof *limited);
        if (stop != NULL) TRY(stop(error));
    }
    *values = made;
    made = NULL;
done:
    free(made);
    free(some);
    emission_pass_free(&p);
    return status;
}
