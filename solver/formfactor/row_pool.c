#include "solver/formfactor/row_pool.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Between two looks at the cancel flag and the progress line: at most so many elements, and about so many
 * rays. */
enum { CHUNK_MOST = 16, CHUNK_RAYS = 1 << 18 };

/* Where a row lies before the rows are put in order. */
typedef struct row_place {
    uint32_t thread;
    uint32_t length;
    size_t offset;
} row_place;

static bool pool_reserve(row_pool *p, size_t more) {
    if (p->capacity - p->used >= more) return true;
    size_t capacity = p->capacity + p->capacity / 2 + more + 4096;
    uint32_t *indices = realloc(p->indices, capacity * sizeof *indices);
    if (indices == NULL) return false;
    p->indices = indices;
    float *data = realloc(p->data, capacity * sizeof *data);
    if (data == NULL) return false;
    p->data = data;
    p->capacity = capacity;
    return true;
}

static void pool_free(row_pool *p) {
    free(p->sums);
    free(p->touched);
    free(p->sky);
    free(p->indices);
    free(p->data);
}

/* Moves the sums into a row with ascending indices and clears them. */
static bool take_row(row_pool *pool, size_t n, row_place *place) {
    const size_t words = (n + 63) / 64;
    size_t length = 0;
    for (size_t w = 0; w < words; w++) length += (size_t)__builtin_popcountll(pool->touched[w]);
    if (!pool_reserve(pool, length)) return false;
    place->offset = pool->used;
    place->length = (uint32_t)length;
    for (size_t w = 0; w < words; w++) {
        for (uint64_t bits = pool->touched[w]; bits != 0; bits &= bits - 1) {
            const uint32_t j = (uint32_t)(w * 64 + (size_t)__builtin_ctzll(bits));
            pool->indices[pool->used] = j;
            pool->data[pool->used++] = (float)pool->sums[j];
            pool->sums[j] = 0;
        }
        pool->touched[w] = 0;
    }
    return true;
}

/* Copies the rows of all pools into one CSR. */
static lam_status gather_rows(size_t n, const row_place *places, const row_pool *pools, csr *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    csr rows = {.n = n};
    rows.indptr = memory_allocate(n + 1, sizeof *rows.indptr, "form factor rows", error);
    if (rows.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) rows.indptr[i + 1] = rows.indptr[i] + places[i].length;
    rows.indices = memory_allocate(rows.indptr[n], sizeof *rows.indices, "form factor rows", error);
    rows.data = memory_allocate(rows.indptr[n], sizeof *rows.data, "form factor rows", error);
    if (rows.indices == NULL || rows.data == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        if (places[i].length == 0) continue; /* its pool may be NULL */
        const row_pool *pool = &pools[places[i].thread];
        memcpy(rows.indices + rows.indptr[i], pool->indices + places[i].offset,
               places[i].length * sizeof *rows.indices);
        memcpy(rows.data + rows.indptr[i], pool->data + places[i].offset,
               places[i].length * sizeof *rows.data);
    }
    *out = rows;
    rows = (csr){0};
done:
    csr_free(&rows);
    return status;
}

static size_t chunk_of(size_t rays) {
    const size_t elements = CHUNK_RAYS / rays;
    return elements < 1 ? 1 : elements > CHUNK_MOST ? CHUNK_MOST : elements;
}

lam_status rows_make(const row_maker *maker, size_t n, const uint32_t *order, csr *rows, double *leaving,
                     double *absorbed, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_pools = (size_t)omp_get_max_threads(), chunk = chunk_of(maker->rays);
    row_pool *pools = memory_allocate(n_pools, sizeof *pools, "form factor rows", error);
    row_place *places = memory_allocate(n, sizeof *places, "form factor rows", error);
    if (pools == NULL || places == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < n_pools; t++) {
        pools[t].sums = memory_allocate(n, sizeof *pools[t].sums, "form factor rows", error);
        pools[t].touched =
            memory_allocate((n + 63) / 64, sizeof *pools[t].touched, "form factor rows", error);
        if (pools[t].sums == NULL || pools[t].touched == NULL) TRY(LAM_ERR_MEMORY);
        if (maker->sky == NULL) continue;
        pools[t].sky = memory_allocate(maker->sky->tiling.n_tiles + 1, sizeof *pools[t].sky,
                                       "the tiles of the sky", error);
        if (pools[t].sky == NULL) TRY(LAM_ERR_MEMORY);
    }

    bool cancelled = false, out_of_memory = false;
    size_t finished = 0;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t c = 0; c < (n + chunk - 1) / chunk; c++) {
        bool stop;
#pragma omp atomic read
        stop = cancelled;
        if (stop) continue;
        const uint32_t thread = (uint32_t)omp_get_thread_num();
        const size_t last = (c + 1) * chunk < n ? (c + 1) * chunk : n;
        for (size_t position = c * chunk; position < last; position++) {
            const size_t i = order[position];
            maker->make(maker->context, i, &pools[thread], &leaving[i], &absorbed[i]);
            if (maker->sky != NULL) sky_bounce_put(maker->sky, i, pools[thread].sky, maker->whole);
            places[i].thread = thread;
            if (!take_row(&pools[thread], n, &places[i])) {
#pragma omp atomic write
                out_of_memory = true;
#pragma omp atomic write
                cancelled = true;
                break;
            }
        }
#pragma omp critical(rows_progress)
        {
            finished += last - c * chunk;
            progress_report(maker->progress, maker->stage, (double)finished / (double)n);
            if (progress_cancelled(maker->progress)) {
#pragma omp atomic write
                cancelled = true;
            }
        }
    }
    if (out_of_memory)
        FAIL(error, LAM_ERR_MEMORY, "form factors of %zu elements at %zu rays: out of memory; use %s", n,
             maker->rays, maker->cheaper);
    if (cancelled) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    TRY(gather_rows(n, places, pools, rows, error));
done:
    if (pools != NULL)
        for (size_t t = 0; t < n_pools; t++) pool_free(&pools[t]);
    free(pools);
    free(places);
    return status;
}
