#include "tests/bench/suites/mesh_truths.h"

#include "solver/base/vector3.h"
#include "solver/method/reference.h"
#include "solver/scene/mesh_cells.h"
#include "solver/walk/walk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double tolerance = 1e-7;

lam_status mesh_lights(const mesh *m, float **E, size_t *first, lam_error *error) {
    const size_t all = m->n * m->n_channels;
    *E = memory_allocate(MESH_LIGHTS * all, sizeof **E, "lights", error);
    if (*E == NULL) return LAM_ERR_MEMORY;
    memcpy(*E, m->emission, all * sizeof **E);
    *first = 1;
    for (size_t i = 0; i < all; i++) {
        if ((*E)[i] > 0) *first = 0;
        (*E)[all + i] = 1;
    }
    return LAM_OK;
}

void mesh_points_free(mesh_points *p) {
    free(p->place);
    free(p->normal);
    free(p->truth);
    free(p->spread);
    *p = (mesh_points){.n = 0};
}

/* Pieces of the faces per point: each piece is a point for any mesh that the suite measures. */
enum { PIECES = 500 };

/* target[i] of the n pieces in the middles of equal shares of the area; a large piece is taken once. */
static void choose_pieces(const mesh *m, size_t n, uint32_t *target, mesh_points *out) {
    double area = 0, before = 0;
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (size_t i = 0; i < m->n; i++) {
        const double share = area / (double)n;
        const bool taken = floor((before + m->area[i]) / share - .5) > floor(before / share - .5);
        before += m->area[i];
        target[i] = WALK_NO_TARGET;
        if (!taken || out->n == n) continue;
        mesh_centroid(m, i, out->place[out->n]);
        memcpy(out->normal[out->n], m->normal[i], sizeof *out->normal);
        target[i] = (uint32_t)out->n++;
    }
}

/* The walks of all points, into truth and spread. */
static lam_status gather(const bench_run *run, const mesh *m, const uint32_t *target, size_t walks,
                         mesh_points *out, lam_error *error) {
    lam_status status = LAM_OK;
    walk_scene *scene = NULL;
    walk_estimates e = {.n_rhs = 0};
    float *E = NULL;
    size_t first;
    TRY(mesh_lights(m, &E, &first, error));
    TRY(walk_scene_create(m, CLOSURE_MEASURED, &scene, error));
    const walk_problem problem = {.n_rhs = MESH_LIGHTS,
                                  .E = E,
                                  .quantity = LAM_INDIRECT,
                                  .n_targets = out->n,
                                  .target = target,
                                  .walks = walks,
                                  .seed = run->seed,
                                  .progress = run->progress,
                                  .stage = "walks from points"};
    TRY(walk_gather(scene, &problem, &e, error));
    const size_t count = MESH_LIGHTS * m->n_channels * out->n;
    memcpy(out->truth, e.mean, count * sizeof *out->truth);
    memcpy(out->spread, e.error, count * sizeof *out->spread);
done:
    walk_estimates_free(&e);
    walk_scene_free(scene);
    free(E);
    return status;
}

lam_status mesh_points_walk(const bench_run *run, mesh *pieces, size_t n, size_t walks, mesh_points *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const mesh_refinement fine = {.elements = PIECES * n};
    mesh_points p = {.n_channels = pieces->n_channels};
    uint32_t *target = NULL;
    TRY(mesh_refine(pieces, &fine, error));
    const size_t count = MESH_LIGHTS * pieces->n_channels * n;
    target = memory_allocate(pieces->n, sizeof *target, "points", error);
    p.place = memory_allocate(n, sizeof *p.place, "points", error);
    p.normal = memory_allocate(n, sizeof *p.normal, "points", error);
    p.truth = memory_allocate(count, sizeof *p.truth, "points", error);
    p.spread = memory_allocate(count, sizeof *p.spread, "points", error);
    if (target == NULL || p.place == NULL || p.normal == NULL || p.truth == NULL || p.spread == NULL)
        TRY(LAM_ERR_MEMORY);
    choose_pieces(pieces, n, target, &p);
    TRY(gather(run, pieces, target, walks, &p, error));
    *out = p;
    p = (mesh_points){.n = 0};
done:
    mesh_points_free(&p);
    free(target);
    return status;
}

/* The least distance of a point from the sides of an element, inwards, and less its distance from the plane:
 * the larger, the deeper inside. */
static double depth(const mesh *m, size_t i, const double place[3]) {
    const size_t corners = mesh_corners(m, i);
    const double normal[3] = {(double)m->normal[i][0], (double)m->normal[i][1], (double)m->normal[i][2]};
    double least = HUGE_VAL, off = 0;
    for (size_t k = 0; k < corners; k++) {
        const double *a = m->vertices[m->elements[i][k]], *b = m->vertices[m->elements[i][(k + 1) % corners]];
        double along[3], to[3], inwards[3];
        subtract3(b, a, along);
        subtract3(place, a, to);
        cross3(normal, along, inwards);
        const double length = sqrt(dot3(along, along));
        if (length > 0) least = fmin(least, dot3(inwards, to) / length);
        off = fabs(dot3(normal, to));
    }
    return least - off;
}

lam_status mesh_points_locate(const mesh_points *p, const mesh *m, uint32_t *element, lam_error *error) {
    lam_status status = LAM_OK;
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    for (size_t k = 0; k < p->n; k++) {
        double deepest = -HUGE_VAL;
        for (size_t i = 0; i < m->n; i++) {
            double cosine = 0;
            for (int d = 0; d < 3; d++) cosine += (double)m->normal[i][d] * (double)p->normal[k][d];
            if (cosine < .999) continue;
            const double deep = depth(m, i, p->place[k]);
            if (deep > deepest) deepest = deep, element[k] = (uint32_t)i;
        }
        if (deepest < -1e-6 * radius)
            FAIL(error, LAM_ERR_INTERNAL, "point %zu lies in no element: %g m away", k, -deepest);
    }
done:
    return status;
}

/* Compares by the finer mesh: it sums A (x - truth)^2 over its elements j of each element i. */
static void compare_finer(const mesh *m, const double *x, const mesh *finer, const double *fine,
                          mesh_errors *out) {
    double means = 0, constant = 0, all = 0;
    for (size_t c = 0; c < m->n_channels; c++)
        for (size_t i = 0; i < m->n; i++) {
            double mean = 0, area = 0;
            const double value = x[c * m->n + i];
            for (size_t j = MESH_FINER * i; j < MESH_FINER * (i + 1); j++) {
                const double truth = fine[c * finer->n + j], A = finer->area[j];
                mean += A * truth;
                area += A;
                all += A * truth * truth;
                constant += A * (value - truth) * (value - truth);
            }
            means += area * (mean / area - value) * (mean / area - value);
        }
    out->means = sqrt(means / all);
    out->constant = sqrt(constant / all);
}

/* At points: q = sum (x - t)^2 - s^2 over sum t^2 - s^2, whose bar comes from the spread of the terms of its
 * linearization over the points. */
static void compare_points(const mesh *m, const double *x, const mesh_points *p, const uint32_t *element,
                           size_t light, mesh_errors *out) {
    const size_t row = p->n_channels * p->n;
    const double *truth = p->truth + light * row, *spread = p->spread + light * row;
    double off = 0, all = 0, squares = 0;
    for (int pass = 0; pass < 2; pass++) {
        const double q = pass > 0 ? off / all : 0;
        for (size_t k = 0; k < p->n; k++) {
            double d = 0, t = 0;
            for (size_t c = 0; c < p->n_channels; c++) {
                const double s = spread[c * p->n + k], T = truth[c * p->n + k],
                             D = x[c * m->n + element[k]] - T;
                d += D * D - s * s;
                t += T * T - s * s;
            }
            if (pass == 0) off += d, all += t;
            squares += pass > 0 ? (d - q * t) * (d - q * t) : 0;
        }
    }
    out->points = sqrt(fmax(off, 0) / all);
    out->bar = sqrt(squares) / all / (2 * fmax(out->points, 1e-9));
}

lam_status mesh_divide(const mesh *m, mesh *out, lam_error *error) {
    static const mesh_refinement twice = {.subdivide_levels = 2};
    lam_status status = LAM_OK;
    mesh_cell *cells = NULL;
    mesh copy = {0};
    size_t n;
    TRY(mesh_cells_even(m, INFINITY, m->n, &cells, &n, error));
    TRY(mesh_of_cells(m, n, cells, &copy, error));
    TRY(mesh_refine(&copy, &twice, error));
    *out = copy;
    copy = (mesh){0};
done:
    free(cells);
    mesh_free(&copy);
    return status;
}

mesh_errors mesh_compare(const mesh *m, const double *x, const mesh *finer, const double *fine,
                         const mesh_points *points, const uint32_t *element, size_t light) {
    mesh_errors e = {.means = NAN, .constant = NAN};
    if (fine != NULL) compare_finer(m, x, finer, fine, &e);
    compare_points(m, x, points, element, light, &e);
    return e;
}

lam_status mesh_converged(const bench_run *run, const lowrank_scene *s, const float *E, double **out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n, channels = s->m.n_channels, all = MESH_LIGHTS * channels * n;
    double *made = memory_allocate(all, sizeof *made, "a reference", error);
    double *emitted = memory_allocate(MESH_LIGHTS * n, sizeof *emitted, "a reference", error);
    double *B = memory_allocate(MESH_LIGHTS * n, sizeof *B, "a reference", error);
    reference *of = NULL;
    if (made == NULL || emitted == NULL || B == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < channels; c++) {
        for (size_t l = 0; l < MESH_LIGHTS; l++)
            for (size_t i = 0; i < n; i++)
                emitted[l * n + i] = B[l * n + i] = (double)E[(l * channels + c) * n + i];
        TRY(reference_create(&s->f.F, s->m.area, s->m.reflectance + c * n, REFERENCE_ITERATED, &of, error));
        TRY(reference_solve(of, MESH_LIGHTS, emitted, B, tolerance, run->progress, error));
        reference_destroy(of);
        of = NULL;
        for (size_t l = 0; l < MESH_LIGHTS; l++)
            for (size_t i = 0; i < n; i++)
                made[(l * channels + c) * n + i] = B[l * n + i] - emitted[l * n + i];
    }
    *out = made;
    made = NULL;
done:
    reference_destroy(of);
    free(made);
    free(emitted);
    free(B);
    return status;
}
