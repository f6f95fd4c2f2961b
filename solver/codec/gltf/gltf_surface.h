/* Materials of glTF, one for each group. Private to solver/codec/gltf. */
#ifndef LAMBERT_CODEC_GLTF_SURFACE_H
#define LAMBERT_CODEC_GLTF_SURFACE_H

#include "solver/codec/gltf/gltf.h"

typedef struct gltf_surface {
    double reflectance[3], emission[3]; /* emission: exitance */
    double factor[3];                   /* with an image: what multiplies it */
    long image;                         /* number of its texture, or -1 */
    double passes; /* the part of light that one face lets pass at normal incidence; 0: it is opaque */
    const gltf_lightmap *lightmap; /* NULL: none */
    unsigned lightmap_texture;     /* number of its texture */
    bool lit; /* it shows light: white and unlit, and passes as much of what lies behind */
} gltf_surface;

/* Writes the members of a material behind its name; false where memory is short. A pane is blended: alpha is
 * 1 - T, and the base colour times alpha its reflectance, so that readers find both again. */
bool gltf_say_surface(const gltf_surface *s, buffer *b);

/* Writes "extensionsUsed" with a comma before, where materials have any. */
bool gltf_say_extensions(bool lit, bool emits, const gltf_lightmap *lightmap, buffer *b);

/* Writes the members of "lightmap" in extras. */
bool gltf_say_lightmap(const gltf_lightmap *l, buffer *b);

#endif
