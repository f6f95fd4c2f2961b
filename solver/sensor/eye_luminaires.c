#include "solver/sensor/eye_luminaires.h"

#include "solver/base/vector3.h"
#include "solver/direct/placed_source.h"
#include "solver/sensor/point_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cells of an opening that nothing hides, by which those of its beams are weighed. */
enum { CELLS = 16 };

typedef struct sight_job {
    const mesh *m;
    const placed_luminaires *placed;
    const direct_options *options;
    size_t n_eyes;
    const direct_point *points; /* [n_eyes] */
    const double (*view)[3];    /* [n_eyes] */
    glare_source *seen;
} sight_job;

lam_status eyes_find(const sensor_list *l, size_t *n_eyes, uint32_t **out, lam_error *error) {
    size_t n = 0;
    for (size_t k = 0; k < l->n_sets; k++)
        if (l->sets[k].kind == SENSOR_EYES) n += l->sets[k].count;
    uint32_t *eyes = memory_allocate(n, sizeof *eyes, "eyes", error);
    if (eyes == NULL) return LAM_ERR_MEMORY;
    *n_eyes = n;
    *out = eyes;
    for (size_t k = 0; k < l->n_sets; k++)
        for (size_t i = 0; l->sets[k].kind == SENSOR_EYES && i < l->sets[k].count; i++)
            *eyes++ = (uint32_t)(l->sets[k].first + i);
    return LAM_OK;
}

/* The light across the way to all of the opening, lx, if nothing hides it. */
static double whole_light(const placed_source *source, const double own[3], opening_cell *cells) {
    const size_t n = opening_cells(&source->opening, own, CELLS, OPENING_CELLS, cells);
    double towards[3], sum = 0;
    for (size_t k = 0; k < n; k++) sum += placed_source_normal(source, &cells[k], own, towards);
    return sum;
}

/* Intensity, projected area, distance and position. */
static void set_source(const sight_job *job, const placed_source *source, size_t eye, const double own[3],
                       glare_source *out) {
    static const char axes[] = "xyz";
    const direct_point *point = &job->points[eye];
    const double r = sqrt(dot3(own, own));
    double to_eye[3], towards[3], up[3];
    if (!(r > 0)) return;
    subtract3(source->at, point->at, towards);
    for (int d = 0; d < 3; d++) {
        to_eye[d] = own[d] / r;
        towards[d] /= r;
        up[d] = job->m->up == axes[d];
    }
    out->intensity = placed_source_intensity(source, to_eye);
    out->area = opening_projected(&source->opening, to_eye);
    out->distance = r;
    out->position = glare_position(job->view[eye], up, towards);
}

/* seen = sum e t^2 / sum e over all cells, of the light e of a cell that nothing hides and what is passed of
 * it, t: a luminance behind a pane is t of its own, and glare goes with its square. */
static void see(void *context, size_t row, size_t eye, size_t n, const direct_beam *beams) {
    const sight_job *job = context;
    const size_t k = job->options->wanted != NULL ? job->options->wanted[row] : row;
    glare_source *out = &job->seen[row * job->n_eyes + eye];
    opening_cell cells[OPENING_CELLS];
    placed_source source;
    double own[3], sum = 0;
    *out = (glare_source){.seen = 0};
    placed_source_set(job->placed, &job->placed->luminaires[k], job->m->up, &source);
    placed_source_inwards(&source, job->points[eye].at, own);
    set_source(job, &source, eye, own, out);
    const double whole = whole_light(&source, own, cells);
    for (size_t i = 0; i < n; i++) sum += beams[i].irradiance * beams[i].passed;
    if (whole > 0) out->seen = fmin(sum / whole, 1);
}

lam_status eye_luminaires_make(const mesh *m, const placed_luminaires *p, const direct_options *o,
                               const receiver *receivers, size_t n_eyes, const uint32_t *eyes,
                               glare_source *seen, lam_error *error) {
    static const char what[] = "luminaires that eyes see";
    lam_status status = LAM_OK;
    point_scene scene = {.m = m};
    visibility *v = NULL;
    direct_point *points = memory_allocate(n_eyes, sizeof *points, what, error);
    double(*view)[3] = memory_allocate(n_eyes, sizeof *view, what, error);
    if (points == NULL || view == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
    TRY(point_balls_make(m, &scene.ball, error));
    scene.v = v;
    for (size_t k = 0; k < n_eyes; k++) {
        point_place place;
        point_place_set(&scene, &receivers[eyes[k]], eyes[k], &place);
        points[k].element = DIRECT_OPEN;
        memcpy(points[k].at, place.r.at, sizeof points[k].at);
        memcpy(view[k], place.r.axis, sizeof view[k]);
    }
    sight_job job = {.m = m,
                     .placed = p,
                     .options = o,
                     .n_eyes = n_eyes,
                     .points = points,
                     .view = (const double(*)[3])view,
                     .seen = seen};
    TRY(direct_points_visit(m, p, o, n_eyes, points, see, &job, error));
done:
    visibility_destroy(v);
    free(scene.ball);
    free(points);
    free(view);
    return status;
}
