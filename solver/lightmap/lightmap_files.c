#include "solver/lightmap/lightmap_files.h"

#include "solver/base/atomic_file.h"
#include "solver/output/mesh_gltf.h"
#include "solver/render/exr.h"
#include "solver/render/image.h"

#include <math.h>
#include <stdlib.h>

/* The value that is shown white, in means of the map, and the largest irradiance that is kept, in these. */
static const double white_in_means = 4, kept_in_whites = 8;

lam_status lightmap_write_exr(const lightmap *map, const lightmap_words *words, const char *path,
                              lam_error *error) {
    const picture_values values = {
        .width = map->width, .height = map->height, .channels = map->n_channels, .values = map->values};
    const exr_notes notes = {.quantity = words->quantity, .unit = words->unit};
    return exr_write(&values, true, &notes, path, NULL, error);
}

/* IEC 61966-2-1. */
static double to_srgb(double x) {
    return x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
}

/* The map in 16 bits, value / peak cut at 1; counts the texels that are cut. */
static lam_status quantize(const lightmap *map, double peak, bool srgb, uint16_t **out, size_t *cut,
                           lam_error *error) {
    const size_t pixels = map->width * map->height, C = map->n_channels;
    uint16_t *made = memory_allocate(pixels, C * sizeof *made, "a lightmap", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    *cut = 0;
    for (size_t k = 0; k < pixels; k++) {
        bool over = false;
        for (size_t c = 0; c < C; c++) {
            const double x = (double)map->values[k * C + c] / peak, inside = fmin(x, 1);
            over = over || x > 1 + 1e-6;
            made[k * C + c] = (uint16_t)lround(65535 * (srgb ? to_srgb(inside) : inside));
        }
        *cut += over;
    }
    *out = made;
    return LAM_OK;
}

/* The places of the corners of elements, [n], in the map. */
static lam_status find_places(const mesh *m, const lightmap_charts *c, float (**out)[4][2],
                              lam_error *error) {
    float(*made)[4][2] = memory_allocate(m->n, sizeof *made, "a lightmap", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++) {
            double place[2];
            lightmap_place(&c->charts[c->chart_of[i]], m->vertices[m->elements[i][k]], place);
            made[i][k][0] = (float)(place[0] / (double)c->width);
            made[i][k][1] = (float)(place[1] / (double)c->height);
        }
    *out = made;
    return LAM_OK;
}

lam_status lightmap_write_glb(const mesh *m, const lightmap_charts *c, const lightmap *map,
                              const lightmap_words *words, const char *path, size_t *cut, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    buffer b = {0};
    uint16_t *values = NULL;
    unsigned char *png = NULL;
    float(*places)[4][2] = NULL;
    const double white = map->mean > 0 ? white_in_means * map->mean : 1;
    gltf_lightmap shown = {.emissive = words->radiosity, .unit = words->unit, .white = white};
    if (!words->radiosity) shown.white = fmin(fmax(map->most, white * 1e-3), kept_in_whites * white);
    /* BRDF rho / pi times intensity times E / peak is rho where E is white. */
    shown.intensity = M_PI * shown.white / white;
    TRY(quantize(map, shown.white, words->radiosity, &values, cut, error));
    TRY(image_encode_deep(map->width, map->height, map->n_channels, values, &png, &shown.png_bytes, error));
    TRY(find_places(m, c, &places, error));
    shown.png = png;
    shown.texcoord = (const float(*)[4][2])places;
    scene_glass glass;
    gltf_mesh of = mesh_gltf(m, words->scene, words->groups, &glass);
    of.pictures = words->radiosity ? NULL : m->pictures;
    of.lightmap = &shown;
    TRY(gltf_write(&of, &b, error));
    TRY(atomic_file_open(path, &file, error));
    fwrite(b.bytes, 1, b.length, file.stream);
    TRY(atomic_file_commit(&file, error));
done:
    atomic_file_abort(&file);
    buffer_free(&b);
    free(values);
    free(png);
    free(places);
    return status;
}
