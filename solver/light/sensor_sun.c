#include "solver/light/sensor_sun.h"

#include "solver/operator/sensor_light.h"
#include "solver/shadow/sun_ground.h"
#include "store/groups.h"

#include <stdlib.h>

void sensor_sun_free(sensor_sun *s) {
    if (s == NULL) return;
    shadow_tree_free(s->tree);
    sun_places_free(s->places);
    free(s->ground);
    free(s);
}

lam_status sensor_sun_create(store *s, const mesh *m, const lam_sensors *l, const sky_tiling *tiling,
                             sensor_sun **out, lam_error *error) {
    lam_status status = LAM_OK;
    placed_receiver *receivers = NULL;
    double albedo = 0;
    const scene_glass glass = {.of = m->glass, .by_angle = m->glass_by_angle};
    const shadow_faces faces = {.n = m->n,
                                .n_fronts = m->n - m->n_backs,
                                .n_vertices = m->n_vertices,
                                .vertices = (const double(*)[3])m->vertices,
                                .elements = (const uint32_t(*)[4])m->elements,
                                .normal = (const float(*)[3])m->normal,
                                .glass = &glass,
                                .group = m->group};
    sensor_sun *made = memory_allocate(1, sizeof *made, "the sun at sensors", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->n = lam_sensors_count(l);
    made->sky = sensors_sky(l);
    if (made->sky == NULL || lam_sensors_tiles(l) != tiling->n_tiles)
        FAIL(error, LAM_ERR_FORMAT, "%s: /sensors has %zu tiles of the sky, must have %zu", store_path(s),
             lam_sensors_tiles(l), tiling->n_tiles);
    TRY(store_get_number(s, STORE_SKY, "ground_albedo", &albedo, error));
    TRY(sensors_receivers(l, &receivers, error));
    made->ground = memory_allocate(made->n, sizeof *made->ground, "the sun at sensors", error);
    if (made->ground == NULL) TRY(LAM_ERR_MEMORY);
    sun_ground_at(tiling, albedo, made->sky, made->n, receivers, made->ground);
    TRY(shadow_tree_create(&faces, &made->tree, error));
    TRY(sun_places_create(made->tree, made->n, receivers, &made->places, error));
    *out = made;
    made = NULL;
done:
    sensor_sun_free(made);
    free(receivers);
    return status;
}
