/* The blocks A_i F_ij = A_i A_j d_i d_j m_a(i)^T L m_b(j), d the balance, and their tree are written to
 * /form_factors and read back (store/FORMAT.md, storage = blocks); of L the numbers are stored that have a
 * function on both sides. Each array is checked, and a block that is negative anywhere is refused. */
#include "solver/operator/blocks/block_store.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GROUP STORE_FORM_FACTORS

/* This stands in place of the left child of a leaf. */
#define NO_CHILD UINT32_MAX
/* This stands in place of PLANE_ABOVE where a cluster holds several parts of the scene. */
#define PARTS_APART (UINT32_MAX - 1)

enum { CLUSTER_NUMBERS = 4, FRAME_NUMBERS = 9 };

/* Function r of a node is there where r is 0 or the axis has a scale. */
static inline bool has_function(const block_node *node, int r) {
    return r == 0 || node->over[r - 1] != 0;
}

static size_t functions_of(const block_node *node) {
    size_t count = 0;
    for (int r = 0; r < BLOCK_FUNCTIONS; r++) count += has_function(node, r) ? 1 : 0;
    return count;
}

static void pack_tree(const block_factors *f, uint32_t (*clusters)[CLUSTER_NUMBERS], double (*rectangles)[4],
                      double (*frames)[FRAME_NUMBERS]) {
    const plane_tree *tree = f->tree;
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        const block_node *node = &f->nodes[t];
        const uint32_t one[] = {c->begin, c->end, c->leaf ? NO_CHILD : c->left,
                                c->apart ? PARTS_APART : c->frame};
        const double rectangle[] = {node->centre[0], node->centre[1], node->over[0], node->over[1]};
        memcpy(clusters[t], one, sizeof one);
        memcpy(rectangles[t], rectangle, sizeof rectangle);
    }
    for (size_t k = 0; k < tree->n_frames; k++)
        for (int d = 0; d < 3; d++) {
            frames[k][d] = tree->frames[k].origin[d];
            for (int axis = 0; axis < 2; axis++) frames[k][3 + 3 * axis + d] = tree->frames[k].axis[axis][d];
        }
}

/* The numbers of the blocks one after the other; returns how many. numbers NULL: only counts them. */
static size_t pack_numbers(const block_factors *f, float *numbers) {
    size_t count = 0;
    for (size_t k = 0; k < f->n_blocks; k++) {
        const block_node *a = &f->nodes[f->blocks[k].a], *b = &f->nodes[f->blocks[k].b];
        for (int r = 0; r < BLOCK_FUNCTIONS; r++)
            for (int c = 0; c < BLOCK_FUNCTIONS; c++) {
                if (!has_function(a, r) || !has_function(b, c)) continue;
                if (numbers != NULL) numbers[count] = f->blocks[k].L[r][c];
                count++;
            }
    }
    return count;
}

lam_status block_factors_save(const block_factors *f, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = f->n, n_clusters = f->n_clusters, n_frames = f->tree->n_frames,
                 ends = n_clusters + n + 1;
    const size_t n_numbers = pack_numbers(f, NULL);
    uint32_t(*clusters)[CLUSTER_NUMBERS] = memory_allocate(n_clusters, sizeof *clusters, "blocks", error);
    double(*rectangles)[4] = memory_allocate(n_clusters, sizeof *rectangles, "blocks", error);
    double(*frames)[FRAME_NUMBERS] = memory_allocate(n_frames, sizeof *frames, "blocks", error);
    uint64_t *from = memory_allocate(ends, sizeof *from, "blocks", error);
    uint32_t *columns = memory_allocate(f->n_blocks, sizeof *columns, "blocks", error);
    float *numbers = memory_allocate(n_numbers, sizeof *numbers, "blocks", error);
    if (clusters == NULL || rectangles == NULL || frames == NULL || from == NULL || columns == NULL ||
        numbers == NULL)
        TRY(LAM_ERR_MEMORY);
    pack_tree(f, clusters, rectangles, frames);
    (void)pack_numbers(f, numbers);
    for (size_t t = 0; t < ends; t++) from[t] = f->from[t];
    for (size_t k = 0; k < f->n_blocks; k++) columns[k] = f->blocks[k].b;
    TRY(store_write(s, GROUP "/order", STORE_U32, 1, &n, f->order, error));
    TRY(store_write(s, GROUP "/clusters", STORE_U32, 2, (size_t[]){n_clusters, CLUSTER_NUMBERS}, clusters,
                    error));
    TRY(store_write(s, GROUP "/rectangles", STORE_F64, 2, (size_t[]){n_clusters, 4}, rectangles, error));
    TRY(store_write(s, GROUP "/frames", STORE_F64, 2, (size_t[]){n_frames, FRAME_NUMBERS}, frames, error));
    TRY(store_write(s, GROUP "/places", STORE_F64, 2, (size_t[]){n, 2}, f->place, error));
    TRY(store_write(s, GROUP "/balance", STORE_F64, 1, &n, f->balance, error));
    TRY(store_write(s, GROUP "/indptr", STORE_U64, 1, &ends, from, error));
    TRY(store_write(s, GROUP "/indices", STORE_U32, 1, &f->n_blocks, columns, error));
    TRY(store_write(s, GROUP "/data", STORE_F32, 1, &n_numbers, numbers, error));
done:
    free(clusters);
    free(rectangles);
    free(frames);
    free(from);
    free(columns);
    free(numbers);
    return status;
}

static lam_status check_numbers(store *s, const char *name, const double *values, size_t count, bool positive,
                                lam_error *error) {
    for (size_t k = 0; k < count; k++)
        if (!isfinite(values[k]) || (positive && !(values[k] > 0)))
            return status_fail(error, LAM_ERR_FORMAT, "%s: " GROUP "/%s[%zu] = %g, must be finite%s",
                               store_path(s), name, k, values[k], positive ? " and above 0" : "");
    return LAM_OK;
}

static lam_status read_order(store *s, plane_tree *tree, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    bool *seen = memory_allocate(tree->n, sizeof *seen, "form factors", error);
    if (seen == NULL) return LAM_ERR_MEMORY;
    TRY(store_read(s, GROUP "/order", STORE_U32, 1, (size_t[]){tree->n}, &data, error));
    tree->order = data;
    for (size_t p = 0; p < tree->n; p++) {
        const size_t i = tree->order[p];
        if (i >= tree->n || seen[i])
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: " GROUP "/order[%zu] = %zu, must hold every number below %zu once", store_path(s), p, i,
                 tree->n);
        seen[i] = true;
    }
done:
    free(seen);
    return status;
}

/* One cluster of a postorder: roots [n_roots] are the subtrees before it that have no parent yet. */
static lam_status check_cluster(store *s, const plane_tree *tree, size_t t, const uint32_t *roots,
                                size_t n_roots, lam_error *error) {
    lam_status status = LAM_OK;
    const plane_cluster *c = &tree->clusters[t], *all = tree->clusters;
    const uint32_t before = n_roots > 0 ? all[roots[n_roots - 1]].end : 0;
    if (c->frame != PLANE_ABOVE && c->frame >= tree->n_frames)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/clusters[%zu] has the plane %u, there are %zu",
             store_path(s), t, c->frame, tree->n_frames);
    if (c->leaf) {
        if (c->begin != before || c->end <= c->begin || c->end > tree->n || c->end - c->begin > PLANE_LEAF ||
            c->frame == PLANE_ABOVE)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: " GROUP "/clusters[%zu] has the positions %u to %u in plane %u, must be a leaf of 1 to "
                 "%d positions from %u on in one plane",
                 store_path(s), t, c->begin, c->end, c->frame, PLANE_LEAF, before);
        goto done;
    }
    if (n_roots < 2 || roots[n_roots - 1] != t - 1 || roots[n_roots - 2] != c->left ||
        c->begin != all[c->left].begin || c->end != all[t - 1].end)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: " GROUP "/clusters[%zu] joins cluster %u and the one before, positions %u to %u, which are "
             "not the two last subtrees",
             store_path(s), t, c->left, c->begin, c->end);
    for (int side = 0; c->frame != PLANE_ABOVE && side < 2; side++)
        if (all[side == 0 ? c->left : t - 1].frame != c->frame)
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/clusters[%zu] is in plane %u, and its part is not",
                 store_path(s), t, c->frame);
done:
    return status;
}

/* Clusters in postorder over all positions, no more than BLOCK_DEPTH_MOST deep. */
static lam_status check_tree(store *s, const plane_tree *tree, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n_roots = 0;
    uint32_t *roots = memory_allocate(tree->n_clusters, sizeof *roots, "form factors", error);
    uint32_t *depth = memory_allocate(tree->n_clusters, sizeof *depth, "form factors", error);
    if (roots == NULL || depth == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        TRY(check_cluster(s, tree, t, roots, n_roots, error));
        if (!c->leaf) {
            depth[t] = 1 + (depth[c->left] > depth[t - 1] ? depth[c->left] : depth[t - 1]);
            n_roots -= 2;
        }
        if (depth[t] >= BLOCK_DEPTH_MOST)
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/clusters[%zu] is %u levels high, must be below %d",
                 store_path(s), t, depth[t], BLOCK_DEPTH_MOST);
        roots[n_roots++] = (uint32_t)t;
    }
    if (n_roots != 1 || tree->clusters[roots[0]].begin != 0 || tree->clusters[roots[0]].end != tree->n)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/clusters are %zu trees, must be one over %zu positions",
             store_path(s), n_roots, tree->n);
done:
    free(roots);
    free(depth);
    return status;
}

static lam_status read_tree(store *s, plane_tree *tree, lam_error *error) {
    lam_status status = LAM_OK;
    void *clusters = NULL, *frames = NULL;
    size_t n_clusters[STORE_MAX_RANK] = {SIZE_MAX, CLUSTER_NUMBERS};
    size_t n_frames[STORE_MAX_RANK] = {SIZE_MAX, FRAME_NUMBERS};
    TRY(read_order(s, tree, error));
    TRY(store_read(s, GROUP "/clusters", STORE_U32, 2, n_clusters, &clusters, error));
    TRY(store_read(s, GROUP "/frames", STORE_F64, 2, n_frames, &frames, error));
    if (n_clusters[0] == 0 || n_clusters[0] > 2 * tree->n || n_clusters[0] + tree->n >= UINT32_MAX)
        FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/clusters has %zu rows, must have 1 to %zu", store_path(s),
             n_clusters[0], 2 * tree->n);
    TRY(check_numbers(s, "frames", frames, n_frames[0] * FRAME_NUMBERS, false, error));
    tree->n_clusters = n_clusters[0];
    tree->n_frames = n_frames[0];
    tree->clusters = memory_allocate(tree->n_clusters, sizeof *tree->clusters, "form factors", error);
    tree->frames = memory_allocate(tree->n_frames, sizeof *tree->frames, "form factors", error);
    if (tree->clusters == NULL || tree->frames == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < tree->n_clusters; t++) {
        const uint32_t *c = (const uint32_t *)clusters + CLUSTER_NUMBERS * t;
        tree->clusters[t] = (plane_cluster){.begin = c[0],
                                            .end = c[1],
                                            .left = c[2] == NO_CHILD ? 0 : c[2],
                                            .leaf = c[2] == NO_CHILD,
                                            .apart = c[3] == PARTS_APART,
                                            .frame = c[3] == PARTS_APART ? PLANE_ABOVE : c[3]};
    }
    for (size_t k = 0; k < tree->n_frames; k++) {
        const double *f = (const double *)frames + FRAME_NUMBERS * k;
        for (int d = 0; d < 3; d++) {
            tree->frames[k].origin[d] = f[d];
            for (int axis = 0; axis < 2; axis++) tree->frames[k].axis[axis][d] = f[3 + 3 * axis + d];
        }
    }
    TRY(check_tree(s, tree, error));
done:
    free(clusters);
    free(frames);
    return status;
}

static lam_status read_nodes(store *s, const double *area, block_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = f->n, n_clusters = f->n_clusters;
    void *data = NULL, *rectangles = NULL;
    TRY(store_read(s, GROUP "/places", STORE_F64, 2, (size_t[]){n, 2}, &data, error));
    f->place = data;
    TRY(check_numbers(s, "places", f->place[0], 2 * n, false, error));
    TRY(store_read(s, GROUP "/balance", STORE_F64, 1, (size_t[]){n}, &data, error));
    f->balance = data;
    TRY(check_numbers(s, "balance", f->balance, n, true, error));
    TRY(store_read(s, GROUP "/rectangles", STORE_F64, 2, (size_t[]){n_clusters, 4}, &rectangles, error));
    TRY(check_numbers(s, "rectangles", rectangles, 4 * n_clusters, false, error));
    f->nodes = memory_allocate(n_clusters + n, sizeof *f->nodes, "form factors", error);
    f->area = memory_allocate(n, sizeof *f->area, "form factors", error);
    if (f->nodes == NULL || f->area == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) f->area[p] = area[f->order[p]];
    for (size_t t = 0; t < n_clusters; t++) {
        const plane_cluster *c = &f->tree->clusters[t];
        const double *r = (const double *)rectangles + 4 * t;
        f->nodes[t] = (block_node){.begin = c->begin,
                                   .end = c->end,
                                   .parent = BLOCK_NO_NODE,
                                   .centre = {r[0], r[1]},
                                   .over = {r[2], r[3]}};
        for (int axis = 0; axis < 2; axis++)
            if (r[2 + axis] < 0 || (c->frame == PLANE_ABOVE && r[2 + axis] != 0))
                FAIL(error, LAM_ERR_FORMAT,
                     "%s: " GROUP "/rectangles[%zu][%d] = %g, must be at least 0, and 0 above planes",
                     store_path(s), t, 2 + axis, r[2 + axis]);
        if (!c->leaf) f->nodes[c->left].parent = f->nodes[t - 1].parent = (uint32_t)t;
        for (uint32_t p = c->begin; c->leaf && p < c->end; p++)
            f->nodes[n_clusters + p] = (block_node){
                .begin = p, .end = p + 1, .parent = (uint32_t)t, .centre = {f->place[p][0], f->place[p][1]}};
    }
done:
    free(rectangles);
    return status;
}

/* Each node lies within its parent, so that no function exceeds 1. */
static lam_status check_nodes(store *s, const block_factors *f, lam_error *error) {
    for (size_t t = 0; t < f->n_clusters + f->n; t++) {
        if (f->nodes[t].parent == BLOCK_NO_NODE) continue;
        const block_step step = block_step_up(&f->nodes[t], &f->nodes[f->nodes[t].parent]);
        for (int axis = 0; axis < 2; axis++)
            if (!(fabs(step.shift[axis]) + step.scale[axis] <= 1 + BLOCK_OVERHANG))
                return status_fail(error, LAM_ERR_FORMAT,
                                   "%s: " GROUP "/%s[%zu] reaches beyond the rectangle of cluster %u, to %g "
                                   "times its half width",
                                   store_path(s), t < f->n_clusters ? "rectangles" : "places",
                                   t < f->n_clusters ? t : t - f->n_clusters, f->nodes[t].parent,
                                   fabs(step.shift[axis]) + step.scale[axis]);
    }
    return LAM_OK;
}

static lam_status read_indices(store *s, block_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_nodes = f->n_clusters + f->n;
    void *from = NULL, *columns = NULL;
    size_t count[STORE_MAX_RANK] = {SIZE_MAX};
    TRY(store_read(s, GROUP "/indptr", STORE_U64, 1, (size_t[]){n_nodes + 1}, &from, error));
    TRY(store_read(s, GROUP "/indices", STORE_U32, 1, count, &columns, error));
    const uint64_t *begin = from;
    const uint32_t *b = columns;
    f->blocks = memory_allocate(count[0], sizeof *f->blocks, "form factors", error);
    if (f->blocks == NULL) TRY(LAM_ERR_MEMORY);
    f->n_blocks = count[0];
    if (begin[0] != 0 || begin[n_nodes] != count[0])
        FAIL(error, LAM_ERR_FORMAT,
             "%s: " GROUP "/indptr begins with %zu and ends with %zu, must be 0 and %zu", store_path(s),
             (size_t)begin[0], (size_t)begin[n_nodes], count[0]);
    for (size_t t = 0; t < n_nodes; t++) {
        if (begin[t + 1] < begin[t] || begin[t + 1] > count[0])
            FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/indptr[%zu] = %zu, must be from %zu to %zu",
                 store_path(s), t + 1, (size_t)begin[t + 1], (size_t)begin[t], count[0]);
        for (uint64_t k = begin[t]; k < begin[t + 1]; k++) {
            if (b[k] >= n_nodes || f->nodes[b[k]].begin < f->nodes[t].end ||
                (k > begin[t] && b[k] <= b[k - 1]))
                FAIL(error, LAM_ERR_FORMAT,
                     "%s: " GROUP "/indices[%zu] = %u, must rise, below %zu, and lie behind node %zu",
                     store_path(s), (size_t)k, b[k], n_nodes, t);
            f->blocks[k].a = (uint32_t)t;
            f->blocks[k].b = b[k];
        }
    }
done:
    free(from);
    free(columns);
    return status;
}

static lam_status read_numbers(store *s, block_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    size_t count = 0;
    for (size_t k = 0; k < f->n_blocks; k++)
        count += functions_of(&f->nodes[f->blocks[k].a]) * functions_of(&f->nodes[f->blocks[k].b]);
    TRY(store_read(s, GROUP "/data", STORE_F32, 1, (size_t[]){count}, &data, error));
    const float *next = data;
    for (size_t k = 0; k < f->n_blocks; k++) {
        cluster_block *block = &f->blocks[k];
        const block_node *a = &f->nodes[block->a], *b = &f->nodes[block->b];
        for (int r = 0; r < BLOCK_FUNCTIONS; r++)
            for (int c = 0; c < BLOCK_FUNCTIONS; c++) {
                if (!has_function(a, r) || !has_function(b, c)) continue;
                block->L[r][c] = *next++;
                if (!isfinite(block->L[r][c]))
                    FAIL(error, LAM_ERR_FORMAT, "%s: " GROUP "/data[%zu] = %g, must be finite", store_path(s),
                         (size_t)(next - 1 - (const float *)data), (double)block->L[r][c]);
            }
    }
done:
    free(data);
    return status;
}

static lam_status check_blocks(store *s, const block_factors *f, lam_error *error) {
    block_range *ranges = NULL;
    lam_status status = block_ranges(f, &ranges, error);
    for (size_t k = 0; status == LAM_OK && k < f->n_blocks; k++) {
        const double least = block_least(ranges, &f->blocks[k]);
        if (!(least >= 0))
            status =
                status_fail(error, LAM_ERR_FORMAT,
                            "%s: " GROUP "/data: block %zu, of nodes %u and %u, is %g 1/m2 at some of its "
                            "elements, must be at least 0",
                            store_path(s), k, f->blocks[k].a, f->blocks[k].b, least);
    }
    free(ranges);
    return status;
}

lam_status block_factors_load(store *s, size_t n, const double *area, plane_tree *tree, block_factors *f,
                              lam_error *error) {
    lam_status status = LAM_OK;
    *tree = (plane_tree){.n = n};
    *f = (block_factors){.n = 0};
    TRY(read_tree(s, tree, error));
    *f = (block_factors){.tree = tree, .n = n, .n_clusters = tree->n_clusters, .order = tree->order};
    TRY(read_nodes(s, area, f, error));
    TRY(check_nodes(s, f, error));
    TRY(read_indices(s, f, error));
    TRY(read_numbers(s, f, error));
    TRY(check_blocks(s, f, error));
    TRY(block_factors_end(f, error));
done:
    return status;
}

/* Bytes for each cluster, element and block once loaded. */
enum {
    CLUSTER_BYTES = sizeof(plane_cluster) + sizeof(block_node) + 2 * sizeof(size_t) + sizeof(uint32_t) +
                    sizeof(block_piece),
    ELEMENT_BYTES = sizeof(block_node) + 2 * sizeof(size_t) + 4 * sizeof(double) + sizeof(uint32_t),
    BLOCK_BYTES = sizeof(cluster_block) + sizeof(uint32_t)
};

size_t block_factors_bytes(const block_factors *f) {
    return CLUSTER_BYTES * f->n_clusters + ELEMENT_BYTES * f->n + BLOCK_BYTES * f->n_blocks;
}

lam_status block_factors_stored(store *s, size_t *kept, size_t *most, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    int rank;
    size_t clusters[STORE_MAX_RANK] = {0}, elements[STORE_MAX_RANK] = {0}, blocks[STORE_MAX_RANK] = {0};
    TRY(store_array_info(s, GROUP "/clusters", &type, &rank, clusters, error));
    TRY(store_array_info(s, GROUP "/order", &type, &rank, elements, error));
    TRY(store_array_info(s, GROUP "/indices", &type, &rank, blocks, error));
    const size_t largest = SIZE_MAX / 1024;
    if (clusters[0] > largest || elements[0] > largest || blocks[0] > largest)
        FAIL(error, LAM_ERR_MEMORY, "%s: " GROUP " is larger than memory can be", store_path(s));
    *kept = CLUSTER_BYTES * clusters[0] + ELEMENT_BYTES * elements[0] + BLOCK_BYTES * blocks[0];
    /* Their numbers as stored, then the ranges of nodes. */
    *most = *kept + sizeof(block_range) * (clusters[0] + elements[0]) +
            BLOCK_FUNCTIONS * BLOCK_FUNCTIONS * sizeof(float) * blocks[0];
done:
    return status;
}
