#include "solver/sensor/probe_grid.h"

#include "solver/base/array_grow.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/sensor/sensor_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RAYS = 64 };

/* first + i spacing in each dimension, i < counts */
typedef struct lattice {
    double first[3], spacing;
    size_t counts[3], n;
} lattice;

static void lattice_point(const lattice *l, size_t k, double at[3]) {
    for (int d = 0; d < 3; k /= l->counts[d], d++)
        at[d] = l->first[d] + (double)(k % l->counts[d]) * l->spacing;
}

/* Lays a lattice over a scene: as many points along each axis as the spacing fits into its extent, rounded.
 */
static lam_status lattice_over(const mesh *m, double spacing, lattice *out, lam_error *error) {
    lam_status status = LAM_OK;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, all = 1;
    lattice l = {.spacing = spacing};
    for (size_t j = 0; j < m->n; j++)
        for (size_t c = 0; c < mesh_corners(m, j); c++)
            for (int d = 0; d < 3; d++) {
                low[d] = fmin(low[d], m->vertices[m->elements[j][c]][d]);
                high[d] = fmax(high[d], m->vertices[m->elements[j][c]][d]);
            }
    for (int d = 0; d < 3; d++) {
        const double count = fmax(round((high[d] - low[d]) / spacing), 1);
        all *= count;
        if (!(all <= SENSORS_MOST))
            FAIL(error, LAM_ERR_ARGUMENT,
                 "--probes-grid %g: the scene of %g x %g x %g m has more than %d points so near to each "
                 "other; "
                 "take a larger spacing",
                 spacing, high[0] - low[0], high[1] - low[1], high[2] - low[2], SENSORS_MOST);
        l.counts[d] = (size_t)count;
        l.first[d] = .5 * (low[d] + high[d]) - .5 * (count - 1) * spacing;
    }
    l.n = (size_t)all;
    *out = l;
done:
    return status;
}

/* RAYS directions, even over the sphere (a spiral of Fibonacci). */
static void spread(double directions[RAYS][3]) {
    static const double golden = 2.39996322972865332; /* pi (3 - sqrt(5)) */
    for (int k = 0; k < RAYS; k++) {
        const double z = 1 - (2 * k + 1.) / RAYS, level = sqrt(1 - z * z);
        directions[k][0] = level * cos(golden * k);
        directions[k][1] = level * sin(golden * k);
        directions[k][2] = z;
    }
}

/* True unless most rays of a point that meet faces meet backs, behind panes too. */
static bool is_free(const mesh *m, const visibility *v, const double directions[RAYS][3],
                    const double at[3]) {
    static const uint32_t self[VISIBILITY_PACKET] = {
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING,
        VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING};
    float origin[3];
    size_t backs = 0, met = 0;
    visibility_recentre(v, at, origin);
    for (size_t first = 0; first < RAYS; first += VISIBILITY_PACKET) {
        ray_packet rays;
        hit_packet hits;
        double passed[VISIBILITY_PACKET] = {0};
        for (size_t i = 0; i < VISIBILITY_PACKET; i++)
            for (int d = 0; d < 3; d++) {
                rays.origin[d][i] = origin[d];
                rays.direction[d][i] = (float)directions[first + i][d];
            }
        visibility_cast(v, &rays, VISIBILITY_PACKET, self, 0, &hits);
        pane_path_follow(v, m, &rays, VISIBILITY_PACKET, &hits, passed, NULL);
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            met += hits.element[i] != VISIBILITY_NOTHING;
            backs += hits.element[i] != VISIBILITY_NOTHING && hits.back[i];
        }
    }
    return (double)backs <= SENSOR_BACKS_MOST * (double)met;
}

/* Takes a set out of a list. */
static void remove_set(sensor_list *l, size_t set) {
    const size_t first = l->sets[set].first, count = l->sets[set].count, after = first + count;
    memmove(l->receivers + first, l->receivers + after, (l->n - after) * sizeof *l->receivers);
    memmove(l->cell + first, l->cell + after, (l->n - after) * sizeof *l->cell);
    memmove(l->sets + set, l->sets + set + 1, (l->n_sets - set - 1) * sizeof *l->sets);
    l->n -= count;
    l->n_sets--;
    for (size_t k = set; k < l->n_sets; k++) l->sets[k].first -= count;
}

static lam_status make_room(sensor_list *l, size_t n_probes, lam_error *error) {
    lam_status status = LAM_OK;
    static const char what[] = "a grid of probes";
    for (size_t k = 0; k < l->n_sets; k++) {
        if (strcmp(l->sets[k].name, PROBE_GRID_NAME) != 0) continue;
        if (l->sets[k].kind != SENSOR_PROBES)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "--probes-grid: other sensors have the name %s, which its set takes: give them another one",
                 PROBE_GRID_NAME);
        remove_set(l, k--);
    }
    if (n_probes > (SENSORS_MOST - l->n) / HARMONICS)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--probes-grid: %zu probes beside %zu sensors are too many, at most %zu fit; take a larger "
             "spacing",
             n_probes, l->n, (SENSORS_MOST - l->n) / HARMONICS);
    if (l->n_sets == SENSOR_SETS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "--probes-grid: there are %d sets of sensors, the most that may be",
             SENSOR_SETS_MOST);
    const size_t n = l->n + HARMONICS * n_probes;
    TRY(array_resize(&l->sets, l->n_sets + 1, sizeof *l->sets, what, error));
    TRY(array_resize(&l->receivers, n, sizeof *l->receivers, what, error));
    TRY(array_resize(&l->cell, n, sizeof *l->cell, what, error));
done:
    return status;
}

static void add_probe(sensor_list *l, const receiver *first, const double at[3]) {
    for (int k = 0; k < HARMONICS; k++) {
        receiver *r = &l->receivers[l->n];
        *r = *first;
        r->kind = (receiver_kind)(RECEIVER_HARMONIC + k);
        memcpy(r->at, at, sizeof r->at);
        l->cell[l->n++] = SENSOR_NO_CELL;
    }
}

lam_status probe_grid_add(const mesh *m, const probe_grid *grid, sensor_list *list, size_t *n_out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    bool *free_at = NULL;
    lattice l = {.n = 0};
    double directions[RAYS][3];
    size_t n = 0;
    TRY(lattice_over(m, grid->spacing, &l, error));
    free_at = memory_allocate(l.n, sizeof *free_at, "a grid of probes", error);
    if (free_at == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
    spread(directions);
#pragma omp parallel for schedule(dynamic, 64) reduction(+ : n)
    for (size_t k = 0; k < l.n; k++) {
        double at[3];
        lattice_point(&l, k, at);
        free_at[k] = is_free(m, v, (const double(*)[3])directions, at);
        n += free_at[k];
    }
    if (n == 0)
        FAIL(
            error, LAM_ERR_ARGUMENT,
            "--probes-grid %g: none of %zu points is in free space; take a smaller spacing, or turn faces to "
            "where light is (--fix)",
            grid->spacing, l.n);
    TRY(make_room(list, n, error));
    const receiver first = sensors_probe(grid->y_up, m->up);
    list->sets[list->n_sets++] = (sensor_set){
        .name = PROBE_GRID_NAME, .kind = SENSOR_PROBES, .first = list->n, .count = HARMONICS * n};
    for (size_t k = 0; k < l.n; k++) {
        double at[3];
        lattice_point(&l, k, at);
        if (free_at[k]) add_probe(list, &first, at);
    }
    *n_out = l.n - n;
done:
    free(free_at);
    visibility_destroy(v);
    return status;
}
