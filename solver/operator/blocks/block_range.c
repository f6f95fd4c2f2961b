#include "solver/operator/blocks/block_range.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>

/* Share of the sum of |L| that a bound gives to the rounding of nine products and of the ranges, four
 * roundings for each of at most BLOCK_DEPTH_MOST levels. */
static const double slack = 1e-12;
/* The rest that reduced slopes leave of the value at the centres, so that single precision cannot make it
 * negative: L is rounded by 6e-8 of its largest number. */
static const double rest = 1e-5;

/* Sweeps over the corners at most; corners of a range. */
enum { SWEEPS = 16, CORNERS = 4 };

static void widen(block_range *r, const block_range *by) {
    for (int d = 0; d < 2; d++) {
        r->low[d] = fmin(r->low[d], by->low[d]);
        r->high[d] = fmax(r->high[d], by->high[d]);
    }
}

lam_status block_ranges(const block_factors *f, block_range **out, lam_error *error) {
    const size_t n_nodes = f->n_clusters + f->n;
    block_range *r = memory_allocate(n_nodes, sizeof *r, "blocks", error);
    if (r == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < f->n_clusters; t++)
        r[t] = (block_range){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    /* Elements are at 0 in themselves; they stand behind the clusters, which are in postorder. */
    for (size_t k = 0; k < n_nodes; k++) {
        const size_t t = k < f->n ? f->n_clusters + k : k - f->n;
        const block_node *node = &f->nodes[t];
        if (node->parent == BLOCK_NO_NODE) continue;
        const block_step s = block_step_up(node, &f->nodes[node->parent]);
        block_range up;
        for (int d = 0; d < 2; d++) {
            up.low[d] = s.shift[d] + s.scale[d] * r[t].low[d];
            up.high[d] = s.shift[d] + s.scale[d] * r[t].high[d];
        }
        widen(&r[node->parent], &up);
    }
    *out = r;
    return LAM_OK;
}

double block_magnitude(const cluster_block *k) {
    double sum = 0;
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = 0; c < BLOCK_FUNCTIONS; c++) sum += fabs((double)k->L[r][c]);
    return sum;
}

/* The least value over the corners of sign (m_a^T L m_b - L_00). */
static double least_slope(const block_range *ranges, const cluster_block *k, double sign) {
    const block_range *a = &ranges[k->a], *b = &ranges[k->b];
    double least = INFINITY;
    for (int corner = 0; corner < CORNERS; corner++) {
        const double u = corner & 1 ? a->high[0] : a->low[0], v = corner & 2 ? a->high[1] : a->low[1];
        double y[BLOCK_FUNCTIONS];
        for (int c = 0; c < BLOCK_FUNCTIONS; c++)
            y[c] =
                sign * (u * (double)k->L[1][c] + v * (double)k->L[2][c] + (c > 0 ? (double)k->L[0][c] : 0));
        for (int d = 0; d < 2; d++) {
            const double low = y[1 + d] * b->low[d], high = y[1 + d] * b->high[d];
            y[0] += low < high ? low : high;
        }
        least = fmin(least, y[0]);
    }
    return least;
}

double block_least(const block_range *ranges, const cluster_block *k) {
    return (double)k->L[0][0] + least_slope(ranges, k, 1) - slack * block_magnitude(k);
}

double block_most(const block_range *ranges, const cluster_block *k) {
    return (double)k->L[0][0] - least_slope(ranges, k, -1) + slack * block_magnitude(k);
}

/* The functions of a node at corner 0 ... 3 of its range. */
static void corner_of(const block_range *r, int corner, double m[BLOCK_FUNCTIONS]) {
    m[0] = 1;
    m[1] = corner & 1 ? r->high[0] : r->low[0];
    m[2] = corner & 2 ? r->high[1] : r->low[1];
}

/* The squares of the functions at a corner over their mean squares: 1 + 3 u^2 + 3 v^2. */
static double square_of(const double x[BLOCK_FUNCTIONS]) {
    return 1 + 3 * x[1] * x[1] + 3 * x[2] * x[2];
}

/* The nearest L, in the 2-norm over both rectangles, that is `least` where it was less at this pair of
 * corners; L_00 stays. The functions 1, u, v have the mean squares 1, 1/3, 1/3. across: L y, which follows L.
 */
static bool lift_corner(const double x[BLOCK_FUNCTIONS], const double y[BLOCK_FUNCTIONS], double least,
                        double across[BLOCK_FUNCTIONS], double L[BLOCK_FUNCTIONS][BLOCK_FUNCTIONS]) {
    const double value = across[0] + x[1] * across[1] + x[2] * across[2];
    if (value >= least) return false;
    const double norm = square_of(x) * square_of(y) - 1;
    if (!(norm > 0)) return false;
    const double by = (least - value) / norm;
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = r == 0; c < BLOCK_FUNCTIONS; c++) {
            const double more = by * (r > 0 ? 3 : 1) * (c > 0 ? 3 : 1) * x[r] * y[c];
            L[r][c] += more;
            across[r] += more * y[c];
        }
    return true;
}

/* Projections onto one corner after the other; what they leave below 0 takes a common factor. */
static void reduce(const block_range *ranges, cluster_block *block) {
    const double middle = fmax((double)block->L[0][0], 0);
    double L[BLOCK_FUNCTIONS][BLOCK_FUNCTIONS], x[CORNERS][BLOCK_FUNCTIONS], y[CORNERS][BLOCK_FUNCTIONS];
    bool lifted = true;
    for (int corner = 0; corner < CORNERS; corner++) {
        corner_of(&ranges[block->a], corner, x[corner]);
        corner_of(&ranges[block->b], corner, y[corner]);
    }
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = 0; c < BLOCK_FUNCTIONS; c++) L[r][c] = (double)block->L[r][c];
    L[0][0] = middle;
    for (int sweep = 0; sweep < SWEEPS && lifted; sweep++) {
        lifted = false;
        for (int b = 0; b < CORNERS; b++) {
            double across[BLOCK_FUNCTIONS];
            for (int r = 0; r < BLOCK_FUNCTIONS; r++)
                across[r] = L[r][0] + y[b][1] * L[r][1] + y[b][2] * L[r][2];
            for (int a = 0; a < CORNERS; a++)
                lifted = lift_corner(x[a], y[b], rest * middle, across, L) || lifted;
        }
    }
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = 0; c < BLOCK_FUNCTIONS; c++) block->L[r][c] = (float)L[r][c];
    if (block_least(ranges, block) >= 0) return;
    const double slope = least_slope(ranges, block, 1), share = slope < 0 ? (1 - rest) * middle / -slope : 0;
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = r == 0; c < BLOCK_FUNCTIONS; c++)
            block->L[r][c] = (float)(share * (double)block->L[r][c]);
}

lam_status block_factors_reduce(block_factors *f, size_t *n_reduced, lam_error *error) {
    block_range *ranges = NULL;
    size_t count = 0;
    if (block_ranges(f, &ranges, error) != LAM_OK) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(static, 4096) reduction(+ : count)
    for (size_t k = 0; k < f->n_blocks; k++) {
        if (block_least(ranges, &f->blocks[k]) >= 0) continue;
        reduce(ranges, &f->blocks[k]);
        count++;
    }
    free(ranges);
    if (n_reduced != NULL) *n_reduced = count;
    return LAM_OK;
}
