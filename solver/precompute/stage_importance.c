/* --receivers, --importance and --sources: the elements that are read, or that light comes from to sensors,
 * and those that emit, or reflect the light of luminaires, and from them the importance of all. */
#include "solver/base/atomic_file.h"
#include "solver/light/emission.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A word among names of groups that means all luminaires, or all sensors. */
typedef struct other_word {
    const char *word;
    bool given;
} other_word;

/* A group of the scene keeps its name. */
static bool means_others(const emission_scene *scene, const char *name, const other_word *others) {
    const uint32_t *found;
    return strcmp(name, others->word) == 0 &&
           group_index_find(&scene->groups, name, strlen(name), &found) == 0;
}

/* E [C][n]: every element of the groups NAME,NAME emits 1. others: a word that may be among them; NULL:
 * none. */
static lam_status read_groups(const char *option, const char *names, const emission_scene *scene,
                              emission *out, other_word *others, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = scene->m;
    char *name = memory_allocate(strlen(names) + 1, 1, option, error);
    if (name == NULL) return LAM_ERR_MEMORY;
    TRY(emission_allocate(option, m->n_channels, m->n, 1, &out->E, error));
    out->n_vectors = 1;
    for (const char *at = names;; at++) {
        const size_t length = strcspn(at, ",");
        memcpy(name, at, length);
        name[length] = '\0';
        if (others != NULL && means_others(scene, name, others))
            others->given = true;
        else
            TRY(emission_fill_group(scene, option, name, NULL, out->E, error));
        at += length;
        if (*at == '\0') break;
    }
done:
    free(name);
    return status;
}

static lam_status read_file(const char *path, const emission_scene *scene, emission *out, lam_error *error) {
    char extension[16];
    atomic_file_extension(path, extension);
    if (strcmp(extension, "npy") != 0 && strcmp(extension, "json") != 0)
        return status_fail(error, LAM_ERR_ARGUMENT, "--importance %.200s: must end in .npy or .json", path);
    return emission_read(path, scene, false, out, error);
}

/* out [n]: the largest of all channels over the largest of all elements, of groups NAME,NAME or, where groups
 * are NULL, of a file of one emission; 0 where `others` are all that is named. */
static lam_status read_weights(const char *option, const char *groups, const char *file,
                               const emission_scene *scene, float **out, other_word *others,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->m->n, C = scene->m->n_channels;
    emission read = {.E = NULL};
    float *w = NULL, most = 0;
    if (groups != NULL)
        TRY(read_groups(option, groups, scene, &read, others, error));
    else
        TRY(read_file(file, scene, &read, error));
    if (read.n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "--importance %.200s: has %zu vectors, must have 1", file,
             read.n_vectors);
    w = memory_allocate(n, sizeof *w, "importance", error);
    if (w == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n * C; k++) w[k % n] = fmaxf(w[k % n], read.E[k]);
    for (size_t i = 0; i < n; i++) most = fmaxf(most, w[i]);
    if (!(most > 0) && (others == NULL || !others->given))
        FAIL(error, LAM_ERR_ARGUMENT, "--importance %.200s: is 0 everywhere, must be above 0 somewhere",
             file);
    for (size_t i = 0; most > 0 && i < n; i++) w[i] /= most;
    *out = w;
    w = NULL;
done:
    emission_free(&read);
    free(w);
    return status;
}

lam_status scene_read_importance(const precompute_job *job, const precompute_plan *plan,
                                 precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const mesh *m = &scene->m;
    emission_scene named = {.m = NULL};
    importance made = {.n = m->n};
    other_word sensors = {.word = RECEIVERS_SENSORS}, luminaires = {.word = SOURCES_LUMINAIRES};
    if (o->receivers == NULL && o->importance == NULL && o->sources == NULL) return LAM_OK;
    TRY(emission_scene_create(m, &named, error));
    if (o->receivers != NULL || o->importance != NULL)
        TRY(read_weights("--receivers", o->receivers, o->importance, &named, &made.read, &sensors, error));
    if (o->sources != NULL)
        TRY(read_weights("--sources", o->sources, NULL, &named, &made.emits, &luminaires, error));
    made.sensors = sensors.given;
    made.luminaires = luminaires.given;
    if (made.sensors && scene->sensors.list.n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--receivers sensors: there are none; give --sensors FILE too");
    if (made.luminaires && scene->luminaires.placed.n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--sources luminaires: there are none; give --luminaires FILE too");
    if (!(plan->method->flags & METHOD_READS)) goto done;
    scene->importance = made;
    made = (importance){.n = 0};
done:
    emission_scene_free(&named);
    importance_free(&made);
    return status;
}

/* weights = max(weights, min(1, x_i / mean x)) of light x [n]; the mean is by area over all where there is
 * some. Less than the least importance is none. */
static void add_shares(const mesh *m, const double *x, float *weights) {
    double light = 0, area = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (!(x[i] > 0)) continue;
        light += m->area[i] * x[i];
        area += m->area[i];
    }
    for (size_t i = 0; i < m->n; i++) {
        const double s = x[i] > 0 ? fmin(x[i] * area / light, 1) : 0;
        if (s >= importance_least) weights[i] = fmaxf(weights[i], (float)s);
    }
}

static size_t count_above_zero(const float *w, size_t n) {
    size_t count = 0;
    for (size_t i = 0; i < n; i++) count += w[i] > 0;
    return count;
}

lam_status scene_light_sources(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    importance *of = &scene->importance;
    const mesh *m = &scene->m;
    const size_t n = m->n;
    double *x = NULL; /* rho H of the largest channel: light of a luminaire that an element sends on */
    if (of->n == 0 || !of->luminaires) return LAM_OK;
    x = memory_allocate(n, sizeof *x, "importance", error);
    if (x == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < scene->luminaires.placed.n; k++) {
        for (size_t i = 0; i < n; i++) {
            double rho = 0;
            for (size_t c = 0; c < m->n_channels; c++) rho = fmax(rho, (double)m->reflectance[c * n + i]);
            x[i] = rho * (double)scene->luminaires.H[k * n + i];
        }
        add_shares(m, x, of->emits);
    }
    const size_t count = count_above_zero(of->emits, n);
    if (count == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--sources luminaires: no element reflects any of their light");
    terminal_log(job->t, "sources: %zu of %zu elements, those that reflect light of luminaires with them",
                 count, n);
done:
    free(x);
    return status;
}

/* Of an element as many rays of a set of sensors tell enough of its weight. */
enum { RAYS_OF_ELEMENT = 8, RAYS_LEAST = 256 };

/* x_i = sum_r |w_ri| / A_i over the rows of a set, its mean over each so many elements that follow each other
 * in `order`; rows of sensors in walls are left out. */
static void add_rows(const sensor_rows *rows, const mesh *m, const uint32_t *order, size_t together,
                     double *x) {
    const size_t n = m->n;
    for (size_t i = 0; i < n; i++) x[i] = 0;
    for (size_t r = 0; r < rows->n_receivers; r++)
        for (uint64_t e = rows->start[r];
             (double)rows->backs[r] <= SENSOR_BACKS_MOST && e < rows->start[r + 1]; e++)
            x[rows->element[e]] += fabs((double)rows->weight[e]);
    for (size_t first = 0; first < n; first += together) {
        const size_t end = first + together < n ? first + together : n;
        double light = 0, area = 0;
        for (size_t k = first; k < end; k++) {
            light += x[order[k]];
            area += m->area[order[k]];
        }
        for (size_t k = first; k < end; k++) x[order[k]] = light / area;
    }
}

lam_status scene_read_at_sensors(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    importance *of = &scene->importance;
    const mesh *m = &scene->m;
    const size_t n = m->n;
    sensor_rows rows = {.n = 0};
    double *x = NULL;
    if (of->n == 0 || !of->sensors) return LAM_OK;
    x = memory_allocate(n, sizeof *x, "importance", error);
    if (x == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < scene->sensors.list.n_sets; k++) {
        const sensor_set *set = &scene->sensors.list.sets[k];
        size_t rays = RAYS_LEAST;
        while (rays < SENSOR_RAYS_MOST && rays * set->count < RAYS_OF_ELEMENT * n) rays *= 2;
        const size_t together = 1 + (RAYS_OF_ELEMENT * n - 1) / (rays * set->count);
        const sensor_rows_options how = {.rays = rays,
                                         .seed = precompute_seed(job->options->seed, SEED_SENSORS),
                                         .progress = &job->progress,
                                         .stage = "importance"};
        sensor_rows_free(&rows);
        TRY(sensor_rows_make(m, set->count, scene->sensors.list.receivers + set->first, &how, &rows, error));
        add_rows(&rows, m, scene->order, together, x);
        add_shares(m, x, of->read);
    }
    const size_t count = count_above_zero(of->read, n);
    if (count == 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--receivers sensors: they see no element; all of them may lie in walls");
    terminal_log(job->t, "receivers: %zu of %zu elements, those that light comes from to sensors with them",
                 count, n);
done:
    sensor_rows_free(&rows);
    free(x);
    return status;
}

/* Rows of a stream are found as the operator asks for them: a few rays of each element tell enough. */
static lam_status find_by_rays(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    enum { RAYS = 64 };
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = {.rays = RAYS, .seed = job->options->seed},
                                     .progress = &job->progress,
                                     .stage = "importance"};
    form_factors f = {.row_sums = NULL};
    TRY(form_factors_make(&scene->m, scene->order, &how, &f, error));
    const factor_product F = factor_product_of_rows(&f.F);
    TRY(importance_find(&F, scene->m.n_channels, scene->m.reflectance, scene->m.area, &scene->importance,
                        error));
done:
    form_factors_free(&f);
    return status;
}

lam_status scene_find_importance(const precompute_job *job, precompute_scene *scene,
                                 const precompute_plan *plan, const precompute_factors *factors,
                                 lam_error *error) {
    if (scene->importance.n == 0 || importance_is_found(&scene->importance)) return LAM_OK;
    if (plan->streamed) return find_by_rays(job, scene, error);
    const factor_product F = factors->blocks.n > 0 ? block_factors_product(&factors->blocks)
                                                   : factor_product_of_rows(&factors->f.F);
    return importance_find(&F, scene->m.n_channels, scene->m.reflectance, scene->m.area, &scene->importance,
                           error);
}
