/* Luminaires and sensors of a store in place of those that it has, or beside none: all else is copied, so
 * that a lamp or a sensor is moved without making an operator anew. */
#include "solver/base/clock.h"
#include "solver/operator/stated/error_law.h"
#include "solver/precompute/own_error.h"
#include "solver/precompute/stages.h"
#include "solver/sensor/sensors_store.h"
#include "store/groups.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Options that do not ask for another operator. */
static bool is_light_alone(const char *name) {
    static const char *const names[] = {"output",  "luminaires", "sensors", "probes-grid", "probes-y-up",
                                        "assets",  "quality",    "seed",    "threads",     "quiet",
                                        "verbose", "progress",   "json"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (strcmp(name, names[k]) == 0) return true;
    return false;
}

/* True where rows of sensors are to be found; else those of the store stay. */
static bool sensors_are_new(const precompute_options *o) {
    return o->sensors != NULL || o->probes_grid > 0;
}

bool relight_is_asked(const precompute_options *o, const option_result *given) {
    bool alone = o->from_store && (o->luminaires != NULL || sensors_are_new(o));
    for (size_t i = 0; i < given->n_given; i++) alone = alone && is_light_alone(given->given[i]);
    return alone;
}

/* All that luminaires give is written anew, what sensors are in their other parts is not. */
static bool skip_light(const char *object, const char *attribute) {
    return attribute == NULL ? strcmp(object, STORE_LUMINAIRES) == 0 || sensors_are_lit_by(object)
                             : strcmp(object, STORE_MESH) == 0 && strcmp(attribute, "lights") == 0;
}

static bool skip_luminaires(const char *object, const char *attribute) {
    return skip_light(object, attribute) || figure_is_of_luminaires(object, attribute);
}

static bool skip_sensors(const char *object, const char *attribute) {
    return skip_light(object, attribute) || (attribute == NULL && strcmp(object, STORE_SENSORS) == 0);
}

static bool skip_both(const char *object, const char *attribute) {
    return skip_luminaires(object, attribute) || skip_sensors(object, attribute);
}

/* The error of the answer for the luminaires that are there now, by what the store states of all other light,
 * and of the mesh for theirs. */
static lam_status find_own_error(precompute_scene *scene, store *from, made_operator *made,
                                 lam_error *error) {
    static const int of_luminaires[] = {MESH_OF_LUMINAIRES, MESH_OF_LUMINAIRE};
    lam_status status = LAM_OK;
    const mesh_figures *own = &made->errors_of_mesh;
    const figures_shape shape = {.n_groups = scene->m.n_groups, .n_channels = scene->m.n_channels};
    stated_figures loaded = {.repair = 0};
    TRY(stated_figures_load(from, &shape, &loaded, error));
    TRY(error_overlap_load(from, scene->m.n_groups, &scene->m.overlap, error));
    TRY(importance_load(from, scene->m.n, &scene->importance, error));
    stated_figures view = loaded;
    for (int k = 0; k < 2; k++) {
        const int of = of_luminaires[k];
        view.mesh.variation[of] = own->variation[of];
        view.mesh.reflected[of] = own->reflected[of];
        view.mesh.light_of[of] = own->light_of[of];
    }
    view.mesh.has_luminaires = own->has_luminaires;
    view.mesh.luminaires = own->luminaires;
    view.mesh.luminaires_number = own->luminaires_number;
    view.mesh.has_luminaire = own->has_luminaire;
    view.mesh.luminaire = own->luminaire;
    status = own_error_find(scene, made->op, &view, &made->own, error);
    loaded.by_group = view.by_group;
done:
    stated_figures_free(&loaded);
    return status;
}

/* The stated errors for the luminaires that are there now, where the store states errors. */
static lam_status find_errors(const precompute_job *job, precompute_scene *scene, store *from,
                              made_operator *made, lam_error *error) {
    lam_status status = LAM_OK;
    const double started = clock_seconds();
    if (scene->luminaires.placed.n == 0 || !mesh_figures_are_stated(from)) return LAM_OK;
    TRY(operator_load(from, &made->op, error));
    lam_operator_set_threads(made->op, (size_t)omp_get_max_threads());
    TRY(stage_mesh_error_of_luminaires(job, scene, made, error));
    TRY(find_own_error(scene, from, made, error));
    terminal_log_stage(job->t, "mesh error", clock_seconds() - started);
done:
    return status;
}

/* Writes the sensors anew, or the light of luminaires at those that are copied. */
static lam_status save_sensors(const precompute_scene *scene, bool rows, store *from, store *to,
                               lam_error *error) {
    const scene_sensors *s = &scene->sensors;
    const sensors_lit lit = scene_sensors_lit(scene);
    if (rows) return scene_sensors_save(scene, to, error);
    return s->list.n > 0 ? sensors_save_lit(from, s->list.n, &lit, to, error) : LAM_OK;
}

/* A store of few emitters has the light of those alone, and one for luminaires as sources, or for sensors as
 * receivers, that of its own. Positions of a light have none at sensors. */
static lam_status check_operator(const precompute_job *job, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char *kind = NULL;
    if (sensors_are_new(job->options) && store_has(s, STORE_IMPORTANCE) &&
        store_has_attribute(s, STORE_IMPORTANCE, "sensors"))
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: was built for the light at the sensors that it has (--receivers); precompute its scene "
             "with --sensors",
             job->options->input);
    if (job->options->luminaires != NULL && store_has(s, STORE_SOURCES) &&
        store_has_attribute(s, STORE_SOURCES, "luminaires"))
        FAIL(
            error, LAM_ERR_ARGUMENT,
            "%.200s: was built for the light of the luminaires that it has (--sources); precompute its scene "
            "with --luminaires",
            job->options->input);
    TRY(store_get_text(s, STORE_OPERATOR, "kind", &kind, error));
    if (sensors_are_new(job->options) && store_has(s, STORE_OPERATOR "/direct"))
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: is of positions of a light, whose direct light is known on elements alone: it has no "
             "values at sensors",
             job->options->input);
    if (strcmp(kind, "emitters") == 0 && job->options->luminaires != NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%.200s: answers for the emitters that it was made for; precompute its scene with --luminaires",
             job->options->input);
done:
    free(kind);
    return status;
}

lam_status relight_run(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const bool rows = sensors_are_new(job->options), lights = job->options->luminaires != NULL;
    store_skip *const skip = lights ? rows ? skip_both : skip_luminaires : skip_sensors;
    made_operator made = {.op = NULL};
    sky_bounce sky = {.n = 0};
    store *from = NULL, *to = NULL;
    double started = clock_seconds();
    TRY(store_open(job->options->input, &from, error));
    TRY(check_operator(job, from, error));
    TRY(mesh_load(from, &scene->m, NULL, error));
    TRY(scene_load_luminaires(job, from, scene, error));
    TRY(scene_load_sensors(job, from, scene, error));
    if (rows && store_has(from, STORE_SKY)) TRY(sky_bounce_load(from, scene->m.n, &sky, error));
    terminal_log_stage(job->t, "import", clock_seconds() - started);
    started = clock_seconds();
    TRY(stage_luminaires(job, scene, error));
    if (scene->luminaires.placed.n > 0) terminal_log_stage(job->t, "luminaires", clock_seconds() - started);
    started = clock_seconds();
    TRY(stage_sensors(job, scene, &sky, rows, error));
    if (scene->sensors.list.n > 0) terminal_log_stage(job->t, "sensors", clock_seconds() - started);
    if (lights) TRY(find_errors(job, scene, from, &made, error));
    TRY(terminal_check(error));
    started = clock_seconds();
    TRY(store_create(job->options->output, &to, error));
    TRY(store_copy(from, skip, to, error));
    TRY(store_set_text(to, STORE_MESH, "lights", light_kind_word(scene->m.lights), error));
    TRY(luminaires_save(&scene->luminaires, &scene->m, to, error));
    TRY(save_sensors(scene, rows, from, to, error));
    TRY(stated_figures_save(&(stated_figures){.mesh = made.errors_of_mesh, .own = made.own}, to, error));
    if (scene->luminaires.placed.n > 0)
        TRY(store_set_text(to, STORE_LUMINAIRES, "command", job->options->command, error));
    TRY(terminal_check(error));
    store *sealing = to;
    to = NULL;
    TRY(store_seal(sealing, error));
    terminal_log_stage(job->t, "store", clock_seconds() - started);
done:
    store_close(to);
    store_close(from);
    sky_bounce_free(&sky);
    mesh_figures_free(&made.errors_of_mesh);
    lam_operator_close(made.op);
    return status;
}
