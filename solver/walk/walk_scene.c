/* The scene of walks, and the checks and memory that both ways to walk share. */
#include "solver/base/clock.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/visibility/openings.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>

/* Rays that decide whether a scene is closed, in parts that do not depend on the number of threads; of the
 * lost ones of each part and kind so many are followed. */
enum { PARTS = 64, RAYS_OF_PART = 4096, FOLLOWED = 4 };

/* Lost rays of a kind that were followed, and those of them that passed openings. */
typedef struct followed {
    size_t all, openings;
} followed;

static void follow_lost(const walk_scene *s, const double *before, double width, size_t part,
                        followed *leaving, followed *backs) {
    walk_starts starts;
    walk_starts_init(&starts, 0, part, RAYS_OF_PART);
    for (size_t begun = 0; begun < RAYS_OF_PART && (leaving->all < FOLLOWED || backs->all < FOLLOWED);
         begun += VISIBILITY_PACKET) {
        walk_stream w;
        hit_packet hits;
        ray_packet rays;
        size_t k = 0;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            walker one = {.weight = {0}};
            walk_starts_next(&starts, before, s->m->n, &one, &k);
            one.at = (uint32_t)k;
            walk_stream_set(&w, i, &one);
        }
        walk_cast(s, &w, VISIBILITY_PACKET, &rays, &hits);
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            const bool left = hits.element[i] == VISIBILITY_NOTHING;
            followed *to = left ? leaving : backs;
            if ((!left && !hits.back[i]) || to->all == FOLLOWED) continue;
            const float origin[3] = {rays.origin[0][i], rays.origin[1][i], rays.origin[2][i]};
            const float direction[3] = {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
            to->all++;
            to->openings += !openings_is_crack(s->v, s->m, width, origin, direction, w.at[i]);
        }
    }
}

/* Sets closed and fronts by rays, spread by area, that leave and that hit backs. */
static lam_status look_around(walk_scene *s, scene_closure closure, lam_error *error) {
    const size_t n = s->m->n;
    const double width = openings_crack_width(s->m);
    followed of[PARTS][2] = {{{0, 0}, {0, 0}}}, sums[2] = {{0, 0}, {0, 0}};
    double *before = memory_allocate(n + 1, sizeof *before, "walks", error);
    double *area = memory_allocate(n, sizeof *area, "walks", error);
    if (before == NULL || area == NULL) {
        free(before);
        free(area);
        return LAM_ERR_MEMORY;
    }
    for (size_t i = 0; i < n; i++)
        area[i] = mesh_is_buried(s->m, i) || mesh_is_pane(s->m, i) ? 0 : s->m->area[i];
    walk_accumulate(n, area, before);
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t part = 0; part < PARTS; part++)
        follow_lost(s, before, width, part, &of[part][0], &of[part][1]);
    for (size_t part = 0; part < PARTS; part++)
        for (int kind = 0; kind < 2; kind++) {
            sums[kind].all += of[part][kind].all;
            sums[kind].openings += of[part][kind].openings;
        }
    s->closed = (double)sums[0].openings <= LEAVING_OPEN * (double)sums[0].all;
    s->fronts = (double)sums[1].openings <= LEAVING_OPEN * (double)sums[1].all;
    /* A ray that leaves may have passed a pane: it is not cast again, whatever closure says. */
    if (closure == CLOSURE_OPEN) s->closed = false;
    if (closure == CLOSURE_CLOSED && s->m->glass == NULL) s->closed = true;
    free(before);
    free(area);
    return LAM_OK;
}

lam_status walk_scene_create(const mesh *m, scene_closure closure, walk_scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    walk_scene *s = memory_allocate(1, sizeof *s, "walks", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->m = m;
    TRY(visibility_create(m, &s->v, error));
    TRY(walk_shapes_create(s, error));
    TRY(look_around(s, closure, error));
    *out = s;
    s = NULL;
done:
    walk_scene_free(s);
    return status;
}

void walk_scene_free(walk_scene *s) {
    if (s == NULL) return;
    visibility_destroy(s->v);
    free(s->shapes);
    free(s->share);
    free(s->reflectance);
    free(s);
}

void walk_log_add(walk_log *log, size_t n_packets, const ray_packet *rays) {
    if (log == NULL || log->count == log->capacity) return;
#pragma omp critical(walk_log)
    for (size_t k = 0; k < n_packets && log->count < log->capacity; k++) log->packets[log->count++] = rays[k];
}

lam_status walk_log_bare_seconds(const walk_scene *s, const walk_log *log, double *seconds,
                                 lam_error *error) {
    double wall;
    const double begun = clock_processor_seconds();
    const lam_status status =
        visibility_bare_seconds(s->v, log->packets, NULL, log->count, &wall, NULL, error);
    *seconds = clock_processor_seconds() - begun;
    return status;
}

void walk_estimates_free(walk_estimates *e) {
    free(e->mean);
    free(e->error);
    free(e->largest);
    free(e->visits);
    *e = (walk_estimates){.n_rhs = 0};
}

static lam_status check(const mesh *m, const walk_problem *p, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t count = m->n_channels * m->n;
    if (p->walks == 0) FAIL(error, LAM_ERR_ARGUMENT, "0 walks: must be at least 1");
    for (size_t r = 0; r < p->n_rhs; r++)
        for (size_t i = 0; i < count; i++) {
            const double value = (double)p->E[r * count + i];
            if (!(value >= 0 && isfinite(value)))
                FAIL(error, LAM_ERR_ARGUMENT, "emission[%zu][%zu] = %g, must be at least 0", r, i % m->n,
                     value);
        }
    for (size_t i = 0; i < m->n; i++)
        if (p->target[i] != WALK_NO_TARGET && p->target[i] >= p->n_targets)
            FAIL(error, LAM_ERR_ARGUMENT, "target[%zu] = %u, must be below %zu", i, p->target[i],
                 p->n_targets);
done:
    return status;
}

lam_status walk_estimates_create(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    const size_t channels = s->m->n_channels, targets = problem->n_targets;
    size_t visited, count;
    walk_estimates e = {.n_rhs = problem->n_rhs, .n_channels = channels, .n_targets = targets};
    TRY(check(s->m, problem, error));
    if (!size_multiply(problem->n_rhs, targets, &visited) || !size_multiply(visited, channels, &count))
        FAIL(error, LAM_ERR_MEMORY, "walks: too many estimates");
    e.walks = ((problem->walks - 1) / WALK_BATCHES + 1) * WALK_BATCHES;
    e.mean = memory_allocate(count, sizeof *e.mean, "estimates by walks", error);
    e.error = memory_allocate(count, sizeof *e.error, "estimates by walks", error);
    e.largest = memory_allocate(count, sizeof *e.largest, "estimates by walks", error);
    e.visits = memory_allocate(visited, sizeof *e.visits, "estimates by walks", error);
    if (e.mean == NULL || e.error == NULL || e.largest == NULL || e.visits == NULL) TRY(LAM_ERR_MEMORY);
    *out = e;
    e = (walk_estimates){.n_rhs = 0};
done:
    walk_estimates_free(&e);
    return status;
}

void walk_add_emission(const mesh *m, const walk_problem *problem, walk_estimates *e) {
    const size_t targets = e->n_targets, rows = e->n_rhs * e->n_channels;
    if (problem->quantity != LAM_RADIOSITY) return;
    for (size_t t = 0; t < targets; t++) {
        double area = 0;
        for (size_t i = 0; i < m->n; i++) area += problem->target[i] == t ? m->area[i] : 0;
        for (size_t row = 0; row < rows && area > 0; row++) {
            double power = 0;
            for (size_t i = 0; i < m->n; i++)
                if (problem->target[i] == t) power += m->area[i] * (double)problem->E[row * m->n + i];
            e->mean[row * targets + t] += power / area;
        }
    }
}
