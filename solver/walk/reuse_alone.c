/* Approach A: walks that start at the light and go on at what they meet, like all others. The pieces of the
 * light at its positions are shapes beyond the elements, which nothing meets. */
#include "solver/walk/reuse_alone.h"

#include "solver/base/clock.h"
#include "solver/walk/reuse_sums.h"
#include "solver/walk/walk_steps.h"

#include <stdlib.h>
#include <string.h>

/* All that batches share. */
typedef struct alone {
    walk_scene
        scene; /* with the pieces of the light: that of position l and piece k has the index n + l * pieces
                * + k */
    const light_pieces *pieces;
    size_t n, C, s, of_batch;
    uint64_t seed;
    double per_path; /* the power of a path over that of the light */
} alone;

typedef struct alone_batch {
    const alone *r;
    size_t number, position;
    walk_starts starts; /* of the position */
    double *sum;        /* [s][n][1 + C]: see reuse_sums_add; and of what meets nothing */
    double rays, seconds;
} alone_batch;

static void begin_position(alone_batch *b, size_t position) {
    const alone *r = b->r;
    b->position = position;
    if (position < r->s) walk_starts_init(&b->starts, r->seed, b->number * r->s + position, r->of_batch);
}

/* A ray of the light that meets no front is lost with its path, also where it slipped through a crack. */
static size_t start(void *context, size_t n, walker *w) {
    static const double all[2] = {0, 1};
    alone_batch *b = context;
    const alone *r = b->r;
    size_t started = 0, only;
    while (started < n && b->position < r->s) {
        walker *const one = &w[started];
        if (!walk_starts_next(&b->starts, all, 1, one, &only)) {
            begin_position(b, b->position + 1);
            continue;
        }
        const size_t piece = light_pieces_choose(r->pieces, &one->place[0]);
        one->at = (uint32_t)(r->n + b->position * r->pieces->n + piece);
        one->path = (uint32_t)b->position;
        for (size_t c = 0; c < r->C; c++) one->weight[c] = r->per_path;
        started++;
    }
    return started;
}

/* Adds n arrivals to the 1 + C numbers that an element has for a position. A path that comes straight from
 * the light adds its power to the first number, and a path that was reflected adds its weights to the C
 * numbers of channels. A path that meets no element adds to numbers behind those of all elements, which
 * nobody reads. The loop has no branches, because a processor cannot predict which of these cases comes
 * next. */
static inline void deposit(const alone_batch *b, size_t n, const walk_stream *w, const uint32_t *element,
                           size_t C) {
    const alone *r = b->r;
    const uint32_t n_elements = (uint32_t)r->n;
    const size_t nowhere = r->s * r->n;
    double *sum[WALK_STREAM];
    for (size_t i = 0; i < n; i++) {
        const size_t at = w->path[i] * r->n + element[i], ends = -(size_t)(element[i] == VISIBILITY_NOTHING);
        sum[i] = b->sum + ((at & ~ends) | (nowhere & ends)) * (C + 1);
        __builtin_prefetch(sum[i], 1);
    }
    for (size_t i = 0; i < n; i++) {
        const double reflected = (double)(int)((w->at[i] - n_elements) >> 31); /* at < n */
        double *const to = sum[i];
        to[0] += (1 - reflected) * r->per_path;
        for (size_t c = 0; c < C; c++) to[1 + c] += reflected * w->weight[c][i];
    }
}

static void arrive(void *context, size_t n, const walk_stream *w, const uint32_t *element) {
    const alone_batch *b = context;
    if (b->r->C == 3)
        deposit(b, n, w, element, 3);
    else
        deposit(b, n, w, element, b->r->C);
}

static void go(alone_batch *b, walk_run *run) {
    const walk_batch walks = {
        .scene = &b->r->scene, .run = run, .start = start, .arrive = arrive, .context = b, .rays = &b->rays};
    const double begun = clock_thread_seconds();
    begin_position(b, 0);
    walk_batch_go(&walks);
    b->seconds += clock_thread_seconds() - begun;
}

/* The shapes of a scene and, after them, those of the light. */
static lam_status shapes_create(const walk_scene *s, alone *r, lam_error *error) {
    const size_t of_light = r->s * r->pieces->n;
    r->scene = *s;
    r->scene.share = NULL;
    r->scene.shapes = memory_allocate(r->n + of_light, sizeof *s->shapes, "paths", error);
    r->scene.share = memory_allocate(r->n + of_light, sizeof *s->share, "paths", error);
    if (r->scene.shapes == NULL || r->scene.share == NULL) return LAM_ERR_MEMORY;
    memcpy(r->scene.shapes, s->shapes, r->n * sizeof *s->shapes);
    memcpy(r->scene.share, s->share, r->n * sizeof *s->share);
    for (size_t k = 0; k < of_light; k++) r->scene.share[r->n + k] = 1;
    memcpy(r->scene.shapes + r->n, r->pieces->carried, of_light * sizeof *s->shapes);
    return LAM_OK;
}

lam_status reuse_alone(const walk_scene *s, const reuse_problem *problem, const light_pieces *pieces,
                       walk_run *run, reuse_estimates *e, lam_error *error) {
    lam_status status = LAM_OK;
    alone r = {.pieces = pieces,
               .n = e->n,
               .C = e->n_channels,
               .s = e->n_positions,
               .of_batch = e->paths / WALK_BATCHES,
               .seed = problem->seed};
    const size_t size = (r.n * r.s + 1) * (r.C + 1);
    bool failed = false;
    double rays = 0;
    reuse_sums sums = {.s = 0};
    r.per_path = 1 / (double)r.of_batch;
    TRY(shapes_create(s, &r, error));
    TRY(reuse_sums_create(s->m, problem->light, false, &sums, error));
#pragma omp parallel
    {
        /* The numbers of an element in one line of a cache, where four of them fit. */
        alone_batch b = {.r = &r, .sum = aligned_alloc(64, (size * sizeof *b.sum + 63) / 64 * 64)};
#pragma omp for schedule(static, 1) ordered
        for (size_t k = 0; k < WALK_BATCHES; k++) {
            if (b.sum != NULL) {
                memset(b.sum, 0, size * sizeof *b.sum);
                b.number = k;
                b.rays = 0;
                go(&b, run);
            }
#pragma omp ordered
            {
                if (b.sum != NULL)
                    reuse_sums_add(&sums, b.sum, NULL);
                else
                    failed = true;
                rays += b.rays;
            }
        }
#pragma omp critical(reuse_seconds)
        e->trace_seconds += b.seconds;
        free(b.sum);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "paths: out of memory");
    TRY(walk_run_end(run, error));
    reuse_sums_end(&sums, e);
    e->rays = rays / ((double)e->paths * (double)r.s);
done:
    free(r.scene.shapes);
    free(r.scene.share);
    reuse_sums_free(&sums);
    return status;
}
