/* Elements as flat faces, and which of them lie in one plane. */
#ifndef LAMBERT_SCENE_ELEMENT_FACE_H
#define LAMBERT_SCENE_ELEMENT_FACE_H

#include "solver/scene/mesh.h"

/* The corners of an element in metres, their mean, the farthest one's distance from that, the unit normal by
 * Newell's formula, and the largest distance of a corner from the plane. */
typedef struct element_face {
    int n;
    double corner[4][3], centre[3], normal[3], radius, off;
} element_face;

/* corners: those of an element or of a piece of a facet. False where they span no area. */
bool element_face_set(const mesh *m, const uint32_t corners[4], element_face *out);

/* plane_is_shared (plane.h) of two faces that count as of these radii. */
bool element_faces_share_plane(const element_face *a, double radius_a, const element_face *b,
                               double radius_b);

/* The same of two elements, of their own size: then neither sees the other. */
bool elements_share_plane(const mesh *m, size_t i, size_t j);

#endif
