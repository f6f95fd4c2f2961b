/* The two products of a panel, cut into blocks of rows in a fixed order, so that the bits depend on neither
 * the batch nor the threads. */
#include "solver/base/parallel.h"
#include "solver/base/work_area.h"
#include "solver/linalg/panel_kernels.h"

#include <string.h>

/* Rows whose products are added in single precision before they join a sum in double. */
#define PROJECT_BLOCK 128
#define BLOCK_TILES (PROJECT_BLOCK / PANEL_TILE)
/* Up to this many vectors, the sums of all columns fit into a near cache. */
#define MANY_VECTORS 4
/* The rows are cut into at most MOST_SLABS slabs of at least SLAB_ROWS rows, independent of the number of
 * threads; each slab has its own sums in double, which are then added in the order of the slabs. */
#define MOST_SLABS 64
#define SLAB_ROWS 512
/* Rows of a block of expand, and blocks that a thread takes at a time. */
#define EXPAND_BLOCK 64
#define BLOCKS_AT_ONCE 8
/* Bytes of a panel below which threads cost more than they bring. */
#define THREADS_WORTH ((size_t)1 << 20)

static size_t count_threads(const panel *a, size_t n_blocks) {
    const size_t n_threads = a->n_threads < n_blocks ? a->n_threads : n_blocks;
    return panel_bytes(a) < THREADS_WORTH || n_threads == 0 ? 1 : n_threads;
}

/* Rows of a slab: a multiple of PROJECT_BLOCK. */
static size_t slab_rows(const panel *a) {
    const size_t rows = a->n / MOST_SLABS + 1;
    return rows < SLAB_ROWS ? SLAB_ROWS : (rows + PROJECT_BLOCK - 1) / PROJECT_BLOCK * PROJECT_BLOCK;
}

static size_t count_slabs(const panel *a) {
    return a->n / slab_rows(a) + (a->n % slab_rows(a) > 0);
}

/* The total; a part in single precision for each thread; a sum in double for each slab, or one in all with
 * one thread. */
size_t panel_work_bytes(const panel *a, size_t m) {
    size_t count, total = 0;
    if (m > PANEL_VECTORS) m = PANEL_VECTORS;
    if (!size_multiply(a->stride, m, &count) || count > SIZE_MAX / sizeof(double)) return 0;
    const size_t n_threads = count_threads(a, count_slabs(a)), n_sums = n_threads > 1 ? count_slabs(a) : 1;
    for (size_t i = 0; i < n_threads; i++)
        if (!work_area_add(&total, count * sizeof(float))) return 0;
    for (size_t i = 0; i < n_sums + 1; i++)
        if (!work_area_add(&total, count * sizeof(double))) return 0;
    return total > 0 ? total : WORK_AREA_ALIGN;
}

/* The values from the tile of row i on. */
static panel_values tile_of(const panel *a, size_t i) {
    const bool by_rows = a->layout == PANEL_ROWS;
    const size_t row_step = by_rows ? a->k : a->stride;
    const size_t at = i / PANEL_TILE * PANEL_TILE * row_step * panel_value_size(a->precision);
    return (panel_values){.values = by_rows ? (const char *)a->rows + at : (const char *)a->data + at,
                          .row_step = row_step,
                          .n_chunks = a->stride / PANEL_CHUNK,
                          .tail = by_rows ? a->k % PANEL_CHUNK : 0};
}

/* The rows of a block in which a vector is not 0: for each tile their number, places and coefficients. */
typedef struct block_rows {
    size_t n_tiles, found;
    size_t n_rows[BLOCK_TILES];
    unsigned char which[BLOCK_TILES][PANEL_TILE];
    float c[BLOCK_TILES][PANEL_TILE * PANEL_VECTORS]; /* [rows found][m] */
} block_rows;

/* Fills out with the rows first <= i < last. */
static void find_rows(size_t first, size_t last, size_t m, const float *X, size_t x_stride, block_rows *out) {
    out->n_tiles = (last - first + PANEL_TILE - 1) / PANEL_TILE;
    out->found = 0;
    for (size_t tile = 0; tile < out->n_tiles; tile++) {
        const size_t begin = first + tile * PANEL_TILE;
        const size_t end = last - begin < PANEL_TILE ? last : begin + PANEL_TILE;
        size_t found = 0;
        for (size_t i = begin; i < end; i++) {
            bool any = false;
            for (size_t v = 0; v < m; v++) {
                float x = X[v * x_stride + i];
                out->c[tile][found * m + v] = x;
                any = any || x != 0.0f;
            }
            if (any) out->which[tile][found++] = (unsigned char)(i - begin);
        }
        out->n_rows[tile] = found;
        out->found += found;
    }
}

/* part += the rows of a block. With many vectors it goes step by step of columns through all tiles, so that
 * the sums of a step stay in the nearest cache; with few it reads memory in sequence. */
static void project_block(const panel *a, size_t first, size_t m, const block_rows *rows, float *part) {
    const size_t n_chunks = a->stride / PANEL_CHUNK, step = m > MANY_VECTORS ? STEP_CHUNKS : n_chunks;
    for (size_t q = 0; q < n_chunks; q += step)
        for (size_t tile = 0; tile < rows->n_tiles; tile++) {
            const panel_values from = tile_of(a, first + tile * PANEL_TILE);
            if (rows->n_rows[tile] > 0)
                a->kernels->project[a->layout][a->precision](&from, rows->n_rows[tile], rows->which[tile],
                                                             rows->c[tile], m, q,
                                                             n_chunks - q < step ? n_chunks : q + step, part);
        }
}

/* total += the rows of a slab; part is 0 before and after. True when a row was not 0. */
static bool project_slab(const panel *a, size_t slab, size_t m, const float *X, size_t x_stride, float *part,
                         double *total) {
    const size_t end = a->n - slab < slab_rows(a) ? a->n : slab + slab_rows(a);
    bool any = false;
    for (size_t first = slab; first < end; first += PROJECT_BLOCK) {
        block_rows rows;
        find_rows(first, end - first < PROJECT_BLOCK ? end : first + PROJECT_BLOCK, m, X, x_stride, &rows);
        if (rows.found == 0) continue;
        project_block(a, first, m, &rows, part);
        a->kernels->flush(a->stride * m, part, total);
        any = true;
    }
    return any;
}

/* The slabs of a projection. */
typedef struct projection {
    const panel *a;
    size_t m, x_stride, part_size;
    const float *X;
    char *parts;  /* [n_threads] of part_size bytes, 0 */
    double *sums; /* [n_slabs][stride m], or NULL: they join total in their order */
    double *total, *sum;
    bool *any; /* [n_slabs] */
} projection;

static void project_slabs(const void *job, size_t thread, size_t first, size_t last) {
    const projection *p = job;
    const panel *a = p->a;
    const size_t count = a->stride * p->m;
    float *part = (float *)(void *)(p->parts + thread * p->part_size);
    for (size_t s = first; s < last; s++) {
        double *sum = p->sums != NULL ? p->sums + s * count : p->sum;
        memset(sum, 0, count * sizeof *sum);
        p->any[s] = project_slab(a, s * slab_rows(a), p->m, p->X, p->x_stride, part, sum);
        for (size_t j = 0; j < count && p->any[s] && p->sums == NULL; j++) p->total[j] += sum[j];
    }
}

static void project_pass(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                         void *work) {
    const size_t count = a->stride * m, n_slabs = count_slabs(a), n_threads = count_threads(a, n_slabs);
    const size_t part_size =
        (count * sizeof(float) + WORK_AREA_ALIGN - 1) / WORK_AREA_ALIGN * WORK_AREA_ALIGN;
    double *total = work_area_take(&work, count * sizeof *total);
    char *parts = work_area_take(&work, n_threads * part_size);
    double *sums = work; /* of every slab, or of one at a time */
    bool any[MOST_SLABS] = {false};
    memset(total, 0, count * sizeof *total);
    memset(parts, 0, n_threads * part_size);
    const projection p = {.a = a,
                          .m = m,
                          .x_stride = x_stride,
                          .part_size = part_size,
                          .X = X,
                          .parts = parts,
                          .sums = n_threads > 1 ? sums : NULL,
                          .total = total,
                          .sum = sums,
                          .any = any};
    parallel_share(n_threads, n_slabs, 1, project_slabs, &p);
    for (size_t s = 0; s < n_slabs && n_threads > 1; s++)
        for (size_t j = 0; j < count && any[s]; j++) total[j] += sums[s * count + j];
    for (size_t v = 0; v < m; v++)
        for (size_t j = 0; j < a->k; j++) {
            const double scale = a->scale != NULL ? (double)a->scale[j] : 1.0;
            T[v * t_stride + j] =
                (float)(scale * total[(j / PANEL_CHUNK * m + v) * PANEL_CHUNK + j % PANEL_CHUNK]);
        }
}

void panel_project(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                   void *work) {
    for (size_t v = 0; v < m; v += PANEL_VECTORS)
        project_pass(a, m - v < PANEL_VECTORS ? m - v : PANEL_VECTORS, X + v * x_stride, x_stride,
                     T + v * t_stride, t_stride, work);
}

/* The rows of a product: n_rows of them, the first ones when rows is NULL. */
typedef struct row_choice {
    size_t n_rows;
    const uint32_t *rows, *map;
} row_choice;

static size_t chosen_row(const row_choice *choice, size_t r) {
    return choice->map != NULL ? choice->map[choice->rows[r]] : choice->rows[r];
}

/* The rows of a product, a block of them a piece. */
typedef struct expansion {
    const panel *a;
    size_t m, y_stride;
    const float *t;
    const row_choice *choice;
    float *Y;
} expansion;

static void expand_blocks(const void *job, size_t thread, size_t first_block, size_t last_block) {
    const expansion *x = job;
    const panel *a = x->a;
    const size_t n_rows = x->choice->n_rows;
    (void)thread;
    for (size_t b = first_block; b < last_block; b++) {
        const size_t first = b * EXPAND_BLOCK;
        const size_t last = n_rows - first < EXPAND_BLOCK ? n_rows : first + EXPAND_BLOCK;
        if (x->choice->rows == NULL) {
            const panel_values from = tile_of(a, first);
            a->kernels->expand[a->layout][a->precision](&from, last - first, x->m, x->t, x->Y + first,
                                                        x->y_stride);
        }
        for (size_t r = first; r < last && x->choice->rows != NULL; r++) {
            const size_t i = chosen_row(x->choice, r);
            const panel_values from = tile_of(a, i);
            a->kernels->expand_row[a->layout][a->precision](&from, i % PANEL_TILE, x->m, x->t, x->Y + r,
                                                            x->y_stride);
        }
    }
}

static void expand_pass(const panel *a, size_t m, const float *T, size_t t_stride, const row_choice *choice,
                        float *Y, size_t y_stride, void *work) {
    const size_t n_rows = choice->n_rows;
    const size_t n_blocks = n_rows / EXPAND_BLOCK + (n_rows % EXPAND_BLOCK > 0);
    const size_t n_threads = count_threads(a, n_blocks);
    float *t = work_area_take(&work, a->stride * m * sizeof *t);
    for (size_t v = 0; v < m; v++)
        for (size_t j = 0; j < a->stride; j++) {
            float *t_vj = t + (j / PANEL_CHUNK * m + v) * PANEL_CHUNK + j % PANEL_CHUNK;
            *t_vj = j < a->k ? T[v * t_stride + j] : 0.0f;
            if (a->scale != NULL && j < a->k) *t_vj *= a->scale[j];
        }
    const expansion x = {.a = a, .m = m, .y_stride = y_stride, .t = t, .choice = choice, .Y = Y};
    parallel_share(n_threads, n_blocks, BLOCKS_AT_ONCE, expand_blocks, &x);
}

static void expand(const panel *a, size_t m, const float *T, size_t t_stride, const row_choice *choice,
                   float *Y, size_t y_stride, void *work) {
    for (size_t v = 0; v < m; v += PANEL_VECTORS)
        expand_pass(a, m - v < PANEL_VECTORS ? m - v : PANEL_VECTORS, T + v * t_stride, t_stride, choice,
                    Y + v * y_stride, y_stride, work);
}

void panel_expand(const panel *a, size_t m, const float *T, size_t t_stride, float *Y, size_t y_stride,
                  void *work) {
    const row_choice all = {.n_rows = a->n};
    expand(a, m, T, t_stride, &all, Y, y_stride, work);
}

void panel_expand_rows(const panel *a, size_t m, const float *T, size_t t_stride, size_t n_rows,
                       const uint32_t *rows, const uint32_t *map, float *Y, size_t y_stride, void *work) {
    const row_choice chosen = {.n_rows = n_rows, .rows = rows, .map = map};
    expand(a, m, T, t_stride, &chosen, Y, y_stride, work);
}
