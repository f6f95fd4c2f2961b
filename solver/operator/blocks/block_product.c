/* Products with form factors by blocks, panels of vectors at a time: the two passes of an H^2-matrix product
 * (Hackbusch and Boerm 2002) around one over the blocks. */
#include "solver/base/cpu.h"
#include "solver/operator/blocks/block_factors.h"

#include "store/status.h"

#include <stdlib.h>
#include <string.h>

/* Vectors of a wide panel; prefetch distance, in blocks; nodes that a thread takes at a time. */
enum { WIDE = 8, AHEAD = 6, NODES_AT_ONCE = 256 };
typedef double wide __attribute__((vector_size(8 * WIDE), may_alias));

/* Some vectors on their way: `count` of those from x to y, [n][n_vectors], and in panels beside each other
 * numbers of elements [n] and moments of clusters [n_clusters][BLOCK_FUNCTIONS]. */
typedef struct panel {
    const block_factors *f;
    const double *from;
    double *to;
    size_t n_vectors, count;
    void *x, *y, *up, *down;
} panel;

#define KERNEL(name) name##_one
#define TARGET
#define LANES one
#define WIDTH 1
typedef double one __attribute__((vector_size(8), may_alias));
#include "solver/operator/blocks/block_product_kernels.inc"

#define KERNEL(name) name##_portable
#define TARGET
#define LANES wide
#define WIDTH WIDE
#include "solver/operator/blocks/block_product_kernels.inc"

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define LANES wide
#define WIDTH WIDE
#include "solver/operator/blocks/block_product_kernels.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define LANES wide
#define WIDTH WIDE
#include "solver/operator/blocks/block_product_kernels.inc"
#endif

/* Each takes a node. */
typedef struct product_kernels {
    void (*load_leaf)(const panel *, size_t);
    void (*raise)(const panel *, size_t);
    void (*gather_blocks)(const panel *, size_t);
    void (*lower)(const panel *, size_t);
    void (*store_leaf)(const panel *, size_t);
} product_kernels;

#define KERNELS(name)                                                                                        \
    { load_leaf_##name, raise_##name, gather_blocks_##name, lower_##name, store_leaf_##name }
static const product_kernels one_kernels = KERNELS(one);
static const product_kernels wide_kernels[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx512));
#undef KERNELS

/* Nodes [first, last), a subtree that one thread takes at a time. */
typedef struct piece {
    size_t first, last;
} piece;

/* The largest subtrees of at most this many elements. */
typedef struct product {
    const block_factors *f;
    piece *pieces; /* [n_pieces] */
    size_t most, n_pieces;
} product;

static size_t elements_of(const block_factors *f, size_t t) {
    return f->nodes[t].end - f->nodes[t].begin;
}

static bool is_leaf(const block_factors *f, size_t t) {
    return f->tree->clusters[t].leaf;
}

static lam_status cut(const block_factors *f, product *out, lam_error *error) {
    size_t first = 0;
    *out = (product){.f = f, .most = f->n / 64 + 8};
    out->pieces = memory_allocate(f->n_clusters, sizeof *out->pieces, "blocks", error);
    if (out->pieces == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < f->n_clusters; t++) {
        const uint32_t parent = f->nodes[t].parent;
        if (elements_of(f, t) > out->most) {
            first = t + 1;
        } else if (parent == BLOCK_NO_NODE || elements_of(f, parent) > out->most) {
            out->pieces[out->n_pieces++] = (piece){first, t + 1};
            first = t + 1;
        }
    }
    return LAM_OK;
}

/* Moments from the elements to the root. The topmost node of a piece waits for the pass above. */
static void pass_up(const product *c, const product_kernels *kernels, const panel *p) {
    const block_factors *f = c->f;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < c->n_pieces; k++)
        for (size_t t = c->pieces[k].first; t < c->pieces[k].last; t++) {
            if (is_leaf(f, t)) kernels->load_leaf(p, t);
            if (t + 1 < c->pieces[k].last) kernels->raise(p, t);
        }
    for (size_t k = 0; k < c->n_pieces; k++)
        if (f->nodes[c->pieces[k].last - 1].parent != BLOCK_NO_NODE) kernels->raise(p, c->pieces[k].last - 1);
    for (size_t t = 0; t < f->n_clusters; t++) {
        if (elements_of(f, t) <= c->most) continue;
        if (is_leaf(f, t)) kernels->load_leaf(p, t);
        if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->raise(p, t);
    }
}

static void pass_blocks(const product *c, const product_kernels *kernels, const panel *p) {
    const size_t n_nodes = c->f->n_clusters + c->f->n;
#pragma omp parallel for schedule(dynamic, NODES_AT_ONCE)
    for (size_t t = 0; t < n_nodes; t++) kernels->gather_blocks(p, t);
}

static void pass_down(const product *c, const product_kernels *kernels, const panel *p) {
    const block_factors *f = c->f;
    for (size_t t = f->n_clusters; t-- > 0;) {
        if (elements_of(f, t) <= c->most) continue;
        if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->lower(p, t);
        if (is_leaf(f, t)) kernels->store_leaf(p, t);
    }
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < c->n_pieces; k++)
        for (size_t t = c->pieces[k].last; t-- > c->pieces[k].first;) {
            if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->lower(p, t);
            if (is_leaf(f, t)) kernels->store_leaf(p, t);
        }
}

static void *lines(size_t count, size_t bytes, lam_error *error) {
    size_t all;
    void *made = NULL;
    if (size_multiply(count, bytes, &all) && all < SIZE_MAX / 2)
        made = aligned_alloc(64, (all + 63) / 64 * 64);
    if (made == NULL)
        status_fail(error, LAM_ERR_MEMORY, "blocks: cannot allocate %zu x %zu bytes", count, bytes);
    return made;
}

lam_status block_factors_multiply(const block_factors *f, size_t n_vectors, const double *x, double *y,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    product c = {.f = f};
    const size_t each = sizeof(double) * (n_vectors > 1 ? WIDE : 1), cluster = BLOCK_FUNCTIONS * each;
    panel p = {.f = f, .n_vectors = n_vectors};
    p.x = lines(f->n, each, error);
    p.y = lines(f->n, each, error);
    p.up = lines(f->n_clusters, cluster, error);
    p.down = lines(f->n_clusters, cluster, error);
    if (p.x == NULL || p.y == NULL || p.up == NULL || p.down == NULL) TRY(LAM_ERR_MEMORY);
    TRY(cut(f, &c, error));
    const product_kernels *kernels = n_vectors > 1 ? &wide_kernels[cpu_best()] : &one_kernels;
    for (size_t first = 0; first < n_vectors; first += WIDE) {
        p.from = x + first;
        p.to = y + first;
        p.count = n_vectors - first < WIDE ? n_vectors - first : WIDE;
        memset(p.up, 0, f->n_clusters * cluster);
        pass_up(&c, kernels, &p);
        pass_blocks(&c, kernels, &p);
        pass_down(&c, kernels, &p);
    }
done:
    free(c.pieces);
    free(p.x);
    free(p.y);
    free(p.up);
    free(p.down);
    return status;
}

static lam_status multiply_in_mesh_order(const void *context, size_t m, const double *x, double *y,
                                         lam_error *error) {
    lam_status status = LAM_OK;
    const block_factors *f = context;
    double *in = memory_allocate(f->n, m * sizeof *in, "blocks", error);
    double *out = memory_allocate(f->n, m * sizeof *out, "blocks", error);
    if (in == NULL || out == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < f->n; p++) memcpy(in + p * m, x + f->order[p] * m, m * sizeof *in);
    TRY(block_factors_multiply(f, m, in, out, error));
    for (size_t p = 0; p < f->n; p++) memcpy(y + f->order[p] * m, out + p * m, m * sizeof *out);
done:
    free(in);
    free(out);
    return status;
}

factor_product block_factors_product(const block_factors *f) {
    return (factor_product){.n = f->n, .multiply = multiply_in_mesh_order, .context = f};
}
