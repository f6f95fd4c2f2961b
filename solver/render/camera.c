#include "solver/render/camera.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The side of the square of rays by which a camera is judged. */
#define PROBE_SIDE 64
#define MARGIN 0.03     /* free at each side, as a share of half the picture */
#define INSIDE_FOV 75.0 /* a view from inside a room needs a wide angle */
#define CENTRING_PASSES 12
#define RAISED_ELEVATION 25.0

static void scale_to_unit(double a[3]) {
    double length = sqrt(dot3(a, a));
    for (int d = 0; d < 3; d++) a[d] /= length;
}

/* The scene's axes: up, north (+y, or -z where y is up), and east. */
static void scene_axes(char up, double axes_up[3], double north[3], double east[3]) {
    memset(axes_up, 0, 3 * sizeof *axes_up);
    memset(north, 0, 3 * sizeof *north);
    axes_up[up == 'x' ? 0 : up == 'y' ? 1 : 2] = 1;
    if (up == 'y')
        north[2] = -1;
    else
        north[1] = 1;
    cross3(north, axes_up, east);
}

/* forward is a unit vector. */
static void orient(camera *c, const double forward[3], char up, double fov, double aspect) {
    double axes_up[3], north[3], east[3];
    scene_axes(up, axes_up, north, east);
    memcpy(c->forward, forward, sizeof c->forward);
    /* A camera that faces straight up or down has north at the top. */
    const double *upright = fabs(dot3(forward, axes_up)) > 1 - 1e-9 ? north : axes_up;
    cross3(forward, upright, c->right);
    scale_to_unit(c->right);
    cross3(c->right, c->forward, c->up);
    c->tan_y = tan(fov / 2 * M_PI / 180);
    c->tan_x = c->tan_y * aspect;
}

lam_status camera_look(const double eye[3], const double target[3], double fov, double aspect, char up,
                       camera *c, lam_error *error) {
    lam_status status = LAM_OK;
    double forward[3], length = 0;
    for (int d = 0; d < 3; d++) {
        forward[d] = target[d] - eye[d];
        length = fmax(length, fabs(forward[d]));
    }
    if (!(fov >= 1 && fov <= 170))
        FAIL(error, LAM_ERR_ARGUMENT, "the camera's field of view = %g degrees, must be from 1 to 170", fov);
    if (!(length > 0) || !isfinite(length))
        FAIL(error, LAM_ERR_ARGUMENT, "the camera's eye and target must be two different finite points");
    for (int d = 0; d < 3; d++) forward[d] /= length;
    scale_to_unit(forward);
    orient(c, forward, up, fov, aspect);
    memcpy(c->eye, eye, sizeof c->eye);
done:
    return status;
}

lam_status camera_place(const double eye[3], const double direction[3], const double up[3], double fov,
                        double aspect, camera *c, lam_error *error) {
    lam_status status = LAM_OK;
    if (!(fov >= 1 && fov <= 170))
        FAIL(error, LAM_ERR_ARGUMENT, "the camera's field of view = %g degrees, must be from 1 to 170", fov);
    memcpy(c->eye, eye, sizeof c->eye);
    memcpy(c->forward, direction, sizeof c->forward);
    memcpy(c->up, up, sizeof c->up);
    cross3(direction, up, c->right);
    c->tan_y = tan(fov / 2 * M_PI / 180);
    c->tan_x = c->tan_y * aspect;
done:
    return status;
}

void camera_direction(const camera *c, double x, double y, double direction[3]) {
    double right = (2 * x - 1) * c->tan_x, up = (1 - 2 * y) * c->tan_y;
    for (int d = 0; d < 3; d++) direction[d] = c->forward[d] + right * c->right[d] + up * c->up[d];
}

/* Moves the eye, keeping the direction, to the nearest place from which the picture holds every vertex.
 * With v = (x, y, z) in camera axes, z towards the viewer, and the eye at (s, ., d): x - s <= (d - z) tan_x
 * and s - x <= (d - z) tan_x; so the two outermost planes give s, and d as their half sum over tan_x. */
static void fit(const mesh *m, camera *c) {
    const double tangent[2] = {c->tan_x * (1 - MARGIN), c->tan_y * (1 - MARGIN)};
    const double *axis[2] = {c->right, c->up};
    double centre[3], radius, most[2][2] = {{-INFINITY, -INFINITY}, {-INFINITY, -INFINITY}};
    double nearest = -INFINITY;
    mesh_bounds(m, centre, &radius);
    for (size_t i = 0; i < m->n_vertices; i++) {
        double offset[3];
        for (int d = 0; d < 3; d++) offset[d] = m->vertices[i][d] - centre[d];
        double z = -dot3(offset, c->forward);
        nearest = fmax(nearest, z);
        for (int a = 0; a < 2; a++) {
            double side = dot3(offset, axis[a]);
            most[a][0] = fmax(most[a][0], side + z * tangent[a]);
            most[a][1] = fmax(most[a][1], -side + z * tangent[a]);
        }
    }
    double distance = nearest + 0.01 * radius; /* a flat scene seen edge-on */
    for (int a = 0; a < 2; a++) distance = fmax(distance, (most[a][0] + most[a][1]) / (2 * tangent[a]));
    for (int d = 0; d < 3; d++) {
        c->eye[d] = centre[d] - distance * c->forward[d];
        for (int a = 0; a < 2; a++) c->eye[d] += (most[a][0] - most[a][1]) / 2 * axis[a][d];
    }
}

/* Moves the eye sideways until the scene is in the middle: fit leaves a margin in one of the two directions.
 */
static void centre_view(const mesh *m, camera *c) {
    const double *axis[2] = {c->right, c->up};
    for (int pass = 0; pass < 2 * CENTRING_PASSES; pass++) {
        const double *along = axis[pass % 2];
        double low = INFINITY, high = -INFINITY, nearest = INFINITY;
        for (size_t i = 0; i < m->n_vertices; i++) {
            double offset[3];
            for (int d = 0; d < 3; d++) offset[d] = m->vertices[i][d] - c->eye[d];
            const double depth = dot3(offset, c->forward), slope = dot3(offset, along) / depth;
            low = fmin(low, slope);
            high = fmax(high, slope);
            nearest = fmin(nearest, depth);
        }
        /* No slope changes faster than by 1 / nearest, so this never goes too far. */
        for (int d = 0; d < 3; d++) c->eye[d] += (low + high) / 2 * nearest * along[d];
    }
}

/* The shares of a coarse picture that show lit and unlit fronts. */
static void probe(const camera *c, const visibility *v, const bool *lit, double *lit_share,
                  double *unlit_share) {
    size_t n_lit = 0, n_unlit = 0;
    ray_packet rays;
    hit_packet hits;
    float eye[3];
    visibility_recentre(v, c->eye, eye);
    for (size_t y = 0; y < PROBE_SIDE; y++)
        for (size_t x = 0; x < PROBE_SIDE; x += VISIBILITY_PACKET) {
            for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
                double direction[3];
                camera_direction(c, ((double)(x + i) + .5) / PROBE_SIDE, ((double)y + .5) / PROBE_SIDE,
                                 direction);
                for (int d = 0; d < 3; d++) {
                    rays.origin[d][i] = eye[d];
                    rays.direction[d][i] = (float)direction[d];
                }
            }
            visibility_cast(v, &rays, VISIBILITY_PACKET, NULL, VISIBILITY_CULL_BACK | VISIBILITY_TOGETHER,
                            &hits);
            for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
                if (hits.element[i] == VISIBILITY_NOTHING) continue;
                if (lit[hits.element[i]])
                    n_lit++;
                else
                    n_unlit++;
            }
        }
    *lit_share = (double)n_lit / (PROBE_SIDE * PROBE_SIDE);
    *unlit_share = (double)n_unlit / (PROBE_SIDE * PROBE_SIDE);
}

/* The distance from a point to the nearest face in a direction, front or back. */
static double free_distance(const visibility *v, const double from[3], const double direction[3]) {
    ray_packet rays;
    hit_packet hits;
    float start[3];
    memset(&rays, 0, sizeof rays);
    visibility_recentre(v, from, start);
    for (int d = 0; d < 3; d++) {
        rays.origin[d][0] = start[d];
        rays.direction[d][0] = (float)direction[d];
    }
    visibility_cast(v, &rays, 1, NULL, 0, &hits);
    return hits.element[0] == VISIBILITY_NOTHING ? INFINITY : (double)hits.distance[0];
}

/* The area-weighted mean of the centroids of lit elements. */
static void lit_centre(const mesh *m, const bool *lit, double centre[3]) {
    double total = 0, sum[3] = {0, 0, 0};
    for (size_t i = 0; i < m->n; i++) {
        if (!lit[i]) continue;
        double centroid[3];
        mesh_centroid(m, i, centroid);
        for (int d = 0; d < 3; d++) sum[d] += m->area[i] * centroid[d];
        total += m->area[i];
    }
    for (int d = 0; d < 3; d++) centre[d] = sum[d] / total;
}

/* Tries views from inside: the eye moves from the centre of the lit elements towards a wall or corner and
 * faces back. */
static void enter(const mesh *m, const visibility *v, const bool *lit, const double directions[8][3],
                  double aspect, double *best_score, camera *best) {
    double centre[3], radius, middle[3];
    mesh_bounds(m, centre, &radius);
    lit_centre(m, lit, middle);
    for (int i = 0; i < 8; i++) {
        camera inside = {0};
        double distance = fmin(free_distance(v, middle, directions[i]), radius);
        double back[3];
        for (int d = 0; d < 3; d++) back[d] = -directions[i][d];
        orient(&inside, back, m->up, INSIDE_FOV, aspect);
        for (int d = 0; d < 3; d++) inside.eye[d] = middle[d] + .92 * distance * directions[i][d];
        double lit_share, unlit_share;
        probe(&inside, v, lit, &lit_share, &unlit_share);
        double score = lit_share * (.5 + .5 * distance / radius);
        if (score > *best_score) {
            *best_score = score;
            *best = inside;
        }
    }
}

lam_status camera_choose(const mesh *m, const visibility *v, const bool *lit, double aspect, camera *c,
                         lam_error *error) {
    lam_status status = LAM_OK;
    double up[3], north[3], east[3], directions[8][3], best_score = -1;
    camera best = {0};
    bool hidden = false;
    if (m->n == 0 || m->n_vertices == 0) FAIL(error, LAM_ERR_ARGUMENT, "the scene is empty: nothing to see");
    scene_axes(m->up, up, north, east);
    /* The eye's direction from the scene: south, east, west and north, then the four between. */
    static const double compass[8][2] = {{-1, 0}, {0, 1},   {0, -1}, {1, 0},
                                         {-1, 1}, {-1, -1}, {1, 1},  {1, -1}};
    for (int i = 0; i < 8; i++) {
        for (int d = 0; d < 3; d++) directions[i][d] = compass[i][0] * north[d] + compass[i][1] * east[d];
        scale_to_unit(directions[i]);
    }
    for (int raised = 0; raised < 2; raised++)
        for (int i = 0; i < 8; i++) {
            const double elevation = raised ? RAISED_ELEVATION * M_PI / 180 : 0;
            /* An elevation is preferred unless another view shows clearly more. */
            const double preference = i < 4 && !raised ? 1 : i < 4 ? .85 : .8;
            double forward[3], lit_share, unlit_share;
            camera candidate = {0};
            for (int d = 0; d < 3; d++)
                forward[d] = -cos(elevation) * directions[i][d] - sin(elevation) * up[d];
            orient(&candidate, forward, m->up, CAMERA_DEFAULT_FOV, aspect);
            fit(m, &candidate);
            probe(&candidate, v, lit, &lit_share, &unlit_share);
            double score = preference * (lit_share + .1 * unlit_share);
            if (score > best_score * 1.005) { /* of nearly equal views the first, independent of rounding */
                best_score = score;
                best = candidate;
                hidden = unlit_share > lit_share;
            }
        }
    centre_view(m, &best);
    bool any = false;
    for (size_t i = 0; i < m->n && !any; i++) any = lit[i];
    if (hidden && any) enter(m, v, lit, directions, aspect, &best_score, &best);
    *c = best;
done:
    return status;
}
