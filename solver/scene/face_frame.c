#include "solver/scene/face_frame.h"

#include "solver/base/vector3.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <string.h>

face_frame face_frame_of(const mesh *m, size_t face) {
    face_frame f;
    double length = 0;
    memcpy(f.origin, m->vertices[m->elements[face][0]], sizeof f.origin);
    for (int d = 0; d < 3; d++) f.normal[d] = (double)m->normal[face][d];
    length = sqrt(dot3(f.normal, f.normal));
    for (int d = 0; d < 3; d++) f.normal[d] /= length;
    plane_axes(f.normal, f.u, f.w);
    return f;
}

void face_frame_flatten(const face_frame *f, const double point[3], double out[2]) {
    double to[3];
    subtract3(point, f->origin, to);
    out[0] = dot3(to, f->u);
    out[1] = dot3(to, f->w);
}

flat_line flat_line_through(const double from[2], const double to[2]) {
    const double length = plane_distance(from, to);
    flat_line l = {.across = {(from[1] - to[1]) / length, (to[0] - from[0]) / length}};
    l.level = l.across[0] * from[0] + l.across[1] * from[1];
    return l;
}
