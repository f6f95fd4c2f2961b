/* Sensors of --sensors or of a store: the weights with which light comes to them, and that of luminaires. */
#include "solver/precompute/stages.h"
#include "solver/sensor/eye_luminaires.h"
#include "solver/sensor/probe_grid.h"
#include "solver/sensor/sensor_luminaires.h"
#include "solver/sensor/sensors_store.h"

#include <stdlib.h>
#include <string.h>

/* Rays of a receiver by --quality. */
static const size_t rays_of[] = {[QUALITY_DRAFT] = 256, [QUALITY_NORMAL] = 1024, [QUALITY_HIGH] = 4096};

void scene_sensors_free(scene_sensors *s) {
    sensors_free(&s->list);
    sensor_rows_free(&s->rows);
    free(s->H);
    free(s->inside);
    free(s->eyes);
    free(s->seen);
    *s = (scene_sensors){.H = NULL};
}

/* Adds the probes of --probes-grid, and says how many sensors there are. */
static lam_status add_probes(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const probe_grid grid = {.spacing = o->probes_grid, .y_up = o->probes_y_up};
    sensor_list *list = &scene->sensors.list;
    size_t left_out = 0;
    if (o->probes_y_up && !(o->probes_grid > 0))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--probes-y-up is for --probes-grid; sets of a file have \"axes\": \"y-up\"");
    if (o->probes_grid > 0) {
        TRY(probe_grid_add(&scene->m, &grid, list, &left_out, error));
        const size_t n = list->sets[list->n_sets - 1].count / HARMONICS;
        terminal_log(job->t, "probes at %zu of %zu points of the grid; others lie in walls or outside", n,
                     n + left_out);
    }
    size_t n = 0; /* a probe is one of them */
    for (size_t k = 0; k < list->n; k++) n += !receiver_follows(&list->receivers[k]);
    if (n > 0)
        terminal_log(job->t, "%zu sensor%s in %zu set%s", n, n == 1 ? "" : "s", list->n_sets,
                     list->n_sets == 1 ? "" : "s");
done:
    return status;
}

lam_status scene_take_sensors(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const char *path = job->options->sensors;
    const sensors_options how = {.up = scene->m.up, .m = &scene->m};
    sensor_list *list = &scene->sensors.list;
    if (path != NULL && strcmp(path, SENSORS_NONE) != 0) {
        TRY(sensors_read(path, &how, list, error));
        scene_warn(job, &list->warnings);
    }
    TRY(add_probes(job, scene, error));
done:
    return status;
}

lam_status scene_load_sensors(const precompute_job *job, store *s, precompute_scene *scene,
                              lam_error *error) {
    lam_status status = LAM_OK;
    if (job->options->sensors != NULL) return scene_take_sensors(job, scene, error);
    TRY(sensors_load_list(s, &scene->sensors.list, error));
    if (job->options->probes_grid > 0 || job->options->probes_y_up) TRY(add_probes(job, scene, error));
done:
    return status;
}

/* [n_groups]: groups of elements that --sources names, all of whose elements are whole sources; elements that
 * luminaires light are mostly parts of one. NULL where there are none. */
static lam_status find_sources(const precompute_scene *scene, bool **out, lam_error *error) {
    const float *emits = scene->importance.emits;
    *out = NULL;
    if (emits == NULL) return LAM_OK;
    *out = memory_allocate(scene->m.n_groups, sizeof **out, "sensors", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < scene->m.n_groups; g++) (*out)[g] = true;
    for (size_t i = 0; i < scene->m.n; i++)
        if (emits[i] < 1) (*out)[scene->m.group[i]] = false;
    return LAM_OK;
}

/* Says which sets have receivers without a value. */
static void log_flags(const precompute_job *job, const scene_sensors *s, bool rows) {
    for (size_t k = 0; k < s->list.n_sets; k++) {
        const sensor_set *set = &s->list.sets[k];
        size_t walls = 0, inside = 0, all = 0;
        for (size_t i = set->first; i < set->first + set->count; i++) {
            if (receiver_follows(&s->list.receivers[i])) continue;
            all++;
            walls += rows && (double)s->rows.backs[i] > SENSOR_BACKS_MOST;
            inside += s->inside != NULL && s->inside[i];
        }
        if (walls > 0)
            terminal_warn(
                job->t,
                "sensors %s: %zu of %zu lie in a wall or outside of the scene, as most of their rays "
                "meet backs of faces: they have no value",
                set->name, walls, all);
        if (inside > 0)
            terminal_warn(job->t,
                          "sensors %s: %zu of %zu lie in the opening of a luminaire: they have no value",
                          set->name, inside, all);
    }
}

/* All luminaires as the eyes among the sensors see them. */
static lam_status find_seen(precompute_scene *scene, const direct_options *how, lam_error *error) {
    lam_status status = LAM_OK;
    scene_sensors *s = &scene->sensors;
    const placed_luminaires *placed = &scene->luminaires.placed;
    size_t size;
    TRY(eyes_find(&s->list, &s->n_eyes, &s->eyes, error));
    if (s->n_eyes == 0) return LAM_OK;
    if (!size_multiply(placed->n, s->n_eyes, &size))
        FAIL(error, LAM_ERR_MEMORY, "%zu luminaires for %zu eyes are too many for memory", placed->n,
             s->n_eyes);
    s->seen = memory_allocate(size, sizeof *s->seen, "luminaires that eyes see", error);
    if (s->seen == NULL) TRY(LAM_ERR_MEMORY);
    TRY(eye_luminaires_make(&scene->m, placed, how, s->list.receivers, s->n_eyes, s->eyes, s->seen, error));
done:
    return status;
}

/* The direct light of all luminaires at the sensors. */
static lam_status find_luminaires(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    scene_sensors *s = &scene->sensors;
    const placed_luminaires *placed = &scene->luminaires.placed;
    const direct_options how = {.seed = precompute_seed(job->options->seed, SEED_LUMINAIRES),
                                .progress = &job->progress,
                                .stage = "luminaires at sensors"};
    size_t size;
    if (placed->n == 0) return LAM_OK;
    if (!size_multiply(placed->n, s->list.n, &size))
        FAIL(error, LAM_ERR_MEMORY, "%zu luminaires for %zu sensors are too many for memory", placed->n,
             s->list.n);
    s->H = memory_allocate(size, sizeof *s->H, "light of luminaires", error);
    s->inside = memory_allocate(s->list.n, sizeof *s->inside, "light of luminaires", error);
    if (s->H == NULL || s->inside == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sensor_luminaires_make(&scene->m, placed, &how, s->list.n, s->list.receivers, s->H, s->inside,
                               error));
    TRY(find_seen(scene, &how, error));
done:
    return status;
}

lam_status stage_sensors(const precompute_job *job, precompute_scene *scene, const sky_bounce *sky, bool rows,
                         lam_error *error) {
    lam_status status = LAM_OK;
    scene_sensors *s = &scene->sensors;
    bool *sources = NULL;
    if (s->list.n == 0) return LAM_OK;
    if (rows) {
        TRY(find_sources(scene, &sources, error));
        const sensor_rows_options how = {.rays = rays_of[job->options->quality],
                                         .seed = precompute_seed(job->options->seed, SEED_SENSORS),
                                         .sources = sources,
                                         .sky = sky->first_bounce != NULL ? sky : NULL,
                                         .openings = scene->openings,
                                         .progress = &job->progress,
                                         .stage = "sensors"};
        TRY(sensor_rows_make(&scene->m, s->list.n, s->list.receivers, &how, &s->rows, error));
    }
    TRY(find_luminaires(job, scene, error));
    log_flags(job, s, rows);
done:
    free(sources);
    return status;
}

sensors_lit scene_sensors_lit(const precompute_scene *scene) {
    const scene_sensors *s = &scene->sensors;
    return (sensors_lit){.n_luminaires = scene->luminaires.placed.n,
                         .H = s->H,
                         .inside = s->inside,
                         .n_eyes = s->n_eyes,
                         .eyes = s->eyes,
                         .seen = s->seen};
}

lam_status scene_sensors_save(const precompute_scene *scene, store *s, lam_error *error) {
    const scene_sensors *sensors = &scene->sensors;
    const sensors_lit lit = scene_sensors_lit(scene);
    if (sensors->list.n == 0) return LAM_OK;
    return sensors_save(&sensors->list, &sensors->rows, &lit, s, error);
}
