#include "solver/formfactor/rays.h"

#include "solver/formfactor/sample.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Elements traced between two looks at the cancel flag and the progress line. */
enum { CHUNK = 16 };

/* The rows that one thread has made, one after the other, and the counters it works with. */
typedef struct row_pool {
    uint32_t *indices;
    float *data;
    size_t used, capacity;
    uint32_t *hits;    /* [n], all zero between elements */
    uint64_t *touched; /* bit set over elements */
} row_pool;

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
    free(p->indices);
    free(p->data);
    free(p->hits);
    free(p->touched);
}

/* Traces one element into the pool's counters; returns how many rays left and how many were absorbed. */
static void trace_element(const mesh *m, const visibility *v, size_t element, const ray_options *options,
                          row_pool *pool, size_t *left, size_t *absorbed) {
    element_sampler sampler;
    element_sampler_init(&sampler, m, v, element, options->seed);
    uint32_t self[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    *left = *absorbed = 0;
    for (size_t ray = 0; ray < options->rays; ray += VISIBILITY_PACKET) {
        ray_packet rays;
        hit_packet hits;
        const size_t n = options->rays - ray < VISIBILITY_PACKET ? options->rays - ray : VISIBILITY_PACKET;
        element_sampler_packet(&sampler, (uint32_t)ray, &rays);
        visibility_cast(v, &rays, n, self, false, &hits);
        for (size_t i = 0; i < n; i++) {
            const uint32_t hit = hits.element[i];
            if (hit == VISIBILITY_NOTHING) {
                ++*left;
            } else if (hits.back[i]) {
                ++*absorbed;
            } else {
                pool->hits[hit]++;
                pool->touched[hit >> 6] |= 1ull << (hit & 63);
            }
        }
    }
}

/* Moves the counters into a row with ascending indices and clears them. */
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
            pool->data[pool->used++] = (float)pool->hits[j];
            pool->hits[j] = 0;
        }
        pool->touched[w] = 0;
    }
    return true;
}

/* Copies the rows of all pools into one CSR. */
static lam_status gather_rows(size_t n, const row_place *places, const row_pool *pools, csr *counts,
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
        const row_pool *pool = &pools[places[i].thread];
        memcpy(rows.indices + rows.indptr[i], pool->indices + places[i].offset,
               places[i].length * sizeof *rows.indices);
        memcpy(rows.data + rows.indptr[i], pool->data + places[i].offset,
               places[i].length * sizeof *rows.data);
    }
    *counts = rows;
    rows = (csr){0};
done:
    csr_free(&rows);
    return status;
}

lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order, const ray_options *options,
                      csr *counts, double *leaving, double *absorbed, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n, n_pools = (size_t)omp_get_max_threads();
    row_pool *pools = memory_allocate(n_pools, sizeof *pools, "ray counters", error);
    row_place *places = memory_allocate(n, sizeof *places, "ray counters", error);
    if (pools == NULL || places == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < n_pools; t++) {
        pools[t].hits = memory_allocate(n, sizeof *pools[t].hits, "ray counters", error);
        pools[t].touched = memory_allocate((n + 63) / 64, sizeof *pools[t].touched, "ray counters", error);
        if (pools[t].hits == NULL || pools[t].touched == NULL) TRY(LAM_ERR_MEMORY);
    }

    bool cancelled = false, out_of_memory = false;
    size_t finished = 0;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t chunk = 0; chunk < (n + CHUNK - 1) / CHUNK; chunk++) {
        bool stop;
#pragma omp atomic read
        stop = cancelled;
        if (stop) continue;
        const uint32_t thread = (uint32_t)omp_get_thread_num();
        const size_t last = (chunk + 1) * CHUNK < n ? (chunk + 1) * CHUNK : n;
        for (size_t position = chunk * CHUNK; position < last; position++) {
            const size_t i = order[position];
            size_t left, lost;
            trace_element(m, v, i, options, &pools[thread], &left, &lost);
            leaving[i] = (double)left / (double)options->rays;
            absorbed[i] = (double)lost / (double)options->rays;
            places[i].thread = thread;
            if (!take_row(&pools[thread], n, &places[i])) {
#pragma omp atomic write
                out_of_memory = true;
#pragma omp atomic write
                cancelled = true;
                break;
            }
        }
#pragma omp critical(rays_progress)
        {
            finished += last - chunk * CHUNK;
            progress_report(options->progress, options->stage, (double)finished / (double)n);
            if (progress_cancelled(options->progress)) {
#pragma omp atomic write
                cancelled = true;
            }
        }
    }
    if (out_of_memory)
        FAIL(error, LAM_ERR_MEMORY,
             "form factors of %zu elements at %zu rays: out of memory; use fewer --rays", n, options->rays);
    if (cancelled) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    TRY(gather_rows(n, places, pools, counts, error));
done:
    if (pools != NULL)
        for (size_t t = 0; t < n_pools; t++) pool_free(&pools[t]);
    free(pools);
    free(places);
    return status;
}
