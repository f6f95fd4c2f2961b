/* Blocks A_i F_ij = A_i A_j m_a(i)^T L m_b(j) are made usable (Hanrahan, Salzman and Aupperle 1991): nodes
 * get their rectangles, m_t(i) = (1, (x - centre) over), blocks are sorted by a, then by b, and listed by b
 * as well, and the tree is cut into the pieces that threads share. block_product.c has the products. */
#include "solver/operator/blocks/block_factors.h"

#include "solver/base/array_grow.h"
#include "solver/base/parallel.h"
#include "store/status.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

void block_factors_free(block_factors *f) {
    free(f->nodes);
    free(f->place);
    free(f->area);
    free(f->balance);
    free(f->blocks);
    free(f->from);
    free(f->into_from);
    free(f->into);
    free(f->pieces);
    free(f->above);
    *f = (block_factors){.n = 0};
}

typedef struct rectangle {
    double low[2], high[2];
} rectangle;

static void widen(rectangle *r, const rectangle *by) {
    for (int axis = 0; axis < 2; axis++) {
        r->low[axis] = fmin(r->low[axis], by->low[axis]);
        r->high[axis] = fmax(r->high[axis], by->high[axis]);
    }
}

/* Areas and places of the elements of a leaf, and their nodes; returns the rectangle around them. */
static rectangle place_elements(const plane_tree *tree, size_t leaf, const double *area,
                                const double (*centre)[3], block_factors *f) {
    const plane_cluster *c = &tree->clusters[leaf];
    const plane_frame *frame = &tree->frames[c->frame];
    rectangle around = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (uint32_t p = c->begin; p < c->end; p++) {
        const uint32_t i = tree->order[p];
        rectangle point;
        for (int axis = 0; axis < 2; axis++) {
            double at = 0;
            for (int d = 0; d < 3; d++) at += frame->axis[axis][d] * (centre[i][d] - frame->origin[d]);
            f->place[p][axis] = point.low[axis] = point.high[axis] = at;
        }
        f->area[p] = area[i];
        f->nodes[f->n_clusters + p] = (block_node){
            .begin = p, .end = p + 1, .parent = (uint32_t)leaf, .centre = {f->place[p][0], f->place[p][1]}};
        widen(&around, &point);
    }
    return around;
}

static void set_rectangle(const rectangle *r, block_node *node) {
    for (int axis = 0; axis < 2; axis++) {
        node->centre[axis] = (r->low[axis] + r->high[axis]) / 2;
        node->over[axis] = r->high[axis] > r->low[axis] ? 2 / (r->high[axis] - r->low[axis]) : 0;
    }
}

lam_status block_factors_begin(const plane_tree *tree, const double *area, const double (*centre)[3],
                               block_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = tree->n, n_clusters = tree->n_clusters;
    block_factors f = {.tree = tree, .n = n, .n_clusters = n_clusters, .order = tree->order};
    rectangle *around = memory_allocate(n_clusters, sizeof *around, "blocks", error);
    f.nodes = memory_allocate(n_clusters + n, sizeof *f.nodes, "blocks", error);
    f.place = memory_allocate(n, sizeof *f.place, "blocks", error);
    f.area = memory_allocate(n, sizeof *f.area, "blocks", error);
    if (around == NULL || f.nodes == NULL || f.place == NULL || f.area == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        block_node *node = &f.nodes[t];
        *node = (block_node){.begin = c->begin, .end = c->end, .parent = BLOCK_NO_NODE};
        if (!c->leaf) f.nodes[c->left].parent = f.nodes[t - 1].parent = (uint32_t)t;
        if (c->frame == PLANE_ABOVE) continue;
        if (c->leaf) {
            around[t] = place_elements(tree, t, area, centre, &f);
        } else {
            around[t] = around[t - 1];
            widen(&around[t], &around[c->left]);
        }
        set_rectangle(&around[t], node);
    }
    *out = f;
    f = (block_factors){.n = 0};
done:
    free(around);
    block_factors_free(&f);
    return status;
}

/* Swaps a and b where b stands before a. */
static void turn(const block_node *nodes, cluster_block *k) {
    if (nodes[k->a].begin < nodes[k->b].begin) return;
    const cluster_block was = *k;
    k->a = was.b;
    k->b = was.a;
    for (int r = 0; r < BLOCK_FUNCTIONS; r++)
        for (int c = 0; c < BLOCK_FUNCTIONS; c++) k->L[r][c] = was.L[c][r];
}

/* from[t] = the number of blocks that have a node below t as a (or as b), for t up to n_nodes. */
static void count_blocks(const block_factors *f, size_t n_nodes, bool as_b, size_t *from) {
    memset(from, 0, (n_nodes + 1) * sizeof *from);
    for (size_t k = 0; k < f->n_blocks; k++) from[(as_b ? f->blocks[k].b : f->blocks[k].a) + 1]++;
    for (size_t t = 0; t < n_nodes; t++) from[t + 1] += from[t];
}

/* Counts by a and by b, at once. */
static void count_both(const block_factors *f) {
#pragma omp parallel for schedule(static, 1)
    for (int as_b = 0; as_b < 2; as_b++)
        count_blocks(f, f->n_clusters + f->n, as_b == 1, as_b == 1 ? f->into_from : f->from);
}

/* The first node of part k of n_parts, which hold about as many blocks each. */
static uint32_t part_begin(const size_t *from, size_t n_nodes, size_t k, size_t n_parts) {
    const size_t before = from[n_nodes] / n_parts * k;
    size_t low = 0, high = n_nodes;
    if (k == n_parts) return (uint32_t)n_nodes;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (from[middle] < before)
            low = middle + 1;
        else
            high = middle;
    }
    return (uint32_t)low;
}

/* Cuts the tree into the largest subtrees of at most some elements, which threads take one at a time, and the
 * clusters above them. */
static lam_status cut(block_factors *f, lam_error *error) {
    const size_t most = f->n / 64 + 8;
    size_t first = 0;
    f->pieces = memory_allocate(f->n_clusters, sizeof *f->pieces, "blocks", error);
    f->above = memory_allocate(f->n_clusters, sizeof *f->above, "blocks", error);
    if (f->pieces == NULL || f->above == NULL) return LAM_ERR_MEMORY;
    f->n_pieces = f->n_above = 0;
    for (size_t t = 0; t < f->n_clusters; t++) {
        const block_node *node = &f->nodes[t];
        if (node->end - node->begin > most) {
            f->above[f->n_above++] = (uint32_t)t;
            first = t + 1;
        } else if (node->parent == BLOCK_NO_NODE ||
                   f->nodes[node->parent].end - f->nodes[node->parent].begin > most) {
            f->pieces[f->n_pieces++] = (block_piece){first, t + 1};
            first = t + 1;
        }
    }
    return LAM_OK;
}

/* True where each block has a before b, and stands behind those of smaller a, or of the same a and smaller b.
 */
static bool is_sorted(const block_factors *f) {
    for (size_t k = 0; k < f->n_blocks; k++) {
        const cluster_block *here = &f->blocks[k], *last = &f->blocks[k > 0 ? k - 1 : 0];
        if (f->nodes[here->a].begin >= f->nodes[here->b].begin) return false;
        if (here->a < last->a || (here->a == last->a && here->b < last->b)) return false;
    }
    return true;
}

/* A block's b, and its place among those of its a. */
typedef struct block_key {
    uint32_t b, place;
} block_key;

/* Keys up to which insertion is quicker. */
enum { FEW_KEYS = 24 };

/* Sorts keys whose b are below `bound`, byte by byte from the lowest; spare [count]. */
static void sort_keys(size_t count, block_key *keys, block_key *spare, size_t bound) {
    if (count <= FEW_KEYS) {
        for (size_t k = 1; k < count; k++) {
            const block_key one = keys[k];
            size_t at = k;
            for (; at > 0 && keys[at - 1].b > one.b; at--) keys[at] = keys[at - 1];
            keys[at] = one;
        }
        return;
    }
    for (int shift = 0; shift < 32 && (bound - 1) >> shift > 0; shift += 8) {
        size_t next[257] = {0};
        for (size_t k = 0; k < count; k++) next[(keys[k].b >> shift & 255) + 1]++;
        for (int byte = 0; byte < 256; byte++) next[byte + 1] += next[byte];
        for (size_t k = 0; k < count; k++) spare[next[keys[k].b >> shift & 255]++] = keys[k];
        memcpy(keys, spare, count * sizeof *keys);
    }
}

/* Blocks are sorted in parts of some nodes a each, so small that a part is sorted within a cache. */
enum { SORTED_PARTS = 128 };

/* Brings the blocks of each part together in place: each exchange brings one into its part. */
static void part_blocks(cluster_block *blocks, const uint8_t *part_of, size_t next[SORTED_PARTS],
                        const size_t end[SORTED_PARTS]) {
    for (size_t p = 0; p < SORTED_PARTS; p++)
        while (next[p] < end[p]) {
            const cluster_block here = blocks[next[p]];
            const size_t q = part_of[here.a], to = next[q]++;
            if (q == p) continue;
            blocks[next[p]] = blocks[to];
            blocks[to] = here;
        }
}

/* Sorts the blocks by a, those of one a by b: no two have both nodes in common. They stay where they are, but
 * for one part for each thread at a time. */
static lam_status sort_blocks(const block_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_nodes = f->n_clusters + f->n;
    size_t next[SORTED_PARTS], end[SORTED_PARTS], longest = 0;
    uint32_t first[SORTED_PARTS + 1];
    cluster_block *room = NULL;
    block_key *keys = NULL; /* twice for each thread */
    size_t *place =
        memory_allocate(n_nodes, sizeof *place, "blocks", error); /* of the next block of a node */
    uint8_t *part_of = memory_allocate(n_nodes, sizeof *part_of, "blocks", error);
    if (place == NULL || part_of == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(place, f->from, n_nodes * sizeof *place);
    for (size_t p = 0; p <= SORTED_PARTS; p++) first[p] = part_begin(f->from, n_nodes, p, SORTED_PARTS);
    for (size_t p = 0; p < SORTED_PARTS; p++) {
        memset(part_of + first[p], (int)p, first[p + 1] - first[p]);
        next[p] = f->from[first[p]];
        end[p] = f->from[first[p + 1]];
        longest = end[p] - next[p] > longest ? end[p] - next[p] : longest;
    }
    room = memory_allocate((size_t)omp_get_max_threads(), longest * sizeof *room, "blocks", error);
    keys = memory_allocate((size_t)omp_get_max_threads(), 2 * longest * sizeof *keys, "blocks", error);
    if (room == NULL || keys == NULL) TRY(LAM_ERR_MEMORY);
    part_blocks(f->blocks, part_of, next, end);
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t p = 0; p < SORTED_PARTS; p++) {
        const size_t begin = f->from[first[p]], count = end[p] - begin;
        const size_t thread = (size_t)omp_get_thread_num();
        cluster_block *const own = room + thread * longest, *const all = f->blocks + begin;
        block_key *const of = keys + 2 * thread * longest;
        for (size_t k = 0; k < count; k++) own[place[all[k].a]++ - begin] = all[k];
        for (size_t t = first[p]; t < first[p + 1]; t++) {
            const size_t from = f->from[t] - begin, n_own = f->from[t + 1] - f->from[t];
            for (size_t k = 0; k < n_own; k++) of[k] = (block_key){own[from + k].b, (uint32_t)k};
            sort_keys(n_own, of, of + longest, n_nodes);
            for (size_t k = 0; k < n_own; k++) all[from + k] = own[from + of[k].place];
        }
    }
done:
    free(keys);
    free(room);
    free(place);
    free(part_of);
    return status;
}

/* f->into, the blocks by b, those of one b in their present order. next as above. */
static void order_by_b(const block_factors *f, size_t *next) {
    const size_t n_nodes = f->n_clusters + f->n;
#pragma omp parallel
    {
        const size_t n_parts = (size_t)omp_get_num_threads(), part = (size_t)omp_get_thread_num();
        const uint32_t first = part_begin(f->into_from, n_nodes, part, n_parts),
                       last = part_begin(f->into_from, n_nodes, part + 1, n_parts);
        memcpy(next + first, f->into_from + first, (last - first) * sizeof *next);
        for (size_t k = 0; k < f->n_blocks; k++) {
            const uint32_t b = f->blocks[k].b;
            if (b >= first && b < last) f->into[next[b]++] = (uint32_t)k;
        }
    }
}

static void find_some_parts(const void *job, size_t thread, size_t first_part, size_t last_part) {
    block_factors *f = *(block_factors *const *)job;
    const uint32_t n_clusters = (uint32_t)f->n_clusters, n_nodes = n_clusters + (uint32_t)f->n;
    (void)thread;
    for (size_t k = first_part; k < last_part; k++) {
        block_part part = {.first = part_begin(f->from, n_nodes, k, BLOCK_PARTS),
                           .last = part_begin(f->from, n_nodes, k + 1, BLOCK_PARTS),
                           .least_cluster = n_clusters,
                           .least_element = n_nodes};
        for (size_t at = f->from[part.first]; at < f->from[part.last]; at++) {
            const uint32_t b = f->blocks[at].b;
            uint32_t *const least = b < n_clusters ? &part.least_cluster : &part.least_element;
            if (b < *least) *least = b;
        }
        f->parts[k] = part;
    }
}

/* All blocks behind those of the first list. */
static lam_status join_lists(block_factors *f, size_t n_lists, block_list *lists, lam_error *error) {
    lam_status status = LAM_OK;
    block_list *const all = &lists[0];
    size_t count = 0;
    for (size_t l = 0; l < n_lists; l++) count += lists[l].count;
    if (count > UINT32_MAX) FAIL(error, LAM_ERR_MEMORY, "%zu blocks, must be below 2^32", count);
    if (n_lists > 1) TRY(array_resize(&all->list, count, sizeof *all->list, "blocks", error));
    for (size_t l = 1; l < n_lists; l++) {
        block_list *const from = &lists[l];
        if (from->count > 0) memcpy(all->list + all->count, from->list, from->count * sizeof *from->list);
        all->count += from->count;
        free(from->list);
        *from = (block_list){.list = NULL};
    }
    f->blocks = all->list;
    f->n_blocks = all->count;
    *all = (block_list){.list = NULL};
done:
    return status;
}

lam_status block_factors_end_lists(block_factors *f, size_t n_lists, block_list *lists, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_nodes = f->n_clusters + f->n;
    size_t *next = NULL;
    TRY(cut(f, error));
    TRY(join_lists(f, n_lists, lists, error));
    f->from = memory_allocate(n_nodes + 1, sizeof *f->from, "blocks", error);
    f->into_from = memory_allocate(n_nodes + 1, sizeof *f->into_from, "blocks", error);
    f->into = memory_allocate(f->n_blocks, sizeof *f->into, "blocks", error);
    next = memory_allocate(n_nodes, sizeof *next, "blocks", error);
    if (f->from == NULL || f->into_from == NULL || f->into == NULL || next == NULL) TRY(LAM_ERR_MEMORY);
    const bool sorted = n_lists == 1 && is_sorted(f);
#pragma omp parallel for schedule(static) if (!sorted)
    for (size_t k = 0; k < (sorted ? 0 : f->n_blocks); k++) turn(f->nodes, &f->blocks[k]);
    count_both(f);
    if (!sorted) TRY(sort_blocks(f, error));
    order_by_b(f, next);
    parallel_share(parallel_threads(), BLOCK_PARTS, 1, find_some_parts, &f);
done:
    free(next);
    return status;
}

lam_status block_factors_end(block_factors *f, lam_error *error) {
    block_list all = {.list = f->blocks, .count = f->n_blocks};
    f->blocks = NULL;
    f->n_blocks = 0;
    const lam_status status = block_factors_end_lists(f, 1, &all, error);
    free(all.list); /* after an error */
    return status;
}
