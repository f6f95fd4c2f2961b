#include "solver/scene/element_face.h"

#include "solver/base/vector3.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <string.h>

bool element_face_set(const mesh *m, const uint32_t corners[4], element_face *out) {
    double twice[3] = {0, 0, 0};
    *out = (element_face){.n = (int)corner_count(corners)};
    for (int c = 0; c < out->n; c++) {
        memcpy(out->corner[c], m->vertices[corners[c]], sizeof out->corner[c]);
        for (int d = 0; d < 3; d++) out->centre[d] += out->corner[c][d] / out->n;
    }
    for (int c = 1; c + 1 < out->n; c++) {
        double u[3], w[3], product[3];
        subtract3(out->corner[c], out->corner[0], u);
        subtract3(out->corner[c + 1], out->corner[0], w);
        cross3(u, w, product);
        for (int d = 0; d < 3; d++) twice[d] += product[d];
    }
    const double length = sqrt(dot3(twice, twice));
    if (!(length > 0)) return false;
    for (int d = 0; d < 3; d++) out->normal[d] = twice[d] / length;
    for (int c = 0; c < out->n; c++) {
        double distance2 = 0, height = 0;
        for (int d = 0; d < 3; d++) {
            const double to = out->corner[c][d] - out->centre[d];
            distance2 += to * to;
            height += to * out->normal[d];
        }
        out->radius = fmax(out->radius, sqrt(distance2));
        out->off = fmax(out->off, fabs(height));
    }
    return true;
}

static plane_face view_of(const element_face *f, double radius) {
    return (plane_face){f->n, (const double(*)[3])f->corner, f->centre, f->normal, radius};
}

bool element_faces_share_plane(const element_face *a, double radius_a, const element_face *b,
                               double radius_b) {
    const plane_face one = view_of(a, radius_a), other = view_of(b, radius_b);
    return plane_is_shared(&one, &other);
}

bool elements_share_plane(const mesh *m, size_t i, size_t j) {
    element_face a, b;
    double cosine = 0;
    for (int d = 0; d < 3; d++) cosine += (double)m->normal[i][d] * (double)m->normal[j][d];
    /* A hundredth less than plane_is_shared asks for: single precision decides nothing. */
    if (!(fabs(cosine) > plane_parallel - .01)) return false;
    if (!element_face_set(m, m->elements[i], &a) || !element_face_set(m, m->elements[j], &b)) return false;
    return element_faces_share_plane(&a, a.radius, &b, b.radius);
}
