/* A lightmap as files: OpenEXR, the map alone, and binary glTF, the scene that shows it. */
#ifndef LAMBERT_LIGHTMAP_FILES_H
#define LAMBERT_LIGHTMAP_FILES_H

#include "solver/lightmap/lightmap_light.h"
#include "solver/operator/groups/groups.h"

/* The words of a map and of its scene. */
typedef struct lightmap_words {
    const char *scene, *quantity, *unit;
    const group_index *groups;
    bool radiosity; /* the map's quantity */
} lightmap_words;

/* Writes the values as 32-bit floats: Y of one channel, R, G, B of three. Errors: LAM_ERR_IO, LAM_ERR_MEMORY.
 */
lam_status lightmap_write_exr(const lightmap *map, const lightmap_words *words, const char *path,
                              lam_error *error);

/* Writes the mesh with the map as a PNG of 16 bits: an irradiance by MOZ_lightmap, linear, beside the images
 * of the scene, a radiosity as emissive texture, sRGB. Four means of the map are shown white, as a
 * perfectly white surface under them is: an irradiance is cut at eight times that, a radiosity there; *cut
 * gets the texels that are. Errors: LAM_ERR_IO, LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (as gltf_write). */
lam_status lightmap_write_glb(const mesh *m, const lightmap_charts *c, const lightmap *map,
                              const lightmap_words *words, const char *path, size_t *cut, lam_error *error);

#endif
