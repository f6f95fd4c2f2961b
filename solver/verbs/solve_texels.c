#include "solver/verbs/solve_texels.h"

#include "solver/base/atomic_file.h"
#include "solver/codec/answer.h"
#include "solver/codec/request.h"
#include "solver/light/emission_apply.h"
#include "solver/lightmap/lightmap_files.h"
#include "solver/luminaire/placed_store.h"
#include "solver/operator/emitters.h"
#include "solver/verbs/own_light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status solve_texels_check(const char *path, lam_error *error) {
    char extension[16];
    atomic_file_extension(path, extension);
    if (strcmp(extension, "glb") == 0 || strcmp(extension, "exr") == 0) return LAM_OK;
    return status_fail(error, LAM_ERR_ARGUMENT, "-o %s: --at texels goes into .glb or .exr only", path);
}

static lam_status check_light(const lit_store *lit, lam_error *error) {
    lam_status status = LAM_OK;
    if (lit->light.n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "--at texels: a lightmap is of one light, and this is a batch of %zu",
             lit->light.n_vectors);
    const char *why = operator_points_why_not(lit->op);
    if (why != NULL) FAIL(error, LAM_ERR_UNSUPPORTED, "--at texels: texels have no values: %s", why);
    if (lit->light.sun != NULL)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "--at texels: an exact sun is not supported; --sun tiles takes it from its tile");
done:
    return status;
}

/* The luminance of three channels, in place of these. */
static void take_luminance(lightmap *map) {
    const size_t pixels = map->width * map->height;
    double sum = 0, before = 0;
    map->most = 0;
    for (size_t k = 0; k < pixels; k++) {
        const float *of = map->values + 3 * k;
        const double red = (double)of[0], green = (double)of[1], blue = (double)of[2],
                     luminance = luminance_of(red, green, blue);
        before += (red + green + blue) / 3;
        sum += luminance;
        map->most = fmax(map->most, luminance);
        map->values[k] = (float)luminance;
    }
    if (before > 0) map->mean *= sum / before;
    map->n_channels = 1;
}

static lam_status write_map(const mesh *m, const lightmap_charts *c, const lightmap *map, const char *path,
                            const solution *out, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    char extension[16];
    size_t cut = 0;
    const lightmap_words words = {.scene = out->scene,
                                  .quantity = codec_quantity_name(out->quantity),
                                  .unit = out->unit,
                                  .groups = out->groups,
                                  .radiosity = out->quantity == LAM_RADIOSITY};
    atomic_file_extension(path, extension);
    if (strcmp(extension, "exr") == 0) return lightmap_write_exr(map, &words, path, error);
    TRY(lightmap_write_glb(m, c, map, &words, path, &cut, error));
    if (cut > 0)
        terminal_log(t, "%zu texels are brighter than the image holds, and white in it; .exr holds all", cut);
done:
    return status;
}

lam_status solve_texels(store *s, const mesh *m, lit_store *lit, double texel, const char *path,
                        const solution *out, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    const emission *light = &lit->light;
    const progress steps = terminal_progress(t);
    lightmap_charts charts = {.n = 0};
    lightmap_texels texels = {.n = 0};
    lightmap map = {.values = NULL};
    sky_bounce sky = {.n = 0};
    placed_luminaires placed = {.n = 0};
    const error_scene about = {.n = m->n, .n_channels = m->n_channels};
    own_light own = {.n_tiles = 0};
    float *B = NULL;
    TRY(check_light(lit, error));
    if (light->W != NULL) { /* weights of few emitters stand for elements and a sky */
        TRY(own_light_make(lit, &about, &own, error));
        TRY(own_light_take(&own, 0, error));
    }
    const float *E = light->W != NULL ? own.E : light->E, *L = light->W != NULL ? own.L : light->L;
    TRY(lightmap_charts_make(m, texel, &charts, error));
    TRY(lightmap_texels_find(m, &charts, &texels, error));
    terminal_log(t, "a lightmap of %zu x %zu: %zu texels of %.3g m in %zu chart%s%s", charts.width,
                 charts.height, texels.n, charts.texel, charts.n, charts.n == 1 ? "" : "s",
                 charts.enlarged ? "; --texel may be shorter" : "");
    TRY(emission_apply(light, lit->op, lit->sky, LAM_RADIOSITY, 0, NULL, terminal_check, &B, NULL, error));
    if (L != NULL) TRY(sky_bounce_load(s, m->n, &sky, error));
    if (light->D != NULL) TRY(placed_load(s, m->n_groups, m->group_names, &placed, error));
    const lightmap_light of = {.n_channels = m->n_channels,
                               .B = B,
                               .E = E,
                               .sky = &sky,
                               .L = L,
                               .placed = &placed,
                               .luminaires = lit->luminaires,
                               .D = light->D,
                               .radiosity = out->quantity == LAM_RADIOSITY,
                               .seed = 1};
    TRY(lightmap_make(m, &charts, &texels, &of, &steps, &map, error));
    terminal_clear(t);
    if (!isfinite(map.mean) || !isfinite(map.most))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the light of texels is beyond single precision: give less light",
             path);
    if (map.hidden > 0)
        terminal_log(t, "%zu texels lie in a body or in a luminaire: they have the light beside them",
                     map.hidden);
    if (lit->told.luminance && m->n_channels == 3) take_luminance(&map);
    TRY(write_map(m, &charts, &map, path, out, t, error));
done:
    lightmap_charts_free(&charts);
    free(texels.texels);
    lightmap_free(&map);
    sky_bounce_free(&sky);
    placed_free(&placed);
    own_light_free(&own);
    free(B);
    return status;
}
