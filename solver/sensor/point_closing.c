/* In a scene without panes all that a point sees at first is a pair, another element, a back or the sky: the
 * shares v_ik of all of these sum, for each row k, to the integral of its density d_k. Pairs are known, and
 * the sky where rays are aimed at it; what rays find fills the rest. Shares are scaled,
 *     v_ik (1 + q_i sum_l a_l v_il / v_i0),    sum_l G_kl a_l = (integral of d_k) - sum_i v_ik
 * with G_kl = sum_i q_i v_ik v_il / v_i0, which is the least change of them: the calibration of Deville and
 * Sarndal 1992, "Calibration estimators in survey sampling". One row has one factor for all rays. */
#include "solver/sensor/point_rows.h"

#include <math.h>

/* q of pairs, beside 1 of rays. In a probe they take what its rays cannot, which may have met little on one
 * side of it: in a box of some hundreds of elements rays alone left up to 1e-2. */
static const double q_pairs = .03;

/* Pairs of sources stay as they are, as they are exact and all light may come from them, unless others are
 * less than this share of all that is seen. */
static const double enough = .1;

/* The diagonal of G has so many rays more, but in the first row, where all shares are positive: without it
 * rays on one side would be changed beyond measure where there are no pairs. */
static const double ridge_rays = .1;

/* Sums over shares of n_rows, and the a that they give. */
typedef struct closing {
    size_t n_rows, half;
    double sum[HARMONICS], G[HARMONICS][HARMONICS], a[HARMONICS];
} closing;

/* Adds the shares of an element or a tile. */
static void add_shares(closing *c, double q, const point_share *v) {
    const size_t h = c->half;
    if (!(v[0][h] > 0)) return;
    for (size_t k = 0; k < c->n_rows; k++) {
        c->sum[k] += v[k][h];
        for (size_t l = 0; l <= k; l++) c->G[k][l] += q * v[k][h] * v[l][h] / v[0][h];
    }
}

/* Scales them; nothing becomes negative. */
static void scale_shares(const closing *c, double q, point_share *v) {
    const size_t h = c->half;
    double scale = 1;
    if (!(v[0][h] > 0)) return;
    for (size_t l = 0; l < c->n_rows; l++) scale += q * c->a[l] * v[l][h] / v[0][h];
    for (size_t k = 0; k < c->n_rows; k++) v[k][h] *= fmax(scale, 0);
}

/* Finds a by Cholesky's method. */
static void solve(closing *c, const double whole[HARMONICS], double ridge) {
    const size_t n = c->n_rows;
    double *a = c->a;
    for (size_t k = 1; k < n; k++) c->G[k][k] += ridge;
    for (size_t k = 0; k < n; k++) {
        double *row = c->G[k];
        for (size_t l = 0; l <= k; l++) {
            for (size_t i = 0; i < l; i++) row[l] -= row[i] * c->G[l][i];
            row[l] = l < k ? row[l] / c->G[l][l] : sqrt(row[l]);
        }
        a[k] = whole[k] - c->sum[k];
        for (size_t i = 0; i < k; i++) a[k] -= row[i] * a[i];
        a[k] /= row[k];
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t i = k + 1; i < n; i++) a[k] -= c->G[i][k] * a[i];
        a[k] /= c->G[k][k];
    }
}

/* The pairs of a single row stay as they are. */
static double q_of_pair(const point_scene *s, const point_place *p, uint32_t pair, bool spared) {
    return p->n_rows == 1 || (spared && s->is_source[pair]) ? 0 : q_pairs;
}

/* Pairs that are no sources, in the first row. */
static double sum_others(const point_scene *s, const point_place *p, const point_room *room, size_t half) {
    double sum = 0;
    for (size_t i = 0; i < room->n_pairs; i++)
        if (!s->is_source[room->pair[i]]) sum += room->factor[i * p->n_rows][half];
    return sum;
}

/* Rays have met nothing but pairs, which take what is missing: elements that no ray has met, and rounding of
 * visible shares, leave it. */
static void close_pairs(const point_scene *s, const point_place *p, point_room *room, size_t half,
                        const double whole[HARMONICS], double ridge) {
    closing c = {.n_rows = p->n_rows, .half = half};
    double all = 0;
    for (size_t i = 0; i < room->n_pairs; i++) all += room->factor[i * p->n_rows][half];
    if (!(all > .5 * whole[0])) return;
    const bool spared = fabs(whole[0] - all) < enough * sum_others(s, p, room, half);
    for (size_t i = 0; i < room->n_pairs; i++)
        add_shares(&c, spared && s->is_source[room->pair[i]] ? 0 : 1, room->factor + i * p->n_rows);
    solve(&c, whole, ridge);
    for (size_t i = 0; i < room->n_pairs; i++)
        scale_shares(&c, spared && s->is_source[room->pair[i]] ? 0 : 1, room->factor + i * p->n_rows);
}

void point_close(const point_scene *s, const point_place *p, point_room *room, size_t half, bool sky_is_known,
                 const point_found *found, double *backs) {
    const size_t n_rows = p->n_rows;
    const size_t tiles = s->sky != NULL && !sky_is_known ? s->sky->tiling.n_tiles + 1 : 0;
    /* The integral of Y_0 / pi is 2 / sqrt(pi), and those of the others are 0. */
    const double whole[HARMONICS] = {n_rows > 1 ? M_2_SQRTPI : 1};
    const double ridge = ridge_rays * whole[0] / (double)s->rays;
    closing c = {.n_rows = n_rows, .half = half};
    for (size_t i = 0; i < room->n_met; i++) add_shares(&c, 1, room->sum + room->met[i] * n_rows);
    for (size_t t = 0; t < tiles; t++) add_shares(&c, 1, room->sky + t * n_rows);
    for (size_t k = 0; k < n_rows; k++) {
        c.sum[k] += found->backs[k] + (sky_is_known || tiles > 0 ? 0 : found->left[k]);
        for (size_t l = 0; l <= k; l++) c.G[k][l] += found->products[k][l];
    }
    if (!(c.sum[0] > 0)) {
        if (found->left[0] == 0) close_pairs(s, p, room, half, whole, ridge);
        return;
    }
    const bool spared = c.sum[0] + sum_others(s, p, room, half) > enough * whole[0];
    for (size_t k = 0; k < n_rows && sky_is_known; k++) c.sum[k] += found->left[k];
    for (size_t i = 0; i < room->n_pairs; i++)
        add_shares(&c, q_of_pair(s, p, room->pair[i], spared), room->factor + i * n_rows);
    solve(&c, whole, ridge);
    for (size_t i = 0; i < room->n_met; i++) scale_shares(&c, 1, room->sum + room->met[i] * n_rows);
    for (size_t t = 0; t < tiles; t++) scale_shares(&c, 1, room->sky + t * n_rows);
    for (size_t i = 0; i < room->n_pairs; i++)
        scale_shares(&c, q_of_pair(s, p, room->pair[i], spared), room->factor + i * n_rows);
    double scale = 1;
    for (size_t l = 0; l < n_rows && found->backs[0] > 0; l++)
        scale += c.a[l] * found->backs[l] / found->backs[0];
    *backs *= fmax(scale, 0);
}
