#include "solver/walk/direct_light.h"

#include "solver/base/parallel_reported.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/walk/spherical_triangle.h"
#include "solver/walk/walk_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A light is nearer than what is hit at this part of the distance to it, or behind. */
static const float near_part = 1e-4f;

/* Samples of an element and a position: of the pilot, which are not used again, and at least; at least of
 * lights that are near, of which a pilot may miss a sliver that shines on the element; at most. */
enum { PILOT = 16, NEAR_LEAST = 256, MOST = 1 << 17 };

/* The spread of samples over the mean without anything in between that is assumed at least: few may have
 * missed what varies, or the only gap that light comes through. */
static const double least_spread = .05;

/* Elements between two looks at the progress. */
enum { ELEMENTS_AT_ONCE = 64 };

/* Lights nearer than this many times their size are sampled by solid angle. */
static const double near_sizes = 3;

/* One position: its corners in metres, its front, what lifts points off a face that it lies in, and the
 * sphere around it. */
typedef struct placed_light {
    double (*corner)[3]; /* [n_corners] */
    double normal[3], lift[3], centre[3], radius;
} placed_light;

typedef struct direct_run {
    const walk_scene *scene;
    const direct_light_problem *problem;
    placed_light *placed; /* [s] */
    double *corners;      /* of all of them */
    const double *all;    /* [s]: see share_samples; NULL: in the pilot */
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

/* True if 1 / r^2 may vary much between points of the element and of the light. */
static bool is_near(const direct_run *r, size_t element, const placed_light *p) {
    const mesh *m = r->scene->m;
    double least = INFINITY, radius = 0, centroid[3];
    mesh_centroid(m, element, centroid);
    for (size_t k = 0; k < mesh_corners(m, element); k++) {
        double to[3];
        subtract3(m->vertices[m->elements[element][k]], centroid, to);
        radius = fmax(radius, sqrt(dot3(to, to)));
    }
    double to[3];
    subtract3(p->centre, centroid, to);
    least = sqrt(dot3(to, to)) - radius;
    return least < near_sizes * p->radius;
}

/* The way from y (metres) to the light, uniform in solid angle; returns cos times that angle over the area of
 * the light, in place of cos cos / r^2 of a point that is uniform in area. */
static double aim(const direct_run *r, const placed_light *p, const float *normal, const double y[3],
                  double u, double w, double way[3]) {
    const size_t triangles = r->problem->light->n_corners - 2;
    double all = 0, to[3], direction[3];
    spherical_triangle t = {.solid_angle = 0};
    subtract3(y, p->corner[0], to);
    const double above = dot3(to, p->normal); /* of y over the light */
    memset(way, 0, 3 * sizeof *way);
    if (!(above > 0)) return 0;
    for (size_t k = 0; k < triangles; k++) {
        spherical_triangle_set(y, p->corner[0], p->corner[k + 1], p->corner[k + 2], &t);
        all += t.solid_angle;
    }
    double left = u * all;
    for (size_t k = 0; k < triangles; k++) {
        spherical_triangle_set(y, p->corner[0], p->corner[k + 1], p->corner[k + 2], &t);
        if (left < t.solid_angle) break;
        left -= t.solid_angle;
    }
    if (!(t.solid_angle > 0)) return 0;
    spherical_triangle_direction(&t, fmin(left / t.solid_angle, 1), w, direction);
    const double towards = -dot3(direction, p->normal);
    if (!(towards > 0)) return 0;
    for (int d = 0; d < 3; d++) way[d] = above / towards * direction[d];
    const double cosine = (double)normal[0] * direction[0] + (double)normal[1] * direction[1] +
                          (double)normal[2] * direction[2];
    return cosine > 0 ? cosine * all / r->problem->light->area : 0;
}

/* The way from y (recentred) to the point of the light at (u, w); returns cos cos / r^2. */
static float reach(const direct_run *r, size_t position, const float *normal, const float y[3], double u,
                   double w, float way[3]) {
    const placed_light *p = &r->placed[position];
    double local[3], at[3];
    float x[3], cos_element = 0, cos_light = 0, square = 0;
    moving_light_point(r->problem->light, u, w, local);
    light_pose_point(&r->problem->light->pose[position], local, at);
    for (int d = 0; d < 3; d++) at[d] += p->lift[d];
    visibility_recentre(r->scene->v, at, x);
    for (int d = 0; d < 3; d++) {
        way[d] = x[d] - y[d];
        cos_element += normal[d] * way[d];
        cos_light -= (float)p->normal[d] * way[d];
        square += way[d] * way[d];
    }
    return cos_element > 0 && cos_light > 0 && square > 0 ? cos_element * cos_light / (square * square) : 0;
}

/* Sums of cos cos V / r^2, of its square, and of cos cos / r^2. */
typedef struct light_sums {
    double seen, squares, open;
} light_sums;

/* Adds a packet of points of the element and of the light. */
static void shine(const direct_run *r, const element_sampler *sampler, size_t element, size_t position,
                  bool near, double place[4][VISIBILITY_PACKET], light_sums *sums) {
    const visibility *v = r->scene->v;
    const placed_light *p = &r->placed[position];
    const float *normal = r->scene->m->normal[element];
    const double *centre = visibility_centre(v);
    float kernel[VISIBILITY_PACKET], length[VISIBILITY_PACKET];
    uint32_t self[VISIBILITY_PACKET];
    ray_packet rays;
    hit_packet hits;
    bool any = false;
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        float y[3], way[3];
        element_sampler_point(sampler, (float)place[0][k], (float)place[1][k], y);
        if (near) {
            double at[3], there[3];
            for (int d = 0; d < 3; d++) at[d] = (double)y[d] + centre[d];
            kernel[k] = (float)aim(r, p, normal, at, place[2][k], place[3][k], there);
            for (int d = 0; d < 3; d++) way[d] = (float)there[d];
        } else {
            kernel[k] = reach(r, position, normal, y, place[2][k], place[3][k], way);
        }
        for (int d = 0; d < 3; d++) {
            rays.origin[d][k] = y[d];
            rays.direction[d][k] = way[d];
        }
        length[k] = sqrtf(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
        self[k] = (uint32_t)element;
        any = any || kernel[k] > 0;
    }
    if (!any) return;
    const float rounding = (float)visibility_rounding(v);
    visibility_cast(v, &rays, VISIBILITY_PACKET, self, VISIBILITY_TOGETHER, &hits);
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        const bool free = hits.element[k] == VISIBILITY_NOTHING ||
                          hits.distance[k] > 1 - near_part - 4 * rounding / length[k];
        sums->open += (double)kernel[k];
        if (!free) continue;
        sums->seen += (double)kernel[k];
        sums->squares += (double)kernel[k] * (double)kernel[k];
    }
}

/* Samples of a half for element i and position l: those of equal size in the pilot, later as many as lower
 * the errors of all positions most (Neyman 1934): by the root of A_i times the variance that the pilot found.
 */
static size_t half_for(const direct_run *r, size_t i, size_t l, bool near, double variance) {
    if (r->all == NULL) return PILOT / 2;
    const double wanted = .5 * (double)(r->problem->samples * r->scene->m->n) *
                          sqrt(r->scene->m->area[i] * variance) / fmax(r->all[l], 1e-300);
    size_t half = (near ? NEAR_LEAST : PILOT) / 2;
    while (half < MOST / 2 && (double)half < wanted) half *= 2;
    return half;
}

/* Of the pilot, variance is that of single samples; later it is that of F. Samples of the two are apart. */
static void light_element(const direct_run *r, size_t element, float *F, float *variance) {
    const direct_light_problem *problem = r->problem;
    const size_t s = problem->light->n;
    element_sampler sampler;
    element_sampler_init(&sampler, r->scene->m, r->scene->v, element, problem->seed);
    for (size_t l = 0; l < s; l++) {
        if (faces_away(r, element, &r->placed[l])) {
            F[l] = variance[l] = 0;
            continue;
        }
        const bool near = is_near(r, element, &r->placed[l]);
        const size_t half = half_for(r, element, l, near, (double)variance[l]);
        const double scale = problem->light->area * M_1_PI / (double)half;
        light_sums sums[2] = {{.seen = 0}, {.seen = 0}};
        for (uint64_t h = 0; h < 2; h++) {
            pair_sampler places;
            pair_sampler_init(&places, problem->seed + 2 * (r->all == NULL) + h, element, l);
            for (uint32_t k = 0; k < half; k += VISIBILITY_PACKET) {
                double place[4][VISIBILITY_PACKET];
                pair_sampler_packet(&places, k, place);
                shine(r, &sampler, element, l, near, place, &sums[h]);
            }
        }
        const double mean = scale * (sums[0].seen + sums[1].seen) / 2,
                     difference = scale * (sums[0].seen - sums[1].seen) / 2,
                     least = least_spread * scale * (sums[0].open + sums[1].open) / 2;
        const double of_one =
            scale * scale * (double)half * (sums[0].squares + sums[1].squares) / 2 - mean * mean;
        F[l] = (float)mean;
        variance[l] = (float)(r->all == NULL ? fmax(of_one, least * least) : difference * difference);
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
        memset(p->centre, 0, sizeof p->centre);
        p->radius = 0;
        for (int d = 0; d < 3; d++) p->lift[d] = off * p->normal[d];
        for (size_t k = 0; k < n; k++) {
            light_pose_point(&light->pose[l], light->corner[k], p->corner[k]);
            for (int d = 0; d < 3; d++) p->corner[k][d] += p->lift[d];
            for (int d = 0; d < 3; d++) p->centre[d] += p->corner[k][d] / (double)n;
        }
        for (size_t k = 0; k < n; k++) {
            double to[3];
            subtract3(p->corner[k], p->centre, to);
            p->radius = fmax(p->radius, sqrt(dot3(to, to)));
        }
    }
    return LAM_OK;
}

/* Light of elements, and where it goes. */
typedef struct direct_result {
    const direct_run *run;
    float *F, *variance;
} direct_result;

static void light_some(const void *of, size_t first, size_t last) {
    const direct_result *to = of;
    const size_t positions = to->run->problem->light->n;
    for (size_t i = first; i < last; i++)
        light_element(to->run, i, to->F + i * positions, to->variance + i * positions);
}

/* All elements once. */
static lam_status light_all(const direct_run *r, float *F, float *variance, lam_error *error) {
    const bool is_first = r->all == NULL;
    const direct_result to = {.run = r, .F = F, .variance = variance};
    const reported_loop loop = {.progress = r->problem->progress,
                                .stage = r->problem->stage,
                                .before = is_first ? 0 : .25,
                                .part = is_first ? .25 : .75};
    return parallel_reported(&loop, r->scene->m->n, ELEMENTS_AT_ONCE, light_some, &to, error);
}

/* all [s]: with N_l = |F_l| the squared errors over N_l^2 of all positions are least in sum if a position's
 * element has the mean number of samples times n (A v)^1/2 / all_l, where
 *     all_l = N_l / s sum_l' (1 / N_l') sum_i (A_i v_il')^1/2. */
static lam_status share_samples(const direct_run *r, const float *F, const float *variance, double *all,
                                lam_error *error) {
    const double *area = r->scene->m->area;
    const size_t n = r->scene->m->n, s = r->problem->light->n;
    double *norm = memory_allocate(s, sizeof *norm, "positions", error), sum = 0;
    if (norm == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n * s; k++) {
        all[k % s] += sqrt(area[k / s] * (double)variance[k]);
        norm[k % s] += area[k / s] * (double)F[k] * (double)F[k];
    }
    for (size_t l = 0; l < s; l++)
        if (norm[l] > 0) sum += all[l] / sqrt(norm[l]);
    for (size_t l = 0; l < s; l++) all[l] = sqrt(norm[l]) * sum / (double)s;
    free(norm);
    return LAM_OK;
}

lam_status walk_direct_light(const walk_scene *s, const direct_light_problem *problem, float *F,
                             float *variance, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t positions = problem->light->n;
    direct_run r = {.scene = s, .problem = problem};
    double *all = memory_allocate(positions, sizeof *all, "positions", error);
    if (all == NULL) TRY(LAM_ERR_MEMORY);
    TRY(place_lights(&r, error));
    TRY(light_all(&r, F, variance, error));
    TRY(share_samples(&r, F, variance, all, error));
    r.all = all;
    TRY(light_all(&r, F, variance, error));
done:
    free(all);
    free(r.placed);
    free(r.corners);
    return status;
}
