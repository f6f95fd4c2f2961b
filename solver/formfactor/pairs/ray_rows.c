/* A row of F1 is cast when it is asked for: a hit of j adds A_j / (rays (A_i + A_j)) to F1_ij, and A_i /
 * (rays (A_i + A_j)) to the row sum of j, so that A F = A F1 + (A F1)^T. Near pairs are found once, and half
 * of their F enters. close_rows() returns the row sums sum / (sum + outside). */
#include "solver/formfactor/pairs/ray_rows.h"

#include "solver/formfactor/leaving.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/rays/portals.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/rows/upper.h"
#include "solver/formfactor/source.h"
#include "solver/formfactor/visibility/parts.h"

#include <math.h>
#include <stdlib.h>

/* Contributions to other rows are summed as integer multiples of this, so that their order does not matter.
 */
static const double unit = 0x1p-44;

struct ray_rows {
    const mesh *m;
    visibility *v;
    portals aimed;      /* rays for the sky; n is 0: none */
    form_factors f;     /* everything but the rows */
    csr near;           /* rows of F with the near pairs only, 0 where they are hidden; n is 0: none */
    double *near_sums;  /* [n], row sums of near */
    double *own;        /* [n], row sums of F1 without near pairs */
    uint64_t *received; /* [n], row sums of A^-1 (A F1)^T without near pairs, in units */
    double noise_share;
    uint32_t *part; /* [n]; NULL: one */
    uint64_t other_seed;
};

/* The elements and rays that tell the share of the noise. */
enum { NOISE_ELEMENTS = 1024, NOISE_RAYS = 64 };

bool ray_rows_can(const recipe *r) {
    return recipe_can(r, SOURCE_STREAM);
}

void ray_rows_destroy(ray_rows *r) {
    if (r == NULL) return;
    visibility_destroy(r->v);
    form_factors_free(&r->f);
    csr_free(&r->near);
    portals_free(&r->aimed);
    free(r->near_sums);
    free(r->own);
    free(r->received);
    free(r->part);
    free(r);
}

/* sum_j 2 A_i F_ij / (A_i + A_j) of an element by some rays. */
static double noise_of_element(const ray_rows *r, size_t i) {
    const ray_context context = {.m = r->m, .v = r->v, .seed = r->f.recipe.seed};
    const double *area = r->m->area;
    uint32_t met[RAYS_AT_ONCE];
    element_sampler sampler;
    ray_tally tally = {0};
    double sum = 0;
    element_sampler_init(&sampler, r->m, r->v, i, r->f.recipe.seed);
    const size_t count = rays_meet(&context, &sampler, i, 0, NOISE_RAYS, met, &tally, NULL);
    for (size_t k = 0; k < count; k++)
        if (met[k] != i) sum += 2 * area[i] / (area[i] + area[met[k]]);
    return sum / NOISE_RAYS;
}

static double find_noise_share(const ray_rows *r) {
    const size_t n = r->m->n, count = n < NOISE_ELEMENTS ? n : NOISE_ELEMENTS;
    double of[NOISE_ELEMENTS], sum = 0;
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t k = 0; k < count; k++) of[k] = noise_of_element(r, k * n / count);
    for (size_t k = 0; k < count; k++) sum += of[k];
    return sqrt(sum / (double)count);
}

static lam_status find_parts(ray_rows *r, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    r->part = memory_allocate(r->m->n, sizeof *r->part, "parts of the scene", error);
    if (r->part == NULL) return LAM_ERR_MEMORY;
    TRY(visibility_parts(r->m, r->v, r->part, &count, error));
    if (count > 1) goto done;
    free(r->part);
    r->part = NULL;
done:
    return status;
}

lam_status ray_rows_create(const mesh *m, const form_factor_options *options, ray_rows **out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    ray_rows *r = memory_allocate(1, sizeof *r, "form factors", error);
    if (r == NULL) TRY(LAM_ERR_MEMORY);
    r->m = m;
    r->f.recipe = options->recipe;
    if (!ray_rows_can(&options->recipe))
        FAIL(error, LAM_ERR_ARGUMENT, "form factors by %s do not come row by row",
             recipe_name(&options->recipe));
    TRY(recipe_check(&options->recipe, error));
    r->f.leaving = memory_allocate(n, sizeof *r->f.leaving, "form factors", error);
    r->f.absorbed = memory_allocate(n, sizeof *r->f.absorbed, "form factors", error);
    r->near_sums = memory_allocate(n, sizeof *r->near_sums, "form factors", error);
    r->own = memory_allocate(n, sizeof *r->own, "form factors", error);
    r->received = memory_allocate(n, sizeof *r->received, "form factors", error);
    if (r->f.leaving == NULL || r->f.absorbed == NULL || r->near_sums == NULL || r->own == NULL ||
        r->received == NULL)
        TRY(LAM_ERR_MEMORY);
    if (options->sky != NULL)
        TRY(sky_bounce_create(options->sky, m->up, options->ground_albedo, n, &r->f.sky, error));
    TRY(visibility_create(m, &r->v, error));
    if (options->sky != NULL)
        TRY(portals_find(m, r->v, options->recipe.seed, options->recipe.rays / 4, options->openings, false,
                         &r->aimed, error));
    r->f.n_aimed = r->aimed.n_openings;
    r->noise_share = find_noise_share(r);
    TRY(find_parts(r, error));
    if (recipe_can(&options->recipe, SOURCE_ACCURACY)) {
        TRY(pairs_find(m, r->v, options, recipe_near(&options->recipe), &r->f, &r->near, error));
        TRY(upper_expand(&r->near, m->area, r->near_sums, error));
    }
    *out = r;
    r = NULL;
done:
    ray_rows_destroy(r);
    return status;
}

/* The near partners of an element, ascending, and a filter of 1,024 bits over their indices. */
typedef struct near_row {
    const uint32_t *indices;
    const float *data;
    size_t count;
    uint64_t maybe[16];
} near_row;

static near_row near_of(const ray_rows *r, size_t element) {
    near_row row = {.count = 0};
    if (r->near.n == 0) return row;
    const uint64_t first = r->near.indptr[element];
    row.indices = r->near.indices + first;
    row.data = r->near.data + first;
    row.count = (size_t)(r->near.indptr[element + 1] - first);
    for (size_t k = 0; k < row.count; k++)
        row.maybe[row.indices[k] >> 6 & 15] |= 1ull << (row.indices[k] & 63);
    return row;
}

static bool is_near(const near_row *row, uint32_t element) {
    if ((row->maybe[element >> 6 & 15] >> (element & 63) & 1) == 0) return false;
    size_t first = 0, last = row->count;
    while (first < last) {
        const size_t middle = first + (last - first) / 2;
        if (row->indices[middle] < element)
            first = middle + 1;
        else
            last = middle;
    }
    return first < row->count && row->indices[first] == element;
}

/* A block that is being filled, row by row. Hits are summed first where there are more rays than elements. */
typedef struct filling {
    uint32_t *indices;
    float *data;
    size_t used;
    double *sums; /* [n], all 0 between rows; NULL: every hit is an entry */
} filling;

static void put(filling *to, uint32_t index, double value) {
    to->indices[to->used] = index;
    to->data[to->used++] = (float)value;
}

static inline void put_hit(filling *to, uint32_t index, double value) {
    if (to->sums != NULL)
        to->sums[index] += value;
    else
        put(to, index, value);
}

/* Turns summed hits into entries. */
static void put_sums(filling *to, size_t n) {
    for (size_t j = 0; to->sums != NULL && j < n; j++) {
        if (to->sums[j] > 0) put(to, (uint32_t)j, to->sums[j]);
        to->sums[j] = 0;
    }
}

static lam_status begin_block(const ray_rows *r, const uint32_t *elements, size_t m, row_block *out,
                              filling *to, lam_error *error) {
    const size_t n = r->m->n, rays = r->f.recipe.rays;
    size_t most = m * (rays < n ? rays : n);
    for (size_t k = 0; k < m && r->near.n > 0; k++)
        most += (size_t)(r->near.indptr[elements[k] + 1] - r->near.indptr[elements[k]]);
    const uint32_t **indices = memory_allocate(m, sizeof *indices, "rows of form factors", error);
    const float **data = memory_allocate(m, sizeof *data, "rows of form factors", error);
    size_t *length = memory_allocate(m, sizeof *length, "rows of form factors", error);
    *to = (filling){.indices = malloc((most + 1) * sizeof *to->indices),
                    .data = malloc((most + 1) * sizeof *to->data),
                    .sums = rays < n ? NULL : calloc(n, sizeof *to->sums)};
    *out = (row_block){.m = m,
                       .indices = indices,
                       .data = data,
                       .length = length,
                       .owned = {indices, data, length, to->indices, to->data}};
    if (indices != NULL && data != NULL && length != NULL && to->indices != NULL && to->data != NULL &&
        (rays < n || to->sums != NULL))
        return LAM_OK;
    row_block_free(out);
    free(to->sums);
    to->sums = NULL;
    return status_fail(error, LAM_ERR_MEMORY, "rows of form factors: cannot allocate %zu x %zu bytes", most,
                       sizeof *to->indices + sizeof *to->data);
}

/* The rays of an element, batch by batch. */
typedef struct ray_batch {
    ray_context rays;
    near_row near;
    element_sampler sampler;
    size_t element, first, n_rays;
    ray_tally tally;
    uint32_t met[RAYS_AT_ONCE]; /* elements that the last batch hit, without near ones */
} ray_batch;

static void ray_batch_begin(const ray_rows *r, size_t element, uint64_t seed, const sky_bounce *sky,
                            ray_batch *g) {
    g->rays = (ray_context){.m = r->m, .v = r->v, .seed = seed, .sky = sky};
    if (sky != NULL && r->aimed.n > 0) g->rays.portals = &r->aimed;
    g->near = near_of(r, element);
    g->element = element;
    g->first = 0;
    g->n_rays = r->f.recipe.rays;
    g->tally = (ray_tally){0};
    element_sampler_init(&g->sampler, r->m, r->v, element, seed);
    rays_aim(&g->rays, &g->sampler, element, r->f.recipe.rays);
}

/* Casts the next batch; count is the number of entries of met. False after the last one. */
static bool ray_batch_next(ray_batch *g, double *sky, size_t *count) {
    if (g->first >= g->n_rays) return false;
    const size_t last = g->first + RAYS_AT_ONCE < g->n_rays ? g->first + RAYS_AT_ONCE : g->n_rays;
    const size_t all = rays_meet(&g->rays, &g->sampler, g->element, g->first, last, g->met, &g->tally, sky);
    *count = 0;
    for (size_t k = 0; k < all; k++) /* a plane does not see itself */
        if (g->met[k] != g->element && !is_near(&g->near, g->met[k])) g->met[(*count)++] = g->met[k];
    g->first = last;
    return true;
}

/* Ends a row: summed hits, then the near pairs times share. */
static void ray_batch_end(const ray_rows *r, const ray_batch *g, double share, filling *to) {
    put_sums(to, r->m->n);
    for (size_t k = 0; k < g->near.count; k++)
        if (g->near.data[k] > 0) put(to, g->near.indices[k], share * (double)g->near.data[k]);
}

/* Row k of a block has the entries from first on. */
static void end_row(row_block *block, size_t k, const filling *to, size_t first) {
    const uint32_t **indices = block->owned[0];
    const float **data = block->owned[1];
    indices[k] = to->indices + first;
    data[k] = to->data + first;
    block->length[k] = to->used - first;
}

static void find_row(ray_rows *r, size_t i, double *sky, filling *to) {
    const double *area = r->m->area, each = 1 / (double)r->f.recipe.rays;
    ray_batch g;
    double own = 0;
    size_t count;
    ray_batch_begin(r, i, r->f.recipe.seed, sky != NULL ? &r->f.sky : NULL, &g);
    while (ray_batch_next(&g, sky, &count))
        for (size_t k = 0; k < count; k++) {
            const uint32_t j = g.met[k];
            const double mine = each * area[j] / (area[i] + area[j]);
            put_hit(to, j, mine);
            own += mine;
            __atomic_fetch_add(&r->received[j], (uint64_t)((each - mine) / unit), __ATOMIC_RELAXED);
        }
    ray_batch_end(r, &g, .5, to);
    if (g.rays.aim.n > 0) portals_cast(&g.rays, &g.sampler, i, &g.tally, sky);
    r->own[i] = own;
    r->f.leaving[i] = fmin(g.tally.left / (double)g.n_rays, 1);
    r->f.absorbed[i] = (double)g.tally.lost / (double)g.n_rays;
    if (sky != NULL) sky_bounce_put(&r->f.sky, i, sky, (double)g.n_rays);
}

static lam_status find_rows(void *context, const uint32_t *elements, size_t m, row_block *out,
                            lam_error *error) {
    ray_rows *r = context;
    double *sky = NULL;
    filling to;
    if (r->f.sky.n > 0) {
        sky = memory_allocate(r->f.sky.tiling.n_tiles + 1, sizeof *sky, "the tiles of the sky", error);
        if (sky == NULL) return LAM_ERR_MEMORY;
    }
    const lam_status status = begin_block(r, elements, m, out, &to, error);
    for (size_t k = 0; status == LAM_OK && k < m; k++) {
        const size_t first = to.used;
        find_row(r, elements[k], sky, &to);
        end_row(out, k, &to, first);
    }
    free(to.sums);
    free(sky);
    return status;
}

/* The row of the other seed, scaled to row_sums. */
static void find_other_row(const ray_rows *r, size_t i, filling *to) {
    const size_t begin = to->used;
    const double each = 1 / (double)r->f.recipe.rays;
    ray_batch g;
    double sum = 0;
    size_t count;
    ray_batch_begin(r, i, r->other_seed, NULL, &g);
    while (ray_batch_next(&g, NULL, &count))
        for (size_t k = 0; k < count; k++) put_hit(to, g.met[k], each);
    ray_batch_end(r, &g, 1, to);
    for (size_t e = begin; e < to->used; e++) sum += (double)to->data[e];
    for (size_t e = begin; e < to->used; e++)
        to->data[e] = (float)((double)to->data[e] * r->f.row_sums[i] / sum);
}

static lam_status find_other_rows(void *context, const uint32_t *elements, size_t m, row_block *out,
                                  lam_error *error) {
    const ray_rows *r = context;
    filling to;
    const lam_status status = begin_block(r, elements, m, out, &to, error);
    for (size_t k = 0; status == LAM_OK && k < m; k++) {
        const size_t first = to.used;
        find_other_row(r, elements[k], &to);
        end_row(out, k, &to, first);
    }
    free(to.sums);
    return status;
}

static lam_status close_rows(void *context, const double **row_sums, lam_error *error) {
    lam_status status = LAM_OK;
    ray_rows *r = context;
    const size_t n = r->m->n;
    form_factors *const f = &r->f;
    double changed = 0, total_area = 0;
    f->row_sums = memory_allocate(n, sizeof *f->row_sums, "row sums", error);
    f->repair = memory_allocate(n, sizeof *f->repair, "row sums", error);
    if (f->row_sums == NULL || f->repair == NULL) TRY(LAM_ERR_MEMORY);
    leaving_measure(f, r->m, r->v);
    for (size_t i = 0; i < n; i++) {
        const double sum = r->near_sums[i] + r->own[i] + (double)r->received[i] * unit;
        const double all = sum + leaving_outside(f, r->m, i);
        /* A row that sees nothing has nothing to close. */
        f->row_sums[i] = sum > 0 ? sum / all : 0;
        f->repair[i] = all - 1;
        f->repair_max = fmax(f->repair_max, fabs(all - 1));
        changed += r->m->area[i] * fabs(all - 1);
        total_area += r->m->area[i];
    }
    f->repair_mean = changed / total_area;
    if (f->sky.n > 0) TRY(leaving_to_sky(f, r->m, error));
    *row_sums = f->row_sums;
done:
    return status;
}

void ray_rows_stream(ray_rows *r, uint64_t other_seed, row_stream *out) {
    const row_source source = {.n = r->m->n, .context = r};
    r->other_seed = other_seed;
    *out = (row_stream){.rows = source,
                        .close = close_rows,
                        .context = r,
                        .noise_share = r->noise_share,
                        .part = r->part,
                        .others = source};
    out->rows.rows = find_rows;
    out->others.rows = find_other_rows;
}

form_factors ray_rows_take(ray_rows *r) {
    const form_factors taken = r->f;
    r->f = (form_factors){.recipe = taken.recipe};
    return taken;
}
