/* Products with form factors by blocks, panels of vectors at a time: the two passes of an H^2-matrix product
 * (Hackbusch and Boerm 2002) around one over the blocks. */
#include "solver/base/cpu.h"
#include "solver/operator/blocks/block_factors.h"

#include "store/status.h"

#include <omp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Vectors of a wide panel; prefetch distance, in blocks; nodes that a thread takes at a time. */
enum { WIDE = BLOCK_VECTORS, AHEAD = 6, NODES_AT_ONCE = 256, LINE = 64 };
typedef double wide __attribute__((vector_size(8 * WIDE), may_alias));

/* Vectors on their way, and in panels beside each other numbers of elements [n] and moments of clusters
 * [n_clusters][BLOCK_FUNCTIONS]. */
typedef struct panel {
    const block_factors *f;
    const block_vectors *vectors;
    const uint32_t *order; /* NULL: vectors are by position */
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

static bool is_leaf(const block_factors *f, size_t t) {
    return f->tree->clusters[t].leaf;
}

/* Moments from the elements to the root. The topmost node of a piece waits for the pass above. */
static void pass_up(const panel *p, const product_kernels *kernels, int n_threads) {
    const block_factors *f = p->f;
#pragma omp parallel for schedule(dynamic, 1) num_threads(n_threads) if (n_threads > 1)
    for (size_t k = 0; k < f->n_pieces; k++)
        for (size_t t = f->pieces[k].first; t < f->pieces[k].last; t++) {
            if (is_leaf(f, t)) kernels->load_leaf(p, t);
            if (t + 1 < f->pieces[k].last) kernels->raise(p, t);
        }
    for (size_t k = 0; k < f->n_pieces; k++)
        if (f->nodes[f->pieces[k].last - 1].parent != BLOCK_NO_NODE) kernels->raise(p, f->pieces[k].last - 1);
    for (size_t k = 0; k < f->n_above; k++) {
        const size_t t = f->above[k];
        if (is_leaf(f, t)) kernels->load_leaf(p, t);
        if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->raise(p, t);
    }
}

static void pass_blocks(const panel *p, const product_kernels *kernels, int n_threads) {
    const size_t n_nodes = p->f->n_clusters + p->f->n;
#pragma omp parallel for schedule(dynamic, NODES_AT_ONCE) num_threads(n_threads) if (n_threads > 1)
    for (size_t t = 0; t < n_nodes; t++) kernels->gather_blocks(p, t);
}

static void pass_down(const panel *p, const product_kernels *kernels, int n_threads) {
    const block_factors *f = p->f;
    for (size_t k = f->n_above; k-- > 0;) {
        const size_t t = f->above[k];
        if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->lower(p, t);
        if (is_leaf(f, t)) kernels->store_leaf(p, t);
    }
#pragma omp parallel for schedule(dynamic, 1) num_threads(n_threads) if (n_threads > 1)
    for (size_t k = 0; k < f->n_pieces; k++)
        for (size_t t = f->pieces[k].last; t-- > f->pieces[k].first;) {
            if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->lower(p, t);
            if (is_leaf(f, t)) kernels->store_leaf(p, t);
        }
}

/* Bytes of a panel's numbers, in whole cache lines. */
static size_t lines(size_t count, size_t n_vectors) {
    const size_t bytes = count * sizeof(double) * (n_vectors > 1 ? WIDE : 1);
    return (bytes + LINE - 1) / LINE * LINE;
}

size_t block_factors_work(const block_factors *f, size_t n_vectors) {
    return LINE + 2 * lines(f->n, n_vectors) + 2 * lines(f->n_clusters * BLOCK_FUNCTIONS, n_vectors);
}

void block_factors_apply(const block_factors *f, const block_vectors *vectors, void *work, size_t n_threads) {
    const size_t element = lines(f->n, vectors->count),
                 cluster = lines(f->n_clusters * BLOCK_FUNCTIONS, vectors->count);
    const product_kernels *kernels = vectors->count > 1 ? &wide_kernels[cpu_best()] : &one_kernels;
    char *const first = (char *)work + (LINE - (uintptr_t)work % LINE) % LINE;
    const panel p = {.f = f,
                     .vectors = vectors,
                     .order = vectors->by_element ? f->order : NULL,
                     .x = first,
                     .y = first + element,
                     .up = first + 2 * element,
                     .down = first + 2 * element + cluster};
    memset(p.up, 0, cluster);
    pass_up(&p, kernels, (int)n_threads);
    pass_blocks(&p, kernels, (int)n_threads);
    pass_down(&p, kernels, (int)n_threads);
}

/* Vectors [n][n_vectors], some at a time. */
static lam_status multiply(const block_factors *f, bool by_element, size_t n_vectors, const double *x,
                           double *y, lam_error *error) {
    const double *from[WIDE];
    double *to[WIDE];
    void *work = memory_allocate(block_factors_work(f, n_vectors), 1, "blocks", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    for (size_t first = 0; first < n_vectors; first += WIDE) {
        const size_t count = n_vectors - first < WIDE ? n_vectors - first : WIDE;
        for (size_t v = 0; v < count; v++) {
            from[v] = x + first + v;
            to[v] = y + first + v;
        }
        const block_vectors vectors = {count, n_vectors, by_element, from, to};
        block_factors_apply(f, &vectors, work, (size_t)omp_get_max_threads());
    }
    free(work);
    return LAM_OK;
}

lam_status block_factors_multiply(const block_factors *f, size_t n_vectors, const double *x, double *y,
                                  lam_error *error) {
    return multiply(f, false, n_vectors, x, y, error);
}

static lam_status multiply_in_mesh_order(const void *context, size_t m, const double *x, double *y,
                                         lam_error *error) {
    return multiply(context, true, m, x, y, error);
}

factor_product block_factors_product(const block_factors *f) {
    return (factor_product){.n = f->n, .multiply = multiply_in_mesh_order, .context = f};
}
