#include "solver/direct/direct_points.h"

#include "solver/base/parallel_reported.h"
#include "solver/base/vector3.h"
#include "solver/direct/luminaire_runs.h"

#include <math.h>

/* Points between two looks at the progress; beams of an opening, and of one that is partly hidden. */
enum { POINTS_AT_ONCE = 16, BEAMS = 16, MORE_BEAMS = 256 };

/* Panes pass light by its angle: shares that differ by less are one. */
static const double same_share = .02;

typedef struct points_job {
    const direct_options *options;
    size_t n, n_rows;
    const direct_point *points;
    direct_beam_visitor *visit;
    void *context;
} points_job;

/* The cells and the beams of a point. */
typedef struct beam_room {
    opening_cell cells[OPENING_CELLS];
    direct_beam beams[OPENING_CELLS];
} beam_room;

/* The beams by at least so many cells; *partly: some of them are hidden and others are not. */
static size_t find_beams(const luminaire_run *run, const direct_point *point, size_t least, beam_room *room,
                         bool *partly) {
    const placed_source *source = &run->source;
    double own[3], least_passed = INFINITY, most_passed = -INFINITY;
    float from[3];
    placed_source_inwards(source, point->at, own);
    luminaire_sight_recentre(run->sight, point->at, from);
    const size_t n = opening_cells(&source->opening, own, least, OPENING_CELLS, room->cells);
    size_t count = 0, lane = 0;
    ray_packet segments = {.origin = {{0}}};
    direct_beam waiting[VISIBILITY_PACKET];
    size_t self[VISIBILITY_PACKET];
    for (size_t k = 0; k < n; k++) {
        double towards[3], there[3], passed[VISIBILITY_PACKET];
        float to[3];
        const double light = placed_source_normal(source, &room->cells[k], own, towards);
        if (light > 0) {
            placed_source_outwards(source, room->cells[k].at, there);
            for (int d = 0; d < 3; d++) {
                waiting[lane].direction[d] = towards[0] * source->frame[0][d] +
                                             towards[1] * source->frame[1][d] +
                                             towards[2] * source->frame[2][d];
                there[d] += run->moved[d];
            }
            luminaire_sight_recentre(run->sight, there, to);
            for (int d = 0; d < 3; d++) {
                segments.origin[d][lane] = from[d];
                segments.direction[d][lane] = to[d] - from[d];
            }
            waiting[lane].irradiance = light;
            self[lane++] = point->element;
        }
        if (lane < VISIBILITY_PACKET && k + 1 < n) continue;
        if (lane > 0) luminaire_sight_passed(run->sight, &segments, lane, self, passed);
        for (size_t i = 0; i < lane; i++) {
            least_passed = fmin(least_passed, passed[i]);
            most_passed = fmax(most_passed, passed[i]);
            waiting[i].irradiance *= passed[i];
            waiting[i].passed = passed[i];
            if (passed[i] > 0) room->beams[count++] = waiting[i];
        }
        lane = 0;
    }
    *partly = most_passed - least_passed > same_share;
    return count;
}

/* The points of a luminaire. */
typedef struct points_run {
    const points_job *job;
    const luminaire_run *run;
} points_run;

static void visit_some(const void *of, size_t first, size_t last) {
    const points_run *r = of;
    beam_room room;
    for (size_t point = first; point < last; point++) {
        bool partly;
        size_t count = find_beams(r->run, &r->job->points[point], BEAMS, &room, &partly);
        if (partly) count = find_beams(r->run, &r->job->points[point], MORE_BEAMS, &room, &partly);
        r->job->visit(r->job->context, r->run->row, point, count, room.beams);
    }
}

static lam_status visit_points(void *context, const luminaire_run *run, lam_error *error) {
    const points_job *job = context;
    const points_run points = {.job = job, .run = run};
    const reported_loop loop = {.progress = job->options->progress,
                                .stage = job->options->stage,
                                .before = (double)run->step / (double)job->n_rows,
                                .part = 1 / (double)job->n_rows};
    return parallel_reported(&loop, job->n, POINTS_AT_ONCE, visit_some, &points, error);
}

lam_status direct_points_visit(const mesh *m, const placed_luminaires *p, const direct_options *o, size_t n,
                               const direct_point *points, direct_beam_visitor *visit, void *context,
                               lam_error *error) {
    points_job job = {.options = o,
                      .n = n,
                      .n_rows = o->wanted != NULL ? o->n_wanted : p->n,
                      .points = points,
                      .visit = visit,
                      .context = context};
    return luminaire_runs(m, p, o->n_wanted, o->wanted, visit_points, &job, error);
}

typedef struct irradiance_job {
    size_t n;
    const double (*normals)[3];
    float *E;
} irradiance_job;

/* sum irradiance max(0, n . d) */
static void add_irradiance(void *context, size_t row, size_t point, size_t n, const direct_beam *beams) {
    const irradiance_job *job = context;
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += beams[k].irradiance * fmax(0, dot3(beams[k].direction, job->normals[point]));
    job->E[row * job->n + point] = (float)sum;
}

lam_status direct_points_irradiance(const mesh *m, const placed_luminaires *p, const direct_options *o,
                                    size_t n, const direct_point *points, const double (*normals)[3],
                                    float *E, lam_error *error) {
    irradiance_job job = {.n = n, .normals = normals, .E = E};
    return direct_points_visit(m, p, o, n, points, add_irradiance, &job, error);
}
