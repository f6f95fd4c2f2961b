#include "solver/sensor/sensor_luminaires.h"

#include "solver/direct/placed_source.h"
#include "solver/sensor/point_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct light_job {
    size_t n;
    const receiver *receivers;
    float *H;
} light_job;

/* sum irradiance weight(direction) */
static void add_light(void *context, size_t row, size_t point, size_t n, const direct_beam *beams) {
    const light_job *job = context;
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += beams[k].irradiance * M_PI * receiver_density(&job->receivers[point], beams[k].direction);
    job->H[row * job->n + point] = (float)sum;
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
    light_job job = {.n = n, .receivers = receivers, .H = H};
    direct_point *points = memory_allocate(n, sizeof *points, "light of luminaires at sensors", error);
    if (points == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
    TRY(point_balls_make(m, &scene.ball, error));
    scene.v = v;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t k = 0; k < n; k++) {
        point_place place;
        point_place_set(&scene, &receivers[k], k, &place);
        points[k].element = DIRECT_OPEN;
        memcpy(points[k].at, place.r.at, sizeof points[k].at);
    }
    TRY(direct_points_visit(m, p, o, n, points, add_light, &job, error));
    if (inside != NULL) find_inside(m, p, n, receivers, inside);
done:
    visibility_destroy(v);
    free(scene.ball);
    free(points);
    return status;
}
