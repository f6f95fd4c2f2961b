#include "server/scene/scene_sun.h"

#include "server/scene/scene_store.h"
#include "server/scene/sensor_answer.h"
#include "solver/base/parallel.h"
#include "solver/base/scene/scene_backs.h"
#include "solver/daylight/sky_tiles.h"
#include "solver/daylight/sun.h"
#include "solver/operator/sensor_light.h"
#include "solver/operator/sky_light.h"
#include "solver/shadow/sun_ground.h"
#include "solver/shadow/sun_places.h"
#include "solver/shadow/sun_shares.h"
#include "store/groups.h"

#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct scene_sun {
    const scene *of;
    size_t n_vertices, n_backs;
    double ground_albedo;
    pthread_mutex_t lock; /* of those below while they are made */
    shadow_tree *tree;    /* NULL until then */
    sky_tiling tiling;
    float *ground;      /* [n], of the irradiance of the ground */
    sun_places *places; /* of the sensors, and what the ground gives them, [receivers]; NULL without */
    float *places_ground;
    float *last; /* [n], the shares of the last sun: clients change lamps under one that stands still */
    request_sun last_of;
    bool has_last; /* with `last` and its sun under the lock */
    atomic_size_t held;
};

lam_status scene_sun_create(store *s, const scene *of, scene_sun **out, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    size_t dims[STORE_MAX_RANK];
    int rank;
    bool two_sided;
    scene_sun *made = memory_allocate(1, sizeof *made, "the sun", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->of = of;
    atomic_init(&made->held, 0);
    pthread_mutex_init(&made->lock, NULL);
    TRY(scene_backs_load(s, of->n, &made->n_backs, &two_sided, error));
    TRY(store_array_info(s, STORE_MESH "/vertices", &type, &rank, dims, error));
    if (type != STORE_F64 || rank != 2 || dims[1] != 3)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/vertices must be [v][3] of f64", store_path(s));
    made->n_vertices = dims[0];
    TRY(store_get_number(s, STORE_SKY, "ground_albedo", &made->ground_albedo, error));
    if (!(made->ground_albedo >= 0 && made->ground_albedo <= 1))
        FAIL(error, LAM_ERR_FORMAT, "%s: /sky attribute ground_albedo is %g, must be from 0 to 1",
             store_path(s), made->ground_albedo);
    *out = made;
    made = NULL;
done:
    scene_sun_destroy(made);
    return status;
}

void scene_sun_destroy(scene_sun *sun) {
    if (sun == NULL) return;
    memory_ledger_give_back(sun->of->ledger, atomic_load(&sun->held));
    shadow_tree_free(sun->tree);
    sky_tiling_free(&sun->tiling);
    free(sun->ground);
    free(sun->last);
    sun_places_free(sun->places);
    free(sun->places_ground);
    pthread_mutex_destroy(&sun->lock);
    free(sun);
}

const char *scene_sun_why_not(const scene *s) {
    if (s->sky == NULL) return "the store has no sky; precompute it with --sky";
    if (s->sun == NULL) return "the store does not state the tiles of its sky; precompute it again";
    if (s->n_emitters > 0)
        return "a store of few emitters answers the sun by the tile that holds it: ask for skies with "
               "sun_in_tiles, or precompute it by another method";
    return NULL;
}

/* Arrays of /mesh that a scene does not hold. */
typedef struct arrays {
    void *vertices, *elements, *normal, *group;
    scene_glass glass;
} arrays;

/* The group of each element. */
static lam_status read_groups(store *s, const scene *of, void **out, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(store_read(s, STORE_MESH "/group", STORE_U32, 1, (size_t[]){of->n}, out, error));
    for (size_t i = 0; i < of->n; i++)
        if (((const uint32_t *)*out)[i] >= of->groups.n_groups)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/group[%zu] = %u, there are %zu groups", store_path(s), i,
                 ((const uint32_t *)*out)[i], of->groups.n_groups);
done:
    return status;
}

static lam_status read_arrays(store *s, const scene_sun *sun, arrays *a, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = sun->of->n, v = sun->n_vertices;
    TRY(store_read(s, STORE_MESH "/vertices", STORE_F64, 2, (size_t[]){v, 3}, &a->vertices, error));
    TRY(store_read(s, STORE_MESH "/elements", STORE_U32, 2, (size_t[]){n, 4}, &a->elements, error));
    TRY(store_read(s, STORE_MESH "/normal", STORE_F32, 2, (size_t[]){n, 3}, &a->normal, error));
    TRY(scene_glass_load(s, sun->of->groups.n_groups, &a->glass, error));
    if (a->glass.of != NULL) TRY(read_groups(s, sun->of, &a->group, error));
    const double *x = a->vertices;
    const uint32_t *e = a->elements;
    const float *normal = a->normal;
    for (size_t k = 0; k < 3 * v; k++)
        if (!(fabs(x[k]) <= (double)FLT_MAX / 4))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/vertices[%zu][%zu] = %g, must be at most %g",
                 store_path(s), k / 3, k % 3, x[k], (double)FLT_MAX / 4);
    for (size_t k = 0; k < 4 * n; k++)
        if (e[k] >= v && !(k % 4 == 3 && e[k] == SHADOW_NO_VERTEX))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements[%zu][%zu] = %u, there are %zu vertices",
                 store_path(s), k / 4, k % 4, e[k], v);
    for (size_t k = 0; k < 3 * n; k++)
        if (!(fabsf(normal[k]) <= 1.0001f))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/normal[%zu][%zu] = %g, must be of a unit vector",
                 store_path(s), k / 3, k % 3, (double)normal[k]);
done:
    return status;
}

static size_t array_bytes(const scene_sun *sun) {
    return sun->n_vertices * 3 * sizeof(double) + sun->of->n * (5 * sizeof(uint32_t) + 3 * sizeof(float)) +
           sun->of->groups.n_groups * sizeof(struct group_glass);
}

/* Rays from the sensors, once there is a tree. */
static lam_status make_places(scene_sun *sun, const shadow_tree *tree, lam_error *error) {
    lam_status status = LAM_OK;
    const scene *of = sun->of;
    placed_receiver *receivers = NULL;
    const size_t s = scene_sensors(of);
    if (s == 0 || sun->places != NULL) return LAM_OK;
    TRY(sensors_receivers(of->sensors, &receivers, error));
    sun->places_ground = memory_allocate(s, sizeof *sun->places_ground, "the sun at sensors", error);
    if (sun->places_ground == NULL) TRY(LAM_ERR_MEMORY);
    if (sensors_sky(of->sensors) != NULL)
        sun_ground_at(&sun->tiling, sun->ground_albedo, sensors_sky(of->sensors), s, receivers,
                      sun->places_ground);
    TRY(sun_places_create(tree, s, receivers, &sun->places, error));
done:
    free(receivers);
    return status;
}

static size_t places_bytes(const scene_sun *sun) {
    const size_t s = scene_sensors(sun->of);
    return s > 0 ? sun_places_bytes(s) + s * sizeof *sun->places_ground : 0;
}

static lam_status make(scene_sun *sun, lam_error *error) {
    lam_status status = LAM_OK;
    const scene *of = sun->of;
    store *s = NULL;
    shadow_tree *tree = NULL;
    arrays a = {.vertices = NULL};
    TRY(scene_store_open(of, &s, error));
    TRY(read_arrays(s, sun, &a, error));
    if (sun->tiling.n_tiles == 0) TRY(sky_tiling_create(of->sky_tiling, of->sky_up, &sun->tiling, error));
    if (sun->tiling.n_tiles != lam_sky_tiles(of->sky))
        FAIL(error, LAM_ERR_FORMAT, "%s: /sky has %zu tiles, %s has %zu", of->path, lam_sky_tiles(of->sky),
             sun->tiling.name, sun->tiling.n_tiles);
    if (sun->ground == NULL) sun->ground = memory_allocate(of->n, sizeof *sun->ground, "the sun", error);
    if (sun->last == NULL) sun->last = memory_allocate(of->n, sizeof *sun->last, "the sun", error);
    if (sun->ground == NULL || sun->last == NULL) TRY(LAM_ERR_MEMORY);
    const shadow_faces faces = {.n = of->n,
                                .n_fronts = of->n - sun->n_backs,
                                .n_vertices = sun->n_vertices,
                                .vertices = (const double(*)[3])a.vertices,
                                .elements = (const uint32_t(*)[4])a.elements,
                                .normal = (const float(*)[3])a.normal,
                                .glass = &a.glass,
                                .group = a.group};
    sun_ground_find(&sun->tiling, sun->ground_albedo, sky_first_bounce(of->sky), of->n, faces.normal,
                    sun->ground);
    TRY(shadow_tree_create(&faces, &tree, error));
    TRY(make_places(sun, tree, error));
    sun->tree = tree;
    tree = NULL;
done:
    store_close(s);
    shadow_tree_free(tree);
    free(a.vertices);
    free(a.elements);
    free(a.normal);
    free(a.group);
    free(a.glass.of);
    return status;
}

/* The same within the memory that the ledger has. */
static lam_status take(scene_sun *sun, lam_error *error) {
    const scene *of = sun->of;
    const size_t stays = 2 * of->n * sizeof *sun->ground + places_bytes(sun),
                 passing = scene_sensors(of) * sizeof(placed_receiver), most = shadow_tree_bytes_most(of->n);
    size_t wanted;
    if (__builtin_add_overflow(most, stays + array_bytes(sun) + passing, &wanted) ||
        !memory_ledger_take(of->ledger, wanted))
        return status_fail(error, LAM_ERR_MEMORY,
                           "%s: the rays to the sun take %zu bytes to make, more than --max-memory leaves",
                           of->path, most);
    const lam_status status = make(sun, error);
    const size_t kept = status == LAM_OK ? stays + shadow_tree_bytes(sun->tree) : 0;
    atomic_store(&sun->held, kept);
    memory_ledger_give_back(of->ledger, wanted - kept);
    return status;
}

lam_status scene_sun_make(scene_sun *sun, lam_error *error) {
    lam_status status = LAM_OK;
    pthread_mutex_lock(&sun->lock);
    if (sun->tree == NULL) status = take(sun, error);
    pthread_mutex_unlock(&sun->lock);
    return status;
}

/* The way to the sun in the axes of the scene. */
static void turn_to_scene(const scene_sun *sun, const sun_position *at, double direction[3]) {
    for (int d = 0; d < 3; d++)
        direction[sun->tiling.axis[d]] = (double)sun->tiling.sign[d] * at->direction[d];
}

static void cast(const scene_sun *sun, const sun_position *at, float *shares) {
    double direction[3];
    turn_to_scene(sun, at, direction);
    sun_shares_find(sun->tree, parallel_threads(), 1, (const double(*)[3])direction, &shares);
    for (size_t i = 0; i < sun->of->n; i++) shares[i] += sun->ground[i] * (float)at->direction[2];
}

void scene_sun_shares(scene_sun *sun, const request_sun *of, float *shares) {
    const size_t bytes = sun->of->n * sizeof *shares;
    const request_sun wanted = {.azimuth = of->azimuth,
                                .altitude = of->altitude,
                                .north = isnan(of->north) ? sun->of->sky_north : of->north};
    const sun_position at = sun_turned(sun_of_angles(wanted.azimuth, wanted.altitude), wanted.north);
    if (!(at.direction[2] > 0)) {
        memset(shares, 0, bytes);
        return;
    }
    pthread_mutex_lock(&sun->lock);
    const request_sun *last = &sun->last_of;
    const bool known = sun->has_last && last->azimuth == wanted.azimuth &&
                       last->altitude == wanted.altitude && last->north == wanted.north;
    if (known) memcpy(shares, sun->last, bytes);
    pthread_mutex_unlock(&sun->lock);
    if (known) return;
    cast(sun, &at, shares);
    pthread_mutex_lock(&sun->lock);
    memcpy(sun->last, shares, bytes);
    sun->last_of = wanted;
    sun->has_last = true;
    pthread_mutex_unlock(&sun->lock);
}

void scene_sun_at_sensors(const scene_sun *sun, const request_sun *of, float *shares) {
    const double north = isnan(of->north) ? sun->of->sky_north : of->north;
    const sun_position at = sun_turned(sun_of_angles(of->azimuth, of->altitude), north);
    const size_t s = scene_sensors(sun->of);
    double direction[3];
    memset(shares, 0, s * sizeof *shares);
    if (!(at.direction[2] > 0)) return;
    turn_to_scene(sun, &at, direction);
    sun_places_find(sun->places, sun->tree, parallel_threads(), 1, (const double(*)[3])direction, &shares);
    for (size_t i = 0; i < s; i++) shares[i] += sun->places_ground[i] * (float)at.direction[2];
}

size_t scene_sun_held(const scene_sun *sun) {
    return sun != NULL ? atomic_load(&sun->held) : 0;
}
