/* A scene is opened from a store, or as a variant of another one, and is freed with its last reference.
 * read_store() forecasts the bytes of operator, sky, luminaires, sensors, mesh and errors before it reads
 * them, and refuses more than options->memory; scene_verify() and scene_damaged() keep the health of mapped
 * arrays. */
#include "server/scene/scene.h"

#include "server/queue/batch.h"
#include "server/scene/group_list.h"
#include "server/scene/luminaire_places.h"
#include "server/scene/map_guard.h"
#include "server/scene/scene_memory.h"
#include "server/scene/sensor_answer.h"
#include "server/scene/sensor_places.h"
#include "server/scene/tile_places.h"
#include "solver/base/clock.h"
#include "solver/base/scene/scene_backs.h"
#include "solver/base/scene/scene_buried.h"
#include "solver/base/scene/scene_lights.h"
#include "solver/codec/describe.h"
#include "solver/operator/emitters.h"
#include "solver/operator/groups/mesh_columns.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/operator.h"
#include "solver/operator/sensor_light.h"
#include "solver/operator/sky_light.h"
#include "store/groups.h"
#include "store/store.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Limit of the adjoint rows of a scene. */
#define ADJOINT_ROWS_BYTES ((size_t)256 << 20)
#define SENSOR_COLUMNS_BYTES ((size_t)256 << 20)

enum { HEALTH_UNKNOWN, HEALTH_SOUND, HEALTH_DAMAGED };

/* Answers may make one doubt a scene once in this many seconds. */
#define DOUBT_S 60
#define NEVER_DOUBTED (-DOUBT_S)

struct scene_health {
    atomic_int state;
    atomic_bool reported;
    atomic_llong verified_at; /* Unix time, s; 0: never */
    atomic_llong doubted_at;  /* of the monotonic clock, s; NEVER_DOUBTED */
    map_range *guard;         /* NULL: nothing is mapped */
    lam_error damage;         /* of HEALTH_DAMAGED: the first, written once and before the state is */
    bool is_named;            /* damage is written; the verifier's own */
};

static void scene_health_free(scene_health *health) {
    if (health == NULL) return;
    map_guard_remove(health->guard);
    free(health);
}

/* Guards a mapping, of which nothing was compared yet. Freed by scene_health_free while the mapping still
 * exists. Errors: LAM_ERR_MEMORY. */
static lam_status scene_health_create(const char *path, const store_map *map, scene_health **out,
                                      lam_error *error) {
    lam_status status = LAM_OK;
    const void *begin;
    size_t bytes;
    scene_health *made = memory_allocate(1, sizeof *made, path, error);
    if (made == NULL) return LAM_ERR_MEMORY;
    atomic_init(&made->state, HEALTH_UNKNOWN);
    atomic_init(&made->reported, false);
    atomic_init(&made->verified_at, 0);
    atomic_init(&made->doubted_at, NEVER_DOUBTED);
    store_map_range(map, &begin, &bytes);
    made->guard = map_guard_add(begin, bytes);
    if (made->guard == NULL)
        FAIL(error, LAM_ERR_MEMORY, "%s: more than %d stores are mapped; serve fewer", path,
             MAP_GUARD_RANGES);
    *out = made;
    made = NULL;
done:
    scene_health_free(made);
    return status;
}

/* Maps the store, so that it is guarded before anything in it is read. */
static lam_status map_store(store *s, const scene_options *options, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(store_map_file(s, error));
    made->map = store_map_hold(store_map_of(s));
    TRY(scene_health_create(made->path, made->map, &made->health, error));
    if (store_identity_of(s)->size < options->verify_below) store_map_populate(made->map);
done:
    return status;
}

/* Compares mapped arrays, if that is to be done before the scene is served, and lets a mapping go that
 * nothing is used of. Only here is it known which numbers are mapped, which must be finite. */
static lam_status settle_map(const scene_options *options, scene *made, lam_error *error) {
    scene_health *health = made->health;
    const size_t mapped = store_map_bytes(made->map);
    if (mapped == 0) {
        map_guard_remove(health->guard);
        health->guard = NULL;
        store_map_release(made->map);
        made->map = NULL;
    }
    const bool first = options->verify || mapped < options->verify_below;
    if (mapped > 0 && first) {
        const lam_status status = store_map_verify(made->map, options->stop, error);
        if (status != LAM_OK) return status;
    }
    if (first) atomic_store(&health->verified_at, (long long)time(NULL));
    if (mapped == 0 || first) atomic_store(&health->state, HEALTH_SOUND);
    return LAM_OK;
}

/* *text: the description of the store under the name that it is served by, one line of JSON, freed by the
 * caller. */
static lam_status describe_scene(store *s, const scene *loaded, char **text, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *made = NULL;
    TRY(describe_store(s, &made, error));
    if (json_object_set_new(made, "name", json_string(loaded->name)) != 0)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: its name is not UTF-8; rename the file, or give the scene another "
             "name: STORE:NAME",
             loaded->path);
    char *written = json_dumps(made, JSON_COMPACT);
    if (written == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory to describe it", loaded->path);
    *text = written;
done:
    json_decref(made);
    return status;
}

/* The description of the base with the name, bytes and reflectances of the variant (groups, a JSON object as
 * text) and without error figures. */
static lam_status describe_variant(const scene *variant, const char *groups, char **text, lam_error *error) {
    lam_status status = LAM_OK;
    json_t *made = json_loads(variant->base->description, 0, NULL);
    char *written = NULL;
    if (made != NULL && json_object_set_new(made, "name", json_string(variant->name)) == 0 &&
        json_object_set_new(made, "bytes", json_integer((json_int_t)variant->bytes)) == 0 &&
        json_object_set_new(made, "error", json_object()) == 0 &&
        json_object_set_new(made, "variant_of", json_string(variant->base->name)) == 0 &&
        json_object_set_new(made, "reflectance", json_loads(groups, 0, NULL)) == 0)
        written = json_dumps(made, JSON_COMPACT);
    if (written == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory to describe it", variant->name);
    *text = written;
done:
    json_decref(made);
    return status;
}

/* *out [n_groups]: true where `others` counts none among the elements of a group. */
static lam_status find_groups(const scene *made,
                              size_t (*others)(const stated_errors *, size_t, const uint32_t *), bool **out,
                              lam_error *error) {
    const group_index *groups = &made->groups;
    *out = memory_allocate(groups->n_groups, sizeof **out, "groups", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < groups->n_groups; g++)
        (*out)[g] = others(&made->errors, groups->start[g + 1] - groups->start[g],
                           groups->elements + groups->start[g]) == 0;
    return LAM_OK;
}

/* The errors for answers, and the groups that have nothing but receivers, or but sources. */
static lam_status read_errors(store *s, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    const error_scene about = scene_for_errors(made);
    TRY(stated_errors_read(s, &about, made->op, &made->errors, error));
    if (made->errors.read != NULL) TRY(find_groups(made, stated_errors_others, &made->group_read, error));
    if (made->errors.emits != NULL)
        TRY(find_groups(made, stated_errors_strangers, &made->group_emits, error));
done:
    return status;
}

/* Once areas are read. */
static lam_status read_faces(store *s, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    scene_faces faces = {.n_faces = 0};
    size_t n_backs = 0;
    bool two_sided;
    TRY(scene_backs_load(s, made->n, &n_backs, &two_sided, error));
    TRY(scene_faces_load(s, made->n, made->n - n_backs, &faces, error));
    TRY(face_index_make(made->n, made->n - n_backs, made->area, &faces, &made->faces, error));
done:
    return status;
}

/* The work area of a thread for its passes; vectors and answers belong to requests. */
static size_t pass_work_bytes(const scene *s) {
    const size_t solving = lam_operator_work_bytes(s->op, BATCH_PASS),
                 limiting = lam_limiter_work_bytes(&s->limiter);
    return solving > limiting ? solving : limiting;
}

uint64_t scene_work_memory(size_t n_threads, size_t work_bytes) {
    return (uint64_t)n_threads * work_bytes;
}

/* Waking a thread for a part of a pass takes about as long as reading this many bytes; a smaller part costs
 * more than it saves. */
#define LEAST_OF_THREAD ((size_t)8 << 20)

static size_t threads_of(const lam_operator *op, size_t most) {
    const size_t worth = lam_operator_bytes(op) / LEAST_OF_THREAD;
    return worth < 1 ? 1 : worth < most ? worth : most;
}

/* The tiling of the sky by name, where the store states it. */
static lam_status read_tiling(store *s, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    char *name = NULL, *up = NULL;
    if (made->sky == NULL || !store_has(s, STORE_SKY "/tiles")) goto done;
    TRY(store_get_text(s, STORE_SKY, "tiling", &name, error));
    TRY(store_get_text(s, STORE_SKY, "up", &up, error));
    if (strlen(name) < sizeof made->sky_tiling) strcpy(made->sky_tiling, name);
    made->sky_up = up[0];
    if (store_has_attribute(s, STORE_SKY, "north"))
        TRY(store_get_number(s, STORE_SKY, "north", &made->sky_north, error));
    if (!(fabs(made->sky_north) <= 360))
        FAIL(error, LAM_ERR_FORMAT, "%s: /sky attribute north is %g, must be from -360 to 360", store_path(s),
             made->sky_north);
done:
    free(name);
    free(up);
    return status;
}

/* Once groups, areas, reflectances and emission are there. *memory: bytes of the text. */
static lam_status keep_groups(scene *made, uint64_t *memory, lam_error *error) {
    buffer groups = {0};
    const lam_status status = group_list_write(made, &groups, error);
    return status == LAM_OK ? scene_texts_add_groups(&made->texts, &groups, made->ledger, memory, error)
                            : status;
}

/* Once the scene is described. */
static lam_status keep_texts(store *s, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    buffer tiles = {0}, luminaires = {0}, sensors = {0};
    uint64_t memory, of_luminaires, of_sensors, of_groups;
    TRY(scene_texts_describe(&made->texts, made->description, made->ledger, error));
    TRY(read_tiling(s, made, error));
    if (made->sky != NULL) TRY(tile_places_read(s, lam_sky_tiles(made->sky), &tiles, error));
    TRY(scene_texts_add_sky(&made->texts, &tiles, &made->weather, made->ledger, &memory, error));
    TRY(luminaire_places_write(made->luminaires, &luminaires, error));
    TRY(scene_texts_add_luminaires(&made->texts, &luminaires, made->ledger, &of_luminaires, error));
    TRY(sensor_places_write(made->sensors, &sensors, error));
    TRY(scene_texts_add_sensors(&made->texts, &sensors, made->ledger, &of_sensors, error));
    TRY(keep_groups(made, &of_groups, error));
    made->memory += memory + of_luminaires + of_sensors + of_groups +
                    made->groups.n_groups * made->n_channels * sizeof *made->group_emission;
done:
    buffer_free(&sensors);
    buffer_free(&luminaires);
    buffer_free(&tiles);
    return status;
}

/* Room for the columns of sensors, and for matrices of elements. */
static lam_status make_columns(scene *made, lam_error *error) {
    const sensor_lights lights = scene_sensor_lights(made);
    const lam_status status = matrix_cache_create(made->ledger, &made->matrices, error);
    if (status != LAM_OK || made->sensors == NULL) return status;
    return sensor_columns_create(sensor_lights_count(&lights), sensor_column_width(made),
                                 SENSOR_COLUMNS_BYTES, made->ledger, &made->columns, error);
}

static lam_status read_store(store *s, const scene_options *options, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    if (!store_has(s, STORE_OPERATOR))
        FAIL(error, LAM_ERR_FORMAT, "%s: holds no operator; precompute it again", options->path);
    uint64_t passing;
    TRY(scene_memory_of(s, &made->memory, &made->bytes, error));
    TRY(scene_memory_passing(s, &passing, error));
    if (made->memory + passing > options->memory)
        FAIL(error, LAM_ERR_MEMORY,
             "%s: takes %llu bytes, and %llu more while it is read, %llu are left of --max-memory; raise it",
             options->path, (unsigned long long)made->memory, (unsigned long long)passing,
             (unsigned long long)options->memory);
    TRY(weather_file_read(options->path, options->memory - made->memory, &made->weather, error));
    made->memory += made->weather.length;
    if (options->verify) TRY(store_verify(s, error));
    TRY(map_store(s, options, made, error));
    if (!options->verify) TRY(store_verify_group(s, STORE_MESH, error));
    TRY(operator_load(s, &made->op, error));
    made->n = lam_operator_elements(made->op);
    made->n_channels = lam_operator_channels(made->op);
    made->reflectance = made->op->reflectance;
    lam_operator_set_threads(made->op, threads_of(made->op, options->threads));
    TRY(sky_load(s, made->n, &made->sky, error));
    TRY(luminaires_load(s, made->n, made->n_channels, &made->luminaires, error));
    TRY(luminaire_names_make(made->luminaires, &made->luminaire_names, error));
    TRY(sensors_load(s, made->n, made->n_channels, &made->sensors, error));
    TRY(sensor_names_make(made->sensors, &made->sensor_sets, error));
    made->n_emitters = lam_operator_emitters(made->op);
    TRY(group_index_of_emitters(made->op, &made->emitters, error));
    TRY(group_index_load(s, made->n, &made->groups, error));
    TRY(areas_view(s, made->n, &made->areas, error));
    made->area = made->areas.data;
    TRY(group_index_measure(&made->groups, made->area, error));
    TRY(group_emission_read(s, made, &made->group_emission, error));
    TRY(scene_lights_load(s, &made->lights, error));
    TRY(read_faces(s, made, error));
    made->limiter =
        limiter_of(made->n, made->groups.n_groups, made->groups.start, made->groups.elements, made->area);
    made->work_bytes = pass_work_bytes(made);
    made->ledger = options->ledger;
    TRY(row_cache_create(ADJOINT_ROWS_BYTES, made->ledger, &made->rows, error));
    TRY(make_columns(made, error));
    TRY(refined_create(s, made->op, made->ledger, &made->refined, error));
    TRY(read_errors(s, made, error));
    TRY(describe_scene(s, made, &made->description, error));
    TRY(keep_texts(s, made, error));
    made->memory += strlen(made->description);
    TRY(scene_mesh_create(s, made, &made->mesh, error));
    TRY(scene_elements_create(made, &made->elements, error));
    TRY(scene_corners_create(made, made->ledger, &made->corners, error));
    if (made->sky_tiling[0] != '\0' && store_has_attribute(s, STORE_SKY, "ground_albedo"))
        TRY(scene_sun_create(s, made, &made->sun, error));
    TRY(settle_map(options, made, error));
done:
    return status;
}

/* True if the file, and the weather beside it, are those that the present scene was read from, and that scene
 * is not damaged. */
static bool is_unchanged(const scene_options *options, const store *s) {
    return options->before != NULL && store_identity_same(&options->before->identity, store_identity_of(s)) &&
           weather_file_same(&options->before->weather, options->path) &&
           !scene_damaged(options->before, NULL, NULL);
}

lam_status scene_open(const scene_options *options, scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    const char *path = options->path;
    store *s = NULL;
    scene *made = memory_allocate(1, sizeof *made, path, error);
    if (made == NULL) return LAM_ERR_MEMORY;
    atomic_init(&made->references, 1);
    made->path = strdup(path);
    if (made->path == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", path);
    TRY(store_open_within(path, options->memory, options->stop, &s, error));
    made->identity = *store_identity_of(s);
    if (is_unchanged(options, s)) {
        if (options->verify) TRY(store_verify(s, error));
        *out = scene_acquire(options->before);
        goto done;
    }
    made->name = strdup(options->name);
    if (made->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", path);
    TRY(read_store(s, options, made, error));
    *out = made;
    made = NULL;
done:
    store_close(s);
    if (made != NULL) scene_release(made);
    return status;
}

lam_status scene_open_variant(scene *base, const char *name, const char *groups, lam_operator *op,
                              scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    operator_description of_op;
    uint64_t of_groups;
    scene *made = memory_allocate(1, sizeof *made, name, error);
    if (made == NULL) {
        lam_operator_close(op);
        return LAM_ERR_MEMORY;
    }
    operator_describe(op, &of_op);
    atomic_init(&made->references, 1);
    made->base = scene_acquire(base);
    made->path = base->path;
    made->n = base->n;
    made->n_channels = base->n_channels;
    made->op = op;
    made->reflectance = op->reflectance;
    made->groups = base->groups;
    made->lights = base->lights;
    made->faces = base->faces;
    made->area = base->area;
    made->group_emission = base->group_emission;
    made->limiter = base->limiter;
    made->sky = base->sky;
    made->luminaires = base->luminaires;
    made->luminaire_names = base->luminaire_names;
    made->sensors = base->sensors;
    made->sensor_sets = base->sensor_sets;
    made->sun = base->sun;
    made->map = base->map;
    made->health = base->health;
    made->work_bytes = base->work_bytes;
    made->bytes = (uint64_t)base->n_channels * of_op.rank * of_op.rank * sizeof(float);
    made->name = strdup(name);
    if (made->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", name);
    made->ledger = base->ledger;
    TRY(row_cache_create(ADJOINT_ROWS_BYTES, made->ledger, &made->rows, error));
    TRY(make_columns(made, error));
    TRY(refined_create_variant(base->refined, op, &made->refined, error));
    TRY(describe_variant(made, groups, &made->description, error));
    TRY(scene_texts_describe(&made->texts, made->description, made->ledger, error));
    TRY(keep_groups(made, &of_groups, error));
    made->memory = made->bytes + of_groups;
    TRY(scene_mesh_create(NULL, made, &made->mesh, error));
    TRY(scene_elements_create(made, &made->elements, error));
    *out = made;
    made = NULL;
done:
    if (made != NULL) scene_release(made);
    return status;
}

uint64_t scene_grown(const scene *s) {
    return (uint64_t)refined_held(s->refined) + row_cache_held(s->rows) + sensor_columns_held(s->columns) +
           scene_mesh_held(s->mesh) + scene_elements_held(s->elements) + scene_corners_held(s->corners) +
           matrix_cache_held(s->matrices) + scene_texts_held(&s->texts) +
           (s->base == NULL ? scene_sun_held(s->sun) : 0);
}

void scene_drop_computed(const scene *s) {
    row_cache_clear(s->rows);
    sensor_columns_clear(s->columns);
    matrix_cache_clear(s->matrices);
    scene_mesh_clear(s->mesh);
    scene_elements_clear(s->elements);
    scene_texts_clear(&s->texts);
}

scene *scene_acquire(scene *s) {
    atomic_fetch_add(&s->references, 1);
    return s;
}

void scene_release(scene *s) {
    if (atomic_fetch_sub(&s->references, 1) != 1) return;
    refined_destroy(s->refined);
    lam_operator_close(s->op);
    row_cache_destroy(s->rows);
    sensor_columns_destroy(s->columns);
    matrix_cache_destroy(s->matrices);
    scene_mesh_destroy(s->mesh);
    scene_elements_destroy(s->elements);
    scene_corners_destroy(s->corners);
    scene_texts_free(&s->texts);
    if (s->base == NULL) {
        scene_sun_destroy(s->sun);
        lam_sky_close(s->sky);
        lam_luminaires_close(s->luminaires);
        luminaire_names_free(&s->luminaire_names);
        lam_sensors_close(s->sensors);
        group_index_free(&s->sensor_sets);
        weather_file_free(&s->weather);
        group_index_free(&s->groups);
        group_index_free(&s->emitters);
        face_index_free(&s->faces);
        store_view_free(&s->areas);
        free(s->group_emission);
        stated_errors_free(&s->errors);
        free(s->group_read);
        free(s->group_emits);
        scene_health_free(s->health);
        store_map_release(s->map);
        free(s->path);
    } else {
        scene_release(s->base);
    }
    free(s->description);
    free(s->name);
    free(s);
}

lam_status scene_verify(scene *s, const stop_check *stop, lam_error *error) {
    scene_health *health = s->health;
    lam_error damage;
    const lam_status status = store_map_verify(s->map, stop, &damage);
    if (status == LAM_OK) {
        atomic_store(&health->verified_at, (long long)time(NULL));
        atomic_store(&health->state, HEALTH_SOUND);
    }
    if (status == LAM_ERR_DAMAGED) {
        /* A second look must not touch what other threads read by now. */
        if (!health->is_named) health->damage = damage;
        health->is_named = true;
        atomic_store(&health->state, HEALTH_DAMAGED);
    }
    if (status != LAM_OK && error != NULL) *error = damage;
    return status;
}

bool scene_verified(const scene *s) {
    return atomic_load(&s->health->state) != HEALTH_UNKNOWN;
}

const char *scene_message(const scene *s, const char *message) {
    const size_t length = strlen(s->path);
    const bool named = strncmp(message, s->path, length) == 0 && strncmp(message + length, ": ", 2) == 0;
    return named ? message + length + 2 : message;
}

long long scene_verified_at(const scene *s) {
    return atomic_load(&s->health->verified_at);
}

bool scene_may_doubt(const scene *s) {
    const long long now = (long long)clock_seconds();
    long long before = atomic_load(&s->health->doubted_at);
    return now - before >= DOUBT_S && atomic_compare_exchange_strong(&s->health->doubted_at, &before, now);
}

bool scene_damaged(const scene *s, lam_error *why, bool *news) {
    scene_health *health = s->health;
    size_t offset;
    lam_error unused;
    if (why == NULL) why = &unused;
    /* Lost pages first: a comparison finds the zeros in their place too, but does not know why. */
    if (map_guard_lost(health->guard, &offset))
        store_map_name(s->map, offset, "cannot be read any more", why);
    else if (atomic_load(&health->state) == HEALTH_DAMAGED)
        *why = health->damage;
    else if (s->map != NULL && store_map_changed(s->map))
        (void)status_fail(why, LAM_ERR_DAMAGED,
                          "%s: was changed since it was mapped; put a new file in its place by renaming, and "
                          "have the stores read again (SIGHUP)",
                          s->path);
    else
        return false;
    if (news != NULL) *news = !atomic_exchange(&health->reported, true);
    return true;
}
