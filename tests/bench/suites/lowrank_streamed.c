/* HF in one pass over rows that rays find as they are read and nobody keeps (Aguerre 2016, sections 3.2 and
 * 3.3.3): the columns of a leaf are in memory, F never is. */
#include "solver/base/clock.h"
#include "solver/formfactor/pairs/ray_rows.h"
#include "solver/formfactor/source.h"
#include "solver/method/norm.h"
#include "solver/method/tall_factors.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/lowrank.h"

#include <math.h>
#include <stdlib.h>

/* Rays of a row: the noise of one-sided rows has a norm of about 2 / sqrt(rays), .03 and .06. */
enum { STREAMED_RAYS = 4096, STREAMED_RAYS_QUICK = 1024, STREAMED_SIZES = 4 };

/* Bytes of memory for the size of a quick run. */
static const double quick_limit = 1 << 26;

/* Rows of F, one-sided, by the rays of a stream. */
typedef struct plain_rows {
    row_source *sampled; /* c_ij / rays * A_j / (A_i + A_j), in any order, and an index may repeat */
    const double *area;
    uint64_t entries; /* given so far */
} plain_rows;

typedef struct row_entry {
    uint32_t index;
    float value;
} row_entry;

static int by_index(const void *one, const void *other) {
    const uint32_t a = ((const row_entry *)one)->index, b = ((const row_entry *)other)->index;
    return (a > b) - (a < b);
}

/* Sorts a row and adds up what it has for one element, in place; returns the entries that are left. */
static size_t sort_row(size_t length, row_entry *entries) {
    size_t kept = 0;
    qsort(entries, length, sizeof *entries, by_index);
    for (size_t p = 0; p < length; p++) {
        if (kept > 0 && entries[kept - 1].index == entries[p].index)
            entries[kept - 1].value += entries[p].value;
        else
            entries[kept++] = entries[p];
    }
    return kept;
}

/* An array of fewer bytes, and the same one where that cannot be had. */
static void *shortened(void *array, size_t bytes) {
    void *shorter = realloc(array, bytes + 1);
    return shorter != NULL ? shorter : array;
}

/* Undoes the weights of a stream: F_ij = F1_ij (A_i + A_j) / A_j. */
static lam_status read_rows(void *context, const uint32_t *elements, size_t m, row_block *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    plain_rows *self = context;
    row_block found = {0}, made = {.m = m};
    row_entry *entries = NULL;
    size_t all = 0, longest = 0, used = 0;
    TRY(self->sampled->rows(self->sampled->context, elements, m, &found, error));
    for (size_t k = 0; k < m; k++) {
        all += found.length[k];
        if (found.length[k] > longest) longest = found.length[k];
    }
    entries = memory_allocate(longest, sizeof *entries, "rows of form factors", error);
    const uint32_t **indices = memory_allocate(m, sizeof *indices, "rows of form factors", error);
    const float **data = memory_allocate(m, sizeof *data, "rows of form factors", error);
    made.length = memory_allocate(m, sizeof *made.length, "rows of form factors", error);
    uint32_t *index = memory_allocate(all, sizeof *index, "rows of form factors", error);
    float *value = memory_allocate(all, sizeof *value, "rows of form factors", error);
    made.indices = indices;
    made.data = data;
    made.owned[0] = indices;
    made.owned[1] = data;
    made.owned[2] = made.length;
    made.owned[3] = index;
    made.owned[4] = value;
    if (entries == NULL || indices == NULL || data == NULL || made.length == NULL || index == NULL ||
        value == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < m; k++) {
        const double own = self->area[elements[k]];
        for (size_t p = 0; p < found.length[k]; p++) {
            const double other = self->area[found.indices[k][p]];
            entries[p] =
                (row_entry){found.indices[k][p], (float)((double)found.data[k][p] * (own + other) / other)};
        }
        made.length[k] = sort_row(found.length[k], entries);
        for (size_t p = 0; p < made.length[k]; p++, used++) {
            index[used] = entries[p].index;
            value[used] = entries[p].value;
        }
    }
    made.owned[3] = index = shortened(index, used * sizeof *index);
    made.owned[4] = value = shortened(value, used * sizeof *value);
    used = 0;
    for (size_t k = 0; k < m; used += made.length[k++]) {
        indices[k] = index + used;
        data[k] = value + used;
    }
    __atomic_fetch_add(&self->entries, used, __ATOMIC_RELAXED);
    *out = made;
    made = (row_block){0};
done:
    free(entries);
    row_block_free(&found);
    row_block_free(&made);
    return status;
}

/* A factorization of rows that are not kept. */
typedef struct streamed_result {
    tall_factors f; /* freed by the caller */
    double seconds, peak, passes, held_bytes;
    factorizer_report report;
} streamed_result;

static lam_status factorize_streamed(const bench_run *run, const lowrank_scene *s, size_t n_rays,
                                     double memory, streamed_result *out, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = formfactors_rays(n_rays, run->seed)};
    factorizer_options options = lowrank_options(run, .1, 0);
    ray_rows *rays = NULL;
    row_stream stream;
    scaled_matrix S = {0};
    plain_rows plain = {.area = s->m.area};
    row_source rows = {.n = s->m.n, .rows = read_rows, .context = &plain};
    const double before = lowrank_begin_peak(), started = clock_seconds();
    options.memory = (size_t)memory;
    TRY(ray_rows_create(&s->m, &how, &rays, error));
    ray_rows_stream(rays, run->seed + 1, &stream);
    plain.sampled = &stream.rows;
    rows.density = fmin(1, (double)n_rays / (double)s->m.n);
    TRY(scaled_init(&S, &rows, s->m.area, s->z_order, error));
    TRY(factorize("hf", &S, &options, &out->f, &out->report, error));
    out->seconds = clock_seconds() - started;
    out->peak = lowrank_peak(before);
    out->passes = row_source_passes(&rows);
    out->held_bytes = (double)plain.entries / out->passes * (sizeof(uint32_t) + sizeof(float));
done:
    scaled_free(&S);
    ray_rows_destroy(rays);
    return status;
}

/* |S - Q V^T|_2 with S of a scene whose form factors were found pair by pair. */
static lam_status norm_against(const bench_run *run, const lowrank_scene *s, const tall_factors *f,
                               double *norm, lam_error *error) {
    lam_status status = LAM_OK;
    row_source rows;
    scaled_matrix S = {0};
    row_source_of_csr(&rows, &s->f.F);
    TRY(scaled_init(&S, &rows, s->m.area, s->z_order, error));
    TRY(norm_of_error(&S, f, run->progress, norm, error));
done:
    scaled_free(&S);
    return status;
}

static lam_status add_size(const bench_run *run, size_t divisions, const double theirs[3], table *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_rays = run->scale == BENCH_QUICK ? STREAMED_RAYS_QUICK : STREAMED_RAYS;
    lowrank_scene s = {.name = NULL};
    streamed_result r = {.seconds = 0};
    const double limit = isfinite(theirs[2]) ? 1e6 * theirs[2] : quick_limit;
    double norm = NAN;
    TRY(bench_check(run, error));
    TRY(lowrank_bare_room(run, divisions, &s, error));
    TRY(factorize_streamed(run, &s, n_rays, limit, &r, error));
    const double n = (double)s.m.n;
    const recipe exact = lowrank_recipe(run, s.m.n);
    if (recipe_source(&exact) == &source_pairs) {
        TRY(lowrank_trace(run, &s, &exact, error));
        TRY(norm_against(run, &s, &r.f, &norm, error));
    }
    table_number(out, n);
    table_number(out, (double)n_rays);
    table_number(out, r.seconds);
    table_number(out, (double)r.f.rank);
    table_number(out, norm);
    table_number(out, r.report.levels);
    table_number(out, r.passes);
    table_number(out, 1e-6 * r.held_bytes);
    table_number(out, 8e-6 * n * (double)r.f.rank);
    table_number(out, 1e-6 * limit);
    table_number(out, 1e-6 * r.peak);
    for (int k = 0; k < 3; k++) table_number(out, theirs[k]);
    bench_say(run, "%zu elements: HF of rows that are not kept in %.1f s, rank %zu, peak %.0f MB", s.m.n,
              r.seconds, r.f.rank, 1e-6 * r.peak);
done:
    tall_factors_free(&r.f);
    lowrank_scene_free(&s);
    return status;
}

lam_status lowrank_of_streamed(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"rays", "", "of a row"},
        {"seconds", "s", "time of the rays and the factorization"},
        {"rank", "", "k at epsilon .1"},
        {"real", "", "|S - Q V^T|_2 with S pair by pair, so that the noise of the rays counts"},
        {"levels", "", "levels of the tree"},
        {"passes", "", "over the rows, those of the forecast of ranks included"},
        {"rows_mb", "MB", "bytes of the rows, had they been kept"},
        {"factors_mb", "MB", "Q and V"},
        {"limit_mb", "MB", "memory that the factorization shall keep to: the thesis' peak"},
        {"peak_mb", "MB", "peak of memory, that of rays included"},
        {"thesis_seconds", "s", "as published, of a factorization whose columns are read from a disk"},
        {"thesis_rank", "", "as published"},
        {"thesis_peak_mb", "MB", "as published"},
    };
    /* of five walls of 10 divisions^2 elements, table 3.2 and 3.3, whose MB are 2^20 bytes */
    static const struct {
        size_t divisions;
        double theirs[3];
    } sizes[STREAMED_SIZES] = {{16, {.257, 416, 184}},
                               {32, {5.67, 877, 209 * 1.048576}},
                               {64, {141, 1791, 820 * 1.048576}},
                               {128, {23200, 3990, 7731.2 * 1.048576}}};
    static const double none[3] = {NAN, NAN, NAN};
    lam_status status = LAM_OK;
    const size_t count = run->scale == BENCH_FULL ? STREAMED_SIZES : STREAMED_SIZES - 1;
    table out = {.name = "streamed",
                 .title =
                     "HF in one pass over rows that are not kept, epsilon .1 (thesis: tables 3.2 and 3.3)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    if (run->scale == BENCH_QUICK)
        TRY(add_size(run, 8, none, &out, error));
    else
        for (size_t k = 0; k < count; k++)
            TRY(add_size(run, sizes[k].divisions, sizes[k].theirs, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
