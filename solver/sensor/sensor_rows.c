#include "solver/sensor/sensor_rows.h"

#include "solver/base/array_grow.h"
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/rays/portals.h"
#include "solver/scene/glass.h"
#include "solver/sensor/point_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rays towards openings for each by the weight. They meet less, and light of the sky is often the most. */
enum { AIMED = 4 };

/* Rows that are made before they are joined with those before them. */
enum { ROWS_AT_ONCE = 256 };

/* An entry of a row. */
typedef struct row_entry {
    uint32_t element;
    float weight, off;
} row_entry;

typedef struct made_row {
    size_t n;
    row_entry *entries;
} made_row;

typedef struct rows_job {
    point_scene scene;
    const receiver *receivers;
    const sensor_rows_options *options;
    sensor_rows *out;
    bool has_probes;
    size_t capacity;
    made_row rows[ROWS_AT_ONCE];
} rows_job;

void sensor_rows_free(sensor_rows *r) {
    free(r->start);
    free(r->element);
    free(r->weight);
    free(r->off);
    free(r->sky);
    free(r->sky_off);
    free(r->backs);
    *r = (sensor_rows){.n = 0};
}

static void room_free(point_room *room) {
    free(room->pair);
    free(room->factor);
    free(room->known);
    free(room->sum);
    free(room->met);
    free(room->sky);
}

static lam_status room_make(const rows_job *job, point_room *room, lam_error *error) {
    static const char what[] = "rows of sensors";
    const point_scene *s = &job->scene;
    const size_t n = s->m->n, tiles = s->sky != NULL ? s->sky->tiling.n_tiles : 0;
    const size_t most = job->has_probes ? HARMONICS : 1;
    *room = (point_room){.n_pairs = 0};
    room->pair = memory_allocate(n, sizeof *room->pair, what, error);
    room->factor = memory_allocate(n, most * sizeof *room->factor, what, error);
    room->known = memory_allocate(n, sizeof *room->known, what, error);
    room->sum = memory_allocate(n, most * sizeof *room->sum, what, error);
    room->met = memory_allocate(n, sizeof *room->met, what, error);
    room->sky = memory_allocate(tiles + 1, most * sizeof *room->sky, what, error);
    const bool enough = room->pair != NULL && room->factor != NULL && room->known != NULL &&
                        room->sum != NULL && room->met != NULL && room->sky != NULL;
    return enough ? LAM_OK : LAM_ERR_MEMORY;
}

static int by_element(const void *a, const void *b) {
    const row_entry *first = a, *second = b;
    return (first->element > second->element) - (first->element < second->element);
}

/* Adds an entry unless it is 0. */
static void add_entry(uint32_t element, const point_share share, made_row *row) {
    if (share[0] != 0 || share[1] != 0)
        row->entries[row->n++] =
            (row_entry){element, (float)(.5 * (share[0] + share[1])), (float)(.5 * (share[0] - share[1]))};
}

/* pi (F_t + F_g a c_t / pi), as sky_bounce_close has it, of both halves. */
static void put_sky(const rows_job *job, size_t k, size_t n_rows, const point_room *room) {
    const sky_bounce *sky = job->scene.sky;
    const size_t tiles = sky->tiling.n_tiles, n = job->out->n_receivers;
    for (size_t t = 0; t < tiles; t++) {
        const double reflected = sky->ground_albedo * sky->tiling.tiles[t].cosine * M_1_PI;
        for (size_t w = 0; w < n_rows; w++) {
            const double *seen = room->sky[t * n_rows + w], *ground = room->sky[tiles * n_rows + w];
            point_share share;
            for (size_t h = 0; h < HALVES; h++) share[h] = M_PI * (seen[h] + reflected * ground[h]);
            job->out->sky[t * n + k + w] = (float)(.5 * (share[0] + share[1]));
            job->out->sky_off[t * n + k + w] = (float)(.5 * (share[0] - share[1]));
        }
    }
}

/* Row w of a point; false where memory is short. */
static bool take_row(const point_room *room, size_t n_rows, size_t w, made_row *out) {
    row_entry *entries =
        memory_allocate(room->n_pairs + room->n_met, sizeof *entries, "rows of sensors", NULL);
    *out = (made_row){.entries = entries};
    if (entries == NULL) return false;
    for (size_t i = 0; i < room->n_pairs; i++) add_entry(room->pair[i], room->factor[i * n_rows + w], out);
    for (size_t i = 0; i < room->n_met; i++)
        add_entry(room->met[i], room->sum[room->met[i] * n_rows + w], out);
    qsort(entries, out->n, sizeof *entries, by_element);
    return true;
}

/* Finds the rows of the point of receiver k; false where memory is short. */
static bool make_rows(const rows_job *job, size_t k, point_room *room, made_row *out) {
    point_place place;
    bool enough = true;
    point_place_set(&job->scene, &job->receivers[k], k, &place);
    const size_t n_rows = place.n_rows;
    point_pairs(&job->scene, &place, room);
    point_rays(&job->scene, &place, room);
    for (size_t w = 0; w < n_rows && enough; w++) enough = take_row(room, n_rows, w, &out[w]);
    if (job->scene.sky != NULL) {
        put_sky(job, k, n_rows, room);
        memset(room->sky, 0, (job->scene.sky->tiling.n_tiles + 1) * n_rows * sizeof *room->sky);
    }
    for (size_t w = 0; w < n_rows; w++) job->out->backs[k + w] = (float)fmin(room->backs, 1);
    for (size_t i = 0; i < room->n_pairs; i++) room->known[room->pair[i]] = 0;
    for (size_t i = 0; i < room->n_met; i++) {
        room->known[room->met[i]] = 0;
        memset(room->sum + room->met[i] * n_rows, 0, n_rows * sizeof *room->sum);
    }
    return enough;
}

/* Appends rows first ... first + count - 1. */
static lam_status join_rows(rows_job *job, size_t first, size_t count, lam_error *error) {
    lam_status status = LAM_OK;
    sensor_rows *out = job->out;
    size_t all = out->start[first];
    for (size_t k = 0; k < count; k++) all += job->rows[k].n;
    const size_t capacity = array_capacity(job->capacity, all);
    if (capacity > job->capacity) {
        TRY(array_resize(&out->element, capacity, sizeof *out->element, "rows of sensors", error));
        TRY(array_resize(&out->weight, capacity, sizeof *out->weight, "rows of sensors", error));
        TRY(array_resize(&out->off, capacity, sizeof *out->off, "rows of sensors", error));
        job->capacity = capacity;
    }
    for (size_t k = 0; k < count; k++) {
        const uint64_t at = out->start[first + k];
        for (size_t i = 0; i < job->rows[k].n; i++) {
            out->element[at + i] = job->rows[k].entries[i].element;
            out->weight[at + i] = job->rows[k].entries[i].weight;
            out->off[at + i] = job->rows[k].entries[i].off;
        }
        out->start[first + k + 1] = at + job->rows[k].n;
    }
done:
    return status;
}

static lam_status make_some(rows_job *job, size_t first, size_t count, lam_error *error) {
    lam_status status = LAM_OK;
    bool fails = false;
    memset(job->rows, 0, sizeof job->rows);
#pragma omp parallel
    {
        point_room room;
        lam_error why;
        bool short_of = room_make(job, &room, &why) != LAM_OK;
#pragma omp for schedule(dynamic, 1)
        for (size_t k = 0; k < count; k++)
            if (!short_of && !receiver_follows(&job->receivers[first + k]))
                short_of = !make_rows(job, first + k, &room, &job->rows[k]);
        if (short_of) {
#pragma omp atomic write
            fails = true;
        }
        room_free(&room);
    }
    if (fails)
        FAIL(error, LAM_ERR_MEMORY, "not enough memory for rows of %zu sensors", job->out->n_receivers);
    TRY(join_rows(job, first, count, error));
done:
    for (size_t k = 0; k < count; k++) free(job->rows[k].entries);
    return status;
}

/* The elements of groups that emit or were named. */
static lam_status find_sources(const mesh *m, const bool *named, bool **out, lam_error *error) {
    lam_status status = LAM_OK;
    bool *group = memory_allocate(m->n_groups, sizeof *group, "rows of sensors", error);
    bool *is_source = memory_allocate(m->n, sizeof *is_source, "rows of sensors", error);
    if (group == NULL || is_source == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < m->n_groups; g++) group[g] = named != NULL && named[g];
    for (size_t c = 0; c < m->n_channels && m->emission != NULL; c++)
        for (size_t j = 0; j < m->n; j++) group[m->group[j]] |= m->emission[c * m->n + j] > 0;
    for (size_t j = 0; j < m->n; j++) is_source[j] = group[m->group[j]];
    *out = is_source;
    is_source = NULL;
done:
    free(group);
    free(is_source);
    return status;
}

/* Panes as openings: light of the sky comes through them. A quad is two triangles. */
static void add_panes(const mesh *m, const visibility *v, portal *array, size_t *n) {
    for (size_t j = 0; j < m->n - m->n_backs; j++) {
        if (!mesh_is_pane(m, j)) continue;
        for (size_t c = 1; c + 1 < mesh_corners(m, j); c++) {
            plane_patch patch = {.triangle = true};
            for (int d = 0; d < 3; d++) {
                patch.corner[d] = m->vertices[m->elements[j][0]][d];
                patch.edge[0][d] = m->vertices[m->elements[j][c]][d] - patch.corner[d];
                patch.edge[1][d] = m->vertices[m->elements[j][c + 1]][d] - patch.corner[d];
            }
            portal *p = &array[(*n)++];
            *p = portal_of(&patch, visibility_centre(v));
            p->strength[0] = p->strength[1] = 1;
        }
    }
}

/* The openings and panes that rays for the sky are aimed at. */
static lam_status find_openings(point_scene *s, const face_openings *given, lam_error *error) {
    lam_status status = LAM_OK;
    portals found = {.n = 0};
    size_t n = 0, panes = 0;
    TRY(portals_find(s->m, s->v, s->seed, AIMED * s->rays, given, true, &found, error));
    for (size_t j = 0; j < s->m->n - s->m->n_backs; j++) panes += mesh_is_pane(s->m, j);
    portal *array = memory_allocate(found.n + 2 * panes, sizeof *array, "openings", error);
    if (array == NULL) TRY(LAM_ERR_MEMORY);
    for (; n < found.n; n++) array[n] = found.portal[n];
    add_panes(s->m, s->v, array, &n);
    /* It takes the array over, also on an error. */
    TRY(portals_build(array, n, &s->openings, error));
    s->aimed = n > 0 ? AIMED * s->rays : 0;
done:
    portals_free(&found);
    return status;
}

lam_status sensor_rows_make(const mesh *m, size_t n, const receiver *receivers, const sensor_rows_options *o,
                            sensor_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    bool *is_source = NULL;
    double(*ball)[4] = NULL;
    sensor_rows made = {.n = m->n, .n_receivers = n, .rays = o->rays > 0 ? o->rays : SENSOR_RAYS};
    size_t sky = 0;
    rows_job *job = memory_allocate(1, sizeof *job, "rows of sensors", error);
    if (job == NULL) return LAM_ERR_MEMORY;
    TRY(visibility_create(m, &v, error));
    TRY(point_balls_make(m, &ball, error));
    TRY(find_sources(m, o->sources, &is_source, error));
    *job = (rows_job){.receivers = receivers, .options = o, .out = &made};
    for (size_t k = 0; k < n; k++) job->has_probes |= receivers[k].kind >= RECEIVER_HARMONIC;
    size_t n_sources = 0;
    for (size_t j = 0; j < m->n; j++) n_sources += is_source[j];
    job->scene = (point_scene){.m = m,
                               .v = v,
                               .ball = ball,
                               .is_source = is_source,
                               .n_sources = n_sources,
                               .sky = o->sky,
                               .rays = made.rays / HALVES,
                               .pair_factor = o->pair_factor,
                               .seed = o->seed};
    if (o->sky != NULL) {
        made.n_tiles = o->sky->tiling.n_tiles;
        TRY(find_openings(&job->scene, o->openings, error));
    }
    if (!size_multiply(made.n_tiles, n, &sky))
        FAIL(error, LAM_ERR_MEMORY, "%zu tiles of sky over %zu sensors are too many", made.n_tiles, n);
    made.start = memory_allocate(n + 1, sizeof *made.start, "rows of sensors", error);
    made.backs = memory_allocate(n, sizeof *made.backs, "rows of sensors", error);
    made.sky = memory_allocate(sky, sizeof *made.sky, "the sky of sensors", error);
    made.sky_off = memory_allocate(sky, sizeof *made.sky_off, "the sky of sensors", error);
    if (made.start == NULL || made.backs == NULL || made.sky == NULL || made.sky_off == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t first = 0, count; first < n; first += count) {
        count = n - first < ROWS_AT_ONCE ? n - first : ROWS_AT_ONCE;
        while (first + count < n && receiver_follows(&receivers[first + count])) count--;
        if (progress_cancelled(o->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        TRY(make_some(job, first, count, error));
        progress_report(o->progress, o->stage, (double)(first + count) / (double)n);
    }
    *out = made;
    made = (sensor_rows){.n = 0};
done:
    portals_free(&job->scene.openings);
    free(job);
    free(ball);
    free(is_source);
    visibility_destroy(v);
    sensor_rows_free(&made);
    return status;
}
