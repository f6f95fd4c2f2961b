#include "solver/operator/refine/kept_blocks.h"

#include "store/status.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Roundings of a level, on the way up or down: of the coordinates of a step (3), of two products and their
 * sum (3), of the sums over two children, or over a leaf's elements (PLANE_LEAF). */
enum { LEVEL_ROUNDINGS = 8 + PLANE_LEAF };
/* Roundings of area, balance and number of an element, twice, and of a product with L. */
enum { OTHER_ROUNDINGS = 16 };
/* Factor for the rounding of the bounds themselves. */
static const double margin = 1 + 1e-9;

void kept_blocks_free(kept_blocks *k) {
    block_factors_free(&k->f);
    plane_tree_free(&k->tree);
}

/* out_i = sum_j value[block of i and j] weight_j, both [n] by position, values at least 0; sums [2][nodes].
 * One thread, as a daemon that loads form factors has others to serve. */
static void add_up(const block_factors *f, const double *value, const double *weight, double *sums,
                   double *out) {
    const size_t n = f->n, n_clusters = f->n_clusters, n_nodes = n_clusters + n;
    double *const up = sums, *const down = sums + n_nodes;
    for (size_t t = 0; t < n_clusters; t++) up[t] = 0;
    for (size_t k = 0; k < n_nodes; k++) {
        const size_t t = k < n ? n_clusters + k : k - n;
        if (k < n) up[t] = weight[k];
        if (f->nodes[t].parent != BLOCK_NO_NODE) up[f->nodes[t].parent] += up[t];
    }
    for (size_t t = 0; t < n_nodes; t++) down[t] = 0;
    for (size_t k = 0; k < f->n_blocks; k++) {
        down[f->blocks[k].a] += value[k] * up[f->blocks[k].b];
        down[f->blocks[k].b] += value[k] * up[f->blocks[k].a];
    }
    /* Parents stand behind their children, and elements behind all clusters. */
    for (size_t t = n_clusters; t-- > 0;)
        if (f->nodes[t].parent != BLOCK_NO_NODE) down[t] += down[f->nodes[t].parent];
    for (size_t p = 0; p < n; p++) out[p] = down[n_clusters + p] + down[f->nodes[n_clusters + p].parent];
}

/* Levels of clusters above an element, at most; blocks of one node, at most. */
static void measure(const block_factors *f, uint32_t *level, size_t *n_levels, size_t *n_blocks) {
    *n_levels = *n_blocks = 0;
    for (size_t t = f->n_clusters; t-- > 0;) {
        level[t] = f->nodes[t].parent == BLOCK_NO_NODE ? 1 : level[f->nodes[t].parent] + 1;
        if (level[t] > *n_levels) *n_levels = level[t];
    }
    for (size_t t = 0; t < f->n_clusters + f->n; t++) {
        const size_t count = f->from[t + 1] - f->from[t] + f->into_from[t + 1] - f->into_from[t];
        if (count > *n_blocks) *n_blocks = count;
    }
}

static lam_status find_rounding(const block_factors *f, double *value, double *weight, double *sums,
                                double *out, double *rounding, lam_error *error) {
    size_t n_levels, n_blocks;
    double largest = 0;
    uint32_t *level = memory_allocate(f->n_clusters, sizeof *level, "form factors", error);
    if (level == NULL) return LAM_ERR_MEMORY;
    measure(f, level, &n_levels, &n_blocks);
    free(level);
    for (size_t p = 0; p < f->n; p++) weight[p] = f->area[p] * f->balance[p];
    for (size_t k = 0; k < f->n_blocks; k++) value[k] = block_magnitude(&f->blocks[k]);
    add_up(f, value, weight, sums, out);
    for (size_t p = 0; p < f->n; p++) largest = fmax(largest, f->balance[p] * out[p]);
    const double count =
        (2. * LEVEL_ROUNDINGS * (double)(n_levels + 1) + OTHER_ROUNDINGS + (double)n_blocks) *
        (.5 * DBL_EPSILON);
    *rounding = margin * count / (1 - count) * pow(1 + BLOCK_OVERHANG, 2. * (double)(n_levels + 1)) * largest;
    return LAM_OK;
}

/* F_ij^2 / A_j <= A_j d_i^2 d_j^2 max f^2. */
static lam_status find_norms(const block_factors *f, double *value, double *weight, double *sums, double *out,
                             double *row_norms, lam_error *error) {
    block_range *ranges = NULL;
    if (block_ranges(f, &ranges, error) != LAM_OK) return LAM_ERR_MEMORY;
    for (size_t p = 0; p < f->n; p++) weight[p] = f->area[p] * f->balance[p] * f->balance[p];
    for (size_t k = 0; k < f->n_blocks; k++) {
        const double most = block_most(ranges, &f->blocks[k]);
        value[k] = most * most;
    }
    add_up(f, value, weight, sums, out);
    for (size_t p = 0; p < f->n; p++) row_norms[f->order[p]] = margin * f->balance[p] * sqrt(out[p]);
    free(ranges);
    return LAM_OK;
}

lam_status kept_blocks_make(plane_tree *tree, block_factors *f, double most, kept_blocks *out,
                            double *row_sums, double *row_norms, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = f->n;
    kept_blocks made = {.tree = *tree, .f = *f};
    double *weight = memory_allocate(n, sizeof *weight, "form factors", error);
    double *sums = memory_allocate(f->n_clusters + n, 2 * sizeof *sums, "form factors", error);
    double *of_row = memory_allocate(n, sizeof *of_row, "form factors", error);
    double *value = memory_allocate(f->n_blocks, sizeof *value, "form factors", error);
    void *work = memory_allocate(block_factors_work(f, 1), 1, "form factors", error);
    const block_vectors ones = {1, 1, false, (const double *const[]){weight}, (double *const[]){of_row}};
    *tree = (plane_tree){.n = 0};
    *f = (block_factors){.n = 0};
    made.f.tree = &made.tree;
    if (weight == NULL || sums == NULL || of_row == NULL || value == NULL || work == NULL)
        TRY(LAM_ERR_MEMORY);
    TRY(find_rounding(&made.f, value, weight, sums, of_row, &made.rounding, error));
    TRY(find_norms(&made.f, value, weight, sums, of_row, row_norms, error));
    for (size_t p = 0; p < n; p++) weight[p] = 1;
    block_factors_apply(&made.f, &ones, work, 1);
    for (size_t p = 0; p < n; p++) {
        const size_t i = made.f.order[p];
        row_sums[i] = of_row[p] + made.rounding;
        if (!(row_sums[i] <= most))
            FAIL(error, LAM_ERR_FORMAT, "form factors of element %zu sum to %g, must be at most %.4g", i,
                 row_sums[i], most);
    }
    *out = made;
    out->f.tree = &out->tree;
    made = (kept_blocks){.rounding = 0};
done:
    free(weight);
    free(sums);
    free(of_row);
    free(value);
    free(work);
    kept_blocks_free(&made);
    return status;
}

lam_status kept_blocks_load(store *s, size_t n, const double *area, double most, kept_blocks *out,
                            double *row_sums, double *row_norms, lam_error *error) {
    lam_status status = LAM_OK;
    lam_error why;
    plane_tree tree;
    block_factors f;
    status = block_factors_load(s, n, area, &tree, &f, error);
    if (status != LAM_OK) goto done;
    status = kept_blocks_make(&tree, &f, most, out, row_sums, row_norms, &why);
    if (status != LAM_OK) FAIL(error, status, "%s: %s", store_path(s), why.message);
done:
    block_factors_free(&f);
    plane_tree_free(&tree);
    return status;
}

size_t kept_blocks_bytes(const kept_blocks *k) {
    return block_factors_bytes(&k->f) + k->f.n_blocks * sizeof *k->f.blocks;
}
