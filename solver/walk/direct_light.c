#include "solver/walk/direct_light.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A light is nearer than what is hit at this part of the distance to it, or behind. */
static const float near_part = 1e-4f;

/* Elements between two looks at the progress. */
enum { ELEMENTS_AT_ONCE = 64 };

/* One position: its corners in metres, its front, and what lifts points off a face that it lies in. */
typedef struct placed_light {
    double (*corner)[3]; /* [n_corners] */
    double normal[3], lift[3];
} placed_light;

typedef struct direct_run {
    const walk_scene *scene;
    const direct_light_problem *problem;
    placed_light *placed; /* [s] */
    double *corners;      /* of all of them */
} direct_run;

/* True if no point of the element sees the front of the light, by their corners. */
static bool faces_away(const direct_run *r, size_t element, const placed_light *p) {
    const mesh *m = r->scene->m;
    const size_t n_corners = r->problem->light->n_corners, own = mesh_corners(m, element);
    const float *normal = m->normal[element];
    const double *at = m->vertices[m->elements[element][0]];
    bool above = false, before = false;
    for (size_t k = 0; k < n_corners && !above; k++) {
        double to[3];
        subtract3(p->corner[k], at, to);
        above = (double)normal[0] * to[0] + (double)normal[1] * to[1] + (double)normal[2] * to[2] > 0;
    }
    for (size_t k = 0; k < own && !before; k++) {
        double to[3];
        subtract3(m->vertices[m->elements[element][k]], p->corner[0], to);
        before = dot3(to, p->normal) > 0;
    }
    return !above || !before;
}

/* Sum over the packet of cos cos V / r^2 for points of the element and of the light. */
static double shine(const direct_run *r, const element_sampler *sampler, size_t element, size_t position,
                    double place[4][VISIBILITY_PACKET]) {
    const visibility *v = r->scene->v;
    const moving_light *light = r->problem->light;
    const placed_light *p = &r->placed[position];
    const float *normal = r->scene->m->normal[element];
    float kernel[VISIBILITY_PACKET], length[VISIBILITY_PACKET];
    uint32_t self[VISIBILITY_PACKET];
    ray_packet rays;
    hit_packet hits;
    double sum = 0;
    bool any = false;
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        double local[3], at[3];
        float y[3], x[3], cos_element = 0, cos_light = 0, square = 0;
        element_sampler_point(sampler, (float)place[0][k], (float)place[1][k], y);
        moving_light_point(light, place[2][k], place[3][k], local);
        light_pose_point(&light->pose[position], local, at);
        for (int d = 0; d < 3; d++) at[d] += p->lift[d];
        visibility_recentre(v, at, x);
        for (int d = 0; d < 3; d++) {
            const float to = x[d] - y[d];
            rays.origin[d][k] = y[d];
            rays.direction[d][k] = to;
            cos_element += normal[d] * to;
            cos_light -= (float)p->normal[d] * to;
            square += to * to;
        }
        const bool open = cos_element > 0 && cos_light > 0 && square > 0;
        kernel[k] = open ? cos_element * cos_light / (square * square) : 0;
        length[k] = sqrtf(square);
        self[k] = (uint32_t)element;
        any = any || open;
    }
    if (!any) return 0;
    const float rounding = (float)visibility_rounding(v);
    visibility_cast(v, &rays, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        const bool free = hits.element[k] == VISIBILITY_NOTHING ||
                          hits.distance[k] > 1 - near_part - 4 * rounding / length[k];
        if (free) sum += (double)kernel[k];
    }
    return sum;
}

static void light_element(const direct_run *r, size_t element, float *F, float *variance) {
    const direct_light_problem *problem = r->problem;
    const size_t s = problem->light->n, half = problem->samples / 2;
    const double scale = problem->light->area * M_1_PI / (double)half;
    element_sampler sampler;
    element_sampler_init(&sampler, r->scene->m, r->scene->v, element, problem->seed);
    for (size_t l = 0; l < s; l++) {
        double sums[2] = {0, 0};
        F[l] = variance[l] = 0;
        if (faces_away(r, element, &r->placed[l])) continue;
        for (uint64_t h = 0; h < 2; h++) {
            pair_sampler places;
            pair_sampler_init(&places, problem->seed + h, element, l);
            for (uint32_t k = 0; k < half; k += VISIBILITY_PACKET) {
                double place[4][VISIBILITY_PACKET];
                pair_sampler_packet(&places, k, place);
                sums[h] += shine(r, &sampler, element, l, place);
            }
        }
        const double difference = scale * (sums[0] - sums[1]) / 2;
        F[l] = (float)(scale * (sums[0] + sums[1]) / 2);
        variance[l] = (float)(difference * difference);
    }
}

static lam_status place_lights(direct_run *r, lam_error *error) {
    const moving_light *light = r->problem->light;
    const size_t n = light->n_corners;
    const double off = 4 * visibility_rounding(r->scene->v);
    r->placed = memory_allocate(light->n, sizeof *r->placed, "positions", error);
    r->corners = memory_allocate(light->n, 3 * n * sizeof *r->corners, "positions", error);
    if (r->placed == NULL || r->corners == NULL) return LAM_ERR_MEMORY;
    for (size_t l = 0; l < light->n; l++) {
        placed_light *p = &r->placed[l];
        p->corner = (double(*)[3])(void *)(r->corners + 3 * n * l);
        light_pose_direction(&light->pose[l], light->normal, p->normal);
        for (int d = 0; d < 3; d++) p->lift[d] = off * p->normal[d];
        for (size_t k = 0; k < n; k++) {
            light_pose_point(&light->pose[l], light->corner[k], p->corner[k]);
            for (int d = 0; d < 3; d++) p->corner[k][d] += p->lift[d];
        }
    }
    return LAM_OK;
}

lam_status walk_direct_light(const walk_scene *s, const direct_light_problem *problem, float *F,
                             float *variance, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m->n, positions = problem->light->n;
    direct_run r = {.scene = s, .problem = problem};
    size_t done = 0;
    bool stop = false;
    TRY(place_lights(&r, error));
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t first = 0; first < n; first += ELEMENTS_AT_ONCE) {
        bool skip;
#pragma omp atomic read
        skip = stop;
        if (skip) continue;
        const size_t last = first + ELEMENTS_AT_ONCE < n ? first + ELEMENTS_AT_ONCE : n;
        for (size_t i = first; i < last; i++)
            light_element(&r, i, F + i * positions, variance + i * positions);
#pragma omp critical(direct_progress)
        {
            done += last - first;
            progress_report(problem->progress, problem->stage, (double)done / (double)n);
            if (progress_cancelled(problem->progress)) {
#pragma omp atomic write
                stop = true;
            }
        }
    }
    if (stop) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
done:
    free(r.placed);
    free(r.corners);
    return status;
}
