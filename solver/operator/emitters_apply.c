/* Answers of an operator of few emitters: B = sum_k w_k B_k, its weights from an emission, its adjoint. */
#include "solver/base/work_area.h"
#include "solver/operator/emitters.h"

#include "solver/operator/luminaire_light.h"
#include "solver/operator/sky_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Largest difference between an emission and the emission of the weights found for it, over the larger of
 * both.
 */
static const float close_enough = 1e-5f;

size_t lam_operator_emitters(const lam_operator *op) {
    const emitters *self = operator_emitters_of(op);
    return self != NULL ? self->a.s : 0;
}

const char *lam_operator_emitter_name(const lam_operator *op, size_t k) {
    return operator_emitters_of(op)->a.names[k];
}

size_t emitters_luminaires(const emitter_arrays *a) {
    return a->luminaires != NULL ? lam_luminaires_count(a->luminaires) : 0;
}

void operator_emitters_dim(const lam_operator *op, size_t n_rhs, const float *D, float *W) {
    const emitter_arrays *a = &operator_emitters_of(op)->a;
    const size_t k = emitters_luminaires(a), first = a->s - k;
    for (size_t row = 0; row < n_rhs * op->n_channels; row++)
        for (size_t j = 0; j < k; j++) W[row * a->s + first + j] += D[row * k + j];
}

/* E [n] += what the elements themselves send out, of one channel. */
static void add_emission(const emitters *self, size_t c, const float *W, float *E) {
    const emitter_arrays *a = &self->a;
    for (size_t k = 0; k < a->s; k++) {
        const size_t row = c * a->s + k;
        if (W[k] == 0) continue;
        for (uint64_t e = a->ends[row]; e < a->ends[row + 1]; e++) E[a->elements[e]] += W[k] * a->values[e];
    }
}

/* L [m] = the radiances of the tiles. */
static void sum_tiles(const emitters *self, size_t c, const float *W, float *L) {
    const emitter_arrays *a = &self->a;
    for (size_t t = 0; t < a->n_tiles; t++) L[t] = 0;
    for (size_t k = 0; k < a->s; k++)
        for (size_t t = 0; t < a->n_tiles && W[k] != 0; t++)
            L[t] += W[k] * a->L[(c * a->s + k) * a->n_tiles + t];
}

/* The irradiance H0 = power H that an emitter outside the mesh, of weight 1, gives directly in a channel; H
 * is [n], NULL: the emitter is of the mesh or of the sky. */
typedef struct direct_row {
    const float *H;
    double power;
} direct_row;

static direct_row direct_of(const emitters *self, size_t c, size_t k) {
    const emitter_arrays *a = &self->a;
    const size_t n = self->base.n, n_luminaires = emitters_luminaires(a), first = a->s - n_luminaires;
    if (a->direct != NULL) return (direct_row){a->direct + k * n, (double)a->exitance[c]};
    if (k < first) return (direct_row){NULL, 0};
    return (direct_row){luminaires_irradiance(a->luminaires) + (k - first) * n,
                        luminaires_factors(a->luminaires)[c * n_luminaires + k - first]};
}

/* H0 [n] += the light that comes straight from emitters outside the mesh. */
static void add_direct(const emitters *self, size_t c, const float *W, float *H0) {
    for (size_t k = 0; k < self->a.s; k++) {
        const direct_row of = direct_of(self, c, k);
        const float power = of.H != NULL ? W[k] * (float)of.power : 0;
        for (size_t i = 0; power != 0 && i < self->base.n; i++) H0[i] += power * of.H[i];
    }
}

/* True where some emitters give an irradiance that no element sent. */
static bool has_direct(const emitter_arrays *a) {
    return a->L != NULL || a->direct != NULL || a->luminaires != NULL;
}

static bool is_close(float x, float y) {
    return fabsf(x - y) <= close_enough * fmaxf(fabsf(x), fabsf(y));
}

static bool all_dark(const float *x, size_t count) {
    for (size_t i = 0; x != NULL && i < count; i++)
        if (x[i] != 0) return false;
    return true;
}

/* One channel of one emission: sent has room for n + m numbers. L is of the tiles that the operator has, or
 * NULL. */
static lam_status weights_of_one(const emitters *self, size_t c, const float *E, const float *L, float *sent,
                                 float *W, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = self->base.n, s = self->a.s, m = self->a.n_tiles;
    const size_t first_luminaire = s - emitters_luminaires(&self->a);
    const char *const what = s == 1 ? "emitter does" : "emitters do";
    if (all_dark(E, n) && all_dark(L, m)) {
        memset(W, 0, s * sizeof *W);
        return LAM_OK;
    }
    for (size_t k = 0; k < s; k++) {
        const uint32_t at = self->own[c * s + k];
        if (self->a.direct != NULL)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "the emitters of this store are no part of its mesh, nor of a sky; give \"emitters\", a "
                 "weight "
                 "each or by name, such as \"%.40s\"",
                 self->a.names[k]);
        if (k >= first_luminaire) { /* no emission of elements or tiles is one */
            W[k] = 0;
            continue;
        }
        if (at == EMITTERS_NONE)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "emitter %zu (%.40s) shares every place with another one, so an emission does not show its "
                 "weight; "
                 "give \"emitters\", a weight each",
                 k, self->a.names[k]);
        const float *from = at < n ? E : L;
        W[k] = from == NULL ? 0 : from[at < n ? at : at - n] / self->own_value[c * s + k];
    }
    memset(sent, 0, n * sizeof *sent);
    add_emission(self, c, W, sent);
    sum_tiles(self, c, W, sent + n);
    for (size_t i = 0; i < n; i++)
        if (!is_close(E != NULL ? E[i] : 0, sent[i]))
            FAIL(error, LAM_ERR_ARGUMENT,
                 "element %zu emits %g, which the store's %zu %s not; give what they send, or \"emitters\"",
                 i, (double)(E != NULL ? E[i] : 0), s, what);
    for (size_t t = 0; t < m; t++)
        if (!is_close(L != NULL ? L[t] : 0, sent[n + t]))
            FAIL(error, LAM_ERR_ARGUMENT,
                 "tile %zu of the sky has radiance %g, which the store's %zu %s not give", t,
                 (double)(L != NULL ? L[t] : 0), s, what);
done:
    return status;
}

lam_status lam_operator_weights(const lam_operator *op, size_t n_rhs, const float *E, size_t n_tiles,
                                const float *L, float *W, lam_error *error) {
    lam_status status = LAM_OK;
    const emitters *self = op != NULL ? operator_emitters_of(op) : NULL;
    float *sent = NULL;
    if (self == NULL || W == NULL) FAIL(error, LAM_ERR_ARGUMENT, "an operator of few emitters is needed");
    const size_t n = op->n, C = op->n_channels, m = self->a.n_tiles;
    if (n_tiles != m && !all_dark(L, n_rhs * C * n_tiles))
        FAIL(error, LAM_ERR_ARGUMENT,
             m == 0 ? "no emitter of the store is of the sky; precompute with --emitters sky"
                    : "the sky has %zu tiles, that of the store's emitters %zu",
             n_tiles, m);
    if (n_tiles != m) L = NULL;
    sent = memory_allocate(n + m, sizeof *sent, "emitters", error);
    if (sent == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t row = 0; row < n_rhs * C; row++)
        TRY(weights_of_one(self, row % C, E != NULL ? E + row * n : NULL, L != NULL ? L + row * m : NULL,
                           sent, W + row * self->a.s, error));
done:
    free(sent);
    return status;
}

lam_status operator_emitters_light(const lam_operator *op, size_t n_rhs, const float *W, float *E, float *H0,
                                   lam_error *error) {
    const emitters *self = operator_emitters_of(op);
    const size_t n = op->n, C = op->n_channels;
    float *L = memory_allocate(self->a.n_tiles + 1, sizeof *L, "emitters", error);
    if (L == NULL) return LAM_ERR_MEMORY;
    memset(E, 0, n_rhs * C * n * sizeof *E);
    memset(H0, 0, n_rhs * C * n * sizeof *H0);
    for (size_t row = 0; row < n_rhs * C; row++) {
        const float *w = W + row * self->a.s;
        add_emission(self, row % C, w, E + row * n);
        if (self->a.L != NULL) {
            sum_tiles(self, row % C, w, L);
            lam_sky_irradiance(self->a.sky, 1, L, H0 + row * n);
        }
        add_direct(self, row % C, w, H0 + row * n);
    }
    free(L);
    return LAM_OK;
}

void operator_emitters_emission(const lam_operator *op, size_t n_rhs, const float *W, float *E) {
    const emitters *self = operator_emitters_of(op);
    const size_t n = op->n, C = op->n_channels;
    memset(E, 0, n_rhs * C * n * sizeof *E);
    for (size_t row = 0; row < n_rhs * C; row++)
        add_emission(self, row % C, W + row * self->a.s, E + row * n);
}

void operator_emitters_radiances(const lam_operator *op, size_t n_rhs, const float *W, float *L) {
    const emitters *self = operator_emitters_of(op);
    const size_t s = self->a.s, m = self->a.n_tiles;
    for (size_t row = 0; row < n_rhs * op->n_channels; row++)
        sum_tiles(self, row % op->n_channels, W + row * s, L + row * m);
}

void operator_emitters_adjoint_radiances(const lam_operator *op, size_t n_rhs, const float *g, float *W) {
    const emitter_arrays *a = &operator_emitters_of(op)->a;
    for (size_t row = 0; a->L != NULL && row < n_rhs * op->n_channels; row++)
        for (size_t k = 0; k < a->s; k++) {
            const float *L = a->L + (row % op->n_channels * a->s + k) * a->n_tiles;
            double sum = 0;
            for (size_t t = 0; t < a->n_tiles; t++) sum += (double)L[t] * (double)g[row * a->n_tiles + t];
            W[row * a->s + k] += (float)sum;
        }
}

const char *operator_points_why_not(const lam_operator *op) {
    const emitters *self = operator_emitters_of(op);
    return self == NULL || self->a.direct == NULL
               ? NULL
               : "the store is of positions of a light, whose direct light is known on elements alone";
}

lam_status operator_emitters_light_double(const lam_operator *op, size_t n_rhs, const float *W, double *E,
                                          double *H0, lam_error *error) {
    const emitters *self = operator_emitters_of(op);
    const emitter_arrays *a = &self->a;
    const size_t n = op->n, C = op->n_channels, s = a->s, m = a->n_tiles;
    double *L = memory_allocate(m + 1, sizeof *L, "emitters", error);
    if (L == NULL) return LAM_ERR_MEMORY;
    memset(E, 0, n_rhs * C * n * sizeof *E);
    memset(H0, 0, n_rhs * C * n * sizeof *H0);
    for (size_t row = 0; row < n_rhs * C; row++) {
        memset(L, 0, m * sizeof *L);
        for (size_t k = 0; k < s; k++) {
            const size_t of = row % C * s + k;
            const double w = (double)W[row * s + k];
            if (w == 0) continue;
            for (uint64_t e = a->ends[of]; e < a->ends[of + 1]; e++)
                E[row * n + a->elements[e]] += w * (double)a->values[e];
            for (size_t t = 0; a->L != NULL && t < m; t++) L[t] += w * (double)a->L[of * m + t];
        }
        if (a->L != NULL) sky_irradiance_double(a->sky, 1, L, H0 + row * n);
        for (size_t k = 0; k < s; k++) {
            const direct_row of = direct_of(self, row % C, k);
            const double power = (double)W[row * s + k] * of.power;
            for (size_t i = 0; of.H != NULL && power != 0 && i < n; i++)
                H0[row * n + i] += power * (double)of.H[i];
        }
    }
    free(L);
    return LAM_OK;
}

static lam_status check(const lam_operator *op, size_t n_rhs, lam_quantity quantity, const float *in,
                        const float *out, const void *work, size_t work_bytes, lam_error *error) {
    lam_status status = LAM_OK;
    if (op == NULL || in == NULL || out == NULL || work == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "an operator, its input, its output and a work area are needed, one is NULL");
    if (operator_emitters_of(op) == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "an operator of kind %s has no emitters", op->kind->name);
    if (quantity != LAM_RADIOSITY && quantity != LAM_IRRADIANCE && quantity != LAM_INDIRECT)
        FAIL(error, LAM_ERR_ARGUMENT, "there is no quantity %d", (int)quantity);
    const size_t needed = lam_operator_work_bytes(op, n_rhs);
    if (needed == 0 || work_bytes < needed)
        FAIL(error, LAM_ERR_ARGUMENT, "work area of %zu bytes, %zu are needed for n_rhs = %zu", work_bytes,
             needed, n_rhs);
done:
    return status;
}

/* T in out becomes the quantity: radiosity E + T, irradiance T / rho', indirect T - rho H0; where rho
 * is 0 radiosity is E alone and indirect 0. other [n]: E, or H0; NULL: 0. */
static void finish(const lam_operator *op, size_t c, lam_quantity quantity, const float *other,
                   size_t n_selected, const uint32_t *selected, float *out) {
    const float *rho = op->reflectance + c * op->n;
    for (size_t r = 0; r < n_selected; r++) {
        const size_t i = selected != NULL ? selected[r] : r;
        const float T = rho[i] > 0 ? out[r] : 0, x = other != NULL ? other[i] : 0;
        if (quantity == LAM_RADIOSITY)
            out[r] = T + x;
        else if (quantity == LAM_INDIRECT)
            out[r] = T - rho[i] * x;
        else if (rho[i] > 0)
            out[r] /= rho[i];
    }
}

lam_status lam_operator_apply_emitters(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                       const float *W, size_t n_selected, const uint32_t *selected,
                                       float *out, void *work, size_t work_bytes, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check(op, n_rhs, quantity, W, out, work, work_bytes, error));
    const emitters *self = operator_emitters_of(op);
    const size_t n = op->n, C = op->n_channels, s = self->a.s, count = selected != NULL ? n_selected : n;
    for (size_t r = 0; selected != NULL && r < n_selected; r++)
        if (selected[r] >= n)
            FAIL(error, LAM_ERR_ARGUMENT, "selected[%zu] = %u, must be below %zu", r, (unsigned)selected[r],
                 n);
    for (size_t first = 0; first < n_rhs; first += OPERATOR_PASS) {
        const size_t m = n_rhs - first < OPERATOR_PASS ? n_rhs - first : OPERATOR_PASS;
        const float *w = W + first * C * s;
        float *to = out + first * C * count;
        void *rest = work_area_begin(work);
        float *other = work_area_take(&rest, n * sizeof *other),
              *L = work_area_take(&rest, self->a.n_tiles * sizeof *L);
        for (size_t c = 0; c < C; c++)
            if (selected != NULL)
                panel_expand_rows(&self->T[c], m, w + c * s, C * s, count, selected, NULL, to + c * count,
                                  C * count, rest);
            else
                panel_expand(&self->T[c], m, w + c * s, C * s, to + c * count, C * count, rest);
        for (size_t row = 0; row < m * C; row++) {
            const bool direct = quantity == LAM_INDIRECT && has_direct(&self->a);
            if (quantity == LAM_RADIOSITY || direct) memset(other, 0, n * sizeof *other);
            if (quantity == LAM_RADIOSITY) add_emission(self, row % C, w + row * s, other);
            if (direct && self->a.L != NULL) {
                sum_tiles(self, row % C, w + row * s, L);
                lam_sky_irradiance(self->a.sky, 1, L, other);
            }
            if (direct) add_direct(self, row % C, w + row * s, other);
            finish(op, row % C, quantity, quantity == LAM_RADIOSITY || direct ? other : NULL, count, selected,
                   to + row * count);
        }
    }
done:
    return status;
}

/* g of the quantity becomes g of T: dB / dT is 1 where rho is not 0, dH / dT is 1 / rho'. */
static void pull_back(const lam_operator *op, size_t c, lam_quantity quantity, const float *g,
                      float *pulled) {
    const float *rho = op->reflectance + c * op->n;
    for (size_t i = 0; i < op->n; i++)
        if (quantity == LAM_IRRADIANCE)
            pulled[i] = rho[i] > 0 ? g[i] / rho[i] : g[i];
        else
            pulled[i] = rho[i] > 0 ? g[i] : 0;
}

/* w [s] += the transpose of the emitters' emission times g (radiosity), or of -rho H0 times g (indirect).
 * other: [n]. */
static void adjoint_of_light(const lam_operator *op, size_t c, lam_quantity quantity, const float *g,
                             float *other, float *L, float *w) {
    const emitters *self = operator_emitters_of(op);
    const emitter_arrays *a = &self->a;
    const float *rho = op->reflectance + c * op->n;
    for (size_t k = 0; quantity == LAM_RADIOSITY && k < a->s; k++) {
        double sum = 0;
        for (uint64_t e = a->ends[c * a->s + k]; e < a->ends[c * a->s + k + 1]; e++)
            sum += (double)a->values[e] * (double)g[a->elements[e]];
        w[k] += (float)sum;
    }
    if (quantity != LAM_INDIRECT) return;
    for (size_t i = 0; i < op->n; i++) other[i] = rho[i] * g[i];
    for (size_t k = 0; k < a->s; k++) {
        const direct_row of = direct_of(self, c, k);
        double sum = 0;
        for (size_t i = 0; of.H != NULL && i < op->n; i++) sum += (double)other[i] * (double)of.H[i];
        w[k] -= (float)(sum * of.power);
    }
    if (a->L == NULL) return;
    lam_sky_adjoint(a->sky, 1, other, L);
    for (size_t k = 0; k < a->s; k++) {
        double sum = 0;
        for (size_t t = 0; t < a->n_tiles; t++)
            sum += (double)a->L[(c * a->s + k) * a->n_tiles + t] * (double)L[t];
        w[k] -= (float)sum;
    }
}

lam_status lam_operator_adjoint_emitters(const lam_operator *op, size_t n_rhs, lam_quantity quantity,
                                         const float *g, float *W, void *work, size_t work_bytes,
                                         lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check(op, n_rhs, quantity, g, W, work, work_bytes, error));
    const emitters *self = operator_emitters_of(op);
    const size_t n = op->n, C = op->n_channels, s = self->a.s;
    for (size_t first = 0; first < n_rhs; first += OPERATOR_PASS) {
        const size_t m = n_rhs - first < OPERATOR_PASS ? n_rhs - first : OPERATOR_PASS;
        const float *from = g + first * C * n;
        float *to = W + first * C * s;
        void *rest = work_area_begin(work);
        float *other = work_area_take(&rest, n * sizeof *other),
              *L = work_area_take(&rest, self->a.n_tiles * sizeof *L);
        float *pulled = work_area_take(&rest, m * C * n * sizeof *pulled);
        for (size_t row = 0; row < m * C; row++)
            pull_back(op, row % C, quantity, from + row * n, pulled + row * n);
        for (size_t c = 0; c < C; c++)
            panel_project(&self->T[c], m, pulled + c * n, C * n, to + c * s, C * s, rest);
        for (size_t row = 0; row < m * C; row++)
            adjoint_of_light(op, row % C, quantity, from + row * n, other, L, to + row * s);
    }
done:
    return status;
}
