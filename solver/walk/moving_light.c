#include "solver/walk/moving_light.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners may lie off the plane by this part of the size of the polygon. */
static const double plane_part = 1e-3;

void moving_light_free(moving_light *l) {
    free(l->corner);
    free(l->share);
    for (size_t k = 0; k < l->n; k++) free(l->pose[k].name);
    free(l->pose);
    *l = (moving_light){.n_corners = 0};
}

/* The vector area of the triangle of corners 0, k + 1, k + 2. */
static void fan_area(const moving_light *l, size_t k, double out[3]) {
    double a[3], b[3];
    subtract3(l->corner[k + 1], l->corner[0], a);
    subtract3(l->corner[k + 2], l->corner[0], b);
    cross3(a, b, out);
    for (int d = 0; d < 3; d++) out[d] /= 2;
}

lam_status moving_light_create(size_t n_corners, double (*corner)[3], moving_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    moving_light l = {.n_corners = n_corners, .corner = corner};
    double size = 0;
    if (n_corners < 3) FAIL(error, LAM_ERR_ARGUMENT, "light: %zu corners, must be at least 3", n_corners);
    for (size_t k = 0; k < n_corners; k++)
        for (int d = 0; d < 3; d++)
            if (!isfinite(corner[k][d])) FAIL(error, LAM_ERR_ARGUMENT, "light: corner %zu is not finite", k);
    for (size_t k = 0; k + 2 < n_corners; k++) {
        double area[3];
        fan_area(&l, k, area);
        for (int d = 0; d < 3; d++) l.normal[d] += area[d];
    }
    l.area = sqrt(dot3(l.normal, l.normal));
    for (size_t k = 1; k < n_corners; k++) {
        double side[3];
        subtract3(corner[k], corner[0], side);
        size = fmax(size, sqrt(dot3(side, side)));
    }
    if (!(l.area > 1e-12 * size * size) || !isfinite(l.area))
        FAIL(error, LAM_ERR_ARGUMENT, "light: its corners span no area");
    for (int d = 0; d < 3; d++) l.normal[d] /= l.area;
    l.share = memory_allocate(n_corners - 2, sizeof *l.share, "light", error);
    if (l.share == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_corners; k++) {
        double side[3], area[3];
        subtract3(corner[k], corner[0], side);
        if (fabs(dot3(side, l.normal)) > plane_part * size)
            FAIL(error, LAM_ERR_ARGUMENT, "light: corner %zu is %.3g m off the plane of the others", k,
                 fabs(dot3(side, l.normal)));
        if (k + 2 >= n_corners) continue;
        fan_area(&l, k, area);
        if (dot3(area, l.normal) < 0)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "light: corner %zu is not seen from corner 0; begin with one that sees all others", k + 1);
        l.share[k] = (k > 0 ? l.share[k - 1] : 0) + dot3(area, l.normal) / l.area;
    }
    *out = l;
    l = (moving_light){.n_corners = 0};
done:
    moving_light_free(&l);
    return status;
}

void moving_light_point(const moving_light *l, double u, double w, double point[3]) {
    size_t k = 0;
    while (k + 3 < l->n_corners && u >= l->share[k]) k++;
    const double before = k > 0 ? l->share[k - 1] : 0, part = l->share[k] - before;
    const double root = sqrt(fmin(fmax((u - before) / part, 0), 1)), b = root * (1 - w), c = root * w;
    for (int d = 0; d < 3; d++)
        point[d] = (1 - root) * l->corner[0][d] + b * l->corner[k + 1][d] + c * l->corner[k + 2][d];
}

void light_pose_direction(const light_pose *p, const double x[3], double out[3]) {
    for (int d = 0; d < 3; d++) out[d] = dot3(p->turn[d], x);
}

void light_pose_point(const light_pose *p, const double x[3], double out[3]) {
    light_pose_direction(p, x, out);
    for (int d = 0; d < 3; d++) out[d] += p->move[d];
}
