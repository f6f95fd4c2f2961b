#include "solver/operator/scene/lam_scene.h"

#include "solver/base/scene/scene_backs.h"
#include "solver/base/scene/scene_buried.h"
#include "solver/base/scene/scene_lights.h"
#include "solver/operator/groups/mesh_columns.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/sky_light.h"
#include "store/groups.h"

#include <stdlib.h>
#include <string.h>

static lam_status read_mesh(store *s, lam_scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    light_kind lights;
    void *normal = NULL;
    TRY(group_index_load(s, made->n, &made->groups, error));
    TRY(areas_view(s, made->n, &made->areas, error));
    made->area = made->areas.data;
    TRY(group_index_measure(&made->groups, made->area, error));
    TRY(centres_load(s, made->n, &made->centre, error));
    TRY(store_read(s, STORE_MESH "/normal", STORE_F32, 2, (size_t[]){made->n, 3}, &normal, error));
    made->normal = normal;
    TRY(scene_lights_load(s, &lights, error));
    made->lights = light_kind_word(lights);
done:
    return status;
}

/* Views of what is read. */
static void make_views(lam_scene *made) {
    made->limiter =
        limiter_of(made->n, made->groups.n_groups, made->groups.start, made->groups.elements, made->area);
    made->linear = (linear_scene){.n = made->n,
                                  .n_channels = made->n_channels,
                                  .op = made->op,
                                  .n_emitters = lam_operator_emitters(made->op),
                                  .groups = &made->groups,
                                  .area = made->area,
                                  .reflectance = made->op->reflectance,
                                  .sky = made->sky,
                                  .luminaires = made->luminaires};
    made->about = (error_scene){.n = made->n,
                                .n_channels = made->n_channels,
                                .n_groups = made->groups.n_groups,
                                .area = made->area,
                                .reflectance = made->op->reflectance,
                                .start = made->groups.start,
                                .members = made->groups.elements,
                                .buried = made->groups.buried};
}

static lam_status read_store(store *s, lam_scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(operator_load(s, &made->op, error));
    made->n = made->op->n;
    made->n_channels = made->op->n_channels;
    TRY(sky_load(s, made->n, &made->sky, error));
    TRY(luminaires_load(s, made->n, made->n_channels, &made->luminaires, error));
    TRY(read_mesh(s, made, error));
    make_views(made);
    TRY(stated_errors_read(s, &made->about, made->op, &made->errors, error));
    made->about.read = made->errors.read;
    made->about.emits = made->errors.emits;
    if (emitter_weights_bytes(&made->linear) > 0) {
        made->weights = emitter_weights_create(&made->linear);
        if (made->weights == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", store_path(s));
    }
done:
    return status;
}

lam_status lam_scene_open(const char *path, lam_scene **scene, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    lam_scene *made = NULL;
    if (path == NULL || scene == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "a path and a place for the scene are needed");
    TRY(store_open(path, &s, error));
    made = memory_allocate(1, sizeof *made, "the scene", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    TRY(read_store(s, made, error));
    *scene = made;
    made = NULL;
done:
    store_close(s);
    lam_scene_close(made);
    return status;
}

void lam_scene_close(lam_scene *scene) {
    if (scene == NULL) return;
    emitter_weights_free(scene->weights);
    stated_errors_free(&scene->errors);
    group_index_free(&scene->groups);
    lam_luminaires_close(scene->luminaires);
    lam_sky_close(scene->sky);
    lam_operator_close(scene->op);
    store_view_free(&scene->areas);
    free(scene->normal);
    free(scene->centre);
    free(scene);
}

void lam_scene_set_threads(lam_scene *scene, size_t n_threads) {
    lam_operator_set_threads(scene->op, n_threads);
}

const lam_operator *lam_scene_operator(const lam_scene *scene) {
    return scene->op;
}

const lam_limiter *lam_scene_limiter(const lam_scene *scene) {
    return &scene->limiter;
}

const lam_sky *lam_scene_sky(const lam_scene *scene) {
    return scene->sky;
}

const lam_luminaires *lam_scene_luminaires(const lam_scene *scene) {
    return scene->luminaires;
}

const char *lam_scene_lights(const lam_scene *scene) {
    return scene->lights;
}

const double *lam_scene_areas(const lam_scene *scene) {
    return scene->area;
}

const float *lam_scene_reflectances(const lam_scene *scene) {
    return scene->op->reflectance;
}

const float *lam_scene_normals(const lam_scene *scene) {
    return scene->normal;
}

const float *lam_scene_centres(const lam_scene *scene) {
    return scene->centre;
}

size_t lam_scene_groups(const lam_scene *scene) {
    return scene->groups.n_groups;
}

const char *lam_scene_group(const lam_scene *scene, size_t group) {
    return scene->groups.names[group];
}

double lam_scene_group_area(const lam_scene *scene, size_t group) {
    return scene->groups.area[group];
}

const uint32_t *lam_scene_group_elements(const lam_scene *scene, size_t group, size_t *count) {
    *count = scene->groups.start[group + 1] - scene->groups.start[group];
    return scene->groups.elements + scene->groups.start[group];
}

size_t lam_scene_find(const lam_scene *scene, const char *name, const uint32_t **groups) {
    return group_index_find(&scene->groups, name, strlen(name), groups);
}

size_t lam_scene_sources(const lam_scene *scene, lam_by by) {
    return adjoint_row_width(&scene->linear, by);
}
