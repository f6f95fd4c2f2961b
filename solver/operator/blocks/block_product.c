/* Products with form factors by blocks, panels of vectors at a time: the two passes of an H^2-matrix product
 * (Hackbusch and Boerm 2002) around one over the blocks. */
#include "solver/base/cpu.h"
#include "solver/base/parallel.h"
#include "solver/operator/blocks/block_factors.h"

#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Vectors of a wide panel; prefetch distance, in blocks; nodes that a thread takes at a time, also of one
 * vector. */
enum { WIDE = BLOCK_VECTORS, AHEAD = 6, NODES_AT_ONCE = 256, MANY_NODES = 4096, LINE = 64 };
typedef double wide __attribute__((vector_size(8 * WIDE), may_alias));

/* Vectors on their way, and in panels beside each other numbers of elements [n] and moments of clusters
 * [n_clusters][BLOCK_FUNCTIONS]. */
typedef struct panel {
    const block_factors *f;
    const struct product_kernels *kernels;
    const block_vectors *vectors;
    const uint32_t *order; /* NULL: vectors are by position */
    void *x, *y, *up, *down;
    double
        *parts; /* of one vector: [BLOCK_PARTS][BLOCK_FUNCTIONS n_clusters + n], what arrives through parts */
} panel;

#define KERNEL(name) name##_one
#define TARGET
#define LANES one
#define WIDTH 1
#define WITHOUT_BLOCKS
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
    void (*gather_blocks)(const panel *, size_t); /* NULL: one vector goes through parts */
    void (*lower)(const panel *, size_t);
    void (*store_leaf)(const panel *, size_t);
} product_kernels;

#define KERNELS(name) {load_leaf_##name, raise_##name, gather_blocks_##name, lower_##name, store_leaf_##name}
static const product_kernels one_kernels = {load_leaf_one, raise_one, NULL, lower_one, store_leaf_one};
static const product_kernels wide_kernels[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx512));
#undef KERNELS

static bool is_leaf(const block_factors *f, size_t t) {
    return f->tree->clusters[t].leaf;
}

/* Moments from the elements to the root. The topmost node of a piece waits for the pass above. */
static void up_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const panel *p = job;
    const block_factors *f = p->f;
    (void)thread;
    for (size_t k = first; k < last; k++)
        for (size_t t = f->pieces[k].first; t < f->pieces[k].last; t++) {
            if (is_leaf(f, t)) p->kernels->load_leaf(p, t);
            if (t + 1 < f->pieces[k].last) p->kernels->raise(p, t);
        }
}

static void pass_up(const panel *p, size_t n_threads) {
    const block_factors *f = p->f;
    const product_kernels *kernels = p->kernels;
    parallel_share(n_threads, f->n_pieces, 1, up_pieces, p);
    for (size_t k = 0; k < f->n_pieces; k++)
        if (f->nodes[f->pieces[k].last - 1].parent != BLOCK_NO_NODE) kernels->raise(p, f->pieces[k].last - 1);
    for (size_t k = 0; k < f->n_above; k++) {
        const size_t t = f->above[k];
        if (is_leaf(f, t)) kernels->load_leaf(p, t);
        if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->raise(p, t);
    }
}

/* The sums of a part at all nodes b, in panel.parts. */
static double *arriving(const panel *p, size_t part) {
    return p->parts + part * (BLOCK_FUNCTIONS * p->f->n_clusters + p->f->n);
}

/* One vector through the blocks of a part, both ways at once: sums of nodes a are done then, as no other part
 * has any of theirs; those of nodes b wait for the other parts. */
static void pass_part(const panel *p, size_t k) {
    const block_factors *f = p->f;
    const block_part *part = &f->parts[k];
    const size_t n_clusters = f->n_clusters;
    const double *const up = p->up, *const elements = p->x;
    double *const down = arriving(p, k), *const y = down + BLOCK_FUNCTIONS * n_clusters;
    memset(down + BLOCK_FUNCTIONS * part->least_cluster, 0,
           BLOCK_FUNCTIONS * (n_clusters - part->least_cluster) * sizeof *down);
    memset(y + (part->least_element - n_clusters), 0, (n_clusters + f->n - part->least_element) * sizeof *y);
    for (size_t a = part->first; a < part->last; a++) {
        const double *const at = up + BLOCK_FUNCTIONS * a;
        const double x0 = a < n_clusters ? at[0] : elements[a - n_clusters], x1 = a < n_clusters ? at[1] : 0,
                     x2 = a < n_clusters ? at[2] : 0;
        double s0 = 0, s1 = 0, s2 = 0;
        for (size_t e = f->from[a]; e < f->from[a + 1]; e++) {
            const cluster_block *block = &f->blocks[e];
            const size_t b = block->b;
            const double l00 = (double)block->L[0][0], l10 = (double)block->L[1][0],
                         l20 = (double)block->L[2][0];
            if (b >= n_clusters) {
                const double z = elements[b - n_clusters];
                s0 += l00 * z;
                s1 += l10 * z;
                s2 += l20 * z;
                y[b - n_clusters] += l00 * x0 + l10 * x1 + l20 * x2;
                continue;
            }
            const double *const z = up + BLOCK_FUNCTIONS * b;
            double *const to = down + BLOCK_FUNCTIONS * b;
            const double l01 = (double)block->L[0][1], l11 = (double)block->L[1][1],
                         l21 = (double)block->L[2][1], l02 = (double)block->L[0][2],
                         l12 = (double)block->L[1][2], l22 = (double)block->L[2][2];
            s0 += l00 * z[0] + l01 * z[1] + l02 * z[2];
            s1 += l10 * z[0] + l11 * z[1] + l12 * z[2];
            s2 += l20 * z[0] + l21 * z[1] + l22 * z[2];
            to[0] += l00 * x0 + l10 * x1 + l20 * x2;
            to[1] += l01 * x0 + l11 * x1 + l21 * x2;
            to[2] += l02 * x0 + l12 * x1 + l22 * x2;
        }
        if (a >= n_clusters) {
            ((double *)p->y)[a - n_clusters] = s0;
        } else {
            double *const own = (double *)p->down + BLOCK_FUNCTIONS * a;
            own[0] = s0;
            own[1] = s1;
            own[2] = s2;
        }
    }
}

/* to[i] += from[i] for first <= i < last. */
static void add_range(double *to, const double *from, size_t first, size_t last) {
    for (size_t i = first; i < last; i++) to[i] += from[i];
}

/* One vector: blocks are read once, in their order, where gathering reads them twice, once at random. Parts
 * are added up in their order. */
static void some_parts(const void *job, size_t thread, size_t first, size_t last) {
    (void)thread;
    for (size_t k = first; k < last; k++) pass_part(job, k);
}

static void add_parts(const void *job, size_t thread, size_t begin_node, size_t end_node) {
    const panel *p = job;
    const block_factors *f = p->f;
    const size_t n_clusters = f->n_clusters;
    (void)thread;
    for (size_t first = begin_node; first < end_node; first += MANY_NODES) {
        const size_t last = first + MANY_NODES < end_node ? first + MANY_NODES : end_node;
        for (size_t k = 0; k < BLOCK_PARTS; k++) {
            const block_part *part = &f->parts[k];
            const double *const down = arriving(p, k), *const y = down + BLOCK_FUNCTIONS * n_clusters;
            const size_t begin = first > part->least_cluster ? first : part->least_cluster,
                         end = last < n_clusters ? last : n_clusters,
                         element = first > part->least_element ? first : part->least_element;
            if (begin < end) add_range(p->down, down, BLOCK_FUNCTIONS * begin, BLOCK_FUNCTIONS * end);
            if (element < last) add_range(p->y, y, element - n_clusters, last - n_clusters);
        }
    }
}

static void pass_parts(const panel *p, size_t n_threads) {
    parallel_share(n_threads, BLOCK_PARTS, 1, some_parts, p);
    parallel_share(n_threads, p->f->n_clusters + p->f->n, MANY_NODES, add_parts, p);
}

static void gather_nodes(const void *job, size_t thread, size_t first, size_t last) {
    const panel *p = job;
    (void)thread;
    for (size_t t = first; t < last; t++) p->kernels->gather_blocks(p, t);
}

static void down_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const panel *p = job;
    const block_factors *f = p->f;
    (void)thread;
    for (size_t k = first; k < last; k++)
        for (size_t t = f->pieces[k].last; t-- > f->pieces[k].first;) {
            if (f->nodes[t].parent != BLOCK_NO_NODE) p->kernels->lower(p, t);
            if (is_leaf(f, t)) p->kernels->store_leaf(p, t);
        }
}

static void pass_down(const panel *p, size_t n_threads) {
    const block_factors *f = p->f;
    const product_kernels *kernels = p->kernels;
    for (size_t k = f->n_above; k-- > 0;) {
        const size_t t = f->above[k];
        if (f->nodes[t].parent != BLOCK_NO_NODE) kernels->lower(p, t);
        if (is_leaf(f, t)) kernels->store_leaf(p, t);
    }
    parallel_share(n_threads, f->n_pieces, 1, down_pieces, p);
}

/* Bytes of a panel's numbers, in whole cache lines. */
static size_t lines(size_t count, size_t n_vectors) {
    const size_t bytes = count * sizeof(double) * (n_vectors > 1 ? WIDE : 1);
    return (bytes + LINE - 1) / LINE * LINE;
}

size_t block_factors_work(const block_factors *f, size_t n_vectors) {
    const size_t numbers = f->n + f->n_clusters * BLOCK_FUNCTIONS;
    const size_t of_one = 2 * lines(f->n, 1) + 2 * lines(f->n_clusters * BLOCK_FUNCTIONS, 1) +
                          BLOCK_PARTS * numbers * sizeof(double);
    const size_t of_many = 2 * lines(f->n, WIDE) + 2 * lines(f->n_clusters * BLOCK_FUNCTIONS, WIDE);
    return LINE + (n_vectors > 1 && of_many > of_one ? of_many : of_one); /* the last of many may be alone */
}

void block_factors_apply(const block_factors *f, const block_vectors *vectors, void *work, size_t n_threads) {
    const size_t element = lines(f->n, vectors->count),
                 cluster = lines(f->n_clusters * BLOCK_FUNCTIONS, vectors->count);
    const product_kernels *kernels = vectors->count > 1 ? &wide_kernels[cpu_best()] : &one_kernels;
    char *const first = (char *)work + (LINE - (uintptr_t)work % LINE) % LINE;
    const panel p = {.f = f,
                     .kernels = kernels,
                     .vectors = vectors,
                     .order = vectors->by_element ? f->order : NULL,
                     .x = first,
                     .y = first + element,
                     .up = first + 2 * element,
                     .down = first + 2 * element + cluster,
                     .parts = (double *)(first + 2 * element + 2 * cluster)};
    memset(p.up, 0, cluster);
    pass_up(&p, n_threads);
    if (kernels->gather_blocks != NULL)
        parallel_share(n_threads, f->n_clusters + f->n, NODES_AT_ONCE, gather_nodes, &p);
    else
        pass_parts(&p, n_threads);
    pass_down(&p, n_threads);
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
        block_factors_apply(f, &vectors, work, parallel_threads());
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
