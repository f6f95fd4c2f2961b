#include "solver/sensor/sensor_luminaires.h"

#include "solver/direct/placed_source.h"
#include "solver/sensor/point_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The nine receivers of a probe are one point. */
typedef struct light_job {
    size_t n;
    const receiver *receivers;
    const size_t *first; /* [points], the receiver of each, or the first one of a probe */
    float *H;
} light_job;

/* sum irradiance weight(direction) */
static void add_light(void *context, size_t row, size_t point, size_t n, const direct_beam *beams) {
    const light_job *job = context;
    const receiver *r = &job->receivers[job->first[point]];
    const size_t rows = r->kind >= RECEIVER_HARMONIC ? HARMONICS : 1;
    double sum[HARMONICS] = {0}, density[HARMONICS];
    for (size_t k = 0; k < n; k++) {
        if (rows > 1)
            receiver_densities(r, beams[k].direction, density);
        else
            density[0] = receiver_density(r, beams[k].direction);
        for (size_t w = 0; w < rows; w++) sum[w] += beams[k].irradiance * M_PI * density[w];
    }
    for (size_t w = 0; w < rows; w++) job->H[row * job->n + job->first[point] + w] = (float)sum[w];
}

static void find_inside(const mesh *m, const placed_luminaires *p, size_t n, const receiver *receivers,
                        bool *inside) {
    for (size_t l = 0; l < p->n; l++) {
        placed_source source;
        placed_source_set(p, &p->luminaires[l], m->up, &source);
        for (size_t k = 0; k < n; k++) {
            double own[3];
            placed_source_inwards(&source, receivers[k].at, own);
            if (!(opening_distance(&source.opening, own) > 0)) inside[k] = true;
        }
    }
}

lam_status sensor_luminaires_make(const mesh *m, const placed_luminaires *p, const direct_options *o,
                                  size_t n, const receiver *receivers, float *H, bool *inside,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    point_scene scene = {.m = m};
    visibility *v = NULL;
    size_t n_points = 0;
    direct_point *points = memory_allocate(n, sizeof *points, "light of luminaires at sensors", error);
    size_t *first = memory_allocate(n, sizeof *first, "light of luminaires at sensors", error);
    light_job job = {.n = n, .receivers = receivers, .first = first, .H = H};
    if (points == NULL || first == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++)
        if (!receiver_follows(&receivers[k])) first[n_points++] = k;
    TRY(visibility_create(m, &v, error));
    TRY(point_balls_make(m, &scene.ball, error));
    scene.v = v;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t k = 0; k < n_points; k++) {
        point_place place;
        point_place_set(&scene, &receivers[first[k]], first[k], &place);
        points[k].element = DIRECT_OPEN;
        memcpy(points[k].at, place.r.at, sizeof points[k].at);
    }
    TRY(direct_points_visit(m, p, o, n_points, points, add_light, &job, error));
    if (inside != NULL) find_inside(m, p, n, receivers, inside);
done:
    visibility_destroy(v);
    free(scene.ball);
    free(points);
    free(first);
    return status;
}
