#include "server/route/sensor_figures.h"

#include "server/route/light_weights.h"
#include "server/route/radiosity_figures.h"
#include "server/scene/direct_light.h"
#include "server/scene/sensor_answer.h"
#include "server/scene/sensor_columns.h"
#include "server/scene/sensor_errors.h"
#include "solver/base/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Products and numbers of a request that the I/O thread answers itself. */
#define QUICK_WORK ((size_t)200000)
#define QUICK_NUMBERS ((size_t)400)

struct sensor_figures {
    kept_figures figures;
    double *values;      /* [C][receivers] of a vector, work; those of sets that are not reduced stay 0 */
    double *off;         /* [C][receivers], by the halves of rows; likewise */
    double *rest, *mesh; /* [C][sets], what values are off by (column_view); likewise */
    sensor_errors errors;
    bool *reduced;      /* [sets]: of some name */
    uint32_t *lights;   /* [n_lights], ascending */
    float *weights;     /* [n_rhs][C][s] of a store of emitters, whose lights these are; else NULL */
    float **own;        /* [n_lights]: columns that the scene has no room for; NULL: it keeps the column */
    float *made, *work; /* of a pass; NULL until the first */
    size_t n_lights, next, vector;
    column_table *table;
    figures_text text;
};

void sensor_figures_free(const scene *s, sensor_figures *f) {
    if (f == NULL) return;
    for (size_t k = 0; f->own != NULL && k < f->n_lights; k++) free(f->own[k]);
    sensor_columns_release(s->columns, f->table);
    figures_free(&f->figures);
    free(f->values);
    free(f->off);
    free(f->rest);
    free(f->mesh);
    sensor_errors_free(&f->errors);
    free(f->reduced);
    free(f->lights);
    free(f->weights);
    free(f->own);
    free(f->made);
    free(f->work);
    free(f);
}

/* Marks the lights of rows [C][width], of a side, that are not 0 in all of them. */
static void mark_side(const side_rows *side, size_t n_channels, size_t width, bool *lit) {
    for (size_t row = 0; side->values != NULL && row < side->n * n_channels; row++)
        for (size_t k = 0; k < width; k++) lit[k] = lit[k] || side->values[row * width + k] != 0;
}

/* The lights that a request has, ascending. False when memory is short. */
static bool find_lights(const scene *s, const radiosity_request *request, sensor_figures *f) {
    const sensor_lights of = scene_sensor_lights(s);
    const size_t all = sensor_lights_count(&of), C = s->n_channels;
    bool *lit = memory_allocate(all, sizeof *lit, "lights", NULL);
    f->lights = memory_allocate(all, sizeof *f->lights, "lights", NULL);
    if (lit == NULL || f->lights == NULL) {
        free(lit);
        return false;
    }
    if (f->weights != NULL) {
        mark_side(&(side_rows){.values = f->weights, .n = request->n_rhs}, C, all, lit);
    } else {
        for (size_t k = 0; k < request->n_spots; k++) lit[request->spots[k].where] = true;
        mark_side(&request->luminaires, C, of.luminaires, lit + of.groups);
        mark_side(&request->sky, C, of.tiles, lit + of.groups + of.luminaires);
    }
    for (size_t k = 0; k < all; k++)
        if (lit[k]) f->lights[f->n_lights++] = (uint32_t)k;
    free(lit);
    return true;
}

/* The lights of a store of few emitters are told by the weights of all that a request has. */
static bool find_weights(const call *in, radiosity_request *request, sensor_figures *f, problem *why) {
    const codec_scene about = call_codec_scene(in);
    if (in->scene->n_emitters == 0) return true;
    if (request->n_spots > 0 && !radiosity_request_expand(request, &about, why)) return false;
    f->weights = light_weights_find(in, request, why);
    return f->weights != NULL;
}

/* Allocates all but what passes need. */
static bool allocate(const scene *s, const radiosity_request *request, answer_notes *notes,
                     sensor_figures *f) {
    const size_t C = s->n_channels;
    const reduce_request *r = &request->reduce;
    if (!figures_allocate(s, request, &f->figures)) return false;
    f->values = memory_allocate(C, scene_sensors(s) * sizeof *f->values, "sensors", NULL);
    f->reduced = memory_allocate(s->sensor_sets.n_groups, sizeof *f->reduced, "sensors", NULL);
    f->own = memory_allocate(f->n_lights, sizeof *f->own, "sensors", NULL);
    f->table = sensor_columns_acquire(s->columns);
    f->off = memory_allocate(C, scene_sensors(s) * sizeof *f->off, "sensors", NULL);
    f->rest = memory_allocate(C, s->sensor_sets.n_groups * sizeof *f->rest, "sensors", NULL);
    f->mesh = memory_allocate(C, s->sensor_sets.n_groups * sizeof *f->mesh, "sensors", NULL);
    if (f->off == NULL || f->rest == NULL || f->mesh == NULL || f->values == NULL || f->own == NULL ||
        f->reduced == NULL)
        return false;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t g = 0; g < r->names[k].n_groups; g++) f->reduced[r->names[k].groups[g]] = true;
    return sensor_errors_begin(s, request, notes, &f->errors);
}

/* Lights whose columns are not there. */
static size_t count_missing(const sensor_figures *f) {
    size_t missing = 0;
    for (size_t k = 0; k < f->n_lights; k++) missing += column_table_get(f->table, f->lights[k]) == NULL;
    return missing;
}

bool sensor_figures_begin(call *in, radiosity_request *request, answer_notes *notes, sensor_figures **out,
                          problem *why) {
    static const char short_of[] = "not enough memory to reduce sensors; ask for fewer vectors or sets";
    const scene *s = in->scene;
    const sensor_lights of = scene_sensor_lights(s);
    const size_t width = sensor_column_width(s);
    *out = NULL;
    if (!request_memory_take(in->memory,
                             bytes_plus(figures_bytes(s, request),
                                        sensor_lights_count(&of) * (sizeof(uint32_t) + sizeof(bool)) +
                                            s->sensor_sets.n_groups * sizeof(bool) +
                                            width * 2 * sizeof(double)),
                             why))
        return false;
    sensor_figures *f = memory_allocate(1, sizeof *f, "figures", NULL);
    if (f == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "%s", short_of);
    if (!find_weights(in, request, f, why)) {
        sensor_figures_free(s, f);
        return false;
    }
    if (!find_lights(s, request, f)) {
        sensor_figures_free(s, f);
        return problem_set(why, PROBLEM_NO_MEMORY, "%s", short_of);
    }
    if (f->n_lights > SENSOR_LIGHTS_MOST || bytes_times(f->n_lights, width) > SENSOR_NUMBERS_MOST) {
        sensor_figures_free(s, f);
        return true;
    }
    *out = f;
    if (!allocate(s, request, notes, f)) return problem_set(why, PROBLEM_NO_MEMORY, "%s", short_of);
    const size_t missing = count_missing(f), pass = missing < BATCH_PASS ? missing : BATCH_PASS;
    /* Columns that the scene may not keep, and the arrays of a pass. */
    return missing == 0 ||
           request_memory_take(
               in->memory, ((missing + pass) * width + sensor_columns_work(s, pass)) * sizeof(float), why);
}

/* Makes the next columns that are missing, as many as a pass has. */
static bool make_columns(call *in, sensor_figures *f, batch_workspace *workspace, problem *why) {
    const scene *s = in->scene;
    const size_t width = sensor_column_width(s);
    size_t count = 0, places[BATCH_PASS];
    uint32_t which[BATCH_PASS];
    for (; f->next < f->n_lights && count < BATCH_PASS; f->next++) {
        if (column_table_get(f->table, f->lights[f->next]) != NULL) continue;
        places[count] = f->next;
        which[count++] = f->lights[f->next];
    }
    if (count == 0) return true;
    if (f->made == NULL) {
        f->made = memory_allocate(BATCH_PASS, width * sizeof *f->made, "sensors", NULL);
        f->work = memory_allocate(sensor_columns_work(s, BATCH_PASS), sizeof *f->work, "sensors", NULL);
    }
    if (f->made == NULL || f->work == NULL)
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to solve for %zu lights", count);
    metrics_pass(in->service->metrics, count);
    if (!sensor_columns_make(s, count, which, workspace, f->work, f->made, why)) return false;
    for (size_t k = 0; k < count; k++) {
        const float *column = f->made + k * width;
        sensor_columns_put(s->columns, f->table, which[k], column);
        if (column_table_get(f->table, which[k]) != NULL) continue;
        float *own = f->own[places[k]] = memory_allocate(width, sizeof *own, "sensors", NULL);
        if (own == NULL) return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for columns");
        memcpy(own, column, width * sizeof *own);
    }
    return true;
}

/* The weight of a light in a vector and channel. Groups are looked up in the vector's spots. */
static double weight_of(const scene *s, const radiosity_request *request, const sensor_figures *f,
                        size_t light, size_t vector, size_t c) {
    const sensor_lights of = scene_sensor_lights(s);
    const size_t C = s->n_channels;
    if (f->weights != NULL) return (double)f->weights[(vector * C + c) * s->n_emitters + light];
    const bool luminaire = light < of.groups + of.luminaires;
    const side_rows *side = luminaire ? &request->luminaires : &request->sky;
    const size_t width = luminaire ? of.luminaires : of.tiles,
                 k = light - of.groups - (luminaire ? 0 : of.luminaires);
    return side->values != NULL && vector < side->n ? (double)side->values[(vector * C + c) * width + k] : 0;
}

/* to += weight x */
static void add_scaled(size_t count, double weight, const float *restrict x, double *restrict to) {
    for (size_t k = 0; k < count; k++) to[k] += weight * (double)x[k];
}

/* values += weight column, and their halves likewise, of the receivers of the sets that are reduced, and what
 * these are off by. The receivers of a set follow each other. */
static void add_column(const scene *s, sensor_figures *f, size_t c, double weight, const float *column) {
    const size_t begin = c * scene_sensors(s), n_sets = s->sensor_sets.n_groups;
    const column_view view = sensor_column_view(s, column);
    for (size_t set = 0; weight != 0 && set < n_sets; set++) {
        size_t first, count;
        if (!f->reduced[set]) continue;
        lam_sensors_set(s->sensors, set, &first, &count);
        add_scaled(count, weight, view.values + begin + first, f->values + begin + first);
        add_scaled(count, weight, view.off + begin + first, f->off + begin + first);
        f->rest[c * n_sets + set] += fabs(weight) * (double)view.rest[set];
        f->mesh[c * n_sets + set] += fabs(weight) * (double)view.mesh[set];
    }
}

static const float *column_of(const sensor_figures *f, size_t k) {
    return f->own[k] != NULL ? f->own[k] : column_table_get(f->table, f->lights[k]);
}

/* The place of a light among those of the request. */
static size_t place_of(const sensor_figures *f, uint32_t light) {
    size_t low = 0, high = f->n_lights;
    while (low + 1 < high) {
        const size_t middle = low + (high - low) / 2;
        if (f->lights[middle] <= light)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Adds up values and what sampling puts them off by, of each set that is reduced. */
static void take_errors(const scene *s, const radiosity_request *request, sensor_figures *f,
                        answer_notes *notes) {
    const group_index *sets = &s->sensor_sets;
    const size_t all = scene_sensors(s);
    for (size_t k = 0; k < f->errors.n_sets; k++) {
        const uint32_t set = f->errors.sets[k];
        sensor_squares *const to = &f->errors.squares[set];
        for (size_t e = sets->start[set]; e < sets->start[set + 1]; e++)
            for (size_t c = 0; group_index_counts(sets, sets->elements[e]) && c < s->n_channels; c++) {
                const double value = f->values[c * all + sets->elements[e]],
                             off = f->off[c * all + sets->elements[e]];
                to->light2 += value * value;
                to->rows2 += off * off;
            }
        for (size_t c = 0; c < s->n_channels; c++) {
            const double rest = f->rest[c * sets->n_groups + set], mesh = f->mesh[c * sets->n_groups + set];
            to->off2 += rest * rest;
            to->mesh2 = mesh < 0 || to->mesh2 < 0 ? -1 : to->mesh2 + mesh * mesh;
        }
    }
    if (f->errors.names != NULL) sensor_errors_take(request, &f->errors, notes);
}

/* Fills the figures of a vector. */
static bool add_vector(const scene *s, const radiosity_request *request, size_t v, sensor_figures *f,
                       answer_notes *notes, problem *why) {
    const size_t C = s->n_channels, all = scene_sensors(s);
    const sensor_lights of = scene_sensor_lights(s);
    const codec_scene about = {.n = s->n,
                               .n_channels = C,
                               .n_tiles = scene_tiles(s),
                               .n_luminaires = of.luminaires,
                               .n_emitters = s->n_emitters};
    const size_t first = radiosity_request_spots(request, v), end = radiosity_request_spots(request, v + 1);
    memset(f->values, 0, C * all * sizeof *f->values);
    memset(f->off, 0, C * all * sizeof *f->off);
    memset(f->rest, 0, C * s->sensor_sets.n_groups * sizeof *f->rest);
    memset(f->mesh, 0, C * s->sensor_sets.n_groups * sizeof *f->mesh);
    for (size_t k = 0; k < f->errors.n_sets; k++)
        f->errors.squares[f->errors.sets[k]] = (sensor_squares){.light2 = 0};
    for (size_t c = 0; c < C; c++) {
        for (size_t k = first; k < end; k++)
            add_column(s, f, c, (double)request->colours[k * C + c],
                       column_of(f, place_of(f, request->spots[k].where)));
        for (size_t k = 0; k < f->n_lights; k++)
            if (f->weights != NULL || f->lights[k] >= of.groups)
                add_column(s, f, c, weight_of(s, request, f, f->lights[k], v, c), column_of(f, k));
        const bool limits = !request->linear_map && !radiosity_request_has_signs(request, &about, v, c);
        for (size_t k = c * all; limits && k < (c + 1) * all; k++) f->values[k] = fmax(f->values[k], 0);
    }
    take_errors(s, request, f, notes);
    if (request->told.luminance) answer_luminance_double(1, all, f->values, NULL);
    return figures_reduce(s, request, radiosity_request_channels(request, C), v, 1,
                          (reduce_values){.doubles = f->values}, &f->figures) ||
           problem_set(why, PROBLEM_NO_MEMORY, "not enough memory to reduce sensors");
}

bool sensor_figures_step(call *in, const radiosity_request *request, sensor_figures *f,
                         batch_workspace *workspace, answer_notes *notes, buffer *b, bool *done,
                         problem *why) {
    const double start = clock_ms(), until = start + FIGURES_STEP_MS;
    bool good = true;
    *done = false;
    while (good && f->next < f->n_lights && clock_ms() < until) good = make_columns(in, f, workspace, why);
    while (good && f->next == f->n_lights && f->vector < request->n_rhs && clock_ms() < until)
        good = add_vector(in->scene, request, f->vector++, f, notes, why);
    notes->solve_ms += clock_ms() - start;
    if (!good || f->vector < request->n_rhs) return good;
    return figures_write(in->scene, request, &f->figures, until, &f->text, notes, b, done, why);
}

/* Products of an answer. */
static size_t work_of(const scene *s, const radiosity_request *request, size_t n_lights) {
    const reduce_request *r = &request->reduce;
    size_t receivers = 0;
    for (size_t k = 0; k < r->n_names; k++)
        for (size_t g = 0; g < r->names[k].n_groups; g++)
            receivers +=
                s->sensor_sets.start[r->names[k].groups[g] + 1] - s->sensor_sets.start[r->names[k].groups[g]];
    /* Beside the lights, figures look at each receiver some times. */
    return bytes_times(2 * request->n_rhs * s->n_channels,
                       scene_sensors(s) + s->sensor_sets.n_groups * n_lights + receivers * (n_lights + 4));
}

bool sensor_figures_quick(call *in, radiosity_request *request, answer_notes *notes, buffer *b) {
    const scene *s = in->scene;
    sensor_figures *f = NULL;
    problem why = {0};
    bool done = false;
    const double start = clock_ms();
    /* The weights of emissions and skies take a look at every element. */
    if (s->n_emitters > 0 && (request->n_spots > 0 || request->sky.values != NULL)) return false;
    scene_note_error(s, request, notes);
    if (!sensor_figures_begin(in, request, notes, &f, &why) || f == NULL) {
        sensor_figures_free(s, f);
        return false;
    }
    bool good =
        count_missing(f) == 0 &&
        bytes_plus(work_of(s, request, f->n_lights), eye_figures_work(f->figures.eyes)) <= QUICK_WORK &&
        bytes_plus(reduce_vectors_written(&request->reduce, request->n_rhs) * s->n_channels,
                   eye_figures_numbers(f->figures.eyes)) <= QUICK_NUMBERS;
    for (size_t v = 0; good && v < request->n_rhs; v++) good = add_vector(s, request, v, f, notes, &why);
    notes->solve_ms = clock_ms() - start;
    good = good && figures_write(s, request, &f->figures, INFINITY, &f->text, notes, b, &done, &why);
    sensor_figures_free(s, f);
    return good;
}
