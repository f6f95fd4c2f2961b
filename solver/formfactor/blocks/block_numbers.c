#include "solver/formfactor/blocks/block_numbers.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* Points of the cubature an axis, and of a rectangle. */
enum { SIDE = 2, POINTS = SIDE * SIDE };
/* Gauss's two nodes on [-1, 1]. */
static const double node = .57735026918962576451;
/* Slopes of the visible share are held back by this share of the number of segments. */
static const double ridge = .02;
/* Below this many radii between centre and cluster nothing is smooth. */
static const double nearest = 1.05;

/* The kernel is cos cos' / (pi r^2), r from x to y, for points that lie in front of both planes, else 0. */
static double kernel(const double *normal_x, const double *normal_y, const double *x, const double *y) {
    const double r[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]}, r2 = dot3(r, r);
    const double leaving = dot3(normal_x, r), arriving = -dot3(normal_y, r);
    return leaving > 0 && arriving > 0 ? leaving * arriving / (M_PI * r2 * r2) : 0;
}

visible_share visible_share_fit(const seen_segment *s, size_t count) {
    visible_share out;
    double M[SHARE_TERMS][SHARE_TERMS + 1] = {{0}};
    for (size_t k = 0; k < count; k++) {
        const double *at = s[k].place;
        const double row[SHARE_TERMS + 1] = {1, at[0], at[1], at[2], at[3], s[k].seen};
        for (int i = 0; i < SHARE_TERMS; i++)
            for (int j = 0; j <= SHARE_TERMS; j++) M[i][j] += row[i] * row[j];
    }
    for (int i = 1; i < SHARE_TERMS; i++) M[i][i] += ridge * (double)count + 1e-9;
    for (int i = 0; i < SHARE_TERMS; i++)
        for (int r = i + 1; r < SHARE_TERMS; r++) {
            const double factor = M[r][i] / M[i][i];
            for (int j = i; j <= SHARE_TERMS; j++) M[r][j] -= factor * M[i][j];
        }
    for (int i = SHARE_TERMS - 1; i >= 0; i--) {
        out.of[i] = M[i][SHARE_TERMS];
        for (int j = i + 1; j < SHARE_TERMS; j++) out.of[i] -= M[i][j] * out.of[j];
        out.of[i] /= M[i][i];
    }
    return out;
}

/* An element has one function, so that linear terms are taken at its centroid. */
static void take_centroid(const flat_clusters *f, uint32_t t, double at[2]) {
    const block_factors *tree = f->tree;
    const flat_cluster *c = &f->of[t];
    const flat_plane *p = &f->planes[c->plane];
    const double *place = tree->place[t - tree->n_clusters];
    const double away[3] = {c->centre[0] - p->origin[0], c->centre[1] - p->origin[1],
                            c->centre[2] - p->origin[2]};
    for (int k = 0; k < 2; k++)
        at[k] = c->half[k] > 0 && !c->full ? (place[k] - dot3(away, p->axis[k])) / c->half[k] : 0;
}

void block_numbers_set(const flat_clusters *f, const visible_share *share, cluster_block *block) {
    static const double side[POINTS][2] = {{-1, -1}, {-1, 1}, {1, -1}, {1, 1}};
    const uint32_t ends[2] = {block->a, block->b};
    const size_t n_clusters = f->tree->n_clusters;
    double at[2][POINTS][3], K[POINTS][POINTS], left[BLOCK_FUNCTIONS][POINTS],
        L[BLOCK_FUNCTIONS][BLOCK_FUNCTIONS];
    const double *normal[2];
    for (int e = 0; e < 2; e++) {
        normal[e] = f->planes[f->of[ends[e]].plane].normal;
        for (int k = 0; k < POINTS; k++)
            flat_cluster_point(f, ends[e], node * side[k][0], node * side[k][1], at[e][k]);
    }
    for (int i = 0; i < POINTS; i++)
        for (int j = 0; j < POINTS; j++) {
            K[i][j] = kernel(normal[0], normal[1], at[0][i], at[1][j]);
            if (share == NULL) continue;
            const double *v = share->of;
            K[i][j] *=
                v[0] + node * (v[1] * side[i][0] + v[2] * side[i][1] + v[3] * side[j][0] + v[4] * side[j][1]);
        }
    /* L = P K P^T: the mean, and the slopes 3 mean(u k), as the mean of u^2 is 1/3. */
    for (int j = 0; j < POINTS; j++) {
        left[0][j] = left[1][j] = left[2][j] = 0;
        for (int i = 0; i < POINTS; i++) {
            left[0][j] += K[i][j] / POINTS;
            left[1][j] += 3 * node * side[i][0] * K[i][j] / POINTS;
            left[2][j] += 3 * node * side[i][1] * K[i][j] / POINTS;
        }
    }
    for (int g = 0; g < BLOCK_FUNCTIONS; g++) {
        L[g][0] = L[g][1] = L[g][2] = 0;
        for (int j = 0; j < POINTS; j++) {
            L[g][0] += left[g][j] / POINTS;
            L[g][1] += 3 * node * side[j][0] * left[g][j] / POINTS;
            L[g][2] += 3 * node * side[j][1] * left[g][j] / POINTS;
        }
    }
    if (ends[0] >= n_clusters) {
        double u[2];
        take_centroid(f, ends[0], u);
        for (int h = 0; h < BLOCK_FUNCTIONS; h++) {
            L[0][h] += u[0] * L[1][h] + u[1] * L[2][h];
            L[1][h] = L[2][h] = 0;
        }
    }
    if (ends[1] >= n_clusters) {
        double u[2];
        take_centroid(f, ends[1], u);
        for (int g = 0; g < BLOCK_FUNCTIONS; g++) {
            L[g][0] += u[0] * L[g][1] + u[1] * L[g][2];
            L[g][1] = L[g][2] = 0;
        }
    }
    for (int g = 0; g < BLOCK_FUNCTIONS; g++)
        for (int h = 0; h < BLOCK_FUNCTIONS; h++) block->L[g][h] = (float)L[g][h];
}

void block_numbers_of_pair(const flat_clusters *f, double exchange, cluster_block *block) {
    memset(block->L, 0, sizeof block->L);
    block->L[0][0] = (float)(exchange / (f->of[block->a].area * f->of[block->b].area));
}

double block_kernel_most(const flat_clusters *f, uint32_t a, uint32_t b, const flat_pair *at,
                         bool behind[2]) {
    enum { CORNERS = FLAT_CORNERS / 2 };
    const flat_cluster *c[2] = {&f->of[a], &f->of[b]};
    const flat_plane *p[2] = {&f->planes[c[0]->plane], &f->planes[c[1]->plane]};
    const double rise = c[0]->rise + c[1]->rise; /* elements may be higher by this */
    double height[2][CORNERS], low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int e = 0; e < 2; e++) {
        const double *n = p[1 - e]->normal;
        for (int k = 0; k < CORNERS; k++) {
            const int i = CORNERS * e + k;
            height[e][k] = n[0] * at->x[0][i] + n[1] * at->x[1][i] + n[2] * at->x[2][i] - c[1 - e]->level;
            low[e] = height[e][k] < low[e] ? height[e][k] : low[e];
            height[e][k] += rise;
            high[e] = height[e][k] > high[e] ? height[e][k] : high[e];
        }
        behind[e] = low[e] < -f->slack;
    }
    if (high[0] <= f->slack || high[1] <= f->slack) return 0;
    if (behind[0] || behind[1]) {
        const double d = fmax(flat_cluster_distance(f, b, c[0]->centre) - c[0]->radius,
                              flat_cluster_distance(f, a, c[1]->centre) - c[1]->radius);
        return d > 0 ? fmin(1, high[0] * high[1] / (d * d)) / (M_PI * d * d) : INFINITY;
    }
    double most = kernel(p[0]->normal, p[1]->normal, c[0]->centre, c[1]->centre);
    for (int i = 0; i < CORNERS; i++)
        for (int j = 0; j < CORNERS; j++) {
            double r2 = 0;
            for (int d = 0; d < 3; d++) {
                const double r = at->x[d][CORNERS + j] - at->x[d][i];
                r2 += r * r;
            }
            const double least = f->slack * f->slack, cosines = height[0][i] * height[1][j];
            const double here = cosines / (M_PI * (r2 > least ? r2 * r2 : least * least));
            most = height[0][i] > 0 && height[1][j] > 0 && here > most ? here : most;
        }
    return most;
}

double block_kernel_roughness(const flat_clusters *f, uint32_t a, uint32_t b, int order) {
    const double z_a = flat_cluster_distance(f, b, f->of[a].centre) / f->of[a].radius;
    const double z_b = flat_cluster_distance(f, a, f->of[b].centre) / f->of[b].radius;
    if (z_a <= nearest || z_b <= nearest) return INFINITY;
    const double r_a = z_a + sqrt(z_a * z_a - 1), r_b = z_b + sqrt(z_b * z_b - 1);
    double a_to = 1, b_to = 1;
    for (int k = 0; k < order; k++) a_to /= r_a, b_to /= r_b;
    return (order + 1) * (a_to + b_to);
}
