/* Approaches B to D of Castro et al. are run here: first hits y of all positions are cast, each is weighted
 * for every position j by Phi F(x_j, y) / sum_l N_l F(x_l, y) (eq. 2.8), and its walk deposits that light
 * wherever it arrives. walk_reuse() gives approaches A and E to reuse_alone.c and reuse_elements.c. */
#include "solver/walk/reuse.h"

#include "solver/base/clock.h"
#include "solver/base/vector3.h"
#include "solver/walk/light_frames.h"
#include "solver/walk/reuse_alone.h"
#include "solver/walk/reuse_counts.h"
#include "solver/walk/reuse_elements.h"
#include "solver/walk/reuse_sums.h"
#include "solver/walk/reuse_weights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void reuse_estimates_free(reuse_estimates *e) {
    free(e->H);
    free(e->error);
    free(e->direct);
    free(e->covariance);
    free(e->of_groups);
    free(e->of_means);
    free(e->count);
    *e = (reuse_estimates){.n = 0};
}

/* First rays of each position that a pilot has at most, and about as many of all together. */
enum { PILOT = 512, PILOT_ALL = 30 * PILOT, PILOT_LEAST = 8 };

/* All that batches share. */
typedef struct reuse {
    const walk_scene *scene;
    const reuse_problem *problem;
    size_t n, C, s;
    size_t *of_batch;    /* [s]: paths of a position in a batch */
    light_frame *frames; /* [s] */
    light_pieces pieces;
    const light_maps *maps; /* or NULL */
    walk_run *run;
} reuse;

/* One batch, and the walk of a chunk of its paths. */
typedef struct reuse_batch {
    const reuse *r;
    double *first, *later; /* of reuse_sums_add */
    first_hits *hits;
    float *weight, *work;  /* [HITS_MOST][s]; see reuse_weights */
    walk_starts starts;    /* of position, 0 <= position <= s */
    size_t position, next; /* of hits: the next to go on */
    double rays, trace, reuse;
} reuse_batch;

/* Numbers that kernels read beyond the last hit: a point whose normal is 0 gets nothing. */
static void fill_up(first_hits *h) {
    for (size_t k = h->count; k % HITS_LANES != 0; k++) {
        h->facet[k] = h->position[k] = VISIBILITY_NOTHING;
        h->part[k] = 0;
        for (int d = 0; d < 3; d++) h->local[d][k] = h->middle[d][k] = h->y[d][k] = h->normal[d][k] = 0;
    }
}

/* The points of the light that first rays start at. */
typedef struct light_points {
    float local[WALK_STREAM][3], middle[WALK_STREAM][3];
    int part[WALK_STREAM];
    uint64_t random[WALK_STREAM];
} light_points;

/* First rays of the position at hand, at most so many; returns how many. */
static size_t first_rays(reuse_batch *b, size_t most, ray_packet *rays, light_points *points) {
    static const double all[2] = {0, 1};
    const light_pieces *light = &b->r->pieces;
    const walk_shape *carried = light->carried + b->position * light->n, *shape[WALK_STREAM];
    uint32_t place[4][WALK_STREAM], facet[WALK_STREAM];
    float share[WALK_STREAM];
    const size_t split = b->r->maps != NULL ? b->r->maps->split : 1;
    walker w;
    size_t n = 0, only;
    for (; n < most && walk_starts_next(&b->starts, all, 1, &w, &only); n++) {
        const size_t k = light_pieces_choose(light, &w.place[0]);
        shape[n] = &carried[k];
        for (int d = 0; d < 4; d++) place[d][n] = w.place[d];
        light_pieces_point(light, k, w.place, points->local[n]);
        points->part[n] = (int)light_pieces_part(light, split, w.place);
        light_pieces_middle(light, split, (size_t)points->part[n], points->middle[n]);
        points->random[n] = w.random;
    }
    const size_t last = n;
    for (size_t i = 0; i < WALK_STREAM; i++) share[i] = 1;
    for (; n % VISIBILITY_PACKET != 0; n++) {
        shape[n] = &carried[0];
        for (int d = 0; d < 4; d++) place[d][n] = w.place[d];
    }
    walk_leave(n, shape, share, place, rays, facet);
    return last;
}

/* Adds the hits of n rays on fronts. */
static void keep_hits(reuse_batch *b, size_t n, const ray_packet *rays, const hit_packet *met,
                      const light_points *points) {
    first_hits *const h = b->hits;
    for (size_t i = 0; i < n; i++) {
        const hit_packet *of = &met[i / VISIBILITY_PACKET];
        const ray_packet *ray = &rays[i / VISIBILITY_PACKET];
        const size_t lane = i % VISIBILITY_PACKET, k = h->count;
        const uint32_t element = of->element[lane];
        if (element == VISIBILITY_NOTHING || of->back[lane]) continue;
        const walk_shape *shape = &b->r->scene->shapes[element];
        h->element[k] = element;
        h->facet[k] = shape->facet & ~WALK_TRIANGLE;
        h->position[k] = (uint32_t)b->position;
        h->random[k] = points->random[i];
        h->part[k] = points->part[i];
        for (int d = 0; d < 3; d++) {
            h->local[d][k] = points->local[i][d];
            h->middle[d][k] = points->middle[i][d];
            h->y[d][k] = ray->origin[d][lane] + of->distance[lane] * ray->direction[d][lane];
            h->normal[d][k] = shape->normal[d];
        }
        h->count++;
    }
}

/* The paths of a batch take their places from one sequence, since every position has the light of all. */
static void begin_position(reuse_batch *b, size_t number, size_t position) {
    const reuse *r = b->r;
    b->position = position;
    if (position >= r->s) return;
    if (position > 0)
        b->starts.count += r->of_batch[position];
    else
        walk_starts_init(&b->starts, r->problem->seed, number * r->s + position, r->of_batch[position]);
}

/* Casts first rays of the positions of batch `number` until a chunk of hits is full or all have been cast. */
static void find_hits(reuse_batch *b, size_t number) {
    const reuse *r = b->r;
    ray_packet rays[WALK_STREAM / VISIBILITY_PACKET];
    hit_packet met[WALK_STREAM / VISIBILITY_PACKET];
    light_points points;
    uint32_t self[WALK_STREAM];
    for (int i = 0; i < WALK_STREAM; i++) self[i] = VISIBILITY_NOTHING;
    b->hits->count = b->next = 0;
    while (b->position < r->s && b->hits->count < HITS_MOST) {
        const size_t room = HITS_MOST - b->hits->count;
        const size_t n = first_rays(b, room < WALK_STREAM ? room : WALK_STREAM, rays, &points);
        if (n == 0) {
            begin_position(b, number, b->position + 1);
            continue;
        }
        b->rays += (double)n;
        walk_log_add(r->run->log, n / VISIBILITY_PACKET, rays);
        visibility_cast_lifted(r->scene->v, rays, n, self, self, met);
        keep_hits(b, n, rays, met, &points);
    }
    fill_up(b->hits);
}

/* Adds the light that comes straight from the light, the same in all channels. */
static void deposit_first(const reuse_batch *b) {
    const size_t s = b->r->s;
    for (size_t k = 0; k < b->hits->count; k++) {
        double *const first = b->first + (size_t)b->hits->element[k] * s;
        const float *const weight = b->weight + k * s;
#pragma omp simd
        for (size_t l = 0; l < s; l++) first[l] += (double)weight[l];
    }
}

static void arrive(void *context, size_t n, const walk_stream *w, const uint32_t *element) {
    const reuse_batch *b = context;
    reuse_deposit(n, b->r->s, b->r->C, w, element, b->weight, b->later);
}

/* The next paths of the chunk that go on from their first hits. */
static size_t start(void *context, size_t n, walker *w) {
    reuse_batch *b = context;
    const first_hits *h = b->hits;
    size_t started = 0;
    while (started < n && b->next < h->count) {
        const size_t k = b->next++;
        walker *const one = &w[started];
        one->at = h->element[k];
        one->path = (uint32_t)k;
        one->random = h->random[k];
        for (size_t c = 0; c < b->r->C; c++) one->weight[c] = 1;
        if (!walk_survives(b->r->scene, one, one->at)) continue;
        walk_draw_place(one);
        started++;
    }
    return started;
}

static void go(reuse_batch *b, size_t number) {
    const reuse *r = b->r;
    const walk_batch walks = {
        .scene = r->scene, .run = r->run, .start = start, .arrive = arrive, .context = b, .rays = &b->rays};
    begin_position(b, number, 0);
    while (!r->run->stop) {
        const double begun = clock_thread_seconds();
        find_hits(b, number);
        if (b->hits->count == 0 && b->position == r->s) break;
        const double traced = clock_thread_seconds();
        reuse_weights(r->scene, r->s, r->frames, r->maps, b->hits, b->work, b->weight);
        const double weighed = clock_thread_seconds();
        deposit_first(b);
        walk_batch_go(&walks);
        b->reuse += weighed - traced;
        b->trace += traced - begun + clock_thread_seconds() - weighed;
    }
}

/* The memory of a chunk of hits. */
static bool batch_memory(reuse_batch *b) {
    b->hits = malloc(sizeof *b->hits);
    b->weight = malloc(HITS_MOST * b->r->s * sizeof *b->weight);
    b->work = malloc(HITS_BLOCK * (b->r->s + 1) * sizeof *b->work);
    return b->hits != NULL && b->weight != NULL && b->work != NULL;
}

static void batch_memory_free(reuse_batch *b) {
    free(b->hits);
    free(b->weight);
    free(b->work);
}

static void set_counts(reuse *r, size_t of_batch, const double *part) {
    for (size_t l = 0; l < r->s; l++) {
        const double count = (double)of_batch * (part != NULL ? part[l] : 1);
        r->of_batch[l] = count > 1 ? (size_t)(count + .5) : 1;
        r->frames[l].paths = (float)r->of_batch[l];
    }
}

/* Sets the counts of paths by a pilot of first hits, a batch that no estimate has. */
static lam_status count_paths(reuse *r, size_t of_batch, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t share = PILOT_ALL / r->s, most = share > PILOT         ? PILOT
                                                  : share < PILOT_LEAST ? PILOT_LEAST
                                                                        : share;
    const size_t twentieth = of_batch * WALK_BATCHES / 20, pilot = twentieth < most ? twentieth : most;
    size_t known = 0;
    reuse_batch b = {.r = r};
    double *part = memory_allocate(r->s, sizeof *part, "paths", error);
    float *weight = memory_allocate(r->s * pilot, r->s * sizeof *weight, "paths", error);
    if (part == NULL || weight == NULL) TRY(LAM_ERR_MEMORY);
    if (!batch_memory(&b)) FAIL(error, LAM_ERR_MEMORY, "paths: out of memory");
    set_counts(r, pilot, NULL);
    begin_position(&b, WALK_BATCHES, 0);
    while (pilot > 0) {
        find_hits(&b, WALK_BATCHES);
        if (b.hits->count == 0 && b.position == r->s) break;
        reuse_weights(r->scene, r->s, r->frames, r->maps, b.hits, b.work, weight + known * r->s);
        known += b.hits->count;
    }
    TRY(reuse_counts(known, r->s, weight, part, error));
    set_counts(r, of_batch, part);
done:
    batch_memory_free(&b);
    free(weight);
    free(part);
    return status;
}

static lam_status run_batches(const reuse *r, reuse_estimates *e, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t straight = r->n * r->s, size = straight * r->C;
    bool failed = false;
    double rays = 0;
    reuse_sums sums = {.s = 0};
    TRY(reuse_sums_create(r->scene->m, r->problem->light, true, &sums, error));
#pragma omp parallel
    {
        reuse_batch b = {.r = r};
        b.first = malloc(straight * sizeof *b.first);
        b.later = malloc(size * sizeof *b.later);
        const bool ready = batch_memory(&b) && b.first != NULL && b.later != NULL;
#pragma omp for schedule(static, 1) ordered
        for (size_t k = 0; k < WALK_BATCHES; k++) {
            if (ready) {
                memset(b.first, 0, straight * sizeof *b.first);
                memset(b.later, 0, size * sizeof *b.later);
                b.rays = 0;
                go(&b, k);
            }
#pragma omp ordered
            {
                if (ready)
                    reuse_sums_add(&sums, b.first, b.later);
                else
                    failed = true;
                rays += b.rays;
            }
        }
#pragma omp critical(reuse_seconds)
        {
            e->trace_seconds += b.trace;
            e->reuse_seconds += b.reuse;
        }
        free(b.first);
        free(b.later);
        batch_memory_free(&b);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "paths: out of memory");
    TRY(walk_run_end(r->run, error));
    reuse_sums_end(&sums, e);
    double paths = 0;
    for (size_t l = 0; l < r->s; l++) paths += (double)e->count[l];
    e->rays = rays / paths;
done:
    reuse_sums_free(&sums);
    return status;
}

/* A position whose light reaches nothing is a mistake. */
static lam_status check_reach(const reuse *r, const reuse_estimates *e, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t l = 0; l < r->s; l++) {
        double most = 0;
        for (size_t c = 0; c < r->C; c++)
            for (size_t i = 0; i < r->n; i++) most = fmax(most, (double)e->H[(c * r->s + l) * r->n + i]);
        if (!(most > 0))
            FAIL(error, LAM_ERR_ARGUMENT,
                 "position %zu (%s): its light reaches no front of the scene; is it inside a wall, or turned "
                 "away?",
                 l, r->problem->light->pose[l].name);
    }
done:
    return status;
}

/* Times the radius of the scene: beyond, single precision has no place for points of the light. */
static const double far_most = 1000;

static lam_status check_places(const mesh *m, const moving_light *l, lam_error *error) {
    lam_status status = LAM_OK;
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    for (size_t p = 0; p < l->n; p++)
        for (size_t k = 0; k < l->n_corners; k++) {
            double at[3], to[3];
            light_pose_point(&l->pose[p], l->corner[k], at);
            subtract3(at, centre, to);
            const double away = sqrt(dot3(to, to));
            if (!(away <= far_most * radius))
                FAIL(error, LAM_ERR_ARGUMENT,
                     "position %zu (%s): corner %zu of the light is %.3g m from the middle of the scene, "
                     "must be "
                     "within %.3g m",
                     p, l->pose[p].name, k, away, far_most * radius);
        }
done:
    return status;
}

lam_status walk_reuse(const walk_scene *s, const reuse_problem *problem, reuse_estimates *out,
                      lam_error *error) {
    lam_status status = LAM_OK;
    const moving_light *light = problem->light;
    reuse_estimates e = {.n = s->m->n, .n_channels = s->m->n_channels, .n_positions = light->n};
    light_maps maps = {.side = 0};
    reuse r = {.scene = s, .problem = problem, .n = e.n, .C = e.n_channels, .s = e.n_positions};
    size_t rows, size;
    if (problem->paths == 0 || light->n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu paths of %zu positions: must be at least 1", problem->paths,
             light->n);
    TRY(check_places(s->m, light, error));
    e.paths = ((problem->paths - 1) / WALK_BATCHES + 1) * WALK_BATCHES;
    const size_t of_batch = e.paths / WALK_BATCHES;
    if (!size_multiply(e.n_channels, e.n_positions, &rows) || !size_multiply(rows, e.n, &size))
        FAIL(error, LAM_ERR_MEMORY, "paths: too many positions");
    e.H = memory_allocate(size, sizeof *e.H, "paths", error);
    e.error = memory_allocate(size, sizeof *e.error, "paths", error);
    e.direct = memory_allocate(e.n_positions, e.n * sizeof *e.direct, "paths", error);
    const size_t by_group = reuse_sums_groups(s->m, e.n_positions);
    if (by_group > 0) {
        e.of_groups = memory_allocate(by_group, sizeof *e.of_groups, "paths", error);
        e.of_means = memory_allocate(by_group, sizeof *e.of_means, "paths", error);
        if (e.of_groups == NULL || e.of_means == NULL) TRY(LAM_ERR_MEMORY);
    }
    e.covariance = memory_allocate(e.n_positions, e.n_positions * sizeof *e.covariance, "paths", error);
    r.frames = memory_allocate(e.n_positions, sizeof *r.frames, "paths", error);
    r.of_batch = memory_allocate(e.n_positions, sizeof *r.of_batch, "paths", error);
    e.count = memory_allocate(e.n_positions, sizeof *e.count, "paths", error);
    if (e.H == NULL || e.error == NULL || e.direct == NULL || e.covariance == NULL || r.frames == NULL ||
        r.of_batch == NULL || e.count == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t l = 0; l < e.n_positions; l++) light_frame_set(s->v, light, &light->pose[l], &r.frames[l]);
    set_counts(&r, of_batch, NULL);
    TRY(light_pieces_create(light, r.frames, &r.pieces, error));
    walk_run run = {.log = problem->log,
                    .progress = problem->progress,
                    .stage = problem->stage,
                    .all = (double)e.paths * (double)e.n_positions};
    r.run = &run;
    if (problem->way == REUSE_MAPS || problem->way == REUSE_CUBES) {
        const double begun = clock_processor_seconds();
        if (problem->resolution < 2)
            FAIL(error, LAM_ERR_ARGUMENT, "maps of %zu cells a side: must be at least 2",
                 problem->resolution);
        TRY(light_maps_create(s, e.n_positions, r.frames, &r.pieces, problem->way, problem->resolution,
                              light_maps_split(s, light, &r.pieces), &maps, error));
        e.maps_seconds = clock_processor_seconds() - begun;
        r.maps = &maps;
    }
    if (problem->even && problem->way != REUSE_NONE && problem->way != REUSE_ELEMENTS)
        TRY(count_paths(&r, of_batch, error));
    for (size_t l = 0; l < r.s; l++) e.count[l] = r.of_batch[l] * WALK_BATCHES;
    if (problem->way == REUSE_ELEMENTS)
        TRY(reuse_elements(s, problem, &e, error));
    else if (problem->way == REUSE_NONE)
        TRY(reuse_alone(s, problem, &r.pieces, &run, &e, error));
    else
        TRY(run_batches(&r, &e, error));
    TRY(check_reach(&r, &e, error));
    *out = e;
    e = (reuse_estimates){.n = 0};
done:
    free(r.frames);
    free(r.of_batch);
    light_pieces_free(&r.pieces);
    light_maps_free(&maps);
    reuse_estimates_free(&e);
    return status;
}
