/* Faces of parts of a glTF and their area. Private to solver/scene/import; used in the child. */
#ifndef LAMBERT_SCENE_IMPORT_GLTF_AMOUNT_H
#define LAMBERT_SCENE_IMPORT_GLTF_AMOUNT_H

#include "solver/scene/import/gltf_file.h"
#include "solver/scene/import/gltf_nodes.h"

typedef struct gltf_amount {
    double faces, area; /* triangles; units of the file, squared */
    bool blind;         /* of some faces the area is not known */
} gltf_amount;

/* Counts a primitive where a node puts it, and nothing of points and lines. The area is not known where the
 * file has no plain vertices of it: of a compressed mesh, of sparse or missing ones. O(faces). */
gltf_amount gltf_amount_of(gltf_file *g, const json_t *primitive, const gltf_transform *placed);

void gltf_amount_add(gltf_amount *sum, const gltf_amount *more);

/* "2 of 3 faces, 1 of 1.5 m2"; unit: metres of the file's, 0 where it is not known yet. */
#define GLTF_AMOUNT_TEXT 160
void gltf_amount_text(const gltf_amount *part, const gltf_amount *all, double unit,
                      char text[GLTF_AMOUNT_TEXT]);

#endif
