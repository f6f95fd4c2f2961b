#include "solver/formfactor/rows/row_pool.h"

#include "solver/base/array_grow.h"
#include "solver/formfactor/rows/row_file.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* A chunk, after which a thread reports progress and checks for cancellation, has at most CHUNK_MOST elements
 * and about CHUNK_RAYS rays. A block on the disk takes about a tenth of a second. */
enum { CHUNK_MOST = 16, CHUNK_RAYS = 1 << 18, BLOCK_RAYS = 1 << 20 };

static bool pool_reserve(row_pool *p, size_t more) {
    return array_grow(&p->bytes, &p->capacity, p->used + more, 1, "form factor rows", NULL) == LAM_OK;
}

static lam_status pools_create(const row_maker *maker, size_t n_pools, row_pool **out, lam_error *error) {
    const size_t n = maker->m->n;
    row_pool *pools = memory_allocate(n_pools, sizeof *pools, "form factor rows", error);
    *out = pools;
    if (pools == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < n_pools; t++) {
        pools[t].sums = memory_allocate(n, sizeof *pools[t].sums, "form factor rows", error);
        if (pools[t].sums == NULL) return LAM_ERR_MEMORY;
        if (bitset_make(n, 0, "form factor rows", &pools[t].summed, error) != LAM_OK) return LAM_ERR_MEMORY;
        if (maker->sky == NULL) continue;
        pools[t].sky = memory_allocate(maker->sky->tiling.n_tiles + 1, sizeof *pools[t].sky,
                                       "the tiles of the sky", error);
        if (pools[t].sky == NULL) return LAM_ERR_MEMORY;
    }
    return LAM_OK;
}

static void pools_free(row_pool *pools, size_t n_pools) {
    for (size_t t = 0; pools != NULL && t < n_pools; t++) {
        free(pools[t].sums);
        bitset_free(&pools[t].summed);
        free(pools[t].sky);
        free(pools[t].bytes);
    }
    free(pools);
}

/* Packs the sums with ascending columns and clears them. */
static bool take_row(row_pool *pool, row_kind kind, packed_row *row) {
    const size_t length = bitset_take(&pool->summed);
    const uint32_t *columns = pool->summed.taken;
    if (!pool_reserve(pool, length * ROW_ENTRY_MOST)) return false;
    uint8_t *const begin = pool->bytes + pool->used, *to = begin;
    uint32_t next = 0;
    for (size_t k = 0; k < length; k++) {
        const uint32_t j = columns[k];
        to = row_put(kind, to, j - next, (float)pool->sums[j]);
        next = j + 1;
        pool->sums[j] = 0;
    }
    *row = (packed_row){.n_bytes = (uint32_t)(to - begin), .n_entries = (uint32_t)length};
    pool->used += (size_t)(to - begin);
    return true;
}

/* All that the threads share. */
typedef struct rows_run {
    const row_maker *maker;
    const uint32_t *order;
    packed_rows *rows;
    size_t n_wanted; /* elements of the order whose rows are computed */
    double *leaving, *absorbed;
    row_file *file;         /* NULL: all in memory */
    size_t chunk, of_block; /* elements in a chunk, chunks in a block */
    size_t *left;           /* [blocks], chunks that are not finished */
    size_t finished;        /* elements */
    bool stop;
    lam_status status;
    lam_error error;
} rows_run;

static void run_fail(rows_run *run, lam_status status, const lam_error *error) {
#pragma omp critical(rows_failure)
    if (run->status == LAM_OK) {
        run->status = status;
        run->error = *error;
    }
#pragma omp atomic write
    run->stop = true;
}

/* Computes the rows of a chunk; their bytes become a chunk of run->rows. */
static void make_chunk(rows_run *run, size_t c, row_pool *pool) {
    const row_maker *maker = run->maker;
    const size_t n = run->rows->n, first = c * run->chunk,
                 last = first + run->chunk < run->n_wanted ? first + run->chunk : run->n_wanted;
    lam_error error = {0};
    bool enough = true;
    pool->used = 0;
    for (size_t position = first; position < last && enough; position++) {
        const size_t i = run->order[position];
        pool->whole = maker->whole;
        maker->make(maker->context, i, pool, &run->leaving[i], &run->absorbed[i]);
        if (maker->sky != NULL) sky_bounce_put(maker->sky, i, pool->sky, pool->whole);
        enough = take_row(pool, maker->kind, &run->rows->rows[i]);
    }
    uint8_t *bytes = enough ? malloc(pool->used + 1) : NULL;
    if (bytes == NULL) {
        run_fail(run,
                 status_fail(&error, LAM_ERR_MEMORY,
                             "form factors of %zu elements at %zu rays: out of memory; use %s", n,
                             maker->rays, maker->cheaper),
                 &error);
        return;
    }
    if (pool->used > 0) memcpy(bytes, pool->bytes, pool->used);
    run->rows->chunks[c] = bytes;
    for (size_t position = first; position < last; position++) {
        packed_row *row = &run->rows->rows[run->order[position]];
        row->bytes = bytes;
        bytes += row->n_bytes;
    }
}

/* Writes a block to the file and frees its memory when its last chunk is finished. */
static void finish_chunk(rows_run *run, size_t c) {
    lam_error error = {0};
    lam_status status = LAM_OK;
    const size_t block = c / run->of_block, first = block * run->of_block,
                 last = first + run->of_block < run->rows->n_chunks ? first + run->of_block
                                                                    : run->rows->n_chunks;
    size_t left;
#pragma omp atomic capture seq_cst
    left = --run->left[block];
    if (left > 0 || run->file == NULL) return;
#pragma omp critical(rows_file)
    status = row_file_append(run->file, block, run->rows->rows, run->leaving, run->absorbed, &error);
    for (size_t k = first; k < last; k++) {
        free(run->rows->chunks[k]);
        run->rows->chunks[k] = NULL;
    }
    if (status != LAM_OK) run_fail(run, status, &error);
}

static void report_rows(rows_run *run, size_t elements) {
    const row_maker *maker = run->maker;
#pragma omp critical(rows_progress)
    {
        run->finished += elements;
        progress_report(maker->progress, maker->stage, (double)run->finished / (double)run->n_wanted);
        if (progress_cancelled(maker->progress)) {
            lam_error error = {0};
            run_fail(run, status_fail(&error, LAM_ERR_CANCELLED, "cancelled"), &error);
        }
    }
}

static lam_status open_file(const row_maker *maker, size_t block_rows, const uint32_t *order, row_file **out,
                            lam_error *error) {
    row_file_contents contents = {.recipe = *maker->recipe,
                                  .n = maker->m->n,
                                  .block_rows = block_rows,
                                  .kind = maker->kind,
                                  .sky = maker->sky};
    mesh_geometry_hash(maker->m, contents.geometry);
    return row_file_open(maker->scratch, maker->scratch_name, &contents, order, out, error);
}

static size_t at_least_one(size_t x) {
    return x < 1 ? 1 : x;
}

lam_status row_pool_make(const row_maker *maker, const uint32_t *order, packed_rows *rows, double *leaving,
                         double *absorbed, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = maker->m->n, n_pools = (size_t)omp_get_max_threads();
    row_pool *pools = NULL;
    packed_rows found = {.n = n, .kind = maker->kind};
    const bool some = maker->only_first > 0 && maker->only_first < n && maker->scratch == NULL;
    const size_t n_wanted = some ? maker->only_first : n;
    rows_run run = {.maker = maker,
                    .order = order,
                    .rows = &found,
                    .n_wanted = n_wanted,
                    .leaving = leaving,
                    .absorbed = absorbed};
    run.chunk = at_least_one(CHUNK_RAYS / maker->rays);
    if (run.chunk > CHUNK_MOST) run.chunk = CHUNK_MOST;
    run.of_block = at_least_one(BLOCK_RAYS / maker->rays / run.chunk);
    const size_t n_chunks = (n_wanted + run.chunk - 1) / run.chunk,
                 n_blocks = (n_chunks + run.of_block - 1) / run.of_block;
    TRY(pools_create(maker, n_pools, &pools, error));
    found.rows = memory_allocate(n, sizeof *found.rows, "form factor rows", error);
    found.chunks = memory_allocate(n_chunks, sizeof *found.chunks, "form factor rows", error);
    run.left = memory_allocate(n_blocks, sizeof *run.left, "form factor rows", error);
    if (found.rows == NULL || found.chunks == NULL || run.left == NULL) TRY(LAM_ERR_MEMORY);
    found.n_chunks = n_chunks;
    for (size_t c = 0; c < n_chunks; c++) run.left[c / run.of_block]++;
    if (maker->scratch != NULL) {
        TRY(open_file(maker, run.chunk * run.of_block, order, &run.file, error));
        found.kept = run.finished = row_file_kept(run.file);
    }

#pragma omp parallel for schedule(dynamic, 1)
    for (size_t c = 0; c < n_chunks; c++) {
        bool stop;
#pragma omp atomic read
        stop = run.stop;
        if (stop || (run.file != NULL && row_file_has(run.file, c / run.of_block))) continue;
        make_chunk(&run, c, &pools[omp_get_thread_num()]);
        if (found.chunks[c] == NULL) continue;
        finish_chunk(&run, c);
        report_rows(&run, c + 1 < n_chunks ? run.chunk : n_wanted - c * run.chunk);
    }
    if (run.status != LAM_OK) {
        if (error != NULL) *error = run.error;
        TRY(run.status);
    }
    if (run.file != NULL) TRY(row_file_map(run.file, &found, leaving, absorbed, error));
    *rows = found;
    found = (packed_rows){0};
done:
    pools_free(pools, n_pools);
    free(run.left);
    row_file_close(run.file);
    packed_rows_free(&found);
    return status;
}
